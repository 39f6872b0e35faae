"""The stabiliser's modes: what each takes out, and what happens when the attitude is not known."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freelook.attitude import AttitudeBuffer
from freelook.clock import NS_PER_MS, NS_PER_S
from freelook.errors import TrackerError
from freelook.gimbal import (
    CENTRE,
    MODES,
    Base,
    Direction,
    Gimbal,
    Location,
    Stabiliser,
    StabiliserSettings,
    parse_target,
)
from freelook.gimbal.base import level
from freelook.gimbal.headings import Heading, nose
from freelook.gimbal.targets import direction_to
from freelook.rotations import angle_between_deg, body_from_view, head_angles_deg
from freelook.types import Attitude, Pose

PERIOD_NS = 10 * NS_PER_MS


def flown(roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> Rotation:
    """`world_from_body` of a vehicle: roll right wing down, pitch nose up, yaw clockwise from
    north, in the usual order."""
    return Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True)


def steady(
    mode: str, attitude: Rotation, target: str | None = None, until_ms: int = 1000
) -> Stabiliser:
    """A stabiliser whose vehicle has kept one attitude, asked once."""
    stabiliser = Stabiliser(buffer=AttitudeBuffer(span_s=100))
    stabiliser.set_mode(mode, parse_target(target) if target else None)
    for t_ns in range(0, until_ms * NS_PER_MS + 1, PERIOD_NS):
        stabiliser.push(Attitude(t_ns, attitude))
    stabiliser.at(until_ms * NS_PER_MS, until_ms * NS_PER_MS)
    return stabiliser


def turn(stabiliser: Stabiliser, attitude: Rotation, from_ms: int = 1000) -> Base:
    """The vehicle turned to another attitude, slowly enough for no jump, within a second."""
    last = stabiliser._buffer.newest
    assert last is not None
    way = (last.world_from_body.inv() * attitude).as_rotvec()
    base = stabiliser.newest
    for step in range(1, 101):
        t_ns = from_ms * NS_PER_MS + step * PERIOD_NS
        at = last.world_from_body * Rotation.from_rotvec(way * step / 100)
        stabiliser.push(Attitude(t_ns, at))
        base = stabiliser.at(t_ns, t_ns)
    return base


def view(base: Base, yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0) -> Rotation:
    return base.body_from_base * body_from_view(yaw, pitch, roll)


def right_of_view(world_from_view: Rotation) -> np.ndarray:
    right: np.ndarray = world_from_view.apply([1.0, 0.0, 0.0])
    return right


# --- in words -----------------------------------------------------------------------------------


def test_convention_vehicle_rolls_right_and_horizon_mode_keeps_the_horizon_level() -> None:
    base = turn(steady("horizon", flown()), flown(roll=35))
    aim = view(base)
    assert right_of_view(flown(roll=35) * aim)[2] == pytest.approx(0, abs=1e-12)
    yaw, pitch, roll = head_angles_deg(aim)
    assert (yaw, pitch, roll) == pytest.approx((0, 0, -35)), "the view rolls left in the body"


def test_convention_vehicle_yaws_left_in_world_mode_and_the_view_turns_right_in_the_body() -> None:
    base = turn(steady("world", flown(yaw=100)), flown(yaw=70))
    assert head_angles_deg(view(base)) == pytest.approx((30, 0, 0))


def test_convention_vehicle_pitches_up_and_horizon_mode_looks_down_in_the_body() -> None:
    base = turn(steady("horizon", flown()), flown(pitch=20))
    assert head_angles_deg(view(base)) == pytest.approx((0, -20, 0))


def test_convention_body_mode_knows_nothing_of_the_vehicle() -> None:
    base = turn(steady("body", flown()), flown(40, 30, 20))
    assert base == Base(base.body_from_base)
    assert head_angles_deg(view(base, 10, 5)) == pytest.approx((10, 5, 0))


@given(st.floats(-180, 180), st.floats(-65, 65), st.floats(-180, 180), st.floats(-80, 80))
def test_in_horizon_mode_the_view_is_as_the_head_is_over_level_ground(
    roll: float, pitch: float, yaw: float, look: float
) -> None:
    """Whatever the vehicle does: the head's angles are those over the ground from its heading."""
    attitude = flown(round(roll, 3), round(pitch, 3), round(yaw, 3))
    base = steady("horizon", attitude, until_ms=0).newest
    seen = level(-nose(attitude)[0]) * attitude * view(base, round(look, 3), 10)
    assert head_angles_deg(seen) == pytest.approx((round(look, 3), 10, 0), abs=1e-6)


