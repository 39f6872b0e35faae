"""How a solved camera does on views it was solved without.

A least-squares solution says itself how it would be without some of its views: their share is
taken out of the normal equations and one Gauss-Newton step made from the minimum (as for
leave-one-out residuals of linear fits; Cook and Weisberg, "Residuals and Influence in Regression",
1982, section 2.2). Whether the problem is near enough to linear for that is checked on the views
that stay: their squared distances must fall as the step says. Where not, it is solved anew.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..errors import CalibrationError, FreelookError
from ..lens import Floats
from .bundle import WORST_CONDITION, BoardProblem, Solution, fit, resect_all, rms
from .equations import Equations, State
from .minimise import NEAR
from .parameters import Freedom
from .views import View

FOLDS = 5
NEARLY = 1e-3  # of the squared distances: so far they may be from what the step said
STEPS, ENOUGH = 15, 1e-5  # anew: along flat valleys nothing changes what is predicted
NO_DAMPING = 1e-12

Bools = NDArray[np.bool_]


def cross_validate(solution: Solution, views: Sequence[View], freedom: Freedom) -> float:
    """RMS in pixels (2-D, per point) on views that the camera was solved without, a fifth of them
    at a time; those only get their pose.

    The points that count are the solution's, which is taken to be the least-squares one over them.
    NaN with fewer than 3 views, and where those that are left do not determine the camera.
    """
    return predicted_px(solution, views, camera_without(solution, views, freedom))


def camera_without(
    solution: Solution, views: Sequence[View], freedom: Freedom
) -> Callable[[list[int]], Camera]:
    """From the numbers of the views that are kept to the camera of these alone.

    CalibrationError where they do not determine it.
    """
    if solution.pull:
        return lambda kept: _solved_from(kept, solution, views, freedom)
    whole = _Whole.of(solution, views, freedom)
    return lambda kept: whole.camera_from(kept) or _solved_from(kept, solution, views, freedom)


def predicted_px(
    solution: Solution, views: Sequence[View], camera_of: Callable[[list[int]], Camera]
) -> float:
    """As `cross_validate`, of cameras that come from anywhere: `camera_of` gets the numbers of the
    views that are kept."""
    used = [i for i, ok in enumerate(solution.inliers) if ok.any()]
    if len(used) < 3:
        return float("nan")
    folds, errors = min(FOLDS, len(used)), []
    for fold in range(folds):
        held_out = used[fold::folds]
        kept = [i for i in used if i not in held_out]
        try:
            camera = camera_of(kept)
        except CalibrationError:
            return float("nan")
        counted = [solution.inliers[i] for i in held_out]
        poses, held = [solution.poses[i] for i in held_out], [views[i] for i in held_out]
        residuals = resect_all(camera, poses, held, counted, enough=ENOUGH, damping=NEAR)[1]
        errors += [r[ok] for r, ok in zip(residuals, counted, strict=True)]
    return rms(np.concatenate(errors))


def _solved_from(
    kept: list[int], solution: Solution, views: Sequence[View], freedom: Freedom
) -> Camera:
    return fit(
        solution.camera,
        [solution.poses[i] for i in kept],
        [views[i] for i in kept],
        freedom,
        robust=False,
        counted=[solution.inliers[i] for i in kept],
        steps=STEPS,
        enough=ENOUGH,
        pull=solution.pull,
        damping=NEAR,
    ).camera


@dataclass(frozen=True)
class _Whole:
    """The solution of all views, and its normal equations."""

    problem: BoardProblem
    state: State
    equations: Equations
    counted: Floats  # (n,) 1 or 0
    squares: Floats  # (n,) pixels

    @classmethod
    def of(cls, solution: Solution, views: Sequence[View], freedom: Freedom) -> _Whole:
        problem = BoardProblem(views, solution.camera, freedom)
        state = State.of(problem.parameters.values, solution.poses)
        counted = np.concatenate(solution.inliers).astype(np.float64)
        with np.errstate(all="ignore"):
            residuals = problem.residuals(state)
            equations = Equations.of(problem, state, residuals, counted)
            squares = np.asarray(counted * np.sum(residuals**2, axis=-1))
        return cls(problem, state, equations, counted, squares)

    def camera_from(self, kept: list[int]) -> Camera | None:
        """The camera from these views alone; None where one step does not tell.

        CalibrationError where they do not determine it.
        """
        equations = self.equations.only(kept)
        step = equations.step(NO_DAMPING)
        if step is None or not equations.sound or not _determined(equations):
            raise CalibrationError("the views left do not determine the camera")
        moves = np.zeros((len(self.problem.parts), 6))
        moves[kept] = step[1]
        said = float(
            step[0] @ equations.camera_right.sum(0) + np.sum(step[1] * equations.poses_right)
        )
        rows = np.isin(self.problem.view_of, kept)
        before = float(self.squares[rows].sum())
        try:
            with np.errstate(all="raise", under="ignore"):
                state = self.state.moved((step[0], moves))
                residuals = self.problem.residuals(state)
                camera = self.problem.parameters.camera_of(state.values)
        except (FloatingPointError, ValueError, FreelookError):
            return None
        after = float(self.counted[rows] @ np.sum(residuals[rows] ** 2, axis=-1))
        return camera if abs(before - after - said) < NEARLY * before else None


def _determined(equations: Equations) -> bool:
    try:
        information = equations.eliminated()[0].sum(0)
    except np.linalg.LinAlgError:
        return False
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    scaled = information * np.outer(scale, scale)
    return bool(np.isfinite(scaled).all() and np.linalg.cond(scaled) < WORST_CONDITION)
