"""What the circle finder found, drawn into the picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from ...errors import FreelookError
from ...sinks.picture import rgb24
from ...types import Picture

if TYPE_CHECKING:
    from ...calibration.circle import ImageCircle
    from ...camera import Camera

Bgr = tuple[int, int, int]
RIM: Bgr = (80, 230, 120)
USED: Bgr = (60, 220, 255)
UNUSED: Bgr = (90, 90, 235)
RIVAL: Bgr = (230, 120, 230)
RINGS: Bgr = (235, 190, 120)
INK: Bgr = (240, 240, 240)
FONT = cv2.FONT_HERSHEY_SIMPLEX
SHIFT = 4  # OpenCV draws to a 16th of a pixel
DOT = 26  # 16ths
LONGEST_SIDE = 1600
RING_DEG = 30


def drawing(picture: Picture, circle: ImageCircle, camera: Camera) -> NDArray[np.uint8]:
    """(rows, columns, 3) BGR: the picture, dimmed, with the circle, its centre, the edges used
    (amber) and left out (red), rings of equal angles, and a caption below."""
    canvas, scale = _backdrop(picture)
    for ring_deg in range(RING_DEG, round(np.degrees(camera.theta_max)), RING_DEG):
        _ring(canvas, camera, np.radians(ring_deg), scale)
    if circle.rival:
        *middle, radius_px = circle.rival
        _ellipse(canvas, (middle[0], middle[1]), radius_px, circle.aspect, scale, RIVAL, 2)
    _ellipse(canvas, circle.center, circle.radius_px, circle.aspect, scale, RIM, 3)
    for pixels, color in ((circle.unused, UNUSED), (circle.used, USED)):
        for x, y in _dots(pixels, scale).tolist():
            cv2.circle(canvas, (x, y), DOT, color, -1, cv2.LINE_AA, SHIFT)
    x, y = _dots(np.array(circle.center), scale).tolist()
    cv2.drawMarker(canvas, (x >> SHIFT, y >> SHIFT), RIM, cv2.MARKER_CROSS, 28, 2, cv2.LINE_AA)
    return np.vstack([canvas, _caption(canvas.shape[1], circle, camera)])


def write_drawing(path: Path, drawn: NDArray[np.uint8]) -> None:
    """Encode by the file's suffix, which must be a picture's; FreelookError if that fails."""
    done, data = cv2.imencode(path.suffix, drawn)
    if not done:
        raise FreelookError(f"{path}: OpenCV cannot write this kind of picture")
    try:
        path.write_bytes(data.tobytes())
    except OSError as error:
        raise FreelookError(f"{path}: {error.strerror}") from None


def _backdrop(picture: Picture) -> tuple[NDArray[np.uint8], float]:
    """The picture at a good size to draw on, and how many of its pixels are one there."""
    bgr = rgb24(picture)[..., ::-1]
    rows, columns = bgr.shape[:2]
    scale = float(np.clip(LONGEST_SIDE / max(rows, columns), 0.1, 2.0))
    size = (round(columns * scale), round(rows * scale))
    shown = cv2.resize(bgr, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC)
    # dark rims show better a little lifted, and lines better on what is not white
    lifted = 255 * (shown / 255.0) ** 0.7
    return (20 + 0.75 * lifted).astype(np.uint8), scale


def _dots(pixels: NDArray[np.float64], scale: float) -> NDArray[np.int64]:
    """Where pixels of the picture are on the canvas, in 16ths."""
    return np.rint(((pixels + 0.5) * scale - 0.5) * 2**SHIFT).astype(np.int64)


def _ellipse(
    canvas: NDArray[np.uint8],
    center: tuple[float, float],
    radius_px: float,
    aspect: float,
    scale: float,
    color: Bgr,
    width: int,
) -> None:
    x, y = _dots(np.array(center), scale).tolist()
    axes = [round(radius_px * a * scale * 2**SHIFT) for a in (1.0, aspect)]
    cv2.ellipse(canvas, (x, y), axes, 0, 0, 360, color, width, cv2.LINE_AA, SHIFT)


def _ring(canvas: NDArray[np.uint8], camera: Camera, theta: float, scale: float) -> None:
    radius_px = float(camera.lens.radius(np.array([theta]))[0])
    aspect = float(camera.stretch[1, 1])
    _ellipse(canvas, camera.center, radius_px, aspect, scale, RINGS, 1)
    place = np.array(camera.center) + np.array([radius_px, radius_px * aspect]) * np.sqrt(0.5)
    x, y = (_dots(place, scale) >> SHIFT).tolist()
    _write(canvas, f"{np.degrees(theta):.0f}", (x + 4, y + 16), RINGS, 0.5)


def _caption(width: int, circle: ImageCircle, camera: Camera) -> NDArray[np.uint8]:
    size = float(np.clip(width / 1500, 0.4, 0.7))
    line = round(44 * size)
    band = np.full((round(3.6 * line), width, 3), 24, np.uint8)
    x, y = circle.center
    columns, rows = circle.size
    lines = [
        f"centre {x:.1f}, {y:.1f} +- {circle.center_error_px:.1f}   "
        f"radius {circle.radius_px:.1f} +- {circle.radius_error_px:.1f} px   "
        f"of {columns} x {rows}",
        f"{type(camera.lens).__name__.lower()}, {2 * np.degrees(camera.theta_max):.5g} degrees "
        f"across; rings every {RING_DEG} degrees from the axis",
    ]
    for number, text in enumerate(lines):
        _write(band, text, (line // 2, round((number + 1) * line)), INK, size)
    legend = [("image circle", RIM), ("edges used", USED), ("edges left out", UNUSED)]
    legend += [("nearly as likely", RIVAL)] if circle.rival else []
    left, base = line // 2, round(3 * line)
    for text, color in legend:
        cv2.circle(band, (left + line // 4, base - line // 5), line // 5, color, -1, cv2.LINE_AA)
        _write(band, text, (left + line // 2 + 6, base), INK, size)
        left += line + cv2.getTextSize(text, FONT, size, 1)[0][0]
    return band


def _write(
    canvas: NDArray[np.uint8], text: str, place: tuple[int, int], color: Bgr, size: float
) -> None:
    cv2.putText(canvas, text, place, FONT, size, color, 1, cv2.LINE_AA)
