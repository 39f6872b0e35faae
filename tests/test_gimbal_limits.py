"""The lens's edge, gain and dead zone, and sensible fields of view."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freelook.camera import Camera, make_camera
from freelook.clock import NS_PER_MS
from freelook.errors import TrackerError
from freelook.gimbal import (
    AxisShape,
    Gimbal,
    GimbalSettings,
    LensLimit,
    Shape,
    parse_shape,
    soft_stop,
    zoom_limits,
)
from freelook.gimbal.limits import half_sides, reach, reach_of, softened
from freelook.gimbal.zoom import MOST_ENLARGED
from freelook.lens import Equidistant
from freelook.projections import PROJECTIONS
from freelook.resolution import resolution_at
from freelook.rotations import angle_between_deg, body_from_view, head_angles_deg
from freelook.types import Pose
from freelook.viewport import Viewport

LENSES_DEG = [120.0, 180.0, 188.0, 230.0]
VIEWS = [Viewport((1280, 720), 90), Viewport((640, 480), 40), Viewport((360, 800), 60)]


def farthest_deg(camera_from_view: Rotation, viewport: Viewport) -> float:
    """The angle from the axis of the farthest point on the view's border, by looking at many."""
    right, bottom = half_sides(viewport)
    along = np.linspace(-1, 1, 1001)
    edge = np.ones_like(along)
    x = np.concatenate([along, along, -edge, edge]) * right
    y = np.concatenate([-edge, edge, along, along]) * bottom
    rays = camera_from_view.apply(np.stack([x, y, np.ones_like(x)], axis=-1))
    return float(np.degrees(np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2])).max())


def looking(theta_deg: float, phi_deg: float, roll_deg: float = 0.0) -> Rotation:
    """`camera_from_view` theta away from the axis, towards phi (0 right, 90 down)."""
    side = Rotation.from_euler("z", phi_deg, degrees=True)
    away = Rotation.from_euler("y", theta_deg, degrees=True)
    return side * away * side.inv() * Rotation.from_euler("z", roll_deg, degrees=True)


@pytest.mark.parametrize("lens_deg", LENSES_DEG)
@pytest.mark.parametrize("viewport", VIEWS, ids=str)
def test_at_the_limit_the_view_just_touches_the_edge(lens_deg: float, viewport: Viewport) -> None:
    """On every side and at every roll, by the whole border of the view."""
    for phi in range(0, 360, 35):
        for roll in (0, 20, 45, 90, 160):
            stopped = soft_stop(
                looking(175, phi, roll), viewport, math.radians(lens_deg) / 2, knee=0.0
            )
            edge_deg = farthest_deg(stopped, viewport)
            # 1001 points on a side come within 4e-4 degrees of its farthest
            alone = farthest_deg(Rotation.identity(), viewport)
            assert edge_deg == pytest.approx(max(lens_deg / 2, alone), abs=4e-4)


def test_a_wide_view_stops_earlier_and_a_tall_one_later_to_the_side() -> None:
    half = math.radians(90)
    to_the_right = [reach((1.0, 0.0), half_sides(view), half) for view in VIEWS]
    assert np.degrees(to_the_right) == pytest.approx([45, 70, 60])
    rolled = reach((0.0, 1.0), half_sides(VIEWS[0]), half)
    assert math.degrees(rolled) == pytest.approx(90 - VIEWS[0].vfov_deg / 2)


def test_a_view_wider_than_the_lens_stays_in_the_middle() -> None:
    viewport = Viewport((1280, 720), 140)
    stopped = soft_stop(looking(30, 10), viewport, math.radians(50))
    assert stopped.apply([0, 0, 1.0]) == pytest.approx([0, 0, 1])


def test_before_the_knee_nothing_changes_and_after_it_the_view_slows_down() -> None:
    limit = math.radians(60)
    assert softened(math.radians(50), limit) == math.radians(50)
    theta = np.radians(np.linspace(0, 180, 721))
    kept = np.array([softened(value, limit) for value in theta])
    steps = np.diff(kept) / np.diff(theta)
    assert kept.max() < limit
    assert (steps >= 0).all()
    assert (steps <= 1 + 1e-9).all()
    assert abs(np.diff(steps)).max() < 0.03, "no kink: 0.25 of 10 degrees bend by 1/40"


