"""The filter: steady at rest, on time in a turn."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.clock import NS_PER_S
from freelook.prediction.smoothing import SmoothingSettings, SpeedAdaptiveFilter
from freelook.rotations import angle_between_deg

HZ = 60.0


def yaw(angle_deg: float) -> Rotation:
    return Rotation.from_euler("z", angle_deg, degrees=True)


def lag_in_a_turn_s(speed_deg_s: float, seconds: float = 5.0) -> tuple[float, float]:
    """(measured, as the filter says) once it has settled."""
    smoother = SpeedAdaptiveFilter()
    for index in range(round(seconds * HZ)):
        t_s = index / HZ
        truth = yaw(speed_deg_s * t_s)
        smooth = smoother.push(truth, round(t_s * NS_PER_S), speed_deg_s)
    return angle_between_deg(smooth, truth) / speed_deg_s, smoother.lag_s


@pytest.mark.parametrize("speed_deg_s", [1.0, 3.0, 10.0])
def test_the_lag_is_what_the_filter_says(speed_deg_s: float) -> None:
    measured_s, said_s = lag_in_a_turn_s(speed_deg_s)
    assert measured_s == pytest.approx(said_s, rel=1e-3)  # times are whole nanoseconds


def test_the_faster_the_less_late() -> None:
    lags_s = [lag_in_a_turn_s(speed)[0] for speed in (1.0, 2.0, 5.0, 10.0, 20.0)]
    assert lags_s == sorted(lags_s, reverse=True)
    assert lags_s[0] < 0.12
    assert lags_s[-1] < 1e-6


def test_at_rest_most_of_the_noise_is_gone(rng: np.random.Generator) -> None:
    """A first-order low-pass at 1 Hz leaves sqrt(a / (2 - a)) = 0.23 of white noise at 60 Hz."""
    share = 1 - np.exp(-2 * np.pi * 1.0 / HZ)
    smoother = SpeedAdaptiveFilter()
    noise = rng.standard_normal(3000)
    out = [
        smoother.push(yaw(angle), round(index * NS_PER_S / HZ), 0.0).as_rotvec()[2]
        for index, angle in enumerate(noise)
    ]
    left = np.degrees(np.std(out[200:])) / np.std(noise)
    # 3000 samples of a process with a memory of 10: a spread of 4 %
    assert left == pytest.approx(np.sqrt(share / (2 - share)), rel=0.15)


def test_time_must_advance() -> None:
    smoother = SpeedAdaptiveFilter()
    smoother.push(yaw(0), 5, 0.0)
    with pytest.raises(ValueError, match="time must advance"):
        smoother.push(yaw(1), 5, 0.0)


def test_after_a_reset_the_first_pose_is_taken_as_it_is() -> None:
    smoother = SpeedAdaptiveFilter()
    smoother.push(yaw(0), 0, 0.0)
    smoother.reset()
    assert angle_between_deg(smoother.push(yaw(90), 1, 0.0), yaw(90)) < 1e-9
    assert smoother.lag_s == 0.0


def test_the_cutoff_doubles_at_the_knee() -> None:
    settings = SmoothingSettings(still_hz=2.0, knee_deg_s=3.0)
    assert settings.cutoff_hz(0.0) == 2.0
    assert settings.cutoff_hz(3.0) == 4.0
