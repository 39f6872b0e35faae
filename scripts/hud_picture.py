"""Make docs/hud.jpg: a view of a simulated flight with the HUD over it."""

from __future__ import annotations

import sys

import cv2
import numpy as np

from freelook import Viewport, body_from_view, load_camera
from freelook.hud import (
    Dial,
    HudState,
    LensField,
    Link,
    Recording,
    TrackerState,
    place_of,
    shapes,
    theme_named,
)
from freelook.hud.place import MOVING, RESTING, pixels_per_point
from freelook.renderers.cpu import CpuRenderer
from freelook.renderers.cpu_pen import CpuPen
from freelook.simulation.camera import SimulatedCamera
from freelook.simulation.world import World
from freelook.sinks.picture import rgb24

FLIGHT_NS = 68_400_000_000
LOOK_DEG = (24.0, -2.0, 6.0)  # yaw, pitch, roll
SIZE = (1280, 720)
HFOV_DEG = 90.0
CAMERA_SIZE = (1920, 1920)


def compose() -> np.ndarray:
    simulated = SimulatedCamera(load_camera("demo").resized(CAMERA_SIZE), World(softness_deg=0.1))
    camera, look = simulated.camera, body_from_view(*LOOK_DEG)
    viewport = Viewport(SIZE, HFOV_DEG)
    picture = simulated.frame(FLIGHT_NS).picture
    view = CpuRenderer().render(picture, camera, camera.camera_from_body * look, viewport)
    state = HudState(
        look,
        HFOV_DEG,
        world_from_body=simulated.truth(FLIGHT_NS).world_from_body,
        lens=LensField.of(camera),
        link=Link("live"),
        tracker=TrackerState("opentrack", "tracking"),
        recording=Recording("live", 2052),
        dials={"head": Dial(17.0, 29.0), "video": Dial(48.0, 71.0)},
    )
    ratio = pixels_per_point(SIZE)
    places = [place_of(SIZE[0] / ratio, SIZE[1] / ratio, parts) for parts in (MOVING, RESTING)]
    pen = CpuPen(theme_named("day"), ratio)
    drawn = pen.drawn([shapes(state, place) for place in places], view)
    return np.ascontiguousarray(rgb24(drawn)[..., ::-1])


if __name__ == "__main__":
    path = sys.argv[1]
    if not cv2.imwrite(path, compose(), [cv2.IMWRITE_JPEG_QUALITY, 86]):
        sys.exit(f"cannot write {path}")
