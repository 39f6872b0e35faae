"""From views of a target to a camera, with the model chosen and the bad points dropped.

guess (no prior) -> Kannala-Brandt, robustly -> views that fit nothing go -> do the views say
enough? -> the wanted models from there, on the same points -> the best (see `candidates`)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..camera import Camera
from ..errors import CalibrationError, FreelookError
from ..lens import Floats, SplinedStereographic
from .bundle import Fit, Solution, fit, resect_all, solve
from .candidates import (
    AUTO,
    Candidate,
    Progress,
    check_model,
    chosen,
    tried,
    with_free_form,
)
from .doubts import check_enough, check_fit, doubts, typical_uncertainty
from .field import seen_angle, with_field
from .free_form import FREE_FORM, Control, check_control
from .initial import as_kannala_brandt, first_guesses, mirrored, pose_of
from .minimise import FAR, NEAR
from .parameters import Freedom
from .views import Pose, View, checked

__all__ = ["Calibration", "Candidate", "Progress", "calibrate"]

RACE_POINTS, RACE_STEPS, RACE_ENOUGH = 40, 8, 1e-3  # of each view, to tell the guesses apart
STRAY = 0.5  # a view counts if so many of its points do
POOR_VIEW = 2.0  # times the usual median distance
BETTER_POSE = 0.9  # times the median distance: less is another pose, not the same


@dataclass(frozen=True)
class Calibration:
    """The result.

    camera              field: to the outermost point that counts, and 5 degrees more
    solution            poses, residuals, covariance; its views are `views`
    cross_validated_px  RMS on views left out (2-D, per point); NaN with fewer than 3 views
    dropped             (name, why) of views that could not be used, or fit nothing
    candidates          all models tried
    seen_rad            angle from the axis of the outermost point that counts
    uncertainty_px      stated standard deviation of the projection where points were seen (root
                        mean square); see `uncertainty`
    doubts              what is weak, in sentences
    """

    camera: Camera
    model: str
    solution: Solution
    views: tuple[View, ...]
    cross_validated_px: float
    dropped: tuple[tuple[str, str], ...]
    candidates: tuple[Candidate, ...]
    seen_rad: float
    freedom: Freedom
    uncertainty_px: float
    doubts: tuple[str, ...]

    @property
    def rms_px(self) -> float:
        return self.solution.rms_px

    @property
    def control(self) -> Control | None:
        """(across, down) control points of a free-form lens; None of any other."""
        lens = self.camera.lens
        return (lens.nx, lens.ny) if isinstance(lens, SplinedStereographic) else None

    @property
    def rejected(self) -> int:
        """Points of the used views that do not count."""
        return int(sum((~ok).sum() for ok in self.solution.inliers))


def calibrate(
    views: Sequence[View],
    size: tuple[int, int],
    model: str = "auto",
    freedom: Freedom | None = None,
    *,
    drop: bool = True,
    control: Control | None = None,
    progress: Progress = lambda _: None,
) -> Calibration:
    """Calibrate a camera from views of a flat target, without any guess.

    size   (width, height) of all pictures
    model  a name in `MODELS`, or auto: the simplest that predicts views left out best
    drop   False: every point of the views counts in the end, far off or not
    control  (across, down) control points of a free-form lens; None: as many as points carry

    CalibrationError says what is wrong with the views and what to do about it.
    """
    check_model(model)
    if control:
        check_control(control)
    freedom = freedom or Freedom()
    used, dropped = checked(views, size)
    progress("first guess")
    used, base, strays = _without_strays(used, _base(used, size, freedom), freedom)
    check_enough(base, used, freedom)
    asked = model == FREE_FORM
    models = AUTO if asked or model == "auto" else (model,)
    candidates = tried(models, used, base, freedom, progress, drop=drop)
    if asked or model == "auto":
        candidates = with_free_form(candidates, used, freedom, progress, control, asked=asked)
    best = chosen(candidates[-1:] if asked else candidates)
    solution = best.solution
    assert solution is not None
    seen = seen_angle(solution, used)
    unsure = typical_uncertainty(solution, used, freedom)
    return Calibration(
        with_field(solution.camera, seen),
        best.model,
        solution,
        tuple(used),
        best.cross_validated_px,
        dropped + strays,
        tuple(candidates),
        seen,
        freedom,
        unsure,
        doubts(solution, used, unsure),
    )


def share_counted(solution: Fit) -> float:
    """The share of points that count."""
    return float(np.mean(np.concatenate(solution.inliers)))


def _base(views: list[View], size: tuple[int, int], freedom: Freedom) -> Solution:
    """A Kannala-Brandt solution over all views: the best of the guesses, refined."""
    few = [_even(view, RACE_POINTS) for view in views]
    refined = []
    for guess in first_guesses(views, size):
        try:
            start = as_kannala_brandt(guess.camera)
            refined.append(
                fit(start, guess.poses, few, freedom, steps=RACE_STEPS, enough=RACE_ENOUGH)
            )
        except FreelookError:
            continue
    if not refined:
        raise CalibrationError(
            "no lens fits these views; are the board's rows and columns right, and is it flat?"
        )
    best = min(refined, key=lambda s: s.noise_px / share_counted(s))
    rough = fit(best.camera, best.poses, views, freedom, enough=RACE_ENOUGH)
    poses, better = _other_poses(rough, views)
    solution = solve(rough.camera, poses, views, freedom, damping=FAR if better else NEAR)
    check_fit(solution)
    return solution


def _even(view: View, most: int) -> View:
    count = len(view.pixels)
    if count <= most:
        return view
    chosen = np.linspace(0, count - 1, most).astype(int)
    return View(view.name, view.points[chosen], view.pixels[chosen])


def _other_poses(solution: Fit, views: list[View]) -> tuple[list[Pose], bool]:
    """For every view the best pose found from some other starts, and whether any is new.

    A small flat target looks much the same from its mirrored pose, and a first guess from points
    some of which are wrong may be far off; a solution ends up in either.
    """
    try:
        camera = with_field(solution.camera, seen_angle(solution, views))
    except CalibrationError:
        return list(solution.poses), False
    now = _medians(solution.residuals)
    poor = [i for i, miss in enumerate(now) if miss > POOR_VIEW * float(np.median(now))]
    every = list(range(len(views)))
    linear = list(solution.poses)
    for i in poor:
        linear[i] = pose_of(camera, views[i]) or linear[i]
    tries: list[tuple[list[int], Sequence[Pose]]] = [
        (every, solution.poses),
        (every, [mirrored(p, v) for p, v in zip(solution.poses, views, strict=True)]),
        (poor, linear),
        (poor, [mirrored(p, v) for p, v in zip(linear, views, strict=True)]),
    ]
    best, least, new = list(solution.poses), np.full(len(views), np.inf), False
    for number, (asked, starts) in enumerate(tries):
        if not asked:
            continue
        from_there, some = [starts[i] for i in asked], [views[i] for i in asked]
        poses, residuals = resect_all(solution.camera, from_there, some, robust=True)
        for i, pose, miss in zip(asked, poses, _medians(residuals), strict=True):
            if miss < BETTER_POSE * least[i]:
                best[i], least[i] = pose, miss
                new |= number > 0
    return best, new


def _medians(residuals: Sequence[Floats]) -> list[float]:
    return [float(np.median(np.linalg.norm(r, axis=1))) for r in residuals]


def _without_strays(
    views: list[View], solution: Solution, freedom: Freedom
) -> tuple[list[View], Solution, tuple[tuple[str, str], ...]]:
    """Without views most of whose points fit nothing; their poses would only do harm."""
    shares = [float(ok.mean()) for ok in solution.inliers]
    kept = [i for i, share in enumerate(shares) if share >= STRAY]
    dropped = tuple(
        (view.name, f"only {share:.0%} of its points fit the others")
        for view, share in zip(views, shares, strict=True)
        if share < STRAY
    )
    if not dropped:
        return views, solution, ()
    if len(kept) < 2:
        raise CalibrationError(
            "the views do not fit each other; is it one board, flat, and are its rows and columns "
            "right?"
        )
    poses = [solution.poses[i] for i in kept]
    remaining = [views[i] for i in kept]
    return remaining, solve(solution.camera, poses, remaining, freedom), dropped
