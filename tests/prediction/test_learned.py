"""The learned predictor: what it sees, and how it behaves on heads of the simplest kinds."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.bench import predict
from freelook.clock import NS_PER_MS, NS_PER_S
from freelook.prediction import ConstantRate, HeadPredictor, Hold
from freelook.prediction.features import Features, features
from freelook.prediction.history import PoseHistory
from freelook.prediction.learned import course, fade
from freelook.prediction.network import silu, trained
from freelook.rotations import angle_between_deg, body_from_view
from freelook.types import Pose

AHEAD_NS = 50 * NS_PER_MS


def swing(t_s: float) -> Rotation:
    return body_from_view(40.0 * np.sin(2.0 * t_s), 15.0 * np.cos(3.0 * t_s), 5.0 * np.sin(t_s))


def mirrored(rotation: Rotation) -> Rotation:
    """As seen in a mirror that swaps left and right, in body and in view."""
    body, view = np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, 1.0, 1.0])
    return Rotation.from_matrix(body @ rotation.as_matrix() @ view)


def poses(seconds: float = 0.7, hz: float = 60.0) -> list[Pose]:
    times_ns = [round(k * NS_PER_S / hz) for k in range(round(seconds * hz))]
    return [Pose(swing(t_ns / NS_PER_S), t_ns) for t_ns in times_ns]


def seen(moves: list[Pose]) -> Features:
    history = PoseHistory()
    for pose in moves:
        history.push(pose)
    found = features(history)
    assert found is not None
    return found


def test_what_is_seen_is_the_same_in_every_direction_and_in_a_mirror() -> None:
    straight = seen(poses())
    about = body_from_view(110.0, 0.0) * body_from_view(0.0, 0.0).inv()
    turned = seen([Pose(about * pose.body_from_view, pose.t_ns) for pose in poses()])
    mirror = seen([Pose(mirrored(pose.body_from_view), pose.t_ns) for pose in poses()])
    for other in (turned, mirror):
        np.testing.assert_allclose(other.inputs, straight.inputs, atol=1e-6)
        assert other.speed_deg_s == pytest.approx(straight.speed_deg_s)


def test_the_first_axis_is_the_one_turned_about() -> None:
    moves = [Pose(body_from_view(80.0 * k / 60, 0.0), round(k * NS_PER_S / 60)) for k in range(40)]
    found = seen(moves)
    # a turn to the right is one about the view's down, which is y
    np.testing.assert_allclose(found.axes[0], [0.0, 1.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(found.rate_deg_s, [0.0, 80.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(found.axes @ found.axes.T, np.eye(3), atol=1e-9)


def test_a_head_that_rests_has_features_too() -> None:
    found = seen([Pose(body_from_view(0, 0), round(k * NS_PER_S / 60)) for k in range(40)])
    assert np.isfinite(found.inputs).all()
    np.testing.assert_allclose(found.axes @ found.axes.T, np.eye(3), atol=1e-9)


def test_one_pose_has_none() -> None:
    history = PoseHistory()
    history.push(poses()[0])
    assert features(history) is None


def test_the_past_is_that_of_the_poses() -> None:
    """Against slerp between the poses; a chord is as good as an arc for steps of a degree."""
    history = PoseHistory()
    for pose in poses():
        history.push(pose)
    newest = poses()[-1]
    ages_s = np.array([0.0, 0.01, 0.05, 0.123, 0.4])
    for age_s, past in zip(ages_s, history.past_deg(ages_s), strict=True):
        then = newest.body_from_view * Rotation.from_rotvec(np.radians(past))
        # 0.02: slerp cuts the corner of the swing itself, 200 deg/s^2 over 8 ms
        assert angle_between_deg(then, swing(newest.t_ns / NS_PER_S - age_s)) < 0.02


def test_a_fast_tracker_costs_no_more() -> None:
    """Two seconds at 2000 Hz: half a second is kept, at 2.5 ms, and the newest."""
    history = PoseHistory()
    for k in range(4000):
        pose = Pose(body_from_view(0.02 * k, 0.0), k * NS_PER_MS // 2)
        history.push(pose)
    assert len(history) == pytest.approx(200, abs=3)
    assert history.newest is pose
    past = history.past_deg(np.array([0.0, 0.1]))
    np.testing.assert_allclose(past, [[0.0, 0.0, 0.0], [0.0, -4.0, 0.0]], atol=1e-6)


def test_before_its_oldest_pose_a_head_turned_as_since() -> None:
    history = PoseHistory()
    for k in range(3):
        history.push(Pose(body_from_view(2.0 * k, 0.0), k * 20 * NS_PER_MS))
    np.testing.assert_allclose(history.past_deg(np.array([0.1]))[0], [0.0, -10.0, 0.0], atol=1e-9)


def test_the_weights_fit_what_is_seen() -> None:
    networks = trained()
    found = seen(poses())
    assert networks.mean.shape == networks.spread.shape == found.inputs.shape
    assert course(found).shape == (3, 3)
    assert silu(np.array([0.0]))[0] == 0.0
    assert silu(np.array([1.0]))[0] == pytest.approx(1 / (1 + np.exp(-1)))


@pytest.mark.parametrize("hz", [60.0, 120.0, 250.0])
@pytest.mark.parametrize("speed_deg_s", [30.0, 150.0])
def test_a_steady_turn_goes_on(hz: float, speed_deg_s: float) -> None:
    """Nearly: heads have taught it that turns end. Better than to hold by far."""
    predictor = HeadPredictor()
    for k in range(round(0.8 * hz)):
        t_ns = round(k * NS_PER_S / hz)
        predictor.push(Pose(body_from_view(speed_deg_s * t_ns / NS_PER_S, 0.0), t_ns))
    truth = body_from_view(speed_deg_s * (t_ns + AHEAD_NS) / NS_PER_S, 0.0)
    missed_deg = angle_between_deg(predictor.at(t_ns + AHEAD_NS), truth)
    assert missed_deg < 0.2 * speed_deg_s * AHEAD_NS / NS_PER_S


def test_looking_ahead_begins_at_the_present_without_a_step() -> None:
    predictor = HeadPredictor()
    for pose in poses():
        predictor.push(pose)
    said = [predictor.at(pose.t_ns + k * NS_PER_MS) for k in range(200)]
    steps = [angle_between_deg(a, b) for a, b in pairwise(said)]
    assert max(steps) < 0.2  # this head makes at most 100 deg/s


def test_no_jitter_on_a_still_head() -> None:
    assert max(predict.jitter_at_rest_deg("head").values()) < 0.02
    # and it is prediction that would have brought it
    assert min(predict.jitter_at_rest_deg("constant_rate").values()) > 0.06


def test_a_tracker_of_tenths_of_a_degree_does_not_shake_the_view(
    rng: np.random.Generator,
) -> None:
    """Angles rounded to 0.1 degrees, the head on the edge between two of them."""
    predictor = HeadPredictor()
    yaws = []
    for k in range(300):
        t_ns = round(k * NS_PER_S / 60)
        yaw_deg = np.round(0.05 + 0.02 * rng.standard_normal(), 1)
        predictor.push(Pose(body_from_view(yaw_deg, 0.0), t_ns))
        if k >= 60:
            ahead = predictor.at(t_ns + AHEAD_NS)
            yaws.append(np.degrees((body_from_view(0, 0).inv() * ahead).as_rotvec()[1]))
    assert np.std(yaws) < 0.02  # the rounded angles themselves: 0.05


def test_it_fades_in() -> None:
    assert fade(0.0) == 0.0
    assert fade(4.0) == 0.5
    assert fade(20.0) > 0.99


def test_its_lag_is_said(rng: np.random.Generator) -> None:
    predictor = HeadPredictor()
    for k in range(60):
        predictor.push(Pose(body_from_view(0.01 * rng.standard_normal(), 0.0), k * 16 * NS_PER_MS))
    assert predictor.lag_s > 0.05
    predictor.reset()
    assert predictor.lag_s == 0.0


@pytest.mark.data
@pytest.mark.parametrize("user", [1, 2])
def test_real_heads(shared_data: Path, user: int) -> None:
    """Quarter of a minute: the constant rate is beaten at 50 and 100 ms, and holding by far."""
    whole = predict.read_recording(shared_data / "head_motion" / f"user{user}_quaternion.txt")
    part = predict.Recording(whole.name, whole.t_ns[:900], whole.body_from_view[:900])
    ours, rate, hold = (
        [np.percentile(error, 95) for error in predict.errors_deg(part, predictor, (50.0, 100.0))]
        for predictor in (HeadPredictor(), ConstantRate(), Hold())
    )
    for k in (0, 1):
        assert ours[k] < 0.95 * rate[k]
        assert ours[k] < 0.5 * hold[k]
