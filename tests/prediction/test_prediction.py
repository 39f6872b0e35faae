"""All predictors on movements whose answer is known, and on poses that make no sense."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freelook.clock import NS_PER_MS, NS_PER_S
from freelook.errors import TrackerError
from freelook.prediction import DEFAULT, PREDICTORS, Predictor, make_predictor
from freelook.rotations import FRD_FROM_RDF, angle_between_deg, body_from_view
from freelook.types import Pose

NAMES = sorted(PREDICTORS)
MOVING = [name for name in NAMES if name != "hold"]


def turned(yaw_deg: float, t_ns: int) -> Pose:
    return Pose(body_from_view(yaw_deg, 0.0), t_ns)


def feed(
    predictor: Predictor, yaw_deg: Callable[[float], float], seconds: float, hz: float = 60.0
) -> int:
    """Push a yaw over time; the time of the last pose."""
    t_ns = 0
    for index in range(round(seconds * hz)):
        t_ns = round(index * NS_PER_S / hz)
        predictor.push(turned(yaw_deg(t_ns / NS_PER_S), t_ns))
    return t_ns


@pytest.fixture(params=NAMES)
def predictor(request: pytest.FixtureRequest) -> Predictor:
    return make_predictor(request.param)


def test_unknown_names_are_told_the_known_ones() -> None:
    with pytest.raises(TrackerError, match=r"'kalman'; known: .*hold, constant_rate"):
        make_predictor("kalman")
    assert DEFAULT in PREDICTORS


def test_before_the_first_pose_straight_ahead(predictor: Predictor) -> None:
    assert angle_between_deg(predictor.at(123), FRD_FROM_RDF) == 0.0


def test_the_newest_pose_for_its_own_time_and_before(predictor: Predictor) -> None:
    t_ns = feed(predictor, lambda t: 100.0 * t, 1.0)
    for asked_ns in (t_ns, t_ns - NS_PER_S, 0):
        # half a degree: what smoothing may leave over
        error = angle_between_deg(
            predictor.at(asked_ns), turned(100.0 * t_ns / NS_PER_S, 0).body_from_view
        )
        assert error < 0.05


def test_hold_holds_and_constant_rate_turns_on() -> None:
    hold, rate = make_predictor("hold"), make_predictor("constant_rate")
    for each in (hold, rate):
        t_ns = feed(each, lambda t: 80.0 * t, 0.5)
    ahead_ns = t_ns + 100 * NS_PER_MS
    newest_deg = 80.0 * t_ns / NS_PER_S
    assert angle_between_deg(hold.at(ahead_ns), body_from_view(newest_deg, 0)) < 1e-9
    assert angle_between_deg(rate.at(ahead_ns), body_from_view(newest_deg + 8.0, 0)) < 1e-6


def test_never_further_ahead_than_a_fifth_of_a_second(predictor: Predictor) -> None:
    t_ns = feed(predictor, lambda t: 80.0 * t, 1.0)
    late = predictor.at(t_ns + 200 * NS_PER_MS)
    assert angle_between_deg(predictor.at(t_ns + 3600 * NS_PER_S), late) < 1e-9


@pytest.mark.parametrize("jump_deg", [8.0, 30.0, 179.0])
def test_a_jump_is_not_extrapolated(predictor: Predictor, jump_deg: float) -> None:
    """Recentring in mid-turn: the new pose, and nothing that a jump's rate would make of it."""
    t_ns = feed(predictor, lambda t: 30.0 * np.sin(t), 1.0)
    jumped = turned(30.0 * np.sin(1.0) + jump_deg, t_ns + 16 * NS_PER_MS)
    predictor.push(jumped)
    for ahead_ms in (0, 20, 50, 100):
        said = predictor.at(jumped.t_ns + ahead_ms * NS_PER_MS)
        assert angle_between_deg(said, jumped.body_from_view) < 1e-9
    assert predictor.counters["jumps"] == 1


def test_a_fast_head_is_no_jump(predictor: Predictor) -> None:
    """700 degrees a second at the most, reached within a tenth of a second."""
    feed(predictor, lambda t: 70.0 * np.sin(10.0 * t), 1.0)
    assert predictor.counters["jumps"] == 0


def test_after_a_gap_only_the_new_pose_counts(predictor: Predictor) -> None:
    t_ns = feed(predictor, lambda t: 100.0 * t, 0.5)
    back = turned(52.0, t_ns + 300 * NS_PER_MS)
    predictor.push(back)
    said = predictor.at(back.t_ns + 100 * NS_PER_MS)
    assert angle_between_deg(said, back.body_from_view) < 1e-9
    assert predictor.counters["gaps"] == 1


def test_times_that_do_not_advance_and_nan_change_nothing(predictor: Predictor) -> None:
    t_ns = feed(predictor, lambda t: 60.0 * t, 0.5)
    before = predictor.at(t_ns + 50 * NS_PER_MS)
    predictor.push(turned(-40.0, t_ns))
    predictor.push(turned(-40.0, t_ns - NS_PER_S))
    with np.errstate(invalid="ignore"):
        nowhere = Rotation.from_rotvec([np.nan, 0.0, 0.0])
    predictor.push(Pose(nowhere, t_ns + NS_PER_MS))
    after = predictor.at(t_ns + 50 * NS_PER_MS)
    assert np.array_equal(before.as_quat(), after.as_quat())
    assert predictor.counters["not newer"] == 2
    assert predictor.counters["not finite"] == 1


def test_reset_forgets(predictor: Predictor) -> None:
    feed(predictor, lambda t: 60.0 * t, 0.5)
    predictor.reset()
    assert angle_between_deg(predictor.at(NS_PER_S), FRD_FROM_RDF) == 0.0
    predictor.push(turned(10.0, 5))  # an earlier time than before: all is forgotten
    assert angle_between_deg(predictor.at(NS_PER_S), turned(10.0, 5).body_from_view) < 1e-9


steps = st.tuples(
    st.sampled_from([-(10**9), 0, 1, 1000, 10**6, 16 * 10**6, 17 * 10**6, 10**9, 10**15]),
    st.integers(-400, 400),
    st.integers(-90, 90),
)


@given(st.sampled_from(NAMES), st.lists(steps, max_size=30))
def test_whatever_comes_the_answer_is_a_rotation(
    name: str, moves: list[tuple[int, int, int]]
) -> None:
    predictor = make_predictor(name)
    t_ns = 0
    for step_ns, yaw_deg, pitch_deg in moves:
        t_ns += step_ns
        predictor.push(Pose(body_from_view(yaw_deg, pitch_deg), t_ns))
        for ahead_ms in (-10, 0, 20, 100, 1000):
            quaternion = predictor.at(t_ns + ahead_ms * NS_PER_MS).as_quat()
            assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-9)
