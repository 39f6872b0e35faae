"""What every lens model supplies, and what follows from it for all of them alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from functools import cache
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Lens(Protocol):
    """A round lens: image radius in pixels against angle from the optical axis.

    radius      theta in radians, any shape, in [0, hard_limit); the result has the same shape and
                is 0 on the axis. Beyond the hard limit it may be anything, NaN and errors too.
    hard_limit  the angle at which the formula itself ends, radians. Within that, a lens is usable
                until its radius stops growing: see `growth_limit`.
    """

    @property
    def hard_limit(self) -> float: ...

    def radius(self, theta: Floats) -> Floats: ...


@runtime_checkable
class BentLens(Lens, Protocol):
    """A lens with terms that are not round: tangential, thin prism, free form.

    offset      how far, in pixels, (x right, y down), a ray lands beside the round image's point
                radius(theta) * (cos phi, sin phi). theta as above; phi is the direction around the
                axis from x to y, radians, same shape as theta; the result has one axis of 2 more.
    """

    def offset(self, theta: Floats, phi: Floats) -> Floats: ...


T = TypeVar("T", bound=Lens)


def parameters(lens: Lens) -> dict[str, float | tuple[float, ...]]:
    """Field name to value, in the model's order."""
    return {f.name: getattr(lens, f.name) for f in fields(lens)}  # type: ignore[arg-type]


# `field(metadata=FIXED)` marks a parameter that says how a lens is described, such as the places
# of a spline's knots. No fit changes it.
FIXED = {"fixed": True}


def vector(lens: Lens) -> Floats:
    """What a fit may change, in one row: the parameters that are not fixed, lists spread out."""
    return np.hstack([getattr(lens, name) for name in free_fields(type(lens))]).astype(float)


def with_vector(lens: T, values: Sequence[float] | Floats) -> T:
    """The same model with other parameters; the reverse of `vector`."""
    left, changed = np.asarray(values, np.float64).tolist(), {}
    for name in free_fields(type(lens)):
        old = getattr(lens, name)
        count = len(old) if isinstance(old, tuple) else 1
        taken, left = left[:count], left[count:]
        changed[name] = tuple(taken) if isinstance(old, tuple) else taken[0]
    return replace(lens, **changed)  # type: ignore[type-var]


@cache
def free_fields(model: type[Lens]) -> tuple[str, ...]:
    """Names of the parameters that a fit may change, in the model's order."""
    return tuple(f.name for f in fields(model) if not f.metadata.get("fixed"))  # type: ignore[arg-type]


def image_point(lens: Lens, theta: Floats, phi: Floats) -> Floats:
    """Where a ray lands, in pixels from the axis, (..., 2): the round part and the offset."""
    radius = lens.radius(theta)
    point = np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=-1)
    return point + lens.offset(theta, phi) if isinstance(lens, BentLens) else point


def radius_slope(lens: Lens, theta: Floats) -> Floats:
    """dr/dtheta in pixels per radian, by central differences, good to about 1e-7 relative.

    One-sided within 1e-5 rad of 0 and of the model's hard limit.
    """
    step = 1e-5
    last = np.nextafter(lens.hard_limit, 0.0)
    low = np.clip(theta - step, 0.0, last)
    high = np.clip(theta + step, 0.0, last)
    return (lens.radius(high) - lens.radius(low)) / (high - low)


def growth_limit(lens: Lens, up_to: float | None = None) -> float:
    """The angle in radians, at most `up_to` or the hard limit, where r(theta) stops growing.

    Found on a grid of 0.01 degree and then bisected. 0.0 if the radius does not grow at all, or
    is no number: impossible parameters are found here.
    """
    end = min(lens.hard_limit, up_to) if up_to is not None else lens.hard_limit
    if not end > 0:
        return 0.0
    theta = np.linspace(0.0, np.nextafter(end, 0.0), max(2, int(np.degrees(end) * 100)))
    with np.errstate(all="ignore"):
        grows = np.diff(lens.radius(theta)) > 0
        if grows.all():
            return float(end)
        first = int(np.argmin(grows))
        low, high = theta[max(first - 1, 0)], theta[first + 1]
        start = lens.radius(np.array([low]))[0]
        for _ in range(40):
            middle = np.array([(low + high) / 2])
            # behind a pole it grows too, but from below
            further = radius_slope(lens, middle)[0] > 0 and lens.radius(middle)[0] >= start
            low, high = (middle[0], high) if further else (low, middle[0])
    return float(low) if low > 1e-9 else 0.0


def angle_at_radius(lens: Lens, radius_px: Floats, theta_max: float) -> Floats:
    """The inverse of `lens.radius` on [0, theta_max], in radians; NaN beyond r(theta_max).

    Bracketed on a grid and refined by secant steps: a round trip closes to 1e-8 px, except at a
    rim where the radius stops growing, where no inverse can, and in the last degree before one
    where it is infinite.
    """
    grid = np.linspace(0.0, theta_max, 2049)
    grid_radius = lens.radius(grid)
    radius_px = np.asarray(radius_px, dtype=np.float64)
    cell = np.clip(np.searchsorted(grid_radius, radius_px) - 1, 0, len(grid) - 2)
    low, high = grid[cell], grid[cell + 1]
    r_low, r_high = grid_radius[cell], grid_radius[cell + 1]
    theta = low + (high - low) * np.clip((radius_px - r_low) / (r_high - r_low), 0.0, 1.0)
    for _ in range(6):  # false position; each step multiplies the error by about 1e-4
        r_theta = lens.radius(theta)
        above = r_theta > radius_px
        high, r_high = np.where(above, theta, high), np.where(above, r_theta, r_high)
        low, r_low = np.where(above, low, theta), np.where(above, r_low, r_theta)
        span = r_high - r_low
        step = np.divide(radius_px - r_low, span, out=np.zeros_like(span), where=span > 0)
        theta = low + (high - low) * np.clip(step, 0.0, 1.0)
    theta = np.asarray(theta)
    theta[radius_px > grid_radius[-1] * (1 + 1e-12)] = np.nan
    return theta
