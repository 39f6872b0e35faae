"""Rotations from directions, most of which agree."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freelook.alignment.rotation_fit import fit_rotation
from freelook.rotations import angle_between_deg

TOLERANCE_RAD = np.radians(0.5)


def directions(rng: np.random.Generator, count: int) -> np.ndarray:
    vectors = rng.normal(size=(count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


@settings(max_examples=30)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(0, 3.1).map(lambda angle: round(angle, 9)),
    st.integers(20, 150),
    st.floats(0, 0.5),
)
def test_the_rotation_of_the_majority_is_found(
    seed: int, angle: float, count: int, wrong: float
) -> None:
    rng = np.random.default_rng(seed)
    truth = Rotation.from_rotvec(angle * directions(rng, 1)[0])
    after = directions(rng, count)
    before = truth.apply(after) + rng.normal(scale=np.radians(0.1), size=(count, 3))
    before /= np.linalg.norm(before, axis=1, keepdims=True)
    outliers = rng.permutation(count)[: int(wrong * count)]
    before[outliers] = directions(rng, len(outliers))
    fit = fit_rotation(before, after, TOLERANCE_RAD, rng)
    assert fit is not None
    # noise of 0.1 degrees per axis over ten directions at least
    assert angle_between_deg(fit.before_from_after, truth) < 0.2
    assert fit.agreeing.sum() >= 0.9 * (count - len(outliers))
    assert fit.residual_rad < TOLERANCE_RAD


def test_directions_without_noise_are_fitted_exactly(rng: np.random.Generator) -> None:
    truth = Rotation.from_rotvec([0.1, -0.2, 0.3])
    after = directions(rng, 30)
    fit = fit_rotation(truth.apply(after), after, TOLERANCE_RAD, rng)
    assert fit is not None
    assert angle_between_deg(fit.before_from_after, truth) < 1e-6
    assert fit.agreeing.all()


@pytest.mark.parametrize("count", [0, 1, 7])
def test_too_few_directions_make_no_rotation(rng: np.random.Generator, count: int) -> None:
    rays = directions(rng, count)
    assert fit_rotation(rays, rays, TOLERANCE_RAD, rng) is None


def test_directions_that_agree_on_nothing_make_no_rotation(rng: np.random.Generator) -> None:
    assert fit_rotation(directions(rng, 60), directions(rng, 60), TOLERANCE_RAD, rng) is None


def test_one_direction_many_times_is_no_reason_to_fail(rng: np.random.Generator) -> None:
    rays = np.tile([[0.0, 0.0, 1.0]], (20, 1))
    fit = fit_rotation(rays, rays, TOLERANCE_RAD, rng)
    assert fit is not None
    assert fit.before_from_after.apply([0.0, 0.0, 1.0]) == pytest.approx([0, 0, 1])
