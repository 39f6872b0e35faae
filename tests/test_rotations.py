from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freelook.rotations import (
    FRD_FROM_RDF,
    RDF_FROM_FRD,
    angle_between_deg,
    body_from_view,
    from_wxyz,
    head_angles_deg,
    slerp,
    to_wxyz,
)

turns = st.floats(-179, 179).map(lambda a: round(a, 6))
tilts = st.floats(-89, 89).map(lambda a: round(a, 6))


def test_axes_of_a_head_that_looks_straight_ahead() -> None:
    right, down, forward = FRD_FROM_RDF.as_matrix().T  # columns: view x, y, z in the body
    np.testing.assert_allclose(right, [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(down, [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(forward, [1, 0, 0], atol=1e-15)


@given(turns, tilts, turns)
def test_angles_survive_the_round_trip(yaw: float, pitch: float, roll: float) -> None:
    assert head_angles_deg(body_from_view(yaw, pitch, roll)) == pytest.approx(
        (yaw, pitch, roll), abs=1e-6
    )


@given(turns, tilts, turns)
def test_rotation_is_the_product_of_three_elementary_ones(
    yaw: float, pitch: float, roll: float
) -> None:
    y, x, z = np.radians([yaw, pitch, roll])
    about_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
    about_z = np.array([[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]])
    head = (RDF_FROM_FRD * body_from_view(yaw, pitch, roll)).as_matrix()
    np.testing.assert_allclose(head, about_y @ about_x @ about_z, atol=1e-12)


@pytest.mark.parametrize("pitch", [90.0, -90.0])
def test_straight_up_and_down_keep_the_rotation_and_report_no_roll(pitch: float) -> None:
    rotation = body_from_view(30, pitch, 20)
    yaw, reported_pitch, roll = head_angles_deg(rotation)
    assert reported_pitch == pytest.approx(pitch)
    assert roll == 0.0
    assert angle_between_deg(rotation, body_from_view(yaw, pitch, roll)) < 1e-4


def test_quaternions_are_written_w_first_with_w_positive() -> None:
    quarter_about_z = Rotation.from_euler("z", 90, degrees=True)
    half = np.sqrt(0.5)
    assert to_wxyz(quarter_about_z) == pytest.approx([half, 0, 0, half])
    assert to_wxyz(from_wxyz([-half, 0, 0, -half])) == pytest.approx([half, 0, 0, half])
    with pytest.raises(ValueError, match="zero"):
        from_wxyz([0, 0, 0, 0])


@given(turns, tilts, turns, st.floats(0, 1).map(lambda f: round(f, 6)))
def test_slerp_goes_the_short_way_at_constant_speed(
    yaw: float, pitch: float, roll: float, fraction: float
) -> None:
    a, b = body_from_view(0, 0), body_from_view(yaw, pitch, roll)
    whole = angle_between_deg(a, b)
    middle = slerp(a, b, fraction)
    assert angle_between_deg(a, middle) == pytest.approx(fraction * whole, abs=1e-5)
    assert angle_between_deg(middle, b) == pytest.approx((1 - fraction) * whole, abs=1e-5)
