"""Attitudes between, before and after the times at which they were reported."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freelook.attitude import AttitudeBuffer
from freelook.clock import NS_PER_S
from freelook.rotations import angle_between_deg
from freelook.types import Attitude

MS = 1_000_000
# fifteen digits of a quaternion, once through acos or sqrt
ROUNDING_DEG = 1e-6


def turned(roll_deg: float, pitch_deg: float = 0.0, yaw_deg: float = 0.0) -> Rotation:
    return Rotation.from_euler("ZYX", [yaw_deg, pitch_deg, roll_deg], degrees=True)


def filled(*pairs: tuple[int, Rotation], **options: float) -> AttitudeBuffer:
    buffer = AttitudeBuffer(**options)
    for t_ms, rotation in pairs:
        buffer.push(Attitude(t_ms * MS, rotation))
    return buffer


def same(a: Rotation | None, b: Rotation) -> bool:
    return a is not None and angle_between_deg(a, b) < ROUNDING_DEG


def test_an_empty_buffer_knows_nothing() -> None:
    buffer = AttitudeBuffer()
    assert buffer.newest is None
    assert buffer.at(0) is None
    assert buffer.rate_at(0) is None


def test_a_reported_attitude_comes_back_as_it_is() -> None:
    buffer = filled((0, turned(1)), (10, turned(7, 3, 170)), (20, turned(9)))
    assert same(buffer.at(10 * MS), turned(7, 3, 170))
    newest = buffer.newest
    assert newest is not None
    assert newest.t_ns == 20 * MS


def test_between_two_attitudes_the_vehicle_turns_steadily() -> None:
    buffer = filled((0, turned(10)), (100, turned(50)))
    assert same(buffer.at(25 * MS), turned(20))
    assert buffer.rate_at(25 * MS) == pytest.approx([np.radians(400), 0, 0])


def test_the_short_way_is_taken_across_south_and_over_the_quaternion_s_sign() -> None:
    buffer = filled((0, turned(0, 0, 170)), (100, turned(0, 0, -170)))
    assert same(buffer.at(50 * MS), turned(0, 0, 180))
    quaternion = turned(20).as_quat()
    buffer = filled((0, turned(0)), (100, Rotation.from_quat(-quaternion)))
    assert same(buffer.at(50 * MS), turned(10))


def test_before_the_oldest_nothing_is_known() -> None:
    buffer = filled((100, turned(0)), (200, turned(10)))
    assert buffer.at(100 * MS - 1) is None
    assert buffer.rate_at(100 * MS - 1) is None
    assert buffer.at(100 * MS) is not None


def test_a_gap_is_not_bridged_but_its_ends_are_known() -> None:
    buffer = filled((0, turned(0)), (501, turned(10)), longest_gap_s=0.5)
    assert buffer.at(1) is None
    assert buffer.at(500 * MS) is None
    assert buffer.rate_at(0) is None
    assert same(buffer.at(0), turned(0))
    assert same(buffer.at(501 * MS), turned(10))
    exactly = filled((0, turned(0)), (500, turned(10)), longest_gap_s=0.5)
    assert same(exactly.at(250 * MS), turned(5))


def test_after_the_newest_the_last_rate_goes_on_for_a_while() -> None:
    buffer = filled((0, turned(0)), (100, turned(10)), extrapolate_s=0.1)
    assert same(buffer.at(200 * MS), turned(20))
    assert buffer.rate_at(200 * MS) == pytest.approx([np.radians(100), 0, 0])
    assert buffer.at(200 * MS + 1) is None
    assert buffer.rate_at(200 * MS + 1) is None


def test_without_a_rate_the_newest_is_held() -> None:
    for buffer in (filled((0, turned(3))), filled((-9000, turned(90)), (0, turned(3)))):
        assert same(buffer.at(100 * MS), turned(3))
        assert buffer.rate_at(100 * MS) is None
        assert buffer.at(101 * MS) is None


def test_late_repeated_and_broken_attitudes_are_ignored_and_counted() -> None:
    buffer = filled((0, turned(0)), (100, turned(10)), (50, turned(80)), (100, turned(80)))
    buffer.push(Attitude(150 * MS, Rotation.from_rotvec([np.nan, 0, 0])))
    assert buffer.counters.values == {"late": 1, "repeated": 1, "broken": 1}
    assert same(buffer.at(50 * MS), turned(5))


def test_after_clear_times_may_begin_anew() -> None:
    buffer = filled((1000, turned(0)))
    buffer.clear()
    assert buffer.at(1000 * MS) is None
    buffer.push(Attitude(0, turned(4)))
    assert same(buffer.at(0), turned(4))


def test_the_span_is_known_to_its_start_and_the_past_is_forgotten() -> None:
    buffer = AttitudeBuffer(span_s=1.0)
    for t_ms in range(0, 8_000, 4):
        buffer.push(Attitude(t_ms * MS, turned(t_ms / 1000)))
        if t_ms > 1000:
            assert same(buffer.at((t_ms - 1000) * MS), turned((t_ms - 1000) / 1000))
    assert buffer.at(3_000 * MS) is None


def test_a_buffer_may_keep_everything() -> None:
    buffer = AttitudeBuffer(span_s=math.inf)
    for t_s in range(1000):
        buffer.push(Attitude(t_s * NS_PER_S, turned(t_s % 90)))
    assert same(buffer.at(7 * NS_PER_S), turned(7))


@pytest.mark.parametrize("option", ["span_s", "longest_gap_s", "extrapolate_s"])
def test_impossible_settings_are_refused(option: str) -> None:
    with pytest.raises(ValueError, match=option):
        AttitudeBuffer(**{option: -1.0})


rotations = st.tuples(*[st.floats(-3, 3).map(lambda x: round(x, 6))] * 3).map(
    lambda v: Rotation.from_rotvec(v)
)


@settings(max_examples=60)
@given(
    steps=st.lists(st.integers(1, 400), min_size=2, max_size=12),
    turns=st.lists(rotations, min_size=12, max_size=12),
    place=st.floats(0, 1),
)
def test_at_follows_slerp_exactly_and_rate_at_is_its_rate(
    steps: list[int], turns: list[Rotation], place: float
) -> None:
    times = np.cumsum([0, *steps]) * MS
    buffer = AttitudeBuffer()
    for t_ns, turn in zip(times[:12].tolist(), turns, strict=False):
        buffer.push(Attitude(t_ns, turn))
    first, last = int(times[0]), int(times[min(len(steps), 11)])
    t_ns = first + int(place * (last - first - 1))
    after = int(np.searchsorted(times, t_ns, side="right"))
    start, end = int(times[after - 1]), int(times[after])
    a, b = turns[after - 1], turns[after]
    found, rate = buffer.at(t_ns), buffer.rate_at(t_ns)
    assert found is not None
    assert rate is not None
    whole = angle_between_deg(a, b)
    fraction = (t_ns - start) / (end - start)
    # of a turn by nearly 180 degrees both ways are short: then only the angle is compared
    assert angle_between_deg(a, found) == pytest.approx(fraction * whole, abs=1e-5)
    assert angle_between_deg(found, b) == pytest.approx((1 - fraction) * whole, abs=1e-5)
    if start < t_ns:
        turned_back = found * Rotation.from_rotvec(-rate * ((t_ns - start) / NS_PER_S))
        assert angle_between_deg(turned_back, a) < 1e-5
