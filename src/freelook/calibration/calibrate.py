"""From views of a target to a camera, with the model chosen and the bad points dropped.

    guess (no prior) -> Kannala-Brandt, robustly -> the wanted model from there -> cross-validation

Cross-validation is what decides between models: the camera is solved without a fifth of the views
at a time, those views only get their pose, and their residuals tell how the model does on pictures
it has not seen. A model with more parameters fits better and predicts worse once it is too much.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..camera import Camera, make_camera
from ..errors import CalibrationError, FreelookError, ProfileError
from ..fitting.refit import refit
from ..lens import MODELS, KannalaBrandt, Lens, RadialSpline, growth_limit
from .bundle import Solution, resect, rms, solve
from .initial import Guess, first_guesses
from .parameters import Freedom
from .views import View, checked

# Tried by `auto`, simple ones first; the others are for those who ask for them.
AUTO = (
    "equidistant",
    "equisolid",
    "stereographic",
    "kannala_brandt",
    "double_sphere",
    "eucm",
    "polynomial",
    "radial_spline",
)
# A more complex model must predict at least this much better.
WORTH_IT = 0.99
OVERFIT = 1.3  # times the RMS on views left out
FOLDS = 5
KNOT_EVERY_DEG = 12.0
MARGIN = np.radians(5.0)  # of field beyond the outermost point seen
RACE_POINTS, RACE_STEPS = 40, 8  # of each view, to tell the guesses apart

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Candidate:
    """A model that was tried: how well it fits, how well it predicts, or why it could not be."""

    model: str
    rms_px: float = float("nan")
    cross_validated_px: float = float("nan")
    solution: Solution | None = None
    why_not: str = ""

    @property
    def remark(self) -> str:
        """In words, if it predicts much worse than it fits."""
        overfit = self.cross_validated_px > OVERFIT * self.rms_px
        return "overfit: fits these views, predicts others worse" if overfit else ""


@dataclass(frozen=True)
class Calibration:
    """The result.

    camera              field: to the outermost point that counts, and 5 degrees more
    solution            poses, residuals, covariance; its views are `views`
    cross_validated_px  RMS on views left out (2-D, per point); NaN with fewer than 3 views
    dropped             views that fit nothing, with the reason
    candidates          all models tried
    seen_rad            angle from the axis of the outermost point that counts
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

    @property
    def rms_px(self) -> float:
        return self.solution.rms_px

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
    progress: Progress = lambda _: None,
) -> Calibration:
    """Calibrate a camera from views of a flat target, without any guess.

    CalibrationError says what is wrong with the views and what to do about it.
    """
    if model != "auto" and model not in MODELS:
        raise CalibrationError(f"unknown model '{model}'; known: auto, {', '.join(MODELS)}")
    freedom = freedom or Freedom()
    used = checked(views, size)
    progress("first guess")
    base = _base(used, size, freedom)
    used, base, dropped = _without_strays(used, base, freedom)
    _check_variety(used, base)
    candidates = []
    for name in AUTO if model == "auto" else (model,):
        progress(name)
        candidates.append(_candidate(name, used, base, freedom))
    best = _best(candidates)
    solution = best.solution
    assert solution is not None
    seen = seen_angle(solution, used)
    return Calibration(
        with_field(solution.camera, seen),
        best.model,
        solution,
        tuple(used),
        best.cross_validated_px,
        dropped,
        tuple(candidates),
        seen,
        freedom,
    )


def cross_validate(solution: Solution, views: Sequence[View], freedom: Freedom) -> float:
    """RMS in pixels (2-D, per point) on views that the camera was solved without.

    Points that do not count in the full solution do not count here. NaN with fewer than 3 views.
    """
    if len(views) < 3:
        return float("nan")
    counted = [view.only(ok) for view, ok in zip(views, solution.inliers, strict=True)]
    folds = min(FOLDS, len(views))
    errors = []
    for fold in range(folds):
        kept = [i for i in range(len(views)) if i % folds != fold]
        part = solve(
            solution.camera,
            [solution.poses[i] for i in kept],
            [counted[i] for i in kept],
            freedom,
            robust=False,
        )
        for i in range(fold, len(views), folds):
            errors.append(resect(part.camera, solution.poses[i], counted[i])[1])
    return rms(np.concatenate(errors))


def seen_angle(solution: Solution, views: Sequence[View]) -> float:
    """The largest angle from the axis of a point that counts, radians."""
    angles = [0.0]
    for pose, view, ok in zip(solution.poses, views, solution.inliers, strict=True):
        at = pose.apply(view.points[ok])
        if len(at):
            angles.append(float(np.arctan2(np.hypot(at[:, 0], at[:, 1]), at[:, 2]).max()))
    return max(angles)


def _base(views: list[View], size: tuple[int, int], freedom: Freedom) -> Solution:
    """A Kannala-Brandt solution over all views: the best of the guesses, refined."""
    few = [_even(view, RACE_POINTS) for view in views]
    refined = []
    for guess in first_guesses(views, size):
        try:
            refined.append(
                solve(_kannala_brandt(guess), guess.poses, few, freedom, steps=RACE_STEPS)
            )
        except FreelookError:
            continue
    if not refined:
        raise CalibrationError(
            "no lens fits these views; are the board's rows and columns right, and is it flat?"
        )
    best = min(refined, key=lambda s: s.noise_px / share_counted(s))
    return solve(best.camera, best.poses, views, freedom)


def share_counted(solution: Solution) -> float:
    """The share of points that count."""
    return float(np.mean(np.concatenate(solution.inliers)))


