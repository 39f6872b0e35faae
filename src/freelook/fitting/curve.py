"""A lens's curve from measured angles and radii, with what is known about its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from ..errors import FitError
from ..lens import MODELS, Floats, Lens, vector
from ._curve_data import CurveData, CurveProblem, checked
from ._grown import HELD_SLOPES, grown
from ._minimum import FAIR, ROUGH, Minimum, spread
from ._models import check_end, check_growth, known_model, radius_of
from ._scores import Scored
from ._starts import starting_curves

# With more points than this, ten groups are left out in turn instead of single points.
MOST_SINGLE = 40

AnyFit = TypeVar("AnyFit", bound=Scored)


# Models that say nothing new about a curve: a surface, and one whose round part is another model.
NOT_CURVES = {
    "splined_stereographic": "it is a surface of corrections: take radial_spline",
    "thin_prism_fisheye": "its round part is kannala_brandt: take that",
}


def curve_models() -> list[str]:
    """Names of the models that can be fitted to a curve."""
    return [name for name in MODELS if name not in NOT_CURVES]


@dataclass(frozen=True)
class CurveFit(Scored):
    """A lens fitted to p(theta) = offset + r(theta).

    model         its name in `MODELS`
    lens          the lens; parameters that do not change its radius are at their defaults
    offset_px     where the axis is on the scale of the measured positions; 0 if not asked for
    names         the fitted parameters, `offset_px` last if it is one of them; those of lists
                  are numbered, as in radii_px[0]; `values`, `sigma`, `covariance` in that order
    residuals_px  (n,) measured minus fitted, in the order given
    theta_max     the largest angle measured, radians
    """

    model: str
    lens: Lens
    offset_px: float
    names: tuple[str, ...]
    residuals_px: Floats
    theta_max: float
    _problem: CurveProblem = field(repr=False)
    _minimum: Minimum = field(repr=False)

    @property
    def noise_px(self) -> float:
        """The standard deviation of most residuals; outliers do not count."""
        return spread(self.residuals_px, len(self.names))

    def __call__(self, theta: Floats) -> Floats:
        """The fitted position at angles in radians (negative: the other side), pixels."""
        theta = np.asarray(theta, dtype=float)
        return np.asarray(self.offset_px + radius_of(self.lens, np.abs(theta)) * np.sign(theta))

    def band(self, theta: Floats) -> Floats:
        """Standard deviation of the fitted curve at angles in radians, pixels.

        It follows from the covariance: right for a model that is right. It says nothing about
        how wrong a wrong model is.
        """
        theta = np.asarray(theta, dtype=float)
        x, steps = self._minimum.x, np.diag(self._minimum.step)
        curve = self._problem.curve
        ahead = np.stack([curve(x + step, theta) for step in steps], axis=-1)
        behind = np.stack([curve(x - step, theta) for step in steps], axis=-1)
        slopes = (ahead - behind) / (2 * self._minimum.step)
        variance = np.einsum("...i,ij,...j->...", slopes, self.covariance, slopes)
        return np.asarray(np.sqrt(np.maximum(variance, 0)))

    @cached_property
    def cv_residuals_px(self) -> Floats:
        """(n,) how far each point is from a fit that has not seen it.

        Up to 40 points are left out one by one, more in ten interleaved groups. Takes as many
        fits.
        """
        data, n = self._problem.data, len(self.residuals_px)
        order = np.argsort(np.abs(data.theta), kind="stable")
        groups = n if n <= MOST_SINGLE else 10
        residuals = np.empty(n)
        for group in range(groups):
            out = np.zeros(n, bool)
            out[order[group::groups]] = True
            seen = replace(self._problem, data=data.part(~out))
            found = seen.fit(
                self._minimum.x,
                self.theta_max,
                scale=self._minimum.scale,
                least_slope=HELD_SLOPES[-2] if self.forced else None,
                effort=FAIR,
            )
            residuals[out] = replace(seen, data=data.part(out)).residuals_px(found.x)
        return residuals

    @property
    def measured(self) -> tuple[Floats, Floats]:
        """(theta in radians, position in pixels) of the points, in the order given."""
        return self._problem.data.theta, self._problem.data.position_px

    @property
    def radial_residuals_px(self) -> Floats:
        """(n,) measured minus fitted, away from the axis."""
        return self.residuals_px

    @property
    def _size_px(self) -> float:
        return self._problem.data.size_px

    @cached_property
    def _log_likelihood(self) -> float:
        return self._problem.log_likelihood(self._minimum)


def fit_curve(
    model: str,
    theta: Floats,
    radius_px: Floats,
    *,
    sigma_px: Floats | float | None = None,
    free_offset: bool = False,
    loss: str = "soft_l1",
) -> CurveFit:
    """The lens of a model that comes closest to measured radii.

    theta        (n,) angles from the axis, radians; negative ones are the other side of the axis,
                 where radii are negative too
    radius_px    (n,) distances from the axis, pixels; with `free_offset` positions on any scale
                 that grows with the angle
    sigma_px     (n,) or one: how uncertain the radii are compared with each other; the size of
                 the noise is always taken from the residuals
    free_offset  seek the position of the axis too
    loss         "soft_l1" or "cauchy" against outliers, "linear" for plain least squares

    A lens whose radius does not grow all the way to the largest angle is never returned: the fit
    is held to those that grow (`forced` tells), and FitError is raised where that does not help,
    where the model ends before the data do, and for too few or impossible points.
    """
    known_model(model)
    if model in NOT_CURVES:
        raise FitError(f"{model} cannot be fitted to a curve; {NOT_CURVES[model]}")
    data = checked(theta, radius_px, sigma_px, free_offset, loss)
    check_end(model, data.theta_max)
    problem, found = best_curve(model, data)
    lens = problem.lens(found.x)
    if lens is None:
        raise FitError(f"{model} does not fit these points: no lens comes near them")
    check_growth(lens, data.theta_max, model)
    return CurveFit(
        model=model,
        lens=lens,
        offset_px=problem.offset_px(found.x),
        names=problem.names,
        residuals_px=problem.residuals_px(found.x),
        theta_max=data.theta_max,
        _problem=problem,
        _minimum=found,
    )


def best_curve(
    model: str, data: CurveData, *, fine_knots: int | None = None, held: Sequence[str] = ()
) -> tuple[CurveProblem, Minimum]:
    """The deepest minimum found, held to growing lenses if need be and if that helps.

    fine_knots  without noise: so many knots, or terms, of models that have as many as one likes
    held        parameters that stay at their defaults
    """
    starts = [
        (CurveProblem.of(data, lens, held), offset)
        for lens, offset in starting_curves(model, data, fine_knots, held)
    ]
    p, n = len(starts[0][0].names), len(data.theta)
    if n <= p:
        raise FitError(f"{model} has {p} parameters here; it needs {p + 1} points, not {n}")
    starts += _simpler(*starts[0])
    ends = [(problem, _rough(problem, offset)) for problem, offset in starts]
    problem, found = max(ends, key=lambda end: end[0].log_likelihood(end[1]))

    def fit(x: Floats, least_slope: float | None) -> Minimum:
        return problem.fit(x, data.theta_max, least_slope=least_slope)

    return problem, grown(fit, problem.lens, found.x, data.theta_max)


def _rough(problem: CurveProblem, offset_px: float) -> Minimum:
    start = problem.start(problem.like, offset_px)
    least_slope = HELD_SLOPES[0]  # a valley of lenses that grow
    return problem.fit(start, problem.data.theta_max, least_slope=least_slope, effort=ROUGH)


def _simpler(problem: CurveProblem, offset: float) -> list[tuple[CurveProblem, float]]:
    """A start where the correcting terms, those that are 0 by default, are 0 and the rest fits.

    A model's simple kinds are found exactly from there, along no valley at all.
    """
    main = problem.free & (vector(problem.like) != 0)
    if main.sum() == problem.free.sum():
        return []
    simple = replace(problem, free=main)
    found = simple.fit(simple.start(problem.like, offset), problem.data.theta_max)
    lens = simple.lens(found.x)
    if lens is None:
        return []
    return [(replace(problem, like=lens), simple.offset_px(found.x))]


def rank(fits: Sequence[AnyFit]) -> list[AnyFit]:
    """Best first, by AICc; they must be fits of the same points with the same loss.

    Two whose AICc differ by less than 2 cannot be told apart by these data (Burnham and Anderson,
    Model Selection and Multimodel Inference, 2002, section 2.6).
    """
    if len({(len(fit.residuals_px), fit._minimum.loss) for fit in fits}) > 1:
        raise FitError("only fits of the same points, with the same loss, can be ranked")
    return sorted(fits, key=lambda fit: (fit.aicc, len(fit.names)))
