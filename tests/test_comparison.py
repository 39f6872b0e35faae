"""Differences of two cameras that are known in closed form, and the turn between them."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.comparison import compare, ring
from freelook.errors import ProfileError
from freelook.lens import Equidistant, Perspective, ThinPrismFisheye
from freelook.rotations import FRD_FROM_RDF, head_angles_deg

CENTER = (499.5, 399.5)


def camera(f: float = 300.0, *, field_deg: float = 188, **changes: object) -> Camera:
    return make_camera((1000, 800), Equidistant(f), field_deg=field_deg, **changes)  # type: ignore[arg-type]


def test_a_camera_does_not_differ_from_itself() -> None:
    bent = make_camera((800, 600), ThinPrismFisheye(250, p1=0.002), field_deg=170)
    for one in (camera(), bent):
        found = compare(one, one)
        assert found.as_is.numbers is not None
        assert found.as_is.numbers.max_px < 1e-8  # the bent lens's inverse closes to 1e-10 px
        assert found.as_is.numbers.max_deg < 1e-9
        assert found.a_from_b.magnitude() < 1e-12
        assert (found.only_a, found.only_b) == (0, 0)


def test_a_longer_focal_length_is_no_turn() -> None:
    """f larger by 1 %: 0.01 f theta in pixels, theta / 101 in angle, all around the same."""
    a, b = camera(), camera(303.0)
    found = compare(a, b)
    at_60 = ring(a, b, found.a_from_b, np.radians(60)).as_is
    assert at_60 is not None
    assert at_60.rms_px == pytest.approx(3 * np.radians(60))
    assert at_60.max_px == pytest.approx(3 * np.radians(60))
    assert at_60.rms_deg == pytest.approx(60 * (1 - 300 / 303))
    assert found.a_from_b.magnitude() < 1e-9
    numbers, turned = found.as_is.numbers, found.turned.numbers
    assert numbers is not None
    assert turned is not None
    assert turned.rms_px == pytest.approx(numbers.rms_px)
    assert np.abs(found.as_is.mean_shift_px).max() < 1e-9


def test_arrows_lead_from_a_to_b() -> None:
    """B puts everything 4 px further right and 3 px further down."""
    found = compare(camera(), camera(center=(CENTER[0] + 4, CENTER[1] + 3)))
    shift = found.as_is.shift_px[found.as_is.common]
    np.testing.assert_allclose(shift, np.tile([4.0, 3.0], (len(shift), 1)), atol=1e-9)
    np.testing.assert_allclose(found.as_is.mean_shift_px, [4, 3], atol=1e-9)
    assert found.as_is.rms_px_unmoved < 1e-9
    assert found.as_is.numbers is not None
    assert found.as_is.numbers.rms_px == pytest.approx(5)


def test_a_forward_further_right_in_the_picture_is_a_turn_to_the_right() -> None:
    """Right is right, up is up: a narrow picture's move is a turn, to second order."""
    a = make_camera((800, 600), Equidistant(2000))
    b = make_camera((800, 600), Equidistant(2000), center=(399.5 + 20, 299.5 - 10))
    found = compare(a, b)
    yaw, pitch, roll = head_angles_deg(FRD_FROM_RDF * found.a_from_b)
    assert yaw == pytest.approx(np.degrees(20 / 2000), rel=0.02)
    assert pitch == pytest.approx(np.degrees(10 / 2000), rel=0.02)
    assert abs(roll) < 0.01
    assert found.turned.numbers is not None
    assert found.turned.numbers.rms_px < 0.2  # of 22: the sphere is not flat


def test_a_picture_turned_on_the_sensor_is_a_roll_and_nothing_else() -> None:
    """A round lens turned about its axis is exactly a roll; all of the difference goes."""
    angle = np.radians(1.0)
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    found = compare(camera(), camera(stretch=turned))
    assert found.as_is.numbers is not None
    assert found.turned.numbers is not None
    assert found.as_is.numbers.max_deg == pytest.approx(
        np.degrees(2 * np.arcsin(np.sin(angle / 2))), rel=1e-3
    )
    assert found.turned.numbers.max_px < 1e-8
    angles = head_angles_deg(FRD_FROM_RDF * found.a_from_b)
    # B's picture turns clockwise, x towards y: its right side is further down
    assert angles == pytest.approx((0, 0, 1), abs=1e-9)


def test_only_what_both_see_is_compared() -> None:
    a, b = camera(200, field_deg=180), camera(200, field_deg=120)
    found = compare(a, b, columns=400)
    circle = np.pi * (200 * np.radians(np.array([90, 60]))) ** 2 / 800_000
    assert found.both == pytest.approx(circle[1], rel=0.01)
    assert found.only_a == pytest.approx(circle[0] - circle[1], rel=0.01)
    assert found.only_b == 0
    swapped = compare(b, a, columns=400)
    assert (swapped.only_a, swapped.only_b) == (0, found.only_a)
    assert found.as_is.numbers is not None
    assert found.as_is.numbers.max_px < 1e-9


def test_rings_that_are_not_common_say_so() -> None:
    a, b = camera(200, field_deg=180), camera(200, field_deg=120)
    turn = compare(a, b).a_from_b
    assert ring(a, b, turn, np.radians(59.9)).as_is is not None
    assert ring(a, b, turn, np.radians(60.1)).as_is is None  # B does not see it
    assert ring(a, b, turn, np.radians(100)).as_is is None  # A neither
    outside = make_camera((300, 300), Equidistant(200), field_deg=180)
    assert ring(outside, outside, turn, np.radians(80)).as_is is None  # not in the picture
    on_the_rim = ring(a, a, turn, a.theta_max).as_is
    assert on_the_rim is not None
    assert on_the_rim.max_px < 1e-6


def test_nothing_in_common_and_other_sizes_are_refused() -> None:
    left = camera(100, field_deg=90, center=(200, 400))
    right = camera(100, field_deg=90, center=(800, 400))
    with pytest.raises(ProfileError, match="no part of the picture"):
        compare(left, right)
    with pytest.raises(ProfileError, match="cannot be compared"):
        compare(camera(), make_camera((640, 480), Perspective(300)))
