"""Lens models: one function each, image radius against angle from the axis.

A model is a frozen dataclass with `radius(theta)`. Its fields are, in one order, the keys of the
JSON profile, the vector a calibration solves for, and the documentation. To add one, write the
class and name it in `MODELS`; tables, renderers, browser, JSON and tests follow.

theta is the angle between ray and optical axis in radians, any shape; radius is in pixels, the
same shape, 0 on the axis. `hard_limit` is the angle at which the formula itself ends. Within
that, a lens is usable until its radius stops growing: see `growth_limit`.

Formulas: Kannala and Brandt, "A generic camera model and calibration method for conventional,
wide-angle, and fish-eye lenses", IEEE PAMI 28 (2006), for the classical five and for the odd
polynomial; Rawashdeh and Sababha, "An Image-Processing-Based Gimbal System Using Fisheye Video",
Computer Technology and Application 2 (2011), for the general polynomial.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Lens(Protocol):
    """What every lens model supplies."""

    hard_limit: ClassVar[float]

    def radius(self, theta: Floats) -> Floats: ...


@dataclass(frozen=True)
class Perspective:
    """r = f tan(theta), below 90 degrees: an ordinary, undistorted lens."""

    f: float
    hard_limit: ClassVar[float] = np.pi / 2

    def radius(self, theta: Floats) -> Floats:
        return self.f * np.tan(theta)


@dataclass(frozen=True)
class Stereographic:
    """r = 2 f tan(theta/2), below 180 degrees: keeps angles between lines."""

    f: float
    hard_limit: ClassVar[float] = np.pi

    def radius(self, theta: Floats) -> Floats:
        return 2 * self.f * np.tan(theta / 2)


@dataclass(frozen=True)
class Equidistant:
    """r = f theta, to 180 degrees: the same pixels per degree all along a radius."""

    f: float
    hard_limit: ClassVar[float] = np.pi

    def radius(self, theta: Floats) -> Floats:
        return self.f * theta


@dataclass(frozen=True)
class Equisolid:
    """r = 2 f sin(theta/2), to 180 degrees: keeps solid angles (areas)."""

    f: float
    hard_limit: ClassVar[float] = np.pi

    def radius(self, theta: Floats) -> Floats:
        return 2 * self.f * np.sin(theta / 2)


@dataclass(frozen=True)
class Orthographic:
    """r = f sin(theta), to 90 degrees, where it stops growing."""

    f: float
    hard_limit: ClassVar[float] = np.pi / 2

    def radius(self, theta: Floats) -> Floats:
        return self.f * np.sin(theta)


@dataclass(frozen=True)
class Polynomial:
    """r = a theta + b theta^2 + c theta^3 + d theta^4 + e theta^5, until it stops growing.

    The general form of the 2011 paper, in pixels and radians.
    """

    a: float
    b: float = 0.0
    c: float = 0.0
    d: float = 0.0
    e: float = 0.0
    hard_limit: ClassVar[float] = np.pi

    def radius(self, theta: Floats) -> Floats:
        return theta * (
            self.a + theta * (self.b + theta * (self.c + theta * (self.d + theta * self.e)))
        )


@dataclass(frozen=True)
class KannalaBrandt:
    """r = f (theta + k1 theta^3 + k2 theta^5 + k3 theta^7 + k4 theta^9), until it stops growing.

    The radial part of Kannala and Brandt; OpenCV's `fisheye` model with fx = f, and fy in the
    camera's `stretch`. Unlike OpenCV's functions it takes rays beyond 90 degrees.
    """

    f: float
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    hard_limit: ClassVar[float] = np.pi

    def radius(self, theta: Floats) -> Floats:
        t2 = theta * theta
        odd = 1 + t2 * (self.k1 + t2 * (self.k2 + t2 * (self.k3 + t2 * self.k4)))
        return self.f * theta * odd


MODELS: dict[str, type[Lens]] = {
    "perspective": Perspective,
    "stereographic": Stereographic,
    "equidistant": Equidistant,
    "equisolid": Equisolid,
    "orthographic": Orthographic,
    "polynomial": Polynomial,
    "kannala_brandt": KannalaBrandt,
}

T = TypeVar("T", bound=Lens)


def model_name(lens: Lens) -> str:
    """The name under which this lens's model stands in `MODELS`."""
    return next(name for name, model in MODELS.items() if type(lens) is model)


def parameters(lens: Lens) -> dict[str, float]:
    """Field name to value, in the model's order."""
    return {field.name: getattr(lens, field.name) for field in fields(lens)}  # type: ignore[arg-type]


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

    Found on a grid of 0.01 degree and then bisected. 0.0 if the radius does not grow at all.
    """
    end = min(lens.hard_limit, up_to) if up_to is not None else lens.hard_limit
    theta = np.linspace(0.0, np.nextafter(end, 0.0), max(2, int(np.degrees(end) * 100)))
    falls = np.diff(lens.radius(theta)) <= 0
    if not falls.any():
        return float(end)
    first = int(np.argmax(falls))
    low, high = theta[max(first - 1, 0)], theta[first + 1]
    for _ in range(40):
        middle = (low + high) / 2
        slope = radius_slope(lens, np.array([middle]))[0]
        low, high = (middle, high) if slope > 0 else (low, middle)
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
