"""How a camera turned from each frame to the next, seen in the pictures alone.

Corners are followed from one picture to the next (Lucas and Kanade, there and back), the lens
makes them directions, and one rotation is fitted to these: on the sphere it is the same for all,
however far from the axis. What moves by itself, or is near and passes by, disagrees and is left
out. What belongs to the vehicle (a propeller, the nose) must not fill most of the picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..clock import NS_PER_S
from ..errors import RenderError
from ..lens import radius_slope
from ..types import Counters, Frame, Picture
from .rotation_fit import Floats, fit_rotation

LARGEST_SIDE = 640  # turns need no more; corners then cost a few milliseconds
CORNERS = 200
TOLERANCE_PX = 1.0
RIM_PX = 9  # the rim of the image circle never moves: corners keep away from it
LONGEST_STEP_S = 0.25
_THERE_AND_BACK_PX = 0.5
_WINDOW = (15, 15)


@dataclass(frozen=True, slots=True)
class ImageTurn:
    """From `start_ns` to `end_ns` (capture times) the vehicle turned by `turn` (3,), a rotation
    vector in radians about its own forward, right and down axes; `directions` agreed on it."""

    start_ns: int
    end_ns: int
    turn: Floats
    directions: int

    @property
    def rate(self) -> Floats:
        """Mean body rates (3,), rad/s."""
        return self.turn * (NS_PER_S / (self.end_ns - self.start_ns))


class ImageTurns:
    """Frames in, in the order of time; a turn out for every two that follow each other.

    `counters`: "frames"; "unclear" (too few directions agreed) and "apart" (more than a quarter
    of a second, or no time, between two frames), for which there is no turn.
    """

    def __init__(self, camera: Camera) -> None:
        self.counters = Counters()
        self._camera = camera
        self._scaled: Camera | None = None
        self._mask: NDArray[np.uint8] | None = None
        self._before: tuple[NDArray[np.uint8], int] | None = None
        self._rng = np.random.default_rng(0)

    def push(self, frame: Frame) -> ImageTurn | None:
        """The turn since the frame before; None for the first and where there is none."""
        self.counters.add("frames")
        gray = self._prepared(frame.picture)
        before, self._before = self._before, (gray, frame.capture_ns)
        if before is None:
            return None
        elapsed_ns = frame.capture_ns - before[1]
        if not 0 < elapsed_ns <= LONGEST_STEP_S * NS_PER_S:
            self.counters.add("apart")
            return None
        found = self._turn(before[0], gray)
        if found is None:
            self.counters.add("unclear")
            return None
        return ImageTurn(before[1], frame.capture_ns, *found)

    def _turn(
        self, before: NDArray[np.uint8], after: NDArray[np.uint8]
    ) -> tuple[Floats, int] | None:
        assert self._scaled is not None
        pixels = _followed(before, after, self._mask)
        rays = self._scaled.ray(pixels.astype(float))  # (2, n, 3)
        seen = np.isfinite(rays).all(axis=(0, 2))
        body_from_camera = self._scaled.camera_from_body.inv()
        first, second = (body_from_camera.apply(r) if len(r) else r for r in rays[:, seen])
        fit = fit_rotation(first, second, TOLERANCE_PX * _pixel_rad(self._scaled), self._rng)
        if fit is None:
            return None
        return fit.before_from_after.as_rotvec(), int(fit.agreeing.sum())

    def _prepared(self, picture: Picture) -> NDArray[np.uint8]:
        """The gray picture at working size; the camera and the mask for that size are kept."""
        gray = picture.planes[0]
        if picture.layout == "rgb24":
            gray = cv2.cvtColor(gray, cv2.COLOR_RGB2GRAY)
        width, height = picture.size
        scale = min(1.0, LARGEST_SIDE / max(width, height))
        size = (max(2, round(width * scale)), max(2, round(height * scale)))
        if size != picture.size:
            gray = cv2.resize(gray, size, interpolation=cv2.INTER_AREA)
        if self._scaled is None or self._scaled.size != size:
            self._scaled = _for_pictures(self._camera, picture.size).resized(size)
            self._mask, self._before = _inside(self._scaled), None
        return np.ascontiguousarray(gray)


def _for_pictures(camera: Camera, size: tuple[int, int]) -> Camera:
    """The camera, or RenderError when pictures of this size cannot be its whole picture, scaled."""
    (width, height), (own_width, own_height) = size, camera.size
    if abs(width * own_height - height * own_width) > max(camera.size):
        raise RenderError(
            f"pictures of {width}x{height} are not of the shape of the lens profile's, "
            f"{own_width}x{own_height}"
        )
    return camera


def _pixel_rad(camera: Camera) -> float:
    """How wide a pixel is in the middle of the picture."""
    slope = float(radius_slope(camera.lens, np.zeros(1))[0])
    return 1.0 / (slope * float(np.sqrt(abs(np.linalg.det(camera.stretch)))))


def _inside(camera: Camera) -> NDArray[np.uint8]:
    """255 where the lens sees something, and RIM_PX around too."""
    width, height = camera.size
    y, x = np.mgrid[0:height, 0:width]
    seen = np.isfinite(camera.ray(np.stack([x, y], axis=-1).astype(float))[..., 2])
    framed = np.pad(seen.astype(np.uint8) * 255, 1)
    kernel = np.ones((2 * RIM_PX + 1, 2 * RIM_PX + 1), np.uint8)
    return np.ascontiguousarray(cv2.erode(framed, kernel)[1:-1, 1:-1])


def _followed(
    before: NDArray[np.uint8], after: NDArray[np.uint8], mask: NDArray[np.uint8] | None
) -> NDArray[np.float32]:
    """Corners in both pictures, (2, n, 2) pixels; only those that lead back to where they began."""
    spacing = max(4, round(max(before.shape) / 60))
    corners = cv2.goodFeaturesToTrack(before, CORNERS, 0.005, spacing, mask=mask)
    if corners is None:
        return np.zeros((2, 0, 2), np.float32)
    there, fine, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, None, winSize=_WINDOW)
    back, also, _ = cv2.calcOpticalFlowPyrLK(after, before, there, None, winSize=_WINDOW)
    closed = np.abs(back - corners).max(axis=(1, 2)) < _THERE_AND_BACK_PX
    good = closed & (fine[:, 0] == 1) & (also[:, 0] == 1)
    return np.stack([corners[good, 0], there[good, 0]])
