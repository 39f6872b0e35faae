"""Lens models tried on the same points, and which of them is taken.

Every candidate is solved robustly, by itself (those plainly far off only roughly). Then one of them
says which points count for all: the one nearest to most points (least median residual). Were each
to drop its own, a poor model would look good by having dropped what it cannot explain. On these
points every candidate is solved again by plain least squares and cross-validated (see `left_out`):
the camera is solved without a fifth of the views at a time, those views only get their pose, and
their residuals tell how the model does on pictures it has not seen. A model with more parameters
fits better and predicts worse once it is too much.

A free-form lens is tried last, from the one taken, when it is asked for or where one linear step
towards it promises to predict views left out better (see `free_form.promised_gain`).

Taken is the model with the fewest parameters that predicts within 1 % of the best. Not within one
standard error, as is often done: a lens model is wrong mostly at the rim, where few views reach,
and over so few views a difference that is all too real is within its standard error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera, make_camera
from ..errors import CalibrationError, FreelookError
from ..fitting.refit import refit
from ..lens import MODELS, Lens, RadialSpline, growth_limit
from .bundle import Fit, Solution, fit, solve
from .field import MARGIN, angles, seen_angle, with_field
from .free_form import (
    FREE_FORM,
    Control,
    free_form,
    free_form_predicts_px,
    promised_gain,
    usual_control,
)
from .left_out import cross_validate
from .minimise import ENOUGH, FAR, NEAR, STEPS
from .nearby import nearby
from .parameters import HELD, Freedom, lens_names
from .views import Pose, View

# Tried by `auto`, those with few parameters first; the others are for those who ask for them.
AUTO = (
    "equidistant",
    "equisolid",
    "stereographic",
    "perspective",
    "eucm",
    "double_sphere",
    "kannala_brandt",
    "polynomial",
    "radial_spline",
    "thin_prism_fisheye",
)
# A model with more parameters must predict at least this much better.
WORTH_IT = 0.99
WORTH_TRYING = 0.02  # of the squared distances, which is 1 % of their root
OUT_OF_THE_RACE = 1.5  # times the best RMS: what fits so badly need not be tested further
# Among others a model is given up, after some steps, at so many times the RMS of Kannala-Brandt.
FAR_OFF, ROUGH_STEPS, ROUGH_ENOUGH = 3.0, 12, 1e-3
# Relative gain of the last step: before it is known which points count for all, and then, of one
# among many. Along the valleys of models that say the same twice it may take dozens for nothing.
NEAR_ENOUGH, AMONG_ENOUGH = 1e-5, 1e-6
OVERFIT = 1.3  # times the RMS on views left out
BEYOND = np.radians(0.5)  # of a model's end: more than the first lens may be off there
FEW_FOLDED = 0.02  # of the points that count
KNOT_EVERY_DEG = 12.0

Progress = Callable[[str], None]
Counted = tuple[NDArray[np.bool_], ...]


@dataclass(frozen=True)
class Candidate:
    """A model that was tried: how well it fits, how well it predicts, or why it could not be.

    `rms_px` and `cross_validated_px` (RMS, 2-D, per point) of all candidates are over the same
    points. The latter is NaN with fewer than 3 views, where the rest did not determine the model,
    and for models that fit 1.5 times as badly as the best. `instead_of` is the model that a
    free-form one is pulled towards.
    """

    model: str
    rms_px: float = float("nan")
    cross_validated_px: float = float("nan")
    solution: Solution | None = None
    why_not: str = ""
    instead_of: str = ""

    @property
    def remark(self) -> str:
        """In words, if it predicts much worse than it fits."""
        overfit = self.cross_validated_px > OVERFIT * self.rms_px
        return "overfit: fits these views, predicts others worse" if overfit else ""


def check_model(model: str) -> None:
    """CalibrationError for a model that is unknown."""
    if model != "auto" and model not in MODELS:
        raise CalibrationError(f"unknown model '{model}'; known: auto, {', '.join(MODELS)}")


def tried(
    models: Sequence[str],
    views: Sequence[View],
    base: Solution,
    freedom: Freedom,
    progress: Progress,
    *,
    drop: bool = True,
) -> list[Candidate]:
    """All models, solved from a Kannala-Brandt solution of the same views on.

    `drop` False: every point counts.
    """
    alone: dict[str, Fit | FreelookError] = {}
    for model in models:
        progress(model)
        alone[model] = _alone(model, views, base, freedom, drop, among=len(models))
    able = [found for found in alone.values() if isinstance(found, Fit)]
    if not able:
        return [Candidate(model, why_not=str(error)) for model, error in alone.items()]
    counted = min(able, key=_median_px).inliers
    progress("the same points for all")
    same = [
        _on_common_points(model, found, views, base, freedom, counted, among=len(models))
        if isinstance(found, Fit)
        else Candidate(model, why_not=str(found))
        for model, found in alone.items()
    ]
    progress("views left out")
    least = np.nanmin([c.rms_px for c in same] + [np.inf])
    return [
        replace(c, cross_validated_px=cross_validate(c.solution, views, freedom))
        if c.solution is not None and c.rms_px <= OUT_OF_THE_RACE * least
        else c
        for c in same
    ]


def with_free_form(
    candidates: list[Candidate],
    views: Sequence[View],
    freedom: Freedom,
    progress: Progress,
    control: Control | None = None,
    *,
    asked: bool = True,
) -> list[Candidate]:
    """The candidates and a free-form lens from the best of them; not `asked`: only where that one
    leaves something to follow.

    control  (across, down) control points; None: as many as the points carry
    """
    best = chosen(candidates)
    assert best.solution is not None
    if not (asked or promised_gain(best.solution, views) > WORTH_TRYING):
        return candidates
    progress(FREE_FORM)
    return [*candidates, _free_form(best, best.solution, views, freedom, control)]


def _free_form(
    best: Candidate,
    start: Solution,
    views: Sequence[View],
    freedom: Freedom,
    control: Control | None,
) -> Candidate:
    try:
        control = control or usual_control(start, views)
        solution = free_form(start, views, None, control)
        with_field(solution.camera, seen_angle(solution, views))
        predicted = free_form_predicts_px(start, views, freedom, control)
    except FreelookError as error:
        return Candidate(FREE_FORM, why_not=str(error), instead_of=best.model)
    return Candidate(FREE_FORM, solution.rms_px, predicted, solution, instead_of=best.model)


def chosen(candidates: Sequence[Candidate]) -> Candidate:
    """The one with the fewest parameters that predicts within 1 % of the best.

    With fewer than 3 views nothing can be predicted; the noise per degree of freedom decides then.
    CalibrationError, with all reasons, if none could be solved.
    """
    able = [c for c in candidates if c.solution is not None]
    if not able:
        raise CalibrationError("; ".join(f"{c.model}: {c.why_not}" for c in candidates))
    if any(np.isfinite(c.cross_validated_px) for c in able):
        able = [c for c in able if np.isfinite(c.cross_validated_px)]
        scores = [c.cross_validated_px for c in able]
    else:
        scores = [c.solution.noise_px for c in able if c.solution is not None]
    near = [c for c, score in zip(able, scores, strict=True) if score * WORTH_IT <= min(scores)]
    return min(near, key=_parameters)


def _alone(
    model: str, views: Sequence[View], base: Solution, freedom: Freedom, drop: bool, among: int
) -> Fit | FreelookError:
    """`among` more than one, a model far off is not solved to the end."""
    try:
        if model == "kannala_brandt" and drop:
            return _without_folded(base, views, freedom)
        start = _start(model, base, seen_angle(base, views), freedom)
        if not drop:
            return fit(start, base.poses, views, freedom, robust=False)
        if among == 1:
            return _without_folded(fit(start, base.poses, views, freedom), views, freedom)
        near = _roughly(start, base.poses, views, freedom, base.inliers)
        if _is_far_off(near, base):
            return near
        found = fit(near.camera, near.poses, views, freedom, enough=NEAR_ENOUGH, damping=NEAR)
        return _without_folded(found, views, freedom)
    except FreelookError as error:
        return error


def _roughly(
    start: Camera, poses: Sequence[Pose], views: Sequence[View], freedom: Freedom, counted: Counted
) -> Fit:
    return fit(
        start,
        poses,
        views,
        freedom,
        robust=False,
        counted=counted,
        steps=ROUGH_STEPS,
        enough=ROUGH_ENOUGH,
    )


def _is_far_off(found: Fit, base: Solution) -> bool:
    return found.rms_px > FAR_OFF * base.rms_px


def _without_folded(found: Fit, views: Sequence[View], freedom: Freedom) -> Fit:
    """Without the few points that fit only because a lens folds back beyond the others."""
    limit = growth_limit(found.camera.lens)
    if limit >= seen_angle(found, views):
        return found
    counted = [
        ok & (angles(pose, view) <= limit)
        for pose, view, ok in zip(found.poses, views, found.inliers, strict=True)
    ]
    before = np.concatenate(found.inliers).sum()
    if np.concatenate(counted).sum() < (1 - FEW_FOLDED) * before:
        return found
    return fit(found.camera, found.poses, views, freedom, robust=False, counted=counted)


def _on_common_points(
    model: str,
    found: Fit,
    views: Sequence[View],
    base: Solution,
    freedom: Freedom,
    counted: Counted,
    among: int,
) -> Candidate:
    far_off = _is_far_off(found, base)
    try:
        solution = solve(
            found.camera,
            found.poses,
            views,
            freedom,
            robust=False,
            counted=counted,
            steps=ROUGH_STEPS if far_off else STEPS,
            enough=ROUGH_ENOUGH if far_off else AMONG_ENOUGH if among > 1 else ENOUGH,
            damping=FAR if far_off else NEAR,
        )
        _check_growth(solution.camera.lens, seen_angle(solution, views))
    except FreelookError as error:
        return Candidate(model, why_not=str(error))
    return Candidate(model, solution.rms_px, solution=solution)


def _median_px(found: Fit) -> float:
    return float(np.median(np.linalg.norm(np.concatenate(found.residuals), axis=1)))


def _parameters(candidate: Candidate) -> int:
    assert candidate.solution is not None
    return len(lens_names(candidate.solution.camera.lens))


def _start(name: str, base: Solution, seen: float, freedom: Freedom) -> Camera:
    """A camera of the wanted model that is near the base solution where points were seen."""
    if name == "kannala_brandt":
        return base.camera
    ends = getattr(MODELS[name], "hard_limit", None)  # some end where their parameters say
    if isinstance(ends, float):
        _check_reach(name, ends, seen)
    grows = min(growth_limit(base.camera.lens), seen + MARGIN)
    known = make_camera(
        base.camera.size,
        base.camera.lens,
        center=base.camera.center,
        stretch=base.camera.stretch,
        field_deg=float(np.degrees(2 * grows)),
    )
    if name == "radial_spline":
        return replace(base.camera, lens=_spline_like(known.lens, grows))
    close = nearby(name, known.lens, grows)
    if close is not None:
        return replace(base.camera, lens=close)
    try:
        stretch, held = "aspect" if freedom.aspect else "none", HELD.get(MODELS[name], ())
        near = refit(known, name, stretch=stretch, held=held).camera
    except FreelookError:  # it may still be solved for, on the points
        f = float(base.camera.lens.radius(np.array([0.01]))[0] / 0.01)
        return replace(base.camera, lens=MODELS[name](f))  # type: ignore[call-arg]
    _check_reach(name, near.lens.hard_limit, seen)
    if not freedom.center:
        return replace(base.camera, lens=near.lens)
    return replace(base.camera, lens=near.lens, center=near.center, stretch=near.stretch)


def _check_reach(name: str, end: float, seen: float) -> None:
    if end <= np.pi / 2 and seen > np.pi / 2 + BEYOND:
        raise CalibrationError(
            f"{name} lenses end at 90 degrees from the axis; points were seen at "
            f"{np.degrees(seen):.1f}"
        )


def _spline_like(lens: Lens, theta_max: float) -> RadialSpline:
    degrees = np.degrees(theta_max)
    knots = np.linspace(0, degrees, max(4, round(degrees / KNOT_EVERY_DEG)) + 1)[1:]
    radii = lens.radius(np.radians(knots))
    return RadialSpline(tuple(map(float, knots)), tuple(map(float, radii)))


def _check_growth(lens: Lens, seen: float) -> None:
    if lens.hard_limit < seen * 0.999:
        raise CalibrationError(
            f"it ends at {np.degrees(lens.hard_limit):.1f} degrees from the axis; points were seen "
            f"at {np.degrees(seen):.1f}"
        )
    limit = growth_limit(lens, seen)
    if limit < seen * 0.999:
        raise CalibrationError(
            f"its radius stops growing at {np.degrees(limit):.1f} degrees, where points were seen"
        )
