"""Bundle adjustment: lens, centre, pixel aspect and every pose at once, by least squares in pixels.

Residuals are pixel distances, and the projection takes rays at any angle, so a point beyond 90
degrees weighs like any other. Levenberg-Marquardt on the normal equations, robustly where asked
(see `minimise`); poses meet each other only through the camera, so they are eliminated (Schur
complement) and a step costs as much as the points are many.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..camera import Camera
from ..errors import CalibrationError
from ..lens import Floats
from .equations import Equations, Problem, Pull, State
from .minimise import ENOUGH, FAR, STEPS, Bools, asked, graduated, minimise, robustly, squares
from .parameters import Freedom, Parameters
from .slopes import both_slopes, project, turn_slopes
from .views import Pose, View

__all__ = [
    "Adjusted",
    "BoardProblem",
    "Fit",
    "Problem",
    "Solution",
    "State",
    "adjusted",
    "fit",
    "resect",
    "resect_all",
    "rms",
    "solve",
]

WORST_CONDITION = 1e14


@dataclass(frozen=True)
class Fit:
    """A camera that fits the views.

    camera      with `theta_max` as it was given; see `calibrate` for the field that was seen
    poses       the target's, one for each view
    residuals   (n, 2) for each view: seen minus projected, pixels
    inliers     (n,) for each view: the points that count
    noise_px    standard deviation of a coordinate, from the points that count
    """

    camera: Camera
    poses: tuple[Pose, ...]
    residuals: tuple[Floats, ...]
    inliers: tuple[Bools, ...]
    noise_px: float

    @property
    def rms_px(self) -> float:
        """Root of the mean squared 2-D distance per point, over the points that count."""
        return rms(
            np.concatenate([r[ok] for r, ok in zip(self.residuals, self.inliers, strict=True)])
        )


@dataclass(frozen=True)
class Solution(Fit):
    """And what is known about it.

    covariance  (k, k) of the free values (see `parameters`), from the residuals
    names       of those
    condition   of the scaled normal equations of the camera alone; above 1e14 they say nothing
    together    how many times as far the views disagree on the camera as independent errors would
                make them (1: not at all); the covariance takes it in
    pull        what the free values were pulled to, if to anything; the covariance takes it in
    """

    covariance: Floats
    names: tuple[str, ...]
    condition: float
    together: float
    pull: Pull | None = None


def rms(residuals: Floats) -> float:
    """Root of the mean squared length of (n, 2) residuals; NaN of none."""
    squared = squares(residuals)
    return float(np.sqrt(squared.mean())) if len(squared) else float("nan")


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
    damping: float = FAR,
) -> Solution:
    """Adjust everything, starting from a camera and poses that are about right.

    robust   False counts every point fully, or those that are true in `counted`, (n,) a view
    steps    bounds each minimisation
    enough   relative gain of a step that is the last
    pull     what the free values are pulled to
    damping  of the first step: `NEAR` where camera and poses are nearly right

    A view with fewer than 4 points that count keeps its pose and counts for nothing.
    CalibrationError when the views do not determine the camera.
    """
    problem = BoardProblem(views, camera, freedom or Freedom(), pull)
    with np.errstate(all="ignore"):  # steps may lead anywhere; what is no number is not taken
        state, weights = _settled(problem, poses, robust, counted, steps, enough, damping)
        known = _known(problem, state, weights)
    plain = _fit(problem, state, known.residuals, weights, known.noise_px)
    return Solution(
        **vars(plain),
        covariance=known.covariance,
        names=problem.parameters.names,
        condition=known.condition,
        together=known.together,
        pull=pull,
    )


def fit(
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
    damping: float = FAR,
) -> Fit:
    """As `solve`, when nothing else need be known: nor whether the views determine the camera."""
    problem = BoardProblem(views, camera, freedom or Freedom(), pull)
    with np.errstate(all="ignore"):
        state, weights = _settled(problem, poses, robust, counted, steps, enough, damping)
        residuals = problem.residuals(state)
        if not np.isfinite(residuals).all():  # the start was nowhere
            raise CalibrationError(UNDETERMINED)
        variance = float(weights @ squares(residuals)) / _surplus(problem, state, weights)
    return _fit(problem, state, residuals, weights, float(np.sqrt(variance)))


def _settled(
    problem: BoardProblem,
    poses: Sequence[Pose],
    robust: bool,
    counted: Sequence[Bools] | None,
    steps: int,
    enough: float,
    damping: float,
) -> tuple[State, Floats]:
    """Where the minimum is, and the weights (n,) of all points."""
    state = State.of(problem.parameters.values, poses)
    if robust:
        return robustly(problem, state, steps, enough, damping)
    weights = asked(problem, counted)
    return minimise(problem, state, lambda _: weights, steps, enough, damping), weights


def _fit(
    problem: BoardProblem, state: State, residuals: Floats, weights: Floats, noise_px: float
) -> Fit:
    return Fit(
        problem.parameters.camera_of(state.values),
        state.poses,
        tuple(residuals[part] for part in problem.parts),
        tuple(weights[part] > 0 for part in problem.parts),
        noise_px,
    )


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
    enough: float = ENOUGH,
    damping: float = FAR,
) -> tuple[tuple[Pose, ...], tuple[Floats, ...]]:
    """The best pose of each view in a known camera, and residuals (n, 2) of all points.

    By plain least squares over the points that are true in `counted`, (n,) a view; None: all.
    `robust` instead by points that fit, with one noise for all views.
    """
    problem = BoardProblem(views, camera, KNOWN)
    state = State.of(np.zeros(0), poses)
    with np.errstate(all="ignore"):
        if robust:
            state = graduated(problem, state, steps, damping)
        else:
            weights = asked(problem, counted)
            state = minimise(problem, state, lambda _: weights, steps, enough, damping)
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
        return np.einsum("nij,nj->ni", state.turns[self.view_of], self.points)

    def residuals(self, state: State) -> Floats:
        camera = self.parameters.camera_of(state.values)
        return self.pixels - project(camera, self.turned(state) + state.shifts[self.view_of])

    def slopes(self, state: State) -> tuple[Floats, Floats]:
        """d pixel / d values (n, 2, k) and d pixel / d (rotation vector, shift) (n, 2, 6)."""
        turned = self.turned(state)
        points = turned + state.shifts[self.view_of]
        by_camera, by_shift = both_slopes(self.parameters, state.values, points)
        return by_camera, np.concatenate([turn_slopes(by_shift, turned), by_shift], axis=-1)


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
        return _known(problem, *robustly(problem, state))


def _known(problem: Problem, state: State, counted: Floats) -> Adjusted:
    surplus = _surplus(problem, state, counted)
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
    variance = float(counted @ squares(residuals)) / surplus
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


def _surplus(problem: Problem, state: State, counted: Floats) -> float:
    """How many more coordinates count than there are unknowns; values that are pulled are none.

    CalibrationError for fewer than one."""
    used = sum(bool(counted[part].any()) for part in problem.parts)
    unknowns = 6 * used + (0 if problem.pull else len(state.values))
    surplus = float(2 * int(counted.sum()) - unknowns)
    if surplus < 1:
        raise CalibrationError(
            f"{int(counted.sum())} points are too few for {unknowns} unknowns; add views"
        )
    return surplus


UNDETERMINED = (
    "the views do not determine all parameters: add views with the target tilted, near the rim and "
    "at other distances, or take a model with fewer parameters"
)