@settings(max_examples=30)
@given(st.floats(0, 179), st.floats(0, 360), st.floats(-180, 180), st.sampled_from(LENSES_DEG))
def test_a_stopped_view_stays_inside_and_on_its_side(
    theta: float, phi: float, roll: float, lens_deg: float
) -> None:
    viewport = Viewport((1280, 720), 70)  # not wider than any of the lenses
    wanted = looking(round(theta, 3), round(phi, 3), round(roll, 3))
    stopped = soft_stop(wanted, viewport, math.radians(lens_deg) / 2)
    assert farthest_deg(stopped, viewport) <= lens_deg / 2 + 1e-6
    before, after = (r.apply([0, 0, 1.0]) for r in (wanted, stopped))
    assert before[0] * after[1] == pytest.approx(before[1] * after[0], abs=1e-9)
    assert before[:2] @ after[:2] >= -1e-12


def test_views_of_other_projections_stay_inside_too() -> None:
    viewport = Viewport((800, 600), 120, "stereographic")
    stopped = soft_stop(looking(80, 30, 10), viewport, math.radians(95))
    rays = stopped.apply(viewport.border(101))
    angle = np.degrees(np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2]))
    # 33 rays on a side miss the farthest point of a bent border by this at most
    assert 90 < angle.max() <= 95 + 0.01


def camera_of(field_deg: float = 180.0) -> Camera:
    return make_camera((1000, 1000), Equidistant(f=300.0), field_deg=field_deg)


def test_a_head_that_turns_right_around_never_makes_the_view_jump() -> None:
    """Straight behind, the soft stop alone changes sides at once."""
    viewport, limit = Viewport((1280, 720), 70), LensLimit(camera_of(), rate_deg_s=240)
    last, most, sides = None, 0.0, set()
    for t_ms in range(0, 3000, 2):
        aim = body_from_view(0.1 * t_ms, 3.0)
        now = limit(aim, viewport, t_ms * NS_PER_MS)
        if last is not None:
            most = max(most, angle_between_deg(last, now))
        last = now
        sides.add(round(head_angles_deg(now)[0] / 30))
        if t_ms % 40 == 0:
            assert farthest_deg(camera_of().camera_from_body * now, viewport) <= 90 + 1e-6
    # the head's own 0.2 degrees, and the rate; and the hard stop may bend the way a little
    assert most <= 1.3 * (0.2 + 0.480)
    assert {-2, 2} <= sides, "it went from one side to the other"


def test_with_nothing_to_stop_the_view_is_not_touched() -> None:
    limit = LensLimit(camera_of())
    aim = body_from_view(20, -10, 5)
    assert angle_between_deg(limit(aim, Viewport((1280, 720), 70), 0), aim) < 1e-9


# --- gain, dead zone, sense ---------------------------------------------------------------------


def tracking(shape: Shape) -> Gimbal:
    return Gimbal(GimbalSettings(shape=shape, blend_s=0.0, rate_deg_s=36_000))


def shaped(shape: Shape, yaw: float, pitch: float = 0.0, roll: float = 0.0) -> tuple[float, ...]:
    gimbal = tracking(shape)
    for t_ms in (0, 10, 20):
        gimbal.push(Pose(body_from_view(yaw, pitch, roll), t_ms * NS_PER_MS))
    return head_angles_deg(gimbal.aim(20 * NS_PER_MS).body_from_view)


def test_gain_dead_zone_and_sense_of_each_axis() -> None:
    shape = parse_shape("yaw=2,roll=0", "pitch=5", "pitch")
    assert shape == Shape(AxisShape(2.0), AxisShape(1.0, 5.0, True), AxisShape(0.0))
    assert shaped(shape, 20, 15, 30) == pytest.approx((40, -10, 0))
    assert shaped(shape, -20, -15, -30) == pytest.approx((-40, 10, 0))
    assert shaped(shape, 0, 4.9) == pytest.approx((0, 0, 0))
    assert shaped(parse_shape("1.5"), 20, 10, -10) == pytest.approx((30, 15, -15))