def test_horizon_mode_follows_the_heading_at_once() -> None:
    base = turn(steady("horizon", flown()), flown(yaw=80, roll=20))
    assert nose(flown(yaw=80, roll=20) * base.body_from_base) == pytest.approx((80, 0), abs=1e-9)


def test_world_mode_looks_at_one_direction_until_chosen_again() -> None:
    stabiliser = steady("world", flown(yaw=30))
    base = turn(stabiliser, flown(20, 10, 150))
    assert nose(flown(20, 10, 150) * base.body_from_base) == pytest.approx((30, 0), abs=1e-9)
    stabiliser.set_mode("world")
    assert turn(stabiliser, flown(20, 10, 150), 2000).moving is False
    assert nose(flown(20, 10, 150) * stabiliser.newest.body_from_base)[0] == pytest.approx(150)


def test_follow_mode_closes_all_but_1_over_e_in_its_time_constant() -> None:
    stabiliser = steady("follow", flown())
    turned = Attitude(1001 * NS_PER_MS, flown(yaw=2))  # at once, and too little for a jump
    stabiliser.push(turned)
    stabiliser.at(turned.t_ns, turned.t_ns)
    base = turn(stabiliser, flown(yaw=2), 1001)
    followed = nose(flown(yaw=2) * base.body_from_base)[0]
    assert followed == pytest.approx(2 * (1 - np.exp(-1)), abs=0.01)


def test_follow_mode_lags_a_steady_turn_by_its_time_constant() -> None:
    stabiliser = steady("follow", flown())
    for second in range(8):
        base = turn(stabiliser, flown(yaw=30 * (second + 1)), 1000 * (second + 1))
    assert nose(flown(yaw=240) * base.body_from_base)[0] % 360 == pytest.approx(210, abs=0.3)


@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 0), (-90, -30), (170, 60)])
def test_point_mode_looks_at_a_direction(azimuth: float, elevation: float) -> None:
    stabiliser = steady("point", flown(yaw=20), f"{azimuth},{elevation}")
    base = turn(stabiliser, flown(30, -20, 80))
    seen = nose(flown(30, -20, 80) * base.body_from_base)
    assert seen == pytest.approx((azimuth, elevation), abs=1e-9)


def test_point_mode_looks_at_a_location_as_the_vehicle_moves_past_it() -> None:
    """A minute of latitude is a nautical mile: 1852 m, to 0.5 percent."""
    stabiliser = steady("point", flown(), "0.016667,0,0")
    assert "no position" in stabiliser.newest.notice
    stabiliser.push_position(Location(0, 0, 1852), 1000 * NS_PER_MS)
    base = turn(stabiliser, flown())
    assert nose(base.body_from_base) == pytest.approx((0, -45), abs=0.3)
    assert base.state == "easing" or base.effective == "point"
    stabiliser.push_position(Location(0.016667, 0.016667, 0), 2000 * NS_PER_MS)
    turn(stabiliser, flown(), 2000)
    stabiliser.push_position(Location(0.016667, 0.016667, 0), 3000 * NS_PER_MS)
    azimuth = nose(turn(stabiliser, flown(), 3000).body_from_base)[0]
    assert azimuth == pytest.approx(-90, abs=0.1), "due west"


def test_an_old_position_is_no_position() -> None:
    stabiliser = steady("point", flown(), "1,1,0", until_ms=1)
    stabiliser.push_position(Location(0, 0, 0), 1000 * NS_PER_MS)
    assert not turn(stabiliser, flown()).notice
    turn(stabiliser, flown(), 2000)
    assert "no direction" in turn(stabiliser, flown(), 3000).notice


