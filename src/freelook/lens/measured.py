"""Lenses described by a curve through what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ProfileError
from ._roots import first_zero
from .base import FIXED, Floats

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# In units of f: farther out a Taylor lens is not looked at. tan(theta) = 10000 is 89.994 degrees.
FARTHEST = 1e4
MOST_TERMS = 16


@dataclass(frozen=True)
class OCamCalib:
    """theta = atan2(q, 1 + t2 q^2 + t3 q^3 + ...), q = r / f, until theta stops growing with r.

    Scaramuzza, Martinelli and Siegwart, "A Flexible Technique for Accurate Omnidirectional Camera
    Calibration", ICVS 2006, without its unit: their z = a0 + a2 rho^2 + a3 rho^3 + ... is
    f = |a0| and t_k = a_k a0^(k-1), see `from_coefficients` and `coefficients`. `taylor` is
    (t2, t3, ...), as many as there are; the default is near the equidistant lens. The radius is
    the inverse of that to 1e-12, not OCamCalib's own fitted inverse polynomial. OCamCalib's affine
    part (c, d, e) is the camera's `stretch`.
    """

    f: float
    taylor: tuple[float, ...] = (-1 / 3, 0.0, -1 / 45)

    def __post_init__(self) -> None:
        if not isinstance(self.taylor, tuple) or not 1 <= len(self.taylor) <= MOST_TERMS:
            raise ProfileError(
                f"taylor of an OCamCalib lens must be a list of 1 to {MOST_TERMS} numbers, "
                f"not {self.taylor!r:.80}"
            )

    @classmethod
    def from_coefficients(cls, a: Sequence[float]) -> OCamCalib:
        """From a0, a1, a2, ... in pixels, of either sign of a0 (OCamCalib's own is negative).

        ProfileError if a0 is 0, a1 is not, or the others are out of all proportion.
        """
        if len(a) < 3 or a[0] == 0 or a[1] != 0:
            raise ProfileError(f"a Taylor polynomial a0, a1 = 0, a2, ... is needed, not {list(a)}")
        with np.errstate(all="ignore"):
            taylor = np.sign(a[0]) * np.array(a[2:]) * np.abs(a[0]) ** np.arange(1.0, len(a) - 1)
        if not np.isfinite(taylor).all():
            raise ProfileError(f"no lens has a Taylor polynomial {list(a)}")
        return cls(abs(a[0]), tuple(taylor.tolist()))

    @property
    def coefficients(self) -> tuple[float, ...]:
        """a0, 0, a2, a3, ... in pixels, a0 = f."""
        return (self.f, 0.0, *(t / self.f ** (k + 1) for k, t in enumerate(self.taylor)))

    @cached_property
    def hard_limit(self) -> float:
        return float(self._table[1][-1])

    def radius(self, theta: Floats) -> Floats:
        q, angle = self._table
        cell = np.clip(np.searchsorted(angle, theta), 1, len(q) - 1)
        low, high, x = q[cell - 1], q[cell], np.interp(theta, angle, q)
        for _ in range(60):  # Newton's method takes 3; halving steps in where it strays
            error = _angle(x, self.taylor) - theta
            low, high = np.where(error <= 0, x, low), np.where(error >= 0, x, high)
            slope = _slope(x, self.taylor)
            step = np.divide(error, slope, out=np.full_like(x, np.inf), where=slope > 0)
            inside = (x - step > low) & (x - step < high)
            before, x = x, np.where(inside, x - step, (low + high) / 2)
            if (np.abs(x - before) <= 1e-14 * x).all():
                break
        return self.f * x

    @cached_property
    def _table(self) -> tuple[Floats, Floats]:
        """(q, theta) as far as both grow together, to start from."""
        # theta grows while z - q dz/dq = 1 - t2 q^2 - 2 t3 q^3 - ... is above 0
        turn = first_zero(0.0, *(-(k + 1) * t for k, t in enumerate(self.taylor)))
        if np.isnan(turn):
            return np.zeros(2), np.zeros(2)
        q = np.tan(np.linspace(0.0, np.arctan(min(turn, FARTHEST)), 513))
        angle = _angle(q, self.taylor)
        falls = np.diff(angle) <= 0
        end = int(np.argmax(falls)) + 1 if falls.any() else len(q)
        return (q[:end], angle[:end]) if end > 1 else (np.zeros(2), np.zeros(2))


def _depth(q: Floats, taylor: Sequence[float]) -> Floats:
    z = np.zeros_like(q)
    with np.errstate(under="ignore"):  # a term that small is none
        for t in reversed(taylor):
            z = q * (z + t)
        return np.asarray(1 + q * z)


def _angle(q: Floats, taylor: Sequence[float]) -> Floats:
    return np.asarray(np.arctan2(q, _depth(q, taylor)))


def _slope(q: Floats, taylor: Sequence[float]) -> Floats:
    """d theta / d q = (z - q dz/dq) / (z^2 + q^2)."""
    z = _depth(q, taylor)
    turning = _depth(q, [-(k + 1) * t for k, t in enumerate(taylor)])
    return np.asarray(turning / (z * z + q * q))


@dataclass(frozen=True)
class RadialSpline:
    """A cubic spline through the points (angles_deg, radii_px): what was measured, joined up.

    Twice continuously differentiable, 0 on the axis and odd there, so smooth across it; at the
    last point the last two pieces are one cubic. It ends at the last angle: nothing is known
    beyond. A point at angle 0 may be left out. The projection of ONVIF's lens description is such
    a list of angles and radii.
    """

    angles_deg: tuple[float, ...] = field(metadata=FIXED)
    radii_px: tuple[float, ...]

    def __post_init__(self) -> None:
        angles, radii = self.angles_deg, self.radii_px
        if not isinstance(angles, tuple) or not isinstance(radii, tuple):
            raise ProfileError("angles_deg and radii_px of a radial spline must be lists")
        if len(angles) != len(radii) or len(angles) < 2:
            raise ProfileError(
                f"a radial spline needs as many angles as radii, at least 2, "
                f"not {len(angles)} and {len(radii)}"
            )
        if not (angles[0] >= 0 and angles[-1] <= 180 and (np.diff(angles) > 1e-6).all()):
            raise ProfileError(
                f"angles_deg of a radial spline must grow from 0 to at most 180, not {angles}"
            )
        if angles[0] == 0 and radii[0] != 0:
            raise ProfileError(f"a radial spline is 0 at 0 degrees, not {radii[0]} px")

    @cached_property
    def hard_limit(self) -> float:
        return float(np.radians(self.angles_deg[-1]))

    def radius(self, theta: Floats) -> Floats:
        return np.asarray(self._spline(theta))

    @cached_property
    def _spline(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline

        first = 1 if self.angles_deg[0] == 0 else 0
        theta = np.radians(self.angles_deg[first:])
        radius = np.array(self.radii_px[first:])
        return CubicSpline(
            np.concatenate([-theta[::-1], [0.0], theta]),
            np.concatenate([-radius[::-1], [0.0], radius]),
        )