def test_pitch_ends_straight_up_whatever_the_gain() -> None:
    assert shaped(parse_shape("pitch=3"), 0, 50)[1] == pytest.approx(90)


def test_with_a_gain_yaw_goes_on_past_half_a_turn() -> None:
    """At half the gain, a head turned 200 degrees right looks 100 right, not 80 left."""
    gimbal = tracking(parse_shape("yaw=0.5"))
    last = 0.0
    for step in range(201):
        gimbal.push(Pose(body_from_view(step, 0), step * 5 * NS_PER_MS))
        yaw = head_angles_deg(gimbal.aim(step * 5 * NS_PER_MS).body_from_view)[0]
        assert abs(yaw - last) < 0.51
        last = yaw
    assert last == pytest.approx(100)
    gimbal.recentre(1000 * NS_PER_MS)
    gimbal.push(Pose(body_from_view(210, 0), 1005 * NS_PER_MS))
    assert head_angles_deg(gimbal.aim(1005 * NS_PER_MS).body_from_view)[0] == pytest.approx(5)


@pytest.mark.parametrize(
    ("texts", "why"),
    [
        (("up=2",), "gain: unknown axis 'up'; known: yaw, pitch, roll"),
        (("two",), "gain: 'two' is not understood; write one number"),
        (("11",), "a gain must be 0 to 10, not 11"),
        (("nan",), "a gain must be"),
        (("", "91"), "a dead zone must be 0 to 90 degrees, not 91"),
        (("", "yaw=-1"), "a dead zone must be"),
        (("", "", "sideways"), "invert: unknown axis 'sideways'"),
    ],
)
def test_what_is_no_shape_is_refused(texts: tuple[str, ...], why: str) -> None:
    with pytest.raises(TrackerError, match=why):
        parse_shape(*texts)


# --- zoom ---------------------------------------------------------------------------------------


def test_the_narrowest_view_enlarges_the_camera_pixels_as_stated() -> None:
    camera = camera_of()
    limits = zoom_limits(camera, 1280)
    view_px_per_deg = Viewport((1280, 720), limits.narrowest_deg).focal_px * math.radians(1)
    camera_px_per_deg = float(resolution_at(camera, np.array([0, 0, 1.0])).mean)
    assert view_px_per_deg / camera_px_per_deg == pytest.approx(MOST_ENLARGED)
    assert limits.widest_deg == 150


def test_zoom_is_limited_by_the_lens_and_by_what_a_view_can_be() -> None:
    assert zoom_limits(camera_of(120), 1280).widest_deg == pytest.approx(120)
    assert zoom_limits(camera_of(), 200).narrowest_deg == 10
    blurred = make_camera((40, 40), Equidistant(f=2.0), field_deg=100)
    limits = zoom_limits(blurred, 4000)
    assert limits.narrowest_deg == limits.widest_deg == pytest.approx(100)
    assert zoom_limits(camera_of(), 1280).clamp(3) == zoom_limits(camera_of(), 1280).narrowest_deg


@pytest.mark.parametrize("name", PROJECTIONS)
@pytest.mark.parametrize("half_deg", [70.0, 95.0, 120.0])
def test_views_of_every_projection_just_touch_the_edge_at_their_limit(
    name: str, half_deg: float
) -> None:
    """A hundredth of a degree is what points of the border may miss between them."""
    kind, theta_max = PROJECTIONS[name], np.radians(half_deg)
    viewport = Viewport((300, 100), max(kind.narrowest_deg, 100.0), name)
    for side_deg in (0, 35, 90, 200):
        side = np.radians(side_deg)
        outward = (float(np.cos(side)), float(np.sin(side)))
        limit = reach_of(outward, viewport, theta_max)
        if kind.cut:
            assert limit == theta_max
            continue
        turn = Rotation.from_rotvec(limit * np.array([-outward[1], outward[0], 0.0]))
        ray = turn.apply(viewport.border(200))
        off_axis = np.degrees(np.arctan2(np.hypot(ray[:, 0], ray[:, 1]), ray[:, 2])).max()
        assert off_axis == pytest.approx(half_deg, abs=0.02) or (limit == 0 and name == "strip")
