from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.clock import NS_PER_MS, NS_PER_S
from freelook.errors import TrackerError
from freelook.gimbal import CENTRE, Aim, Gimbal, GimbalSettings
from freelook.pose_script import parse_script
from freelook.rotations import angle_between_deg, body_from_view, head_angles_deg
from freelook.types import Pose

# a rate that never matters: then the times alone say how long things take
SETTINGS = GimbalSettings(
    lost_after_s=0.3, hold_s=1.0, ease_s=1.5, blend_s=0.3, rate_deg_s=2000, jump_deg_s=10_000
)
PEAK = 15 / 8  # of an ease, over its mean speed


def at(t_s: float) -> int:
    return round(t_s * NS_PER_S)


def pose(t_s: float, yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0) -> Pose:
    return Pose(body_from_view(yaw, pitch, roll), at(t_s))


def angles(gimbal: Gimbal, t_s: float) -> tuple[float, float, float]:
    return head_angles_deg(gimbal.aim(at(t_s)).body_from_view)


def yaw(gimbal: Gimbal, t_s: float) -> float:
    return angles(gimbal, t_s)[0]


def tracking(yaw_deg: float = 60.0, until_s: float = 1.0) -> Gimbal:
    """A gimbal whose tracker has been steadily at one angle, at 100 Hz."""
    gimbal = Gimbal(SETTINGS)
    for i in range(round(until_s * 100) + 1):
        gimbal.push(pose(i / 100, yaw_deg))
    return gimbal


def test_before_the_first_pose_it_looks_forward_and_waits() -> None:
    aim = Gimbal().aim(at(5))
    assert aim == Aim(aim.body_from_view, "waiting", None, stabilised=True)
    assert angle_between_deg(aim.body_from_view, CENTRE) == 0


def test_the_first_pose_is_approached_within_the_blend_time() -> None:
    gimbal = Gimbal(SETTINGS)
    gimbal.push(pose(1.0, 60))
    assert gimbal.aim(at(1.0)).state == "tracking"
    assert yaw(gimbal, 1.0) == pytest.approx(0)
    assert yaw(gimbal, 1.15) == pytest.approx(30)
    assert yaw(gimbal, 1.3) == pytest.approx(60)


def test_while_tracking_a_new_pose_counts_at_once() -> None:
    gimbal = tracking(60)
    gimbal.push(pose(1.01, -20, 10, 5))
    aim = gimbal.aim(at(1.01))
    assert head_angles_deg(aim.body_from_view) == pytest.approx((-20, 10, 5))
    assert (aim.state, aim.pose_ns, aim.moving) == ("tracking", at(1.01), False)


def test_a_silent_tracker_is_held_then_eased_to_the_centre() -> None:
    gimbal = tracking(60, until_s=1.0)
    expected = [
        (1.3, "tracking", 60.0),
        (1.301, "holding", 60.0),
        (2.3, "holding", 60.0),
        (2.301, "easing", 60.0),
        (3.05, "easing", 30.0),
        (3.8, "centred", 0.0),
        (1e6, "centred", 0.0),
    ]
    for t_s, state, angle in expected:
        aim = gimbal.aim(at(t_s))
        assert aim.state == state, t_s
        assert head_angles_deg(aim.body_from_view)[0] == pytest.approx(angle, abs=0.01), t_s
        assert aim.moving == (state == "easing")
        assert aim.pose_ns == at(1.0)


def test_asking_changes_nothing() -> None:
    gimbal = tracking(60)
    first = [yaw(gimbal, t) for t in (1.0, 1.5, 3.0, 9.0)]
    assert [yaw(gimbal, t) for t in (9.0, 3.0, 1.5, 1.0)] == first[::-1]


@pytest.mark.parametrize("back_s", [1.31, 2.0, 2.5, 3.05, 3.7, 4.0, 100.0])
def test_a_returning_tracker_is_approached_from_where_the_view_is(back_s: float) -> None:
    gimbal = tracking(60)
    before = yaw(gimbal, back_s)
    gimbal.push(pose(back_s, -40))
    assert yaw(gimbal, back_s) == pytest.approx(before, abs=1e-6)
    assert gimbal.aim(at(back_s)).moving
    assert yaw(gimbal, back_s + 0.15) == pytest.approx((before - 40) / 2, abs=0.01)
    gimbal.push(pose(back_s + 0.3, -40))
    assert yaw(gimbal, back_s + 0.3) == pytest.approx(-40)
    assert not gimbal.aim(at(back_s + 0.3)).moving


