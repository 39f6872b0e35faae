"""Make docs/picture.jpg: a simulated fisheye picture beside a view into it, with its outline."""

from __future__ import annotations

import sys

import cv2
import numpy as np

from freelook import Camera, Viewport, body_from_view, load_camera
from freelook.renderers.cpu import CpuRenderer
from freelook.simulation.camera import SimulatedCamera
from freelook.simulation.world import World
from freelook.sinks.picture import rgb24
from freelook.types import Picture

FLIGHT_S = 68.4
LOOK_DEG = (45.0, -12.0, 0.0)  # yaw, pitch, roll
HFOV_DEG = 80.0
CAMERA_SIZE = (1920, 1920)
HEIGHT = 560
GAP = 16
OUTLINE_BGR = (60, 200, 255)


def bgr(picture: Picture) -> np.ndarray:
    return np.ascontiguousarray(rgb24(picture)[..., ::-1])


def outline(camera: Camera, viewport: Viewport) -> np.ndarray:
    """Pixels of the fisheye picture along the border of the view, (n, 2)."""
    rays = viewport.rays()
    border = np.vstack([rays[0], rays[:, -1], rays[-1, ::-1], rays[::-1, 0]])
    turn = camera.camera_from_body * body_from_view(*LOOK_DEG)
    return camera.project(turn.apply(border))


def compose() -> np.ndarray:
    simulated = SimulatedCamera(load_camera("demo").resized(CAMERA_SIZE), World(softness_deg=0.1))
    camera = simulated.camera
    viewport = Viewport((HEIGHT * 16 // 9 // 2 * 2, HEIGHT), HFOV_DEG)
    picture = simulated.frame(int(FLIGHT_S * 1e9)).picture
    turn = camera.camera_from_body * body_from_view(*LOOK_DEG)
    view = CpuRenderer().render(picture, camera, turn, viewport)
    fisheye = bgr(picture)
    seen = outline(camera, viewport)
    points = np.round(seen[np.isfinite(seen).all(axis=1)] * 16).astype(np.int32)
    cv2.polylines(fisheye, [points], True, OUTLINE_BGR, 8, cv2.LINE_AA, shift=4)
    fisheye = cv2.resize(fisheye, (HEIGHT, HEIGHT), interpolation=cv2.INTER_AREA)
    gap = np.full((HEIGHT, GAP, 3), 255, np.uint8)
    return np.hstack([fisheye, gap, bgr(view)])


if __name__ == "__main__":
    path = sys.argv[1]
    if not cv2.imwrite(path, compose(), [cv2.IMWRITE_JPEG_QUALITY, 88]):
        sys.exit(f"cannot write {path}")
