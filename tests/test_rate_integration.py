"""Attitude from rates and accelerations, against motions known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.rate_integration import GRAVITY_M_S2, gyro_bias, integrated, levelled
from freelook.rotations import angle_between_deg

TIMES_S = np.arange(0, 60, 0.01)
UP = np.array([0.0, 0.0, -1.0])


def swaying() -> Rotation:
    """world_from_body of a vehicle that sways by 20 degrees about all axes, heading 0 at first."""
    phases = TIMES_S[:, None] * [0.8, 1.1, 1.7]
    angles = np.radians(20) * np.sin(phases)
    return Rotation.from_euler("ZYX", angles)


def rates_of(turns: Rotation) -> np.ndarray:
    """Body rates at the samples, by central differences."""
    step = TIMES_S[1] - TIMES_S[0]
    ahead = (turns[:-1].inv() * turns[1:]).as_rotvec() / step
    return np.concatenate([ahead[:1], 0.5 * (ahead[:-1] + ahead[1:]), ahead[-1:]])


def tilts_deg(a: Rotation, b: Rotation) -> np.ndarray:
    cosine = np.sum(a.inv().apply(UP) * b.inv().apply(UP), axis=1)
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def test_a_steady_turn_is_integrated_exactly() -> None:
    rates = np.tile([0.3, -0.2, 0.5], (len(TIMES_S), 1))
    found = integrated(TIMES_S, rates)
    expected = Rotation.from_rotvec(rates[0] * 59.0)
    assert angle_between_deg(found[np.searchsorted(TIMES_S, 59.0 - 1e-9)], expected) < 1e-6
    assert found[0].magnitude() == pytest.approx(0, abs=1e-9)


def test_a_swaying_vehicle_is_followed() -> None:
    truth = swaying()
    found = integrated(TIMES_S, rates_of(truth))
    # trapezia of 10 ms over sines of 1.7 rad/s
    assert np.degrees((found.inv() * truth).magnitude().max()) < 0.02


def test_gravity_takes_off_the_drift_and_the_unknown_start() -> None:
    truth = Rotation.from_euler("YX", [25.0, -40.0], degrees=True) * swaying()
    rates = rates_of(truth) + np.radians([0.2, -0.1, 0.15])  # bias: 12 degrees a minute
    felt = truth.inv().apply(UP * GRAVITY_M_S2)
    found = levelled(TIMES_S, integrated(TIMES_S, rates), felt)
    # one way of looking at the ends: 0.25 degrees a second times half a window of 4 s
    assert tilts_deg(found, truth).max() < 1.2
    assert np.sqrt(np.mean(tilts_deg(found, truth)[1000:-1000] ** 2)) < 0.15


def test_the_bias_is_found_from_gravity_as_far_as_it_shows_there() -> None:
    """A vehicle that sways about all axes and never rests; about down it shows least."""
    truth = swaying()
    bias = np.radians([0.8, -0.5, 0.6])
    felt = truth.inv().apply(UP * GRAVITY_M_S2)
    found = gyro_bias(TIMES_S, rates_of(truth) + bias, felt)
    assert np.degrees(found - bias)[:2] == pytest.approx([0, 0], abs=0.1)
    assert abs(np.degrees(found - bias)[2]) < 0.6
    corrected = levelled(TIMES_S, integrated(TIMES_S, rates_of(truth) + bias - found), felt)
    assert tilts_deg(corrected, truth).max() < 0.4


def test_the_bias_is_found_at_rest_about_all_axes(rng: np.random.Generator) -> None:
    """Six of sixty seconds of rest, with noise as of a cheap gyroscope."""
    bias = np.radians([0.8, -0.5, 0.6])
    angles = 0.3 * np.sin(np.maximum(TIMES_S - 6, 0)[:, None] * [0.8, 1.1, 1.7])
    truth = Rotation.from_euler("ZYX", angles)
    felt = truth.inv().apply(UP * GRAVITY_M_S2)
    measured = rates_of(truth) + bias + rng.normal(scale=0.01, size=(len(TIMES_S), 3))
    assert np.degrees(gyro_bias(TIMES_S, measured, felt) - bias) == pytest.approx(0, abs=0.1)
    unknown = np.full_like(felt, np.nan)  # without an accelerometer too
    assert np.degrees(gyro_bias(TIMES_S, measured, unknown) - bias) == pytest.approx(0, abs=0.1)


def test_a_vehicle_that_speeds_up_is_not_taken_for_one_that_turns() -> None:
    """Ten seconds without rest, with an acceleration forward that fades away, and no bias."""
    times_s = TIMES_S[:1000]
    truth = swaying()[:1000]
    pushed = UP * GRAVITY_M_S2 + np.array([2.5, 0, 0]) * np.exp(-times_s / 3)[:, None]
    found = gyro_bias(times_s, rates_of(swaying())[:1000], truth.inv().apply(pushed))
    assert np.degrees(np.linalg.norm(found)) < 0.8


def test_hard_manoeuvres_are_not_taken_for_gravity() -> None:
    truth = swaying()
    felt = truth.inv().apply(UP * GRAVITY_M_S2)
    felt[2000:2200] += [30.0, 0.0, 0.0]  # two seconds of 3 g
    found = levelled(TIMES_S, integrated(TIMES_S, rates_of(truth)), felt)
    assert tilts_deg(found, truth).max() < 0.1


def test_a_vehicle_on_its_back_is_turned_over() -> None:
    rates = np.zeros_like(TIMES_S)[:, None] * np.ones(3)
    felt = np.tile(-UP * GRAVITY_M_S2, (len(TIMES_S), 1))
    found = levelled(TIMES_S, integrated(TIMES_S, rates), felt)
    assert found[100].apply([0.0, 0.0, 1.0]) == pytest.approx(UP, abs=1e-6)


def test_heading_begins_in_the_north_also_nose_up() -> None:
    level = swaying()
    for tilt in (0.0, 30.0, 90.0):
        truth = Rotation.from_euler("ZY", [70.0, tilt], degrees=True) * level
        felt = truth.inv().apply(UP * GRAVITY_M_S2)
        found = levelled(TIMES_S, integrated(TIMES_S, rates_of(truth)), felt)
        nose = found[0].apply([1.0, 0.0, 0.0] if tilt < 80 else [0.0, 0.0, 1.0])
        # a belly that looks forward is a nose that looks up
        assert abs(np.degrees(np.arctan2(nose[1], nose[0]))) < 0.1


def test_without_an_accelerometer_the_start_counts() -> None:
    truth = swaying()
    felt = np.full((len(TIMES_S), 3), np.nan)
    found = levelled(TIMES_S, integrated(TIMES_S, rates_of(truth)), felt)
    assert np.degrees((found.inv() * truth).magnitude().max()) < 0.02
