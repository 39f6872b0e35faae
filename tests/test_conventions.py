"""One test per line of docs/conventions.md, in words."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.camera import Camera, make_camera
from freelook.clock import now_ns
from freelook.lens import Equidistant
from freelook.rotations import FRD_FROM_RDF, RDF_FROM_FRD, body_from_view, from_wxyz, to_wxyz
from freelook.types import Picture
from freelook.viewport import Viewport

BODY_FORWARD, BODY_RIGHT, BODY_DOWN = np.eye(3)
VIEW_RIGHT, VIEW_DOWN, VIEW_FORWARD = np.eye(3)


@pytest.fixture
def camera() -> Camera:
    return make_camera((1000, 800), Equidistant(300.0), field_deg=188)


def looks_at(yaw_deg: float, pitch_deg: float, roll_deg: float = 0.0) -> np.ndarray:
    """The direction of the view's axis in the body frame."""
    return np.asarray(body_from_view(yaw_deg, pitch_deg, roll_deg).apply(VIEW_FORWARD))


def where(camera: Camera, body_direction: np.ndarray) -> np.ndarray:
    """The pixel that shows something in this direction of the vehicle."""
    return camera.project(camera.camera_from_body.apply(body_direction))


def test_convention_camera_frame_is_x_right_y_down_z_forward(camera: Camera) -> None:
    x, y = camera.project(np.array([0.1, 0.2, 1.0])) - camera.center
    assert x > 0, "a ray to the right shows right of the centre"
    assert y > 0, "a ray downwards shows below the centre"
    np.testing.assert_allclose(np.cross(VIEW_RIGHT, VIEW_DOWN), VIEW_FORWARD)


def test_convention_body_frame_is_forward_right_down(camera: Camera) -> None:
    center = np.array(camera.center)
    np.testing.assert_allclose(where(camera, BODY_FORWARD), center)
    assert where(camera, BODY_FORWARD + BODY_RIGHT)[0] > center[0]
    assert where(camera, BODY_FORWARD + BODY_DOWN)[1] > center[1]
    np.testing.assert_allclose(np.cross(BODY_FORWARD, BODY_RIGHT), BODY_DOWN)


def test_convention_yaw_is_positive_to_the_right() -> None:
    np.testing.assert_allclose(looks_at(90, 0), BODY_RIGHT, atol=1e-12)


def test_convention_pitch_is_positive_upwards() -> None:
    np.testing.assert_allclose(looks_at(0, 90), -BODY_DOWN, atol=1e-12)


def test_convention_roll_is_positive_right_ear_down() -> None:
    right_ear = body_from_view(0, 0, 30).apply(VIEW_RIGHT)
    assert right_ear @ BODY_DOWN == pytest.approx(0.5)
    np.testing.assert_allclose(looks_at(0, 0, 30), BODY_FORWARD, atol=1e-12)


def test_convention_roll_right_ear_down_tilts_the_horizon_anticlockwise_in_the_view() -> None:
    view_from_body = body_from_view(0, 0, 30).inv()
    horizon_right = view_from_body.apply(BODY_FORWARD + 0.5 * BODY_RIGHT)
    horizon_left = view_from_body.apply(BODY_FORWARD - 0.5 * BODY_RIGHT)
    assert horizon_right @ VIEW_DOWN < 0, "the horizon's right end is above the middle"
    assert horizon_left @ VIEW_DOWN > 0, "its left end is below"


def test_convention_order_is_yaw_then_pitch_then_roll_about_the_turned_axes() -> None:
    yaw, pitch, roll = (
        Rotation.from_euler(axis, angle, degrees=True)
        for axis, angle in (("y", 40), ("x", 30), ("z", 20))
    )
    expected = FRD_FROM_RDF * yaw * pitch * roll
    assert (expected.inv() * body_from_view(40, 30, 20)).magnitude() < 1e-12
    up_after_yaw = looks_at(40, 30)
    assert -up_after_yaw @ BODY_DOWN == pytest.approx(0.5), "pitch lifts by 30 whatever the yaw"


def test_convention_quaternions_are_written_w_x_y_z_of_unit_length() -> None:
    quarter_turn = Rotation.from_rotvec([0, 0, np.pi / 2])
    half = np.sqrt(0.5)
    assert to_wxyz(quarter_turn) == pytest.approx([half, 0, 0, half])
    assert (from_wxyz([1, 0, 0, 1]).inv() * quarter_turn).magnitude() < 1e-12


def test_convention_a_from_b_maps_coordinates_in_b_to_coordinates_in_a() -> None:
    np.testing.assert_allclose(FRD_FROM_RDF.apply(VIEW_FORWARD), BODY_FORWARD, atol=1e-15)
    np.testing.assert_allclose(RDF_FROM_FRD.apply(BODY_FORWARD), VIEW_FORWARD, atol=1e-15)


def test_convention_a_from_c_is_a_from_b_times_b_from_c(camera: Camera) -> None:
    ray_in_view = np.array([0.1, -0.2, 1.0])
    camera_from_view = camera.camera_from_body * body_from_view(50, 10)
    step_by_step = camera.camera_from_body.apply(body_from_view(50, 10).apply(ray_in_view))
    np.testing.assert_allclose(camera_from_view.apply(ray_in_view), step_by_step)


def test_convention_pixel_zero_is_the_middle_of_the_top_left_pixel() -> None:
    camera = make_camera((5, 3), Equidistant(2.0))
    assert camera.center == (2.0, 1.0), "the middle of 5 x 3 pixels is pixel (2, 1)"
    doubled = camera.resized((10, 6))
    assert doubled.center == (4.5, 2.5), "which is between pixels at twice the size"


def test_convention_field_of_view_runs_from_outer_edge_to_outer_edge() -> None:
    viewport = Viewport((640, 480), 90)
    assert viewport.focal_px == pytest.approx(320)
    last_centre = viewport.rays()[0, -1, 0]
    assert last_centre * 320 == pytest.approx(319.5), "half a pixel short of the edge"


def test_convention_time_is_integer_nanoseconds_of_one_monotonic_clock() -> None:
    first, second = now_ns(), now_ns()
    assert isinstance(first, int)
    assert second >= first


def test_convention_sizes_are_width_height_and_shapes_rows_columns() -> None:
    picture = Picture("gray", (np.zeros((480, 640), np.uint8),))
    assert picture.size == (640, 480)
    assert Viewport((640, 480)).rays().shape == (480, 640, 3)


def test_convention_unknown_is_nan_never_zero(camera: Camera) -> None:
    behind = np.array([0.0, 0.1, -1.0])
    assert np.isnan(camera.project(behind)).all()
    assert np.isnan(camera.ray(np.array([-5000.0, 0.0]))).all()
