"""Fisheye lenses whose elements are decentred or tilted: round terms and some that are not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ._bent import decentring
from .base import Floats


@dataclass(frozen=True)
class ThinPrismFisheye:
    """r = f (theta + k1 theta^3 + k2 theta^5 + k3 theta^7 + k4 theta^9): and decentred.

    With (u, v) = theta (cos phi, sin phi) the offset is, in units of f,

        2 p1 u v + p2 (theta^2 + 2 u^2) + sx1 theta^2
        2 p2 u v + p1 (theta^2 + 2 v^2) + sy1 theta^2

    COLMAP's THIN_PRISM_FISHEYE (`colmap/sensor/models.h`), which itself ends at 90 degrees.
    """

    f: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    sx1: float = 0.0
    sy1: float = 0.0
    hard_limit: ClassVar[float] = np.pi

    def radius(self, theta: Floats) -> Floats:
        t2 = theta * theta
        odd = 1 + t2 * (self.k1 + t2 * (self.k2 + t2 * (self.k3 + t2 * self.k4)))
        return self.f * theta * odd

    def offset(self, theta: Floats, phi: Floats) -> Floats:
        t2 = theta * theta
        x, y = decentring(theta * np.cos(phi), theta * np.sin(phi), self.p2, self.p1)
        return self.f * np.stack([x + self.sx1 * t2, y + self.sy1 * t2], axis=-1)


@dataclass(frozen=True)
class RadTanThinPrismFisheye:
    """r = f (theta + k0 theta^3 + k1 theta^5 + ... + k5 theta^13): and decentred.

    With q = r / f and (x, y) = q (cos phi, sin phi), so after the round terms, the offset is, in
    units of f,

        2 p1 x y + p0 (q^2 + 2 x^2) + s0 q^2 + s1 q^4
        2 p0 x y + p1 (q^2 + 2 y^2) + s2 q^2 + s3 q^4

    COLMAP's RAD_TAN_THIN_PRISM_FISHEYE (`colmap/sensor/models.h`), which itself ends at 90
    degrees; Project Aria's Fisheye624.
    """

    f: float
    k0: float = 0.0
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    p0: float = 0.0
    p1: float = 0.0
    s0: float = 0.0
    s1: float = 0.0
    s2: float = 0.0
    s3: float = 0.0
    hard_limit: ClassVar[float] = np.pi

    def radius(self, theta: Floats) -> Floats:
        t2 = theta * theta
        odd = np.zeros_like(t2)
        for k in (self.k5, self.k4, self.k3, self.k2, self.k1, self.k0):
            odd = t2 * (k + odd)
        return self.f * theta * (1 + odd)

    def offset(self, theta: Floats, phi: Floats) -> Floats:
        t2 = theta * theta
        odd = np.zeros_like(t2)
        for k in (self.k5, self.k4, self.k3, self.k2, self.k1, self.k0):
            odd = t2 * (k + odd)
        q = theta * (1 + odd)
        q2 = q * q
        x, y = decentring(q * np.cos(phi), q * np.sin(phi), self.p0, self.p1)
        x, y = x + q2 * (self.s0 + q2 * self.s1), y + q2 * (self.s2 + q2 * self.s3)
        return self.f * np.stack([x, y], axis=-1)
