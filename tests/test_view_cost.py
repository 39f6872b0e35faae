"""What a view costs, where it can be said in closed form: mostly views of perspective cameras."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.camera import Camera, make_camera
from freelook.formats import load_camera
from freelook.lens import Equidistant, Perspective
from freelook.rotations import body_from_view
from freelook.view_cost import ViewCost, view_cost
from freelook.viewport import Viewport

CLOSE = 1e-8  # differences of 0.002 view pixels of pixels below 1e4: rounding errs by less
PERSPECTIVE = make_camera((640, 480), Perspective(320.0))
FISHEYE = make_camera((960, 960), Equidistant(289.0), field_deg=188)


def cost(camera: Camera, viewport: Viewport, yaw: float = 0, pitch: float = 0) -> ViewCost:
    return view_cost(camera, camera.camera_from_body * body_from_view(yaw, pitch), viewport)


def test_the_picture_itself_costs_one_source_pixel_per_view_pixel() -> None:
    same = cost(PERSPECTIVE, Viewport((640, 480), 90))
    assert same.source_pixels == pytest.approx(640 * 480, rel=CLOSE)
    assert same.view_pixels == same.picture_pixels == same.image_pixels == 640 * 480
    assert (same.seen, same.enlarged, same.shrunk) == (1, 0, 0)
    assert same.largest_size == (640, 480)
    for spot in same.spots.values():
        assert spot.per_view_pixel == pytest.approx((1, 1), rel=CLOSE)
    centre = same.spots["centre"]
    assert centre.per_degree == pytest.approx((same.view_px_per_degree,) * 2, rel=1e-6)


@pytest.mark.parametrize(("scale", "enlarged", "shrunk"), [(0.5, 0, 1), (2.0, 1, 0)])
def test_the_picture_at_another_size(scale: float, enlarged: float, shrunk: float) -> None:
    """The largest view that is not enlarged is the picture itself, at whatever size one asks."""
    other = cost(PERSPECTIVE, Viewport((int(640 * scale), int(480 * scale)), 90))
    assert (other.enlarged, other.shrunk) == (enlarged, shrunk)
    assert other.source_pixels == pytest.approx(640 * 480, rel=CLOSE)
    assert other.largest_size == (640, 480)
    assert other.spots["corners"].per_view_pixel == pytest.approx((1 / scale,) * 2, rel=CLOSE)


def test_a_crop_of_the_paper_s_size_uses_a_sixteenth_of_the_picture() -> None:
    """Rawashdeh and Sababha 2011: a window of 180 x 144 out of 720 x 576."""
    camera = make_camera((720, 576), Perspective(360.0))
    hfov_deg = 2 * np.degrees(np.arctan(90 / 360))
    crop = cost(camera, Viewport((180, 144), hfov_deg))
    assert crop.source_pixels / crop.picture_pixels == pytest.approx(1 / 16, rel=CLOSE)
    assert crop.largest_size == (180, 144)


def test_forward_through_a_fisheye() -> None:
    """In the middle f_lens / f_view; nearer the edge a perspective view spreads by 1 / cos."""
    viewport = Viewport((1280, 720), 90)
    forward = cost(FISHEYE, viewport)
    middle = 289 / 640
    assert forward.spots["centre"].per_view_pixel == pytest.approx((middle, middle), rel=1e-6)
    edge = np.arctan((640 - 0.5) / 640)  # of the outermost pixel
    radial = middle * np.cos(edge) ** 2
    tangential = middle * edge / np.tan(edge)
    for side in ("left", "right"):
        assert forward.spots[side].per_view_pixel == pytest.approx((radial, tangential), rel=1e-6)
    assert forward.enlarged == 1
    width, height = forward.largest_size
    assert width / height == pytest.approx(16 / 9, rel=0.01)
    again = cost(FISHEYE, Viewport(forward.largest_size, 90))
    assert again.enlarged == 0
    larger = cost(FISHEYE, Viewport((width + 4, height + 4), 90))
    assert larger.enlarged > 0


def test_left_is_left() -> None:
    """60 degrees to the left the view's left end looks past the rim, its right end does not."""
    left = cost(FISHEYE, Viewport((1280, 720), 90), yaw=-60)
    assert np.isnan(left.spots["left"].per_view_pixel).all()
    assert np.isfinite(left.spots["right"].per_view_pixel).all()
    assert 0.8 < left.seen < 0.9
    right = cost(FISHEYE, Viewport((1280, 720), 90), yaw=60)
    assert right.source_pixels == pytest.approx(left.source_pixels, rel=1e-6)
    assert np.isnan(right.spots["right"].per_degree).all()


def test_up_is_up() -> None:
    up = cost(FISHEYE, Viewport((640, 640), 90), pitch=60)
    assert np.isnan(up.spots["top"].per_view_pixel).all()
    assert np.isfinite(up.spots["bottom"].per_view_pixel).all()


def test_a_view_of_nothing_costs_nothing() -> None:
    behind = cost(FISHEYE, Viewport((640, 480), 60), yaw=180)
    assert (behind.source_pixels, behind.seen, behind.enlarged, behind.shrunk) == (0, 0, 0, 0)
    assert behind.largest_size == (0, 0)


def test_beyond_the_picture_there_is_nothing_to_see() -> None:
    """A lens may see more than the sensor holds."""
    wide = make_camera((400, 400), Equidistant(289.0), field_deg=188)
    forward = cost(wide, Viewport((640, 640), 120))
    assert forward.source_pixels == pytest.approx(400 * 400, rel=0.01)
    assert forward.seen < 0.5
    assert np.isnan(forward.spots["corners"].per_view_pixel).all()


def test_samples_say_the_same_as_all_pixels() -> None:
    viewport, turn = Viewport((640, 360), 100), Rotation.from_euler("Y", 50, degrees=True)
    few = view_cost(FISHEYE, turn, viewport, columns=100)
    every = view_cost(FISHEYE, turn, viewport, columns=640)
    # the rim runs across the view and is cut into steps of 6.4 pixels
    assert few.source_pixels == pytest.approx(every.source_pixels, rel=5e-3)
    assert few.seen == pytest.approx(every.seen, abs=5e-3)
    assert few.largest_size == every.largest_size


def test_the_costs_in_the_docs_are_the_real_ones() -> None:
    text = (Path(__file__).parent.parent / "docs" / "lenses.md").read_text("utf-8")
    row = r"^\| `([\w-]+)` \| (\d+) x (\d+) \| ([\d.]+) % \|" + r" ([\d.]+) \|" * 3
    rows = re.findall(row + r" (\d+) x (\d+) \|$", text, re.M)
    assert len(rows) >= 5
    for name, *numbers in rows:
        width, height, share, per_degree, middle, corners, *largest = map(float, numbers)
        camera = load_camera(name)
        found = cost(camera, Viewport((1280, 720), 90))
        assert camera.size == (width, height)
        assert 100 * found.source_pixels / found.picture_pixels == pytest.approx(share, abs=0.051)
        assert found.spots["centre"].per_degree[0] == pytest.approx(per_degree, abs=0.051)
        assert found.spots["centre"].per_view_pixel[0] == pytest.approx(middle, abs=0.0051)
        assert found.spots["corners"].per_view_pixel[0] == pytest.approx(corners, abs=0.0051)
        assert list(found.largest_size) == pytest.approx(largest, abs=1)  # rounded down
        assert found.seen == 1