def test_while_approaching_new_poses_still_turn_the_view_at_once() -> None:
    gimbal = tracking(60)
    gimbal.push(pose(10.0, 20))
    gimbal.push(pose(10.1, 20))
    before = yaw(gimbal, 10.1)
    gimbal.push(pose(10.1 + 1e-9, 25))
    assert yaw(gimbal, 10.1) == pytest.approx(before + 5)


def test_an_older_pose_is_ignored() -> None:
    gimbal = tracking(60)
    gimbal.push(pose(0.5, -90))
    assert yaw(gimbal, 1.0) == pytest.approx(60)
    assert gimbal.aim(at(0.9)).state == "tracking", "asked for a time before the newest pose"


def test_disable_goes_to_the_centre_and_stays() -> None:
    gimbal = tracking(60)
    gimbal.disable(at(1.0))
    assert yaw(gimbal, 1.0) == pytest.approx(60)
    assert 0 < yaw(gimbal, 1.2) < 60
    for t_s in (1.3, 1.5, 9.0):
        gimbal.push(pose(t_s, 70))
        assert yaw(gimbal, t_s) == pytest.approx(0)
        assert gimbal.aim(at(t_s)).state == "disabled"
    gimbal.disable(at(9.0))
    assert yaw(gimbal, 9.0) == pytest.approx(0)


def test_enable_comes_back_without_a_jump() -> None:
    gimbal = tracking(60)
    gimbal.disable(at(1.0))
    gimbal.push(pose(5.0, 50))
    gimbal.enable(at(5.0))
    assert gimbal.aim(at(5.0)).state == "tracking"
    assert yaw(gimbal, 5.0) == pytest.approx(0)
    assert yaw(gimbal, 5.3) == pytest.approx(50)


def test_enable_long_after_the_last_pose_is_centred() -> None:
    gimbal = tracking(60)
    gimbal.disable(at(1.0))
    gimbal.enable(at(60.0))
    assert gimbal.aim(at(60.0)).state == "centred"
    assert yaw(gimbal, 60.0) == pytest.approx(0)


def test_disabled_before_the_first_pose() -> None:
    gimbal = Gimbal(SETTINGS)
    gimbal.disable(0)
    assert gimbal.aim(0).state == "disabled"
    gimbal.enable(0)
    assert gimbal.aim(0).state == "waiting"


def test_recentre_makes_the_present_direction_forward_at_once() -> None:
    gimbal = Gimbal(SETTINGS)
    gimbal.push(pose(1.0, 50, 20, 10))
    gimbal.recentre(at(1.1))
    assert angles(gimbal, 1.1) == pytest.approx((0, 0, 0), abs=1e-9)
    assert not gimbal.aim(at(1.1)).moving


def test_recentre_before_the_first_pose_does_nothing() -> None:
    gimbal = Gimbal(SETTINGS)
    gimbal.recentre(at(1))
    gimbal.push(pose(2.0, 50))
    assert yaw(gimbal, 2.3) == pytest.approx(50)


def test_recentre_while_held_or_centred_counts_for_the_returning_tracker() -> None:
    gimbal = tracking(50)
    gimbal.recentre(at(1.5))
    assert gimbal.aim(at(1.5)).state == "holding"
    assert yaw(gimbal, 1.5) == pytest.approx(0)
    gimbal.push(pose(9.0, 60))
    gimbal.push(pose(9.3, 60))
    assert yaw(gimbal, 9.3) == pytest.approx(10)


def test_recentre_on_the_way_forward_leaves_the_way_as_it_is() -> None:
    """Also when nobody looked since the way began."""
    looked, unlooked = tracking(50), tracking(50)
    assert yaw(looked, 2.9) == pytest.approx(yaw(looked, 2.9))
    for gimbal in (looked, unlooked):
        gimbal.recentre(at(3.0))
    assert yaw(unlooked, 3.0) == pytest.approx(yaw(looked, 3.0))
    assert 0 < yaw(unlooked, 3.0) < 50


