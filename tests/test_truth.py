"""Rendered views against the exact view of the simulated world, for every lens model.

The world is as soft as four pixels of the coarsest part of the frame that is looked at: what is
left is the renderer's own error, and a wrong sign, centre or scale costs tens of decibels.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from freelook.camera import Camera, make_camera
from freelook.color import i420_from_rgb
from freelook.lens import (
    MODELS,
    Equidistant,
    Equisolid,
    KannalaBrandt,
    Lens,
    Orthographic,
    Perspective,
    Polynomial,
    Stereographic,
    radius_slope,
)
from freelook.renderers.cpu import CpuRenderer
from freelook.rotations import body_from_view
from freelook.simulation.camera import SimulatedCamera
from freelook.simulation.world import World
from freelook.types import Picture
from freelook.viewport import Viewport
from lens_examples import EXAMPLES

SIDE = 1200
VIEW = Viewport((320, 200), 24.0)
# r = f sin(theta) has no resolution left at 90 degrees: stay clear of it when looking at 80
NARROW = Viewport((320, 200), 10.0)
HEADS = [(0, 0, 0), (-80, 0, 0), (80, 0, 0), (0, 78, 0), (0, -80, 0), (-50, -55, 20), (45, 30, -60)]
T_NS = 21_000_000_000

# 90 degrees or more from the axis wherever the model can, an off-centre axis, oblong pixels
LENSES: dict[str, tuple[Lens, float]] = {
    "perspective": (Perspective(480.0), 100.0),
    "stereographic": (Stereographic(240.0), 200.0),
    "equidistant": (Equidistant(320.0), 200.0),
    "equisolid": (Equisolid(360.0), 200.0),
    "orthographic": (Orthographic(540.0), 180.0),
    "polynomial": (Polynomial(350.0, 3.0, -15.0, 0.5, -0.2), 200.0),
    "kannala_brandt": (KannalaBrandt(340.0, -0.03, 0.004, -0.002, 0.0001), 200.0),
}


def camera_of(model: str) -> Camera:
    """A lens of the model: from the list above, else its real calibration, made as large."""
    if model not in LENSES:
        example = EXAMPLES[model][0].camera
        scale = SIDE / max(example.size)
        width, height = (round(side * scale) for side in example.size)
        return example.resized((width, height))
    lens, field_deg = LENSES[model]
    stretch = np.array([[1.0, 0.004], [0.0, 1.01]])
    center = (SIDE / 2 + 7.3, SIDE / 2 - 4.6)
    return make_camera((SIDE, SIDE), lens, center=center, field_deg=field_deg, stretch=stretch)


def coarsest_pixel_deg(camera: Camera, head: tuple[float, float, float], view: Viewport) -> float:
    """How wide a pixel of the frame is, radially, at the far corner of the view."""
    axis = camera.camera_from_body * body_from_view(*head)
    off_axis = np.arccos(np.clip(axis.apply([0, 0, 1])[2], -1, 1))
    corner = np.arctan(np.hypot(*view.size) / 2 / view.focal_px)
    edge = min(off_axis + corner, camera.theta_max - 0.01)
    slope = min(radius_slope(camera.lens, np.array([off_axis, edge])))
    return float(np.degrees(1 / slope))


def psnr_db(a: Picture, b: Picture) -> float:
    """Of luma, where the first picture is not black."""
    seen = a.planes[0] > 16
    assert seen.mean() > 0.4
    error = a.planes[0][seen].astype(float) - b.planes[0][seen]
    return float(10 * np.log10(255**2 / np.mean(error**2)))


def reachable(camera: Camera, view: Viewport) -> list[tuple[float, float, float]]:
    """The directions in which the view is wholly in the picture and well inside the field."""
    found = []
    for head in [*HEADS, (30.0, -10.0, 15.0)]:
        rays = (camera.camera_from_body * body_from_view(*head)).apply(view.rays().reshape(-1, 3))
        off_axis = np.arccos(np.clip(rays[:, 2] / np.linalg.norm(rays, axis=1), -1, 1))
        pixel = camera.project(rays)
        inside = ((pixel > 1) & (pixel < np.array(camera.size) - 2)).all()
        if inside and off_axis.max() < camera.theta_max - np.radians(0.5):
            found.append(head)
    return found


@pytest.mark.parametrize("model", list(MODELS))
def test_views_equal_the_exact_world(model: str) -> None:
    """Above 40 dB out to 80 degrees off axis, as promised; a lens without an entry fails."""
    camera = camera_of(model)
    simulated = SimulatedCamera(camera, threads=2)
    viewport = NARROW if model == "orthographic" else VIEW
    heads = reachable(camera, viewport)
    if model not in LENSES:
        heads = heads[:1] + heads[-2:]  # a picture takes seconds, and the lenses are many
    assert len(heads) >= (7 if model in LENSES and model != "perspective" else 1)
    for head in heads:
        softness_deg = 4 * coarsest_pixel_deg(camera, head, viewport)
        simulated.world = World(softness_deg=softness_deg)
        frame = simulated.picture(T_NS)
        direction = body_from_view(*head)
        camera_from_view = camera.camera_from_body * direction
        view = CpuRenderer().render(frame, camera, camera_from_view, viewport)
        exact = i420_from_rgb(simulated.exact_rgb(T_NS, direction, viewport), frame.color)
        right = psnr_db(view, exact)
        assert right > 40, f"head at {head}: {right:.1f} dB"


def test_the_measure_notices_half_a_pixel() -> None:
    """The bound above means something: a centre half a pixel off already falls below it."""
    camera = camera_of("equidistant")
    off = make_camera(
        camera.size,
        camera.lens,
        center=(camera.center[0] + 1.5, camera.center[1]),
        field_deg=200.0,
        stretch=camera.stretch,
    )
    simulated = SimulatedCamera(camera, World(softness_deg=0.4), threads=2)
    frame, direction = simulated.picture(T_NS), body_from_view(20, -10, 0)
    exact = i420_from_rgb(simulated.exact_rgb(T_NS, direction, VIEW), frame.color)
    rotation = camera.camera_from_body * direction
    right, wrong = (
        psnr_db(CpuRenderer().render(frame, c, rotation, VIEW), exact) for c in (camera, off)
    )
    assert right > wrong + 10


def test_turn_the_head_left_see_what_was_on_the_left() -> None:
    """What stood in the left third of the view ahead is in the middle after turning left."""
    simulated = SimulatedCamera(camera_of("equidistant"), World(softness_deg=0.5), threads=2)
    frame, camera = simulated.picture(T_NS), simulated.camera
    wide = Viewport((641, 401), 80.0)

    def look(yaw: float, pitch: float, roll: float, view: Viewport) -> Picture:
        rotation = camera.camera_from_body * body_from_view(yaw, pitch, roll)
        return CpuRenderer().render(frame, camera, rotation, view)

    ahead = look(0, 0, 0, wide).planes[0].astype(float)
    for yaw, pitch in ((-25.0, 0.0), (25.0, 0.0), (0.0, 15.0), (0.0, -15.0)):
        small = look(yaw, pitch, 0, Viewport((65, 41), 10.0)).planes[0].astype(float)
        x = 320 + wide.focal_px * np.tan(np.radians(yaw))
        y = 200 - wide.focal_px * np.tan(np.radians(pitch))
        expected = ahead[round(y) - 1 : round(y) + 2, round(x) - 1 : round(x) + 2].mean()
        assert small[20, 32] == pytest.approx(expected, abs=3)


def test_tilt_right_and_the_horizon_tilts_left() -> None:
    """Right ear down by 20 degrees, and up in the world points 20 degrees anticlockwise of up
    in the view: the sky moves to the left."""
    simulated = SimulatedCamera(camera_of("equidistant"), World(softness_deg=8.0), threads=2)
    frame, camera = simulated.picture(T_NS), simulated.camera
    world_from_body = simulated.truth(T_NS).world_from_body
    north, east, _ = world_from_body.apply([1.0, 0.0, 0.0])
    heading_deg = np.degrees(np.arctan2(east, north))
    tilts = []
    for roll in (0.0, 20.0, -20.0):
        # to the vehicle's heading, but level, whatever its own bank and pitch
        level = world_from_body.inv() * body_from_view(heading_deg, 0.0, roll)
        rotation = camera.camera_from_body * level
        view = CpuRenderer().render(frame, camera, rotation, Viewport((200, 200), 60.0))
        tilts.append(sky_tilt_deg(view.planes[1].astype(float)))
    # hills and clouds come into and go out of the corners: not exactly 20
    assert tilts[1] - tilts[0] == pytest.approx(20, abs=8)
    assert tilts[2] - tilts[0] == pytest.approx(-20, abs=8)


def sky_tilt_deg(blueness: NDArray[np.float64]) -> float:
    """Which way the plane fitted to the blueness rises: 0 is up, anticlockwise positive."""
    rows, columns = blueness.shape
    y, x = np.mgrid[0:rows, 0:columns] / rows
    basis = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], axis=1)
    (right, down, _), *_ = np.linalg.lstsq(basis, blueness.ravel(), rcond=None)
    return float(np.degrees(np.arctan2(-right, -down)))
