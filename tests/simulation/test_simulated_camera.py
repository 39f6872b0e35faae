"""Frames of the simulated camera against the world's exact colours."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from freelook.camera import make_camera
from freelook.color import i420_from_rgb, rgb_from_picture
from freelook.lens import Equidistant, KannalaBrandt
from freelook.rotations import body_from_view
from freelook.simulation.camera import SimulatedCamera, pixel_deg
from freelook.simulation.flight import Hover
from freelook.simulation.world import World
from freelook.types import ColorSpace
from freelook.viewport import Viewport

T_NS = 21_000_000_000
LENS = KannalaBrandt(70.0, -0.01, 0.001)
# odd, oblong, off centre, looking 20 degrees down and to the left, wider than the picture is high
CAMERA = make_camera(
    (241, 203),
    LENS,
    center=(125.3, 99.1),
    field_deg=190.0,
    stretch=np.array([[1.0, 0.01], [0.0, 0.97]]),
    camera_from_body=body_from_view(-30, -20, 5).inv(),
)


def exact(simulated: SimulatedCamera, t_ns: int) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """(colour, seen) of every pixel, ray by ray with the camera's own `ray`."""
    width, height = simulated.camera.size
    y, x = np.mgrid[0:height, 0:width].astype(float)
    rays = simulated.camera.ray(np.stack([x, y], axis=-1))
    state = simulated.truth(t_ns)
    turn = state.world_from_body * simulated.camera.camera_from_body.inv()
    colors = simulated.world.render_rays(rays @ turn.as_matrix().T, state.position)
    return colors, np.isfinite(rays[..., 0])


@pytest.mark.parametrize(
    "color", [ColorSpace(), ColorSpace("bt601", full_range=True)], ids=["709", "601 full"]
)
@pytest.mark.parametrize("threads", [1, 2])
def test_frames_are_the_exact_colours_rounded_once(color: ColorSpace, threads: int) -> None:
    simulated = SimulatedCamera(CAMERA, World(0.5), color=color, threads=threads)
    frame = simulated.frame(T_NS)
    assert (frame.capture_ns, frame.media_ns, frame.picture.color) == (T_NS, T_NS, color)
    colors, seen = exact(simulated, T_NS)
    assert 0.6 < seen.mean() < 0.98
    truth = i420_from_rgb(colors, color)
    # a tile straddling the picture's border counts black outside it
    for plane, expected, inner in zip(frame.picture.planes, truth.planes, (0, 1, 1), strict=True):
        assert plane.shape == expected.shape
        difference = np.abs(plane.astype(int) - expected)[: len(plane) - inner, : -inner or None]
        assert difference.max() <= 1
        assert (difference > 0).mean() < 0.02


def test_outside_the_field_it_is_black() -> None:
    camera = make_camera((200, 200), Equidistant(60.0), field_deg=120.0)
    picture = SimulatedCamera(camera).picture(0)
    assert picture.planes[0][0].tolist() == [16] * 200
    assert rgb_from_picture(picture)[:20, :20].max() < 0.01
    full = SimulatedCamera(camera, color=ColorSpace("bt709", full_range=True)).picture(0)
    assert not full.planes[0][0].any()


def test_the_same_time_gives_the_same_frame() -> None:
    one, two = (SimulatedCamera(CAMERA, threads=n).picture(T_NS) for n in (1, 2))
    later = SimulatedCamera(CAMERA).picture(T_NS + 100_000_000)
    for a, b, c in zip(one.planes, two.planes, later.planes, strict=True):
        assert np.array_equal(a, b)
        assert not np.array_equal(a, c)


def test_the_exact_view_looks_where_the_head_points() -> None:
    """Looking straight down from above the runway's middle: asphalt with a white line."""
    hover = SimulatedCamera(CAMERA, World(0.1), Hover((-9.0, 0.0, -20.0)))
    view = hover.exact_view(0, body_from_view(0, -90), Viewport((101, 61), 40.0))
    assert view.size == (101, 61)
    row = view.planes[0][30].astype(int)  # east to the right
    assert row[50].min() > 180
    assert row[20:40].max() < 120
    assert row[60:80].max() < 120


def test_pixels_in_degrees() -> None:
    assert pixel_deg(make_camera((100, 100), Equidistant(50.0))) == pytest.approx(
        np.degrees(1 / 50), rel=1e-6
    )
