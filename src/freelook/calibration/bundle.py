"""Bundle adjustment: lens, centre, pixel aspect and every pose at once, by least squares in pixels.

Residuals are pixel distances, and the projection takes rays at any angle, so a point beyond 90
degrees weighs like any other. Levenberg-Marquardt on the normal equations; poses meet each other
only through the camera, so they are eliminated (Schur complement) and a step costs as much as the
points are many.

Outliers: first every point counts by the Geman-McClure weight at a scale taken from the residuals
themselves; then points farther off than `REJECT` times the noise are dropped, and what is left is
solved once more by plain least squares, so that the stated uncertainty means what it says.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..errors import CalibrationError, ProfileError
from ..lens import Floats
from .equations import Equations, Problem, Pull, State
from .parameters import Freedom, Parameters
from .slopes import cross_matrices, point_slopes, project, value_slopes
from .views import Pose, View

__all__ = [
    "Adjusted",
    "BoardProblem",
    "Problem",
    "Solution",
    "State",
    "adjusted",
    "resect",
    "resect_all",
    "rms",
    "solve",
]

Bools = NDArray[np.bool_]

STEPS = 60
ENOUGH, ROUGHLY = 1e-8, 1e-3  # relative gain of a step that is the last
REJECT = 4.5  # times the noise per coordinate: chance drops 4 in 100,000 good points
FEWEST_COUNTED = 4  # points that a view needs for its pose to mean anything
WORST_CONDITION = 1e14


@dataclass(frozen=True)
class Solution:
    """A camera that fits the views, and what is known about it.

    camera      with `theta_max` as it was given; see `calibrate` for the field that was seen
    poses       the target's, one for each view
    residuals   (n, 2) for each view: seen minus projected, pixels
    inliers     (n,) for each view: the points that count
    covariance  (k, k) of the free values (see `parameters`), from the residuals
    names       of those
    condition   of the scaled normal equations of the camera alone; above 1e14 they say nothing
    noise_px    standard deviation of a coordinate, from the points that count
    together    how many times as far the views disagree on the camera as independent errors would
                make them (1: not at all); the covariance takes it in
    pull        what the free values were pulled to, if to anything; the covariance takes it in
    """

    camera: Camera
    poses: tuple[Pose, ...]
    residuals: tuple[Floats, ...]
    inliers: tuple[Bools, ...]
    covariance: Floats
    names: tuple[str, ...]
    condition: float
    noise_px: float
    together: float
    pull: Pull | None = None

    @property
    def rms_px(self) -> float:
        """Root of the mean squared 2-D distance per point, over the points that count."""
        return rms(
            np.concatenate([r[ok] for r, ok in zip(self.residuals, self.inliers, strict=True)])
        )


def rms(residuals: Floats) -> float:
    """Root of the mean squared length of (n, 2) residuals; NaN of none."""
    squares = _squares(residuals)
    return float(np.sqrt(squares.mean())) if len(squares) else float("nan")


def solve(
    camera: Camera,
    poses: Sequence[Pose],
    views: Sequence[View],
    freedom: Freedom | None = None,
    *,
    robust: bool = True,
    counted: Sequence[Bools] | None = None,
    steps: int = STEPS,
    enough: float = ENOUGH,
    pull: Pull | None = None,
) -> Solution:
    """Adjust everything, starting from a camera and poses that are about right.

    robust   False counts every point fully, or those that are true in `counted`, (n,) a view
    steps    bounds each minimisation
    enough   relative gain of a step that is the last
    pull     what the free values are pulled to

    A view with fewer than 4 points that count keeps its pose and counts for nothing.
    CalibrationError when the views do not determine the camera.
    """
    problem = BoardProblem(views, camera, freedom or Freedom(), pull)
    state = State.of(problem.parameters.values, poses)
    with np.errstate(all="ignore"):  # steps may lead anywhere; what is no number is not taken
        if robust:
            state, weights = _robustly(problem, state, steps, enough)
        else:
            weights = _asked(problem, counted)
            state = _minimise(problem, state, lambda _: weights, steps, enough)
        return _solution(problem, state, weights)


def resect(camera: Camera, pose: Pose, view: View) -> tuple[Pose, Floats]:
    """The best pose of one view in a known camera, robustly, and its residuals (n, 2)."""
    poses, residuals = resect_all(camera, [pose], [view], robust=True)
    return poses[0], residuals[0]


def resect_all(
    camera: Camera,
    poses: Sequence[Pose],
    views: Sequence[View],
    counted: Sequence[Bools] | None = None,
    *,
    robust: bool = False,
    steps: int = STEPS,
) -> tuple[tuple[Pose, ...], tuple[Floats, ...]]:
    """The best pose of each view in a known camera, and residuals (n, 2) of all points.

    By plain least squares over the points that are true in `counted`, (n,) a view; None: all.
    `robust` instead by points that fit, with one noise for all views.
    """
    problem = BoardProblem(views, camera, KNOWN)
    state = State.of(np.zeros(0), poses)
    with np.errstate(all="ignore"):
        if robust:
            state = _graduated(problem, state, steps)
        else:
            weights = _asked(problem, counted)
            state = _minimise(problem, state, lambda _: weights, steps)
        residuals = problem.residuals(state)
    return state.poses, tuple(residuals[part] for part in problem.parts)


KNOWN = Freedom(lens=False, center=False, aspect=False)


class BoardProblem:
    """The views stacked, and what a row of values means."""

    def __init__(
        self, views: Sequence[View], camera: Camera, freedom: Freedom, pull: Pull | None = None
    ) -> None:
        self.pull = pull
        self.parameters = Parameters(camera, freedom)
        self.points = np.concatenate([view.points for view in views])
        self.pixels = np.concatenate([view.pixels for view in views])
        self.count = len(self.pixels)
        lengths = [len(view.pixels) for view in views]
        self.parts = [slice(a, b) for a, b in pairwise(np.cumsum([0, *lengths]))]
        self.view_of = np.repeat(np.arange(len(views)), lengths)

    def turned(self, state: State) -> Floats:
        """The points (n, 3) by the rotations alone."""
        each = zip(self.parts, state.turns, strict=True)
        return np.concatenate([self.points[part] @ turn.T for part, turn in each])

    def residuals(self, state: State) -> Floats:
        camera = self.parameters.camera_of(state.values)
        return self.pixels - project(camera, self.turned(state) + state.shifts[self.view_of])

    def slopes(self, state: State) -> tuple[Floats, Floats]:
        """d pixel / d values (n, 2, k) and d pixel / d (rotation vector, shift) (n, 2, 6)."""
        turned = self.turned(state)
        points = turned + state.shifts[self.view_of]
        by_camera = value_slopes(self.parameters, state.values, points)
        by_shift = point_slopes(self.parameters.camera_of(state.values), points)
        return by_camera, np.concatenate([-by_shift @ cross_matrices(turned), by_shift], axis=-1)


def _asked(problem: Problem, counted: Sequence[Bools] | None) -> Floats:
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


def _graduated(problem: Problem, state: State, steps: int = STEPS) -> State:
    """Robust steps: the scale follows the residuals down to their noise."""
    every = np.ones(problem.count, bool)
    scale = 3 * _noise(problem, state, every)
    for _ in range(8):
        state = _minimise(problem, state, _geman_mcclure(scale), steps, ROUGHLY)
        before, scale = scale, 3 * _noise(problem, state, every)
        if scale > 0.9 * before:
            break
    return state


def _robustly(
    problem: Problem, state: State, steps: int = STEPS, enough: float = ENOUGH
) -> tuple[State, Floats]:
    return _cleaned(problem, _graduated(problem, state, steps), steps, enough)


def _cleaned(problem: Problem, state: State, steps: int, enough: float) -> tuple[State, Floats]:
    """Plain least squares without the points that are too far off, until these stay the same."""
    weights = _inliers(problem, state, np.ones(problem.count))
    for _ in range(6):
        fixed = weights
        state = _minimise(problem, state, lambda _: fixed, steps, enough)  # noqa: B023
        weights = _inliers(problem, state, fixed)
        if np.array_equal(weights, fixed):
            break
    return state, fixed


def _inliers(problem: Problem, state: State, counted: Floats) -> Floats:
    """1 for points within `REJECT` times the noise of those that counted before, 0 for others."""
    limit = REJECT * _noise(problem, state, counted > 0)
    distance = np.sqrt(_squares(problem.residuals(state)))
    return _enough(problem, (distance <= limit).astype(float))


def _noise(problem: Problem, state: State, counted: Bools) -> float:
    """Standard deviation per coordinate, pixels, from the median length (Rayleigh: 1.1774 sigma).

    Few points for many unknowns come nearer than their noise; the degrees of freedom make up for
    that. Never quite 0.
    """
    seen, unknowns = 2 * int(counted.sum()), len(state.values) + 6 * len(problem.parts)
    if not seen:
        return 1e-6
    median = float(np.median(np.sqrt(_squares(problem.residuals(state)[counted]))))
    return max(median / 1.1774 / np.sqrt(max(1 - unknowns / seen, 0.1)), 1e-6)


def _squares(residuals: Floats) -> Floats:
    return np.asarray(np.sum(residuals**2, axis=-1))


def _geman_mcclure(scale: float) -> _Weights:
    return lambda residuals: np.asarray((1 + _squares(residuals) / scale**2) ** -2)


def _minimise(
    problem: Problem, state: State, weights_of: _Weights, steps: int, enough: float = ENOUGH
) -> State:
    """Levenberg-Marquardt with weights that follow the residuals."""
    damping = 1e-3
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
            damping *= 8
            if damping > 1e10:
                return state
        state, residuals, damping = moved, new, max(damping / 6, 1e-12)
        if cost - new_cost < enough * cost:
            return state
    return state


def _cost(problem: Problem, state: State, residuals: Floats, weights: Floats) -> float:
    pulled = problem.pull.cost(state.values) if problem.pull else 0.0
    return float(weights @ _squares(residuals)) + pulled


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


@dataclass(frozen=True)
class Adjusted:
    """A problem solved: see `Solution`. `residuals` (n, 2), `counted` (n,), of all points."""

    state: State
    residuals: Floats
    counted: Bools
    covariance: Floats
    condition: float
    noise_px: float
    together: float


def adjusted(problem: Problem, state: State) -> Adjusted:
    """The state adjusted robustly, and what is known about it. CalibrationError as in `solve`."""
    with np.errstate(all="ignore"):
        return _known(problem, *_robustly(problem, state))


def _known(problem: Problem, state: State, counted: Floats) -> Adjusted:
    used = sum(bool(counted[part].any()) for part in problem.parts)
    unknowns = 6 * used + (0 if problem.pull else len(state.values))
    surplus = float(2 * int(counted.sum()) - unknowns)
    if surplus < 1:
        raise CalibrationError(
            f"{int(counted.sum())} points are too few for {unknowns} unknowns; add views"
        )
    residuals = problem.residuals(state)
    equations = Equations.of(problem, state, residuals, counted)
    if not (equations.sound and np.isfinite(residuals).all()):
        raise CalibrationError(UNDETERMINED)
    try:
        each, right = equations.eliminated()
    except np.linalg.LinAlgError:
        raise CalibrationError(UNDETERMINED) from None
    whole = each.sum(0) + equations.pull
    scale = 1 / np.sqrt(np.maximum(np.diag(whole), 1e-300))
    each, whole = each * np.outer(scale, scale), whole * np.outer(scale, scale)
    if not np.isfinite(whole).all():
        raise CalibrationError(UNDETERMINED)
    condition = float(np.linalg.cond(whole)) if len(scale) else 1.0
    if not condition < WORST_CONDITION:
        raise CalibrationError(UNDETERMINED)
    inverse = np.linalg.inv(whole)
    if problem.pull:  # values that are only what was expected of them took up no noise
        surplus -= float(np.sum(inverse * each.sum(0)))
    variance = float(counted @ _squares(residuals)) / surplus
    together = _together(inverse, each, right * scale, variance)
    covariance = together**2 * variance * inverse * np.outer(scale, scale)
    noise = float(np.sqrt(variance))
    return Adjusted(state, residuals, counted > 0, covariance, condition, noise, together)


def _together(inverse: Floats, each: Floats, right: Floats, variance: float) -> float:
    """How many times as far the parts disagree on the values as independent errors would make
    them; at least 1.

    The errors of neighbouring corners go together where a board is not flat, a picture was taken
    in motion or light spills, and then many corners say no more than a few. Were they independent,
    the squared right sides of the parts, weighed by the inverse information L, would sum to

        variance * sum over parts of trace(L I) - trace(L I L I)

    (their sum being 0, as at the minimum). The ratio to that is the design effect of cluster
    samples (Kish, "Survey Sampling", 1965), one number for all values.
    """
    shares = inverse @ each
    own = np.trace(shares, axis1=1, axis2=2).sum() - np.einsum("vij,vji->", shares, shares)
    seen = np.einsum("vi,ij,vj->", right, inverse, right)
    return float(np.sqrt(max(1.0, seen / (variance * own)))) if variance * own > 1e-9 else 1.0


def _solution(problem: BoardProblem, state: State, weights: Floats) -> Solution:
    known = _known(problem, state, weights)
    return Solution(
        problem.parameters.camera_of(state.values),
        state.poses,
        tuple(known.residuals[part] for part in problem.parts),
        tuple(known.counted[part] for part in problem.parts),
        known.covariance,
        problem.parameters.names,
        known.condition,
        known.noise_px,
        known.together,
        problem.pull,
    )


UNDETERMINED = (
    "the views do not determine all parameters: add views with the target tilted, near the rim and "
    "at other distances, or take a model with fewer parameters"
)
