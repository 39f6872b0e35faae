"""Models that project onto one or two spheres first: a few parameters, fields beyond 180 degrees.

Where each ends follows from its parameters: either the radius becomes infinite there, or it stops
growing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ._bent import decentring
from .base import Floats


@dataclass(frozen=True)
class DoubleSphere:
    """r = f s / (alpha hypot(s, z) + (1 - alpha) z), s = sin(theta), z = xi + cos(theta).

    Usenko, Demmel and Cremers, "The Double Sphere Camera Model", 3DV 2018, equations 40 to 46;
    Kalibr's `ds`, Basalt's `ds`. xi is in (-1, 1], alpha in [0, 1].
    """

    f: float
    xi: float = -0.2
    alpha: float = 0.6

    @cached_property
    def hard_limit(self) -> float:
        """Where the ray from the second sphere's centre leaves the domain of alpha."""
        if not -1 < self.xi <= 1:
            return 0.0
        bound = np.arccos(-_share(self.alpha))
        sine, cosine = np.sin(bound), np.cos(bound)
        along = self.xi * cosine + np.sqrt(np.maximum(1 - (self.xi * sine) ** 2, 0.0))
        return float(np.arctan2(along * sine, along * cosine - self.xi))

    def radius(self, theta: Floats) -> Floats:
        sine, depth = np.sin(theta), self.xi + np.cos(theta)
        return self.f * sine / (self.alpha * np.hypot(sine, depth) + (1 - self.alpha) * depth)


@dataclass(frozen=True)
class ExtendedUnified:
    """r = f s / (alpha sqrt(beta s^2 + c^2) + (1 - alpha) c), s = sin(theta), c = cos(theta).

    Khomutenko, Garcia and Martinet, "An Enhanced Unified Camera Model", IEEE RA-L 2016; domain as
    in Usenko et al. 2018, equations 28 to 31. Kalibr's `eucm`, COLMAP's EUCM (which itself ends at
    90 degrees). alpha is in [0, 1], beta above 0; beta = 1 is the unified model (Basalt's `ucm`).
    """

    f: float
    alpha: float = 0.5
    beta: float = 1.0

    @cached_property
    def hard_limit(self) -> float:
        """Where cos(theta) = -w sqrt(beta s^2 + c^2)."""
        if not self.beta > 0:
            return 0.0
        w = _share(self.alpha)
        return float(np.arctan2(np.sqrt(1 - w * w), -w * np.sqrt(self.beta)))

    def radius(self, theta: Floats) -> Floats:
        sine, cosine = np.sin(theta), np.cos(theta)
        d = np.sqrt(self.beta * sine * sine + cosine * cosine)
        return self.f * sine / (self.alpha * d + (1 - self.alpha) * cosine)


def _share(alpha: float) -> float:
    """w of Usenko et al.: at cos = -w the radius is infinite (alpha <= 1/2) or turns back."""
    if not np.isfinite(alpha):
        return -1.0
    return alpha / (1 - alpha) if alpha <= 0.5 else (1 - alpha) / alpha


@dataclass(frozen=True)
class Mei:
    """r = f (m + k1 m^3 + k2 m^5 + k3 m^7), m = sin(theta) / (xi + cos(theta)): and decentred.

    With (x, y) = m (cos phi, sin phi) the offset is, in units of f,

        2 p1 x y + p2 (m^2 + 2 x^2)
        2 p2 x y + p1 (m^2 + 2 y^2)

    Mei and Rives, "Single View Point Omnidirectional Camera Calibration from Planar Grids", ICRA
    2007; the sphere is Barreto's and Geyer's. OpenCV's `omnidir` and Kalibr's `omni-radtan` (both
    without k3), Gyroflow's `insta360`. xi is above -1.
    """

    f: float
    xi: float = 1.0
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    p1: float = 0.0
    p2: float = 0.0

    @cached_property
    def hard_limit(self) -> float:
        """Where m is infinite (xi <= 1) or stops growing (xi > 1)."""
        if not self.xi > -1:
            return 0.0
        return float(np.arccos(-self.xi if self.xi <= 1 else -1 / self.xi))

    def _plane(self, theta: Floats) -> Floats:
        return np.asarray(np.sin(theta) / (self.xi + np.cos(theta)))

    def radius(self, theta: Floats) -> Floats:
        m = self._plane(theta)
        m2 = m * m
        return self.f * m * (1 + m2 * (self.k1 + m2 * (self.k2 + m2 * self.k3)))

    def offset(self, theta: Floats, phi: Floats) -> Floats:
        m = self._plane(theta)
        offset = decentring(m * np.cos(phi), m * np.sin(phi), self.p2, self.p1)
        return self.f * np.stack(offset, axis=-1)
