"""What both pilots see, side by side, over the simulated world.

Left freelook: a view into the fisheye picture that has arrived. Right the gimbal: its own camera's
whole picture. A ring marks the middle of what is shown, a cross where the head looks at that time.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..clock import NS_PER_S
from ..color import rgb_from_picture, to_codes
from ..renderers.cpu import CpuRenderer
from ..simulation.camera import Flight, SimulatedCamera, pixel_deg
from ..simulation.flight import FigureEight
from ..simulation.world import World
from ..types import Frame, Picture
from ..viewport import Viewport
from .contest import Duel
from .measure import angle_deg, direction_of

Pixels = NDArray[np.uint8]

CAPTION_PX = 40
GREEN, WHITE, DARK = (40, 220, 60), (255, 255, 255), (25, 25, 25)
CROSS_PX, RING_PX = 14, 7


@dataclass
class SideBySide:
    """Pictures of a duel. `camera` is freelook's fisheye, looking ahead; `viewport` each half;
    `labels` their headings (plain ASCII), freelook's first."""

    duel: Duel
    camera: Camera
    viewport: Viewport
    labels: tuple[str, str]
    threads: int = 1
    flight: Flight = field(default_factory=FigureEight)

    def __post_init__(self) -> None:
        world = World(pixel_deg(self.camera))
        self._filmed = SimulatedCamera(self.camera, world, self.flight, threads=self.threads)
        self._renderer = CpuRenderer(self.threads)
        self._newest: tuple[int, Picture | None] = (-1, None)

    @property
    def size(self) -> tuple[int, int]:
        width, height = self.viewport.size
        return 2 * width, height + CAPTION_PX

    def frame(self, t_ns: int) -> Frame:
        """What both see at a time of the duel: rgb24, captions above, marks drawn."""
        now = np.array([t_ns], dtype=np.int64)
        head = self.duel.head.at(now)
        halves = []
        for label, (name, shown) in zip(self.labels, self.duel.shown.items(), strict=True):
            seen = shown.at(now)
            capture_ns = t_ns - round(float(shown.age_ms(now)[0]) * 1e6)
            half = self._ours(capture_ns, seen[0]) if name == "freelook" else None
            pixels = half if half is not None else self._theirs(capture_ns, seen[0])
            mark(pixels, self.viewport, seen[0], head[0])
            error = float(angle_deg(direction_of(head), direction_of(seen))[0])
            words = f"off by {error:4.1f} deg, picture {(t_ns - capture_ns) / 1e6:3.0f} ms old"
            halves.append(np.vstack([caption(pixels.shape[1], label, words), pixels]))
        return Frame(Picture("rgb24", (np.hstack(halves),)), t_ns, t_ns)

    def _ours(self, capture_ns: int, body_from_view: Rotation) -> Pixels:
        if self._newest[0] != capture_ns or self._newest[1] is None:
            self._newest = capture_ns, self._filmed.picture(capture_ns)
        picture = self._newest[1]
        assert picture is not None
        camera_from_view = self.camera.camera_from_body * body_from_view
        view = self._renderer.render(picture, self.camera, camera_from_view, self.viewport)
        return np.ascontiguousarray(to_codes(255 * rgb_from_picture(view)))

    def _theirs(self, capture_ns: int, body_from_view: Rotation) -> Pixels:
        view = self._filmed.exact_view(capture_ns, body_from_view, self.viewport)
        return np.ascontiguousarray(view.planes[0])


def times_ns(duel: Duel, fps: float, first_ns: int = NS_PER_S) -> list[int]:
    """When the pictures of a video are: `fps` a second from `first_ns` to the end."""
    count = max(1, int((duel.head.duration_ns - first_ns) * fps / NS_PER_S))
    return [first_ns + round(index * NS_PER_S / fps) for index in range(count)]


def cross_px(
    viewport: Viewport, body_from_shown: Rotation, body_from_head: Rotation
) -> tuple[float, float]:
    """Where in a view the direction of the head is: pixels, held inside by the border's width."""
    width, height = viewport.size
    x, y, z = (body_from_shown.inv() * body_from_head).apply([0.0, 0.0, 1.0])
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    ahead = max(float(z), 1e-3)  # beside or behind: far outside, the right way
    away = np.array([x, y]) * (viewport.focal_px / ahead)
    room = (middle - CROSS_PX) / np.maximum(np.abs(away), 1e-9)
    held = middle + away * min(1.0, float(room.min()))
    return float(held[0]), float(held[1])


def mark(
    pixels: Pixels, viewport: Viewport, body_from_shown: Rotation, body_from_head: Rotation
) -> None:
    """Draw ring and cross into a view, in place."""
    rows, columns = pixels.shape[:2]
    middle = (columns // 2, rows // 2)
    x, y = (round(value) for value in cross_px(viewport, body_from_shown, body_from_head))
    for color, width in ((DARK, 4), (WHITE, 2)):
        cv2.circle(pixels, middle, RING_PX, color, width, cv2.LINE_AA)
    for color, width in ((DARK, 5), (GREEN, 2)):
        cv2.line(pixels, (x - CROSS_PX, y), (x + CROSS_PX, y), color, width)
        cv2.line(pixels, (x, y - CROSS_PX), (x, y + CROSS_PX), color, width)


def caption(width: int, label: str, words: str) -> Pixels:
    """A dark strip with a heading and what is to be said now."""
    strip = np.full((CAPTION_PX, width, 3), DARK, dtype=np.uint8)
    for text, row, color in ((label, 16, WHITE), (words, 33, GREEN)):
        cv2.putText(strip, text, (8, row), cv2.FONT_HERSHEY_SIMPLEX, 0.45, color, 1, cv2.LINE_AA)
    return strip
