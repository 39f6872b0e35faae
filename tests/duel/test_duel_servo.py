"""The modelled motor against closed forms, and what it may never do."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.duel.servo import Motor, angle_at, drive
from freelook.duel.stages import later, newest, ticks

STEP_NS = 1_000_000
STILL = np.zeros(1, dtype=np.int64)


def step_response(motor: Motor, size_deg: float, end_ms: int) -> np.ndarray:
    """At rest at 0, told to be at `size_deg` from the first millisecond on."""
    times = np.array([0, STEP_NS], dtype=np.int64)
    return drive(motor, times, np.array([0.0, size_deg]), end_ms * STEP_NS)


def test_a_slew_limited_step_is_a_ramp() -> None:
    angles = step_response(Motor(slew_deg_s=600), 60.0, 200)
    since_s = np.maximum(np.arange(201) - 1, 0) / 1000
    assert angles == pytest.approx(np.minimum(600 * since_s, 60.0), abs=1e-9)


@pytest.mark.parametrize(("size_deg", "accel"), [(10.0, 1000.0), (-40.0, 4000.0), (1.0, 20000.0)])
def test_an_acceleration_limited_step_is_a_triangle_of_speed(size_deg: float, accel: float) -> None:
    """Half the way speeding up, half braking: 2 sqrt(D / a) in all, sqrt(a D) at the fastest."""
    angles = step_response(Motor(accel_deg_s2=accel), size_deg, 400) * np.sign(size_deg)
    size = abs(size_deg)
    there_ms = np.argmax(angles > size - 1e-6) - 1
    # whole steps of 1 ms: the last bit of the way takes up to three more
    assert there_ms == pytest.approx(2 * sqrt(size / accel) * 1000, abs=3)
    fastest = np.diff(angles).max() * 1000
    assert fastest == pytest.approx(sqrt(accel * size), abs=accel * 1e-3)
    assert angles.max() == pytest.approx(size, abs=1e-6)


def test_both_limits_make_a_trapezoid() -> None:
    """D / v + v / a."""
    angles = step_response(Motor(slew_deg_s=200, accel_deg_s2=2000), 60.0, 600)
    assert np.argmax(angles > 60 - 1e-6) - 1 == pytest.approx(400, abs=3)
    assert np.diff(angles).max() * 1000 == pytest.approx(200)
    ramp = np.diff(angles)[150:250]  # in the middle nothing but full speed
    assert ramp == pytest.approx(np.full(100, 0.2))


def test_a_motor_without_limits_is_where_it_is_told_one_step_later() -> None:
    angles = step_response(Motor(), 33.0, 5)
    assert angles.tolist() == pytest.approx([0, 0, 33, 33, 33, 33])


def test_the_dead_band_holds_until_a_command_is_beyond_it() -> None:
    motor = Motor(slew_deg_s=100, dead_band_deg=0.5)
    times = np.array([0, 10, 20, 300], dtype=np.int64) * STEP_NS
    angles = drive(motor, times, np.array([0.0, 0.5, 0.51, 0.9]), 400 * STEP_NS)
    assert (angles[:21] == 0).all()  # exactly the band is not beyond it
    assert angles[21] > 0
    # once it moves it goes the whole way; the next 0.39 degrees are within the band again
    assert angles[-1] == pytest.approx(0.51, abs=1e-9)


@given(
    targets=st.lists(st.floats(-120, 120), min_size=1, max_size=12),
    gaps=st.integers(1, 60),
    slew=st.floats(10, 2000),
    accel=st.floats(100, 50_000),
    dead_band=st.floats(0, 3),
)
def test_no_motor_exceeds_its_speed_or_its_acceleration(
    targets: list[float], gaps: int, slew: float, accel: float, dead_band: float
) -> None:
    times = np.arange(len(targets), dtype=np.int64) * gaps * STEP_NS
    end_ns = int(times[-1]) + 200 * STEP_NS
    angles = drive(Motor(slew, accel, dead_band), times, np.array(targets), end_ns)
    speed = np.diff(angles) * 1000
    rounding = 1e-8  # of differences of angles of up to 120 degrees, times 1000
    assert np.abs(speed).max() <= slew + rounding
    change = np.abs(np.diff(speed, prepend=0.0)) * 1000
    assert change.max() <= accel + 1e-2  # AT_REST_DEG_S in a step, and rounding a thousandfold
    assert len(angles) == end_ns // STEP_NS + 1


@given(
    size=st.floats(-170, 170), slew=st.floats(20, 2000), accel=st.floats(500, 1e5) | st.just(inf)
)
def test_a_command_that_stands_still_is_never_overshot(
    size: float, slew: float, accel: float
) -> None:
    angles = step_response(Motor(slew, accel), size, 500) * np.sign(size)
    assert angles.max() <= abs(size) + 1e-6
    assert (np.diff(angles) >= -1e-6).all()  # nor does it go back


def test_angles_between_the_milliseconds() -> None:
    angles = np.array([0.0, 1.0, 3.0])
    t_ns = np.array([0, 500_000, 1_250_000, 2_000_000, 9_000_000], dtype=np.int64)
    assert angle_at(angles, t_ns).tolist() == pytest.approx([0, 0.5, 1.5, 3, 3])


@pytest.mark.parametrize("period_ms", [20.0, 7.3])
def test_waiting_for_a_frame_takes_half_a_frame_on_average(period_ms: float) -> None:
    frames = ticks(10_000_000_000, period_ms)
    when = np.arange(100_000_000, 9_900_000_000, 77_777, dtype=np.int64)
    waits = (frames[newest(frames, when) + 1] - when) / 1e6
    assert waits.mean() == pytest.approx(period_ms / 2, rel=0.005)  # 126,000 evenly spread
    assert waits.min() > 0
    assert waits.max() <= period_ms + 1e-6


def test_a_clock_ticks_from_its_offset_to_the_end() -> None:
    assert ticks(50_000_000, 20).tolist() == [0, 20_000_000, 40_000_000]
    assert ticks(40_000_000, 20, 5).tolist() == [5_000_000, 25_000_000]
    assert later(ticks(20_000_000, 20), 1.5).tolist() == [1_500_000, 21_500_000]


def test_the_newest_is_there_from_its_very_time_on() -> None:
    there = np.array([10, 20, 30], dtype=np.int64)
    asked = np.array([0, 9, 10, 19, 20, 99], dtype=np.int64)
    assert newest(there, asked).tolist() == [0, 0, 0, 0, 1, 2]
    assert newest(STILL, asked).tolist() == [0] * 6