@pytest.mark.parametrize(
    ("there", "azimuth", "elevation"),
    [
        (Location(47.0, 8.001, 500), 90, 0),
        (Location(46.999, 8.0, 500), 180, 0),
        (Location(47.0, 8.0, 900), 0, 90),
        (Location(47.0, 8.0, 100), 0, -90),
    ],
)
def test_directions_between_places(there: Location, azimuth: float, elevation: float) -> None:
    """East, south, above and below; 76 m and 111 m away the earth's curvature is 4e-4 degrees."""
    direction = direction_to(there, Location(47.0, 8.0, 500))
    assert direction is not None
    assert direction.elevation_deg == pytest.approx(elevation, abs=1e-3)
    if not elevation:
        assert direction.azimuth_deg % 360 == pytest.approx(azimuth, abs=1e-3)


def test_there_is_no_direction_to_where_one_is() -> None:
    assert direction_to(Location(1, 2, 3), Location(1, 2, 3.5)) is None


def test_targets_are_read_and_nonsense_is_refused() -> None:
    assert parse_target("10,-5") == Direction(10, -5)
    assert parse_target("47.1,8.2,430") == Location(47.1, 8.2, 430)
    for text in ("", "1", "a,b", "1,2,3,4"):
        with pytest.raises(TrackerError, match="is no target; write AZIMUTH,ELEVATION"):
            parse_target(text)
    for text in ("400,0", "0,91", "91,0,0", "0,361,0", "0,0,1e9", "nan,0"):
        with pytest.raises(TrackerError, match="must be"):
            parse_target(text)


def test_unknown_modes_and_no_target_are_refused() -> None:
    with pytest.raises(TrackerError, match="unknown mode 'up'; known: body, horizon, world"):
        Stabiliser().set_mode("up")
    with pytest.raises(TrackerError, match="needs something to point at"):
        Stabiliser().set_mode("point")
    with pytest.raises(TrackerError, match="follow_s must be above 0"):
        StabiliserSettings(follow_s=0)
    with pytest.raises(TrackerError, match="rate_deg_s must be 1 to 36000"):
        StabiliserSettings(rate_deg_s=0.5)


# --- the vertical -------------------------------------------------------------------------------


def test_a_loop_turns_the_view_no_faster_than_stated() -> None:
    """Through straight up, where the nose's heading turns half around in no time."""
    heading = Heading(follow_s=1.0)
    last, most = 0.0, 0.0
    for step in range(1, 5001):
        pitch = min(360, 360 * step / 4000)  # a loop in four seconds
        now = heading.at(step * NS_PER_MS, Rotation.from_euler("Y", pitch, degrees=True))
        most = max(most, abs((now - last + 180) % 360 - 180))
        last = now
    assert most <= 0.180 + 1e-6, "degrees in a millisecond"
    assert last == pytest.approx(0, abs=1e-6), "and it is made up for"


# --- at the frame's capture ---------------------------------------------------------------------


def test_the_attitude_is_the_one_at_capture_not_the_newest() -> None:
    stabiliser = steady("horizon", flown())
    turn(stabiliser, flown(roll=50))
    stabiliser = steady("horizon", flown())
    for step in range(101):
        t_ns = NS_PER_S + step * PERIOD_NS
        stabiliser.push(Attitude(t_ns, flown(roll=step * 0.5)))
    base = stabiliser.at(2 * NS_PER_S, 1_880 * NS_PER_MS)
    assert head_angles_deg(view(base))[2] == pytest.approx(-44)
    glance = stabiliser.at(2 * NS_PER_S, 1_500 * NS_PER_MS)
    assert head_angles_deg(view(glance))[2] == pytest.approx(-25)
    assert stabiliser.newest is base, "an older frame changes nothing"


def test_an_offset_says_when_a_frame_was_really_taken() -> None:
    stabiliser = steady("horizon", flown())
    for step in range(101):
        t_ns = NS_PER_S + step * PERIOD_NS
        stabiliser.push(Attitude(t_ns, flown(roll=step * 0.5)))
    stabiliser.set_offset(-200 * NS_PER_MS)
    eased = stabiliser.at(2 * NS_PER_S, 1_900 * NS_PER_MS)
    assert head_angles_deg(view(eased))[2] == pytest.approx(0)
    assert eased.moving
    there = stabiliser.at(3 * NS_PER_S, 1_900 * NS_PER_MS)
    assert head_angles_deg(view(there))[2] == pytest.approx(-35)


