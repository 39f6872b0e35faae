"""Levenberg-Marquardt on the normal equations, plainly or robustly.

Robustly: first every point counts by the Geman-McClure weight at a scale taken from the residuals
themselves; then points farther off than `REJECT` times the noise are dropped, and what is left is
solved once more by plain least squares, so that the stated uncertainty means what it says.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import ProfileError
from ..lens import Floats
from .equations import Equations, Problem, State

Bools = NDArray[np.bool_]

STEPS = 60
ENOUGH, ROUGHLY = 1e-8, 1e-3  # relative gain of a step that is the last
REJECT = 4.5  # times the noise per coordinate: chance drops 4 in 100,000 good points
FEWEST_COUNTED = 4  # points that a view needs for its pose to mean anything
# Of the first step. From near by the whole step is nearly always right, and damping only slows.
FAR, NEAR = 1e-3, 1e-8
LEAST, MOST = 1e-12, 1e10
AFTER_FAILURE = 1e-5  # at least: below it, a bit more damping changes nothing


def asked(problem: Problem, counted: Sequence[Bools] | None) -> Floats:
    """Weights (n,): 1 for points that are true in `counted`, (n,) a part; None: all."""
    if counted is None:
        return _enough(problem, np.ones(problem.count))
    return _enough(problem, np.concatenate(counted).astype(np.float64))


def _enough(problem: Problem, weights: Floats) -> Floats:
    """Weights without those of views that have too few points left for a pose."""
    weights = weights.copy()
    for part in problem.parts:
        if (weights[part] > 0).sum() < FEWEST_COUNTED:
            weights[part] = 0
    return weights


_Weights = Callable[[Floats], Floats]


def graduated(problem: Problem, state: State, steps: int = STEPS, damping: float = FAR) -> State:
    """Robust steps: the scale follows the residuals down to their noise."""
    every = np.ones(problem.count, bool)
    scale = 3 * _noise(problem, state, every)
    for _ in range(8):
        state = minimise(problem, state, _geman_mcclure(scale), steps, ROUGHLY, damping)
        damping = NEAR
        before, scale = scale, 3 * _noise(problem, state, every)
        if scale > 0.9 * before:
            break
    return state


def robustly(
    problem: Problem,
    state: State,
    steps: int = STEPS,
    enough: float = ENOUGH,
    damping: float = FAR,
) -> tuple[State, Floats]:
    """The state that fits most points, and weights (n,): 1 for those, 0 for the others."""
    return _cleaned(problem, graduated(problem, state, steps, damping), steps, enough)


def _cleaned(problem: Problem, state: State, steps: int, enough: float) -> tuple[State, Floats]:
    """Plain least squares without the points that are too far off, until these stay the same."""
    weights = _inliers(problem, state, np.ones(problem.count))
    for _ in range(6):
        fixed = weights
        state = minimise(problem, state, lambda _: fixed, steps, enough, NEAR)  # noqa: B023
        weights = _inliers(problem, state, fixed)
        if np.array_equal(weights, fixed):
            break
    return state, fixed


def _inliers(problem: Problem, state: State, counted: Floats) -> Floats:
    """1 for points within `REJECT` times the noise of those that counted before, 0 for others."""
    limit = REJECT * _noise(problem, state, counted > 0)
    distance = np.sqrt(squares(problem.residuals(state)))
    return _enough(problem, (distance <= limit).astype(float))


def _noise(problem: Problem, state: State, counted: Bools) -> float:
    """Standard deviation per coordinate, pixels, from the median length (Rayleigh: 1.1774 sigma).

    Few points for many unknowns come nearer than their noise; the degrees of freedom make up for
    that. Never quite 0.
    """
    seen, unknowns = 2 * int(counted.sum()), len(state.values) + 6 * len(problem.parts)
    if not seen:
        return 1e-6
    median = float(np.median(np.sqrt(squares(problem.residuals(state)[counted]))))
    return max(median / 1.1774 / np.sqrt(max(1 - unknowns / seen, 0.1)), 1e-6)


def squares(residuals: Floats) -> Floats:
    return np.asarray(np.sum(residuals**2, axis=-1))


def _geman_mcclure(scale: float) -> _Weights:
    return lambda residuals: np.asarray((1 + squares(residuals) / scale**2) ** -2)


def minimise(
    problem: Problem,
    state: State,
    weights_of: _Weights,
    steps: int,
    enough: float = ENOUGH,
    damping: float = FAR,
) -> State:
    """With weights that follow the residuals; `damping` of the first step."""
    residuals = problem.residuals(state)
    for _ in range(steps):
        weights = weights_of(residuals)
        cost = _cost(problem, state, residuals, weights)
        equations = Equations.of(problem, state, residuals, weights)
        if not equations.sound:
            return state
        while True:
            moved, new = _tried(problem, state, equations.step(damping))
            if new is not None and (new_cost := _cost(problem, moved, new, weights)) < cost:
                break
            damping = max(8 * damping, AFTER_FAILURE)
            if damping > MOST:
                return state
        state, residuals, damping = moved, new, max(damping / 6, LEAST)
        if cost - new_cost < enough * cost:
            return state
    return state


def _cost(problem: Problem, state: State, residuals: Floats, weights: Floats) -> float:
    pulled = problem.pull.cost(state.values) if problem.pull else 0.0
    return float(weights @ squares(residuals)) + pulled


def _tried(
    problem: Problem, state: State, step: tuple[Floats, Floats] | None
) -> tuple[State, Floats | None]:
    """The state after a step and its residuals; None where the lens is no lens any more."""
    if step is None:
        return state, None
    try:
        with np.errstate(all="raise", under="ignore"):
            moved = state.moved(step)
            residuals = problem.residuals(moved)
    except (FloatingPointError, ValueError, ProfileError):
        return state, None
    return moved, residuals if np.isfinite(residuals).all() else None