def test_recentre_while_disabled_leaves_the_view_where_it_is() -> None:
    gimbal = tracking(50)
    gimbal.disable(at(1.0))
    before = yaw(gimbal, 1.1)
    gimbal.recentre(at(1.1))
    assert yaw(gimbal, 1.1) == pytest.approx(before)


@given(st.floats(-170, 170), st.floats(-60, 60), st.floats(-40, 40), st.floats(-90, 90))
def test_after_recentre_turning_the_head_is_a_pure_yaw(
    drift: float, pitch: float, roll: float, turn: float
) -> None:
    """A tracker with a turned reference, worn askew: the horizon stays level all the same."""
    gimbal = Gimbal(SETTINGS)
    gimbal.push(pose(0.0, round(drift, 3), round(pitch, 3), round(roll, 3)))
    gimbal.recentre(0)
    gimbal.push(pose(0.4, round(drift + turn, 3), round(pitch, 3), round(roll, 3)))
    gimbal.push(pose(0.7, round(drift + turn, 3), round(pitch, 3), round(roll, 3)))
    assert angles(gimbal, 0.7) == pytest.approx((turn, 0, 0), abs=0.01)


@pytest.mark.parametrize("field", ["lost_after_s", "hold_s", "ease_s", "blend_s"])
@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf"), 4000])
def test_impossible_times_are_refused(field: str, value: float) -> None:
    with pytest.raises(TrackerError, match=f"{field} must be 0 to 3600 seconds"):
        GimbalSettings(**{field: value})  # type: ignore[arg-type]


def test_with_times_of_zero_only_the_rate_is_left() -> None:
    gimbal = Gimbal(GimbalSettings(0, 0, 0, 0, rate_deg_s=1000))
    gimbal.push(pose(1.0, 60))
    assert gimbal.aim(at(1.0)).state == "tracking"
    assert gimbal.aim(at(1.001)).state == "centred", "it never left the centre"
    gimbal = Gimbal(GimbalSettings(10, 0, 0, 0, rate_deg_s=1000))
    gimbal.push(pose(1.0, 60))
    assert yaw(gimbal, 1.0 + 60 * PEAK / 1000) == pytest.approx(60)
    assert gimbal.aim(at(11.001)).state == "easing"
    assert yaw(gimbal, 11.0 + 60 * PEAK / 1000) == pytest.approx(0)


@given(st.floats(0, 8), st.floats(-180, 180), st.floats(-80, 80))
def test_the_aim_of_a_silent_tracker_is_smooth_everywhere(
    t_s: float, yaw_deg: float, pitch_deg: float
) -> None:
    gimbal = Gimbal(SETTINGS)
    gimbal.push(pose(0, round(yaw_deg, 3), round(pitch_deg, 3)))
    before, now, after = (gimbal.aim(at(t_s) + k * NS_PER_MS).body_from_view for k in (-1, 0, 1))
    slope = 180 * PEAK / SETTINGS.blend_s / 1000
    curvature = 180 * 5.8 / SETTINGS.blend_s**2 / 1e6  # the largest of |s''| is 10 / sqrt(3)
    assert angle_between_deg(before, now) <= slope + 1e-6
    change = (before.inv() * now).as_rotvec(degrees=True) - (now.inv() * after).as_rotvec(
        degrees=True
    )
    assert abs(change).max() <= 2 * curvature + 1e-6, "the speed does not jump either"


@pytest.mark.data
def test_real_head_motion_is_followed_exactly(shared_data: Path) -> None:
    """Gaps to 270 ms and repeated samples included; only the first approach takes its time."""
    lines = (shared_data / "head_motion/user1_quaternion.txt").read_text().splitlines()[1:2001]
    rows = [line.split() for line in lines]
    rows = [b for a, b in pairwise([["-1"], *rows]) if float(b[0]) > float(a[0])]
    table = "\n".join(",".join([t, *wxyz]) for t, _, *wxyz in rows)
    script = parse_script("t_s,qw,qx,qy,qz\n" + table)
    gimbal = Gimbal(SETTINGS)
    for t_ns in map(int, script.times_ns):
        head = script.pose_at(t_ns)
        gimbal.push(Pose(head, t_ns))
        aim = gimbal.aim(t_ns)
        assert aim.state == "tracking"
        if t_ns > at(SETTINGS.blend_s):
            assert angle_between_deg(aim.body_from_view, head) < 1e-4
    assert len(rows) > 1500