def test_without_a_capture_time_the_last_frame_counts() -> None:
    stabiliser = steady("horizon", flown(roll=10))
    before = stabiliser.newest
    stabiliser.push(Attitude(1100 * NS_PER_MS, flown(roll=11)))
    after = stabiliser.at(1100 * NS_PER_MS)
    assert angle_between_deg(after.body_from_base, before.body_from_base) == 0


def test_asked_twice_it_answers_the_same() -> None:
    stabiliser = steady("follow", flown(yaw=3))
    now = 1005 * NS_PER_MS
    assert stabiliser.at(now, now) is stabiliser.at(now, now)


# --- no attitude, late, back, jumping -------------------------------------------------------------


def test_without_attitude_it_is_body_mode_and_says_so() -> None:
    stabiliser = Stabiliser()
    stabiliser.set_mode("horizon")
    base = stabiliser.at(0, 0)
    assert (base.mode, base.effective, base.state) == ("horizon", "body", "degraded")
    assert base.notice == "no attitude of the vehicle yet: body mode instead of horizon"
    assert head_angles_deg(view(base, 20, 10)) == pytest.approx((20, 10, 0))


def test_a_lost_attitude_degrades_gently_and_visibly_and_comes_back() -> None:
    stabiliser = steady("horizon", flown(roll=40))
    seen = {}
    last = stabiliser.newest.body_from_base
    for t_ms in range(1001, 4000):
        t_ns = t_ms * NS_PER_MS
        if t_ms >= 2500 and t_ms % 10 == 0:
            stabiliser.push(Attitude(t_ns, flown(roll=40)))
        base = stabiliser.at(t_ns, t_ns)
        assert angle_between_deg(last, base.body_from_base) <= 0.240 + 1e-9
        last = base.body_from_base
        seen[t_ms] = base
    assert seen[1100].state == "steady", "for 0.1 s the last rate is taken to go on"
    assert (seen[1101].effective, seen[1101].state) == ("body", "degraded")
    assert seen[1200].notice == "no attitude for 0.2 s: body mode instead of horizon"
    assert angle_between_deg(seen[2499].body_from_base, Rotation.identity()) == pytest.approx(0)
    assert seen[2700].notice == "the attitude is back: body mode instead of horizon"
    assert (seen[3001].state, seen[3001].notice) == ("easing", "")
    assert seen[3900].state == "steady"
    assert head_angles_deg(view(seen[3900]))[2] == pytest.approx(-40)


def test_a_trickle_of_attitudes_never_settles() -> None:
    """Two a second: each is good for a tenth. The view stays in body mode instead of nodding."""
    stabiliser = steady("horizon", flown(roll=40))
    for t_ms in range(1001, 8000):
        t_ns = t_ms * NS_PER_MS
        if t_ms % 510 == 0:
            stabiliser.push(Attitude(t_ns, flown(roll=40)))
        base = stabiliser.at(t_ns, t_ns)
    assert base.effective == "body"
    assert not base.moving


def test_an_attitude_that_jumps_does_not_turn_the_view_at_once() -> None:
    """An estimator's reset of the heading by 50 degrees, in world mode."""
    stabiliser = steady("world", flown(yaw=10))
    before = stabiliser.newest.body_from_base
    seen = []
    last = before
    for t_ms in range(1001, 2500):
        t_ns = t_ms * NS_PER_MS
        if t_ms % 10 == 0:
            stabiliser.push(Attitude(t_ns, flown(yaw=60)))
        base = stabiliser.at(t_ns, t_ns - 20 * NS_PER_MS)
        assert angle_between_deg(last, base.body_from_base) <= 0.240 + 1e-9
        last = base.body_from_base
        seen.append(base)
    told = [base.notice == "the attitude jumped: easing to it" for base in seen]
    assert sum(told) > 100, "for as long as it is eased, in milliseconds"
    assert not told[-1]
    assert nose(flown(yaw=60) * last)[0] == pytest.approx(10)
    assert all(base.effective == "world" for base in seen)


