"""The rotation that most of many pairs of directions agree on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
HYPOTHESES = 60  # a pair without outliers is among them, with half the directions wrong, to 3e-8
FEWEST = 8
_REFINEMENTS = 3


@dataclass(frozen=True)
class RotationFit:
    """`before_from_after`, which pairs agree with it (n,), and the rms angle that remains for
    those, in radians."""

    before_from_after: Rotation
    agreeing: NDArray[np.bool_]
    residual_rad: float


def fit_rotation(
    before: Floats, after: Floats, tolerance_rad: float, rng: np.random.Generator
) -> RotationFit | None:
    """The rotation that turns the unit vectors `after` (n, 3) into `before` (n, 3).

    Rotations through two pairs each are tried (RANSAC: Fischler and Bolles 1981), the one within
    `tolerance_rad` of most pairs is refined over these by least squares (Wahba's problem, solved
    after Kabsch 1976). None for fewer than 8 pairs, or when fewer than 8 or a third agree.
    """
    count = len(before)
    if count < FEWEST:
        return None
    largest = 2 * np.sin(tolerance_rad / 2)
    best = _most_agreed(before, after, largest, rng)
    for _ in range(_REFINEMENTS):
        agreeing = _distances(best[None], before, after)[0] < largest
        if agreeing.sum() < max(FEWEST, count / 3):
            return None
        best = _kabsch(before[agreeing], after[agreeing])
    distances = _distances(best[None], before, after)[0][agreeing]
    residual = float(np.sqrt(np.mean(distances**2)))
    return RotationFit(Rotation.from_matrix(best), agreeing, residual)


def _most_agreed(before: Floats, after: Floats, largest: float, rng: np.random.Generator) -> Floats:
    first = rng.integers(0, len(before), HYPOTHESES)
    second = (first + rng.integers(1, len(before), HYPOTHESES)) % len(before)
    tried = _frames(before[first], before[second]) @ _frames(after[first], after[second]).swapaxes(
        1, 2
    )
    # identity too: nothing is tried in vain while nothing moves
    tried = np.concatenate([np.eye(3)[None], tried])
    agreed = (_distances(tried, before, after) < largest).sum(axis=1)
    best: Floats = tried[int(agreed.argmax())]
    return best


def _frames(a: Floats, b: Floats) -> Floats:
    """Right-handed axes (m, 3, 3) in columns, along a (m, 3) and in the plane of a and b."""
    normal = np.cross(a, b)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    # twice the same direction makes no frame; zeros agree with nothing
    normal = np.where(length > 1e-6, normal / np.maximum(length, 1e-6), 0.0)
    return np.stack([a, normal, np.cross(a, normal)], axis=-1)


def _distances(matrices: Floats, before: Floats, after: Floats) -> Floats:
    """Chords (m, n) between `before` and `after` as turned by each of the matrices (m, 3, 3)."""
    turned = np.einsum("mij,nj->mni", matrices, after)
    return np.asarray(np.linalg.norm(turned - before, axis=2))


def _kabsch(before: Floats, after: Floats) -> Floats:
    u, _, vt = np.linalg.svd(before.T @ after)
    proper = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(u @ vt)))])
    return np.asarray(u @ proper @ vt)
