"""Measured angles and positions along one radius, and the least squares over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import FitError
from ..lens import Floats, Lens, vector
from ._minimum import CLOSE, Minimum, minimise
from ._models import (
    Bools,
    free_names,
    lens_with,
    let_free,
    no_slack,
    radius_of,
    round_parameters,
    slope_slack,
)
from ._scores import log_likelihood


@dataclass(frozen=True)
class CurveData:
    """Points to fit, and how: p(theta) = offset + r(theta).

    theta, position_px, sigma_px   (n,) each; negative angles are the other side of the axis
    free_offset                    whether the offset is sought; else it is 0
    loss                           a name of `LOSSES`
    """

    theta: Floats
    position_px: Floats
    sigma_px: Floats
    free_offset: bool
    loss: str

    @property
    def theta_max(self) -> float:
        return float(np.abs(self.theta).max())

    @property
    def size_px(self) -> float:
        """How far the positions extend."""
        whole = np.ptp(self.position_px) if self.free_offset else np.abs(self.position_px).max()
        return float(whole)

    def part(self, chosen: Bools) -> CurveData:
        return replace(
            self,
            theta=self.theta[chosen],
            position_px=self.position_px[chosen],
            sigma_px=self.sigma_px[chosen],
        )


def checked(
    theta: Floats,
    position_px: Floats,
    sigma_px: Floats | float | None,
    free_offset: bool,
    loss: str,
) -> CurveData:
    """The points as arrays of one length; FitError if they are none."""
    theta = np.asarray(theta, dtype=float)
    position_px = np.asarray(position_px, dtype=float)
    sigma = np.broadcast_to(np.asarray(1.0 if sigma_px is None else sigma_px, float), theta.shape)
    if theta.ndim != 1 or position_px.shape != theta.shape:
        raise FitError(
            f"angles and radii must be two rows of one length, not of shapes {theta.shape} and "
            f"{position_px.shape}"
        )
    if not all(np.isfinite(values).all() for values in (theta, position_px, sigma)):
        raise FitError("angles, radii and their uncertainties must be finite numbers")
    if not (sigma > 0).all():
        raise FitError("the uncertainty of every radius must be above 0")
    if theta.size == 0 or np.abs(theta).max() > np.pi or np.abs(theta).max() <= 0:
        raise FitError("angles are radians from the axis, some of them not 0, none beyond pi")
    data = CurveData(theta, position_px, sigma, free_offset, loss)
    if data.size_px <= 0:
        raise FitError("all radii are the same; no lens is like that")
    return data


@dataclass(frozen=True)
class CurveProblem:
    """The points and the kind of lens: what turns a parameter vector into residuals.

    The vector holds the parameters of `like` that its radius depends on, then the offset if
    it is free.
    """

    data: CurveData
    like: Lens
    free: Bools

    @classmethod
    def of(cls, data: CurveData, like: Lens, held: Sequence[str] = ()) -> CurveProblem:
        """All that changes the radius is free but what is held, by name."""
        return cls(data, like, round_parameters(like, np.abs(data.theta)) & let_free(like, held))

    @property
    def names(self) -> tuple[str, ...]:
        chosen = [name for name, free in zip(free_names(self.like), self.free, strict=True) if free]
        return (*chosen, "offset_px") if self.data.free_offset else tuple(chosen)

    def start(self, lens: Lens, offset_px: float) -> Floats:
        x = vector(lens)[self.free]
        return np.append(x, offset_px) if self.data.free_offset else x

    def lens(self, x: Floats) -> Lens | None:
        """The lens of a vector; None where there is no such lens."""
        whole = vector(self.like)
        whole[self.free] = x[: int(self.free.sum())]
        return lens_with(self.like, whole)

    def offset_px(self, x: Floats) -> float:
        return float(x[-1]) if self.data.free_offset else 0.0

    def curve(self, x: Floats, theta: Floats) -> Floats:
        """Positions of a vector's lens at angles; NaN where there is no such lens."""
        lens = self.lens(x)
        if lens is None:
            return np.full(np.shape(theta), np.nan)
        return self._through(lens, self.offset_px(x), theta)

    @staticmethod
    def _through(lens: Lens, offset_px: float, theta: Floats) -> Floats:
        with np.errstate(all="ignore"):
            return np.asarray(offset_px + radius_of(lens, np.abs(theta)) * np.sign(theta))

    def residuals_px(self, x: Floats) -> Floats:
        return self.data.position_px - self.curve(x, self.data.theta)

    def log_likelihood(self, found: Minimum) -> float:
        """ln L of a minimum, in pixels."""
        data = self.data
        floor = 1e-9 * data.size_px / float(np.median(data.sigma_px))
        scaled = self.residuals_px(found.x) / data.sigma_px
        return log_likelihood(scaled, data.loss, floor) - float(np.sum(np.log(data.sigma_px)))

    def fit(
        self,
        start: Floats,
        theta_max: float,
        *,
        scale: float | None = None,
        least_slope: float | None = None,
        effort: tuple[float, int] = CLOSE,
    ) -> Minimum:
        """The minimum from a start on.

        With a least slope, as a share of the mean, among lenses that grow so to theta_max.
        """
        data = self.data
        size = data.size_px / float(np.median(data.sigma_px))

        def rows(x: Floats) -> tuple[Floats, Floats]:
            lens = self.lens(x)
            if lens is None:
                return np.full(len(data.theta), np.nan), no_slack(least_slope)
            curve = self._through(lens, self.offset_px(x), data.theta)
            return (
                (data.position_px - curve) / data.sigma_px,
                slope_slack(lens, theta_max, least_slope),
            )

        return minimise(rows, start, size=size, loss=data.loss, scale=scale, effort=effort)