def test_in_horizon_and_follow_mode_a_heading_reset_does_not_turn_the_view() -> None:
    for mode in ("horizon", "follow"):
        stabiliser = steady(mode, flown(yaw=10, roll=15))
        before = stabiliser.newest.body_from_base
        for step in range(1, 51):
            t_ns = NS_PER_S + step * PERIOD_NS
            stabiliser.push(Attitude(t_ns, flown(yaw=60, roll=15)))
            now = stabiliser.at(t_ns, t_ns).body_from_base
            assert angle_between_deg(before, now) < 1e-4, mode


def test_with_the_gimbal_the_head_turns_in_the_base() -> None:
    stabiliser = steady("world", flown(yaw=0))
    gimbal = Gimbal(stabiliser=stabiliser)
    for step in range(101):
        gimbal.push(Pose(body_from_view(25, 0), step * PERIOD_NS))
    turn(stabiliser, flown(yaw=-40))
    gimbal.push(Pose(body_from_view(25, 0), 2 * NS_PER_S - NS_PER_MS))
    aim = gimbal.aim(3 * NS_PER_S, 2 * NS_PER_S)
    assert aim.state == "holding"
    assert head_angles_deg(aim.body_from_view)[0] == pytest.approx(65)
    assert aim.base.effective == "world"
    whole = aim.leftover * aim.base.body_from_base * aim.head
    assert angle_between_deg(whole, aim.body_from_view) < 1e-9


def test_eyes_front_disable_and_a_dead_tracker_look_along_the_nose_in_every_mode() -> None:
    for mode in MODES:
        for latch in ("eyes_front", "disable", None):
            stabiliser = steady(mode, flown(yaw=50), "10,20")
            gimbal = Gimbal(stabiliser=stabiliser)
            gimbal.push(Pose(body_from_view(25, 10), NS_PER_S))
            gimbal.aim(NS_PER_S, NS_PER_S)
            if latch:
                getattr(gimbal, latch)(NS_PER_S)
            aim = gimbal.aim(9 * NS_PER_S, NS_PER_S)
            assert angle_between_deg(aim.body_from_view, CENTRE) == pytest.approx(0, abs=1e-9)
            assert (
                aim.state == {"eyes_front": "front", "disable": "disabled", None: "centred"}[latch]
            )


TIMES_MS = st.integers(-2000, 20_000)
HAPPENINGS = st.one_of(
    st.tuples(st.just("attitude"), TIMES_MS, st.integers(0, 2**32 - 1)),
    st.tuples(st.just("ask"), TIMES_MS, TIMES_MS),
    st.tuples(st.just("offset"), TIMES_MS, st.just(0)),
    st.tuples(st.just("position"), TIMES_MS, st.integers(-90, 90)),
    st.tuples(st.sampled_from(MODES), st.just(0), st.just(0)),
)


@given(st.lists(HAPPENINGS, max_size=25))
def test_whatever_it_is_told_and_asked_it_answers_with_a_rotation(
    happenings: list[tuple[str, int, int]],
) -> None:
    """Times forward and back, attitudes from nowhere, frames from before and to come."""
    stabiliser = Stabiliser()
    stabiliser.set_mode("point", Location(0.1, 0.1, 10))
    for what, first, second in happenings:
        t_ns = first * NS_PER_MS
        if what == "attitude":
            stabiliser.push(Attitude(t_ns, Rotation.random(rng=np.random.default_rng(second))))
        elif what == "ask":
            base = stabiliser.at(t_ns, second * NS_PER_MS)
            assert np.linalg.norm(base.body_from_base.as_quat()) == pytest.approx(1)
            assert base.effective in (base.mode, "body")
            assert bool(base.notice) >= (base.effective != base.mode), "never without a word"
        elif what == "offset":
            stabiliser.set_offset(t_ns)
        elif what == "position":
            stabiliser.push_position(Location(second, second, first), t_ns)
        else:
            stabiliser.set_mode(what)