def _even(view: View, most: int) -> View:
    count = len(view.pixels)
    if count <= most:
        return view
    chosen = np.linspace(0, count - 1, most).astype(int)
    return View(view.name, view.points[chosen], view.pixels[chosen])


def _kannala_brandt(guess: Guess) -> Camera:
    """The guess as the Kannala-Brandt lens nearest to it, with a field that hinders nothing."""
    lens = guess.camera.lens
    theta = np.linspace(0, guess.camera.theta_max, 200)[1:]
    powers = theta[:, None] ** np.array([1, 3, 5, 7, 9])
    terms = np.linalg.lstsq(powers, lens.radius(theta), rcond=None)[0]
    f = float(terms[0])
    return replace(
        guess.camera, lens=KannalaBrandt(f, *(float(k) / f for k in terms[1:])), theta_max=np.pi
    )


def _without_strays(
    views: list[View], solution: Solution, freedom: Freedom
) -> tuple[list[View], Solution, tuple[tuple[str, str], ...]]:
    """Without views most of whose points fit nothing; their poses would only do harm."""
    shares = [float(ok.mean()) for ok in solution.inliers]
    kept = [i for i, share in enumerate(shares) if share >= 0.5]
    dropped = tuple(
        (view.name, f"only {share:.0%} of its points fit the others")
        for view, share in zip(views, shares, strict=True)
        if share < 0.5
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


def _check_variety(views: Sequence[View], solution: Solution) -> None:
    """Views that all show the board alike leave the camera open, however well they fit."""
    normals = np.stack([p.camera_from_target.as_matrix()[:, 2] for p in solution.poses])
    rays = np.stack(
        [
            p.apply(v.points.mean(0, keepdims=True))[0]
            for p, v in zip(solution.poses, views, strict=True)
        ]
    )
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    facing = np.abs(np.sum(normals * rays, axis=1)).clip(0, 1)
    tilts = np.degrees(np.arccos(facing))
    if len(views) == 1 and solution.condition > 1e8:
        raise CalibrationError(
            "one view does not determine the camera; take at least 5 of the board in other places "
            "and tilted"
        )
    same = np.abs(normals @ normals.T).min() > np.cos(np.radians(3)) and (
        rays @ rays.T
    ).min() > np.cos(np.radians(3))
    if len(views) > 1 and same and solution.condition > 1e8:
        raise CalibrationError(
            f"all {len(views)} views show the board at the same place and tilt "
            f"({tilts.mean():.0f} degrees); move it between pictures, to the rim and tilted"
        )


def _candidate(name: str, views: Sequence[View], base: Solution, freedom: Freedom) -> Candidate:
    try:
        start = _start(name, base, seen_angle(base, views))
        solution = solve(start, base.poses, views, freedom)
        _check_growth(solution.camera.lens, seen_angle(solution, views))
        return Candidate(name, solution.rms_px, cross_validate(solution, views, freedom), solution)
    except FreelookError as error:
        return Candidate(name, why_not=str(error))


def _start(name: str, base: Solution, seen: float) -> Camera:
    """A camera of the wanted model that is near the base solution where points were seen."""
    if name == "kannala_brandt":
        return base.camera
    grows = min(growth_limit(base.camera.lens), seen + MARGIN)
    known = make_camera(
        base.camera.size,
        base.camera.lens,
        center=base.camera.center,
        stretch=base.camera.stretch,
        field_deg=float(np.degrees(2 * grows)),
    )
    if name == "radial_spline":
        lens: Lens = _spline_like(known.lens, grows)
    else:
        try:
            lens = refit(known, name).camera.lens
        except FreelookError:  # it may still be solved for, on the points
            lens = MODELS[name](float(base.camera.lens.radius(np.array([0.01]))[0] / 0.01))  # type: ignore[call-arg]
    return replace(base.camera, lens=lens)


def _spline_like(lens: Lens, theta_max: float) -> RadialSpline:
    degrees = np.degrees(theta_max)
    knots = np.linspace(0, degrees, max(4, round(degrees / KNOT_EVERY_DEG)) + 1)[1:]
    radii = lens.radius(np.radians(knots))
    return RadialSpline(tuple(map(float, knots)), tuple(map(float, radii)))


def _check_growth(lens: Lens, seen: float) -> None:
    limit = growth_limit(lens)
    if limit < seen * 0.999:
        raise CalibrationError(
            f"its radius stops growing at {np.degrees(limit):.1f} degrees, where points were seen"
        )


def _best(candidates: Sequence[Candidate]) -> Candidate:
    """The simplest that predicts about as well as the best; by fit alone with too few views."""
    able = [c for c in candidates if c.solution is not None]
    if not able:
        raise CalibrationError("; ".join(f"{c.model}: {c.why_not}" for c in candidates))

    def score(c: Candidate) -> float:
        return c.rms_px if np.isnan(c.cross_validated_px) else c.cross_validated_px

    least = min(score(c) for c in able)
    return next(c for c in able if score(c) * WORTH_IT <= least)


def with_field(camera: Camera, seen: float) -> Camera:
    """The camera with the field it is good for."""
    half = min(seen + MARGIN, growth_limit(camera.lens))
    try:
        return make_camera(
            camera.size,
            camera.lens,
            center=camera.center,
            stretch=camera.stretch,
            field_deg=float(np.degrees(2 * half)),
        )
    except ProfileError as error:
        raise CalibrationError(f"the result is no lens: {error}") from None
