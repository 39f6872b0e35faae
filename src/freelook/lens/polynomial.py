"""Polynomials of the angle."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from .base import FIXED, Floats


@dataclass(frozen=True)
class Polynomial:
    """r = a theta + b theta^2 + c theta^3 + d theta^4 + e theta^5, until it stops growing.

    The general form of the 2011 paper, in pixels and radians. With e = 0 it is WoodScape's
    `radial_poly` (k1 k2 k3 k4 = a b c d; Yogamani et al., "WoodScape", ICCV 2019).
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


@dataclass(frozen=True)
class KannalaBrandt9:
    """r = f (theta + k1 theta^3 + k2 theta^5 + ... + k9 theta^19), until it stops growing.

    Kannala and Brandt's odd polynomial with nine terms, for lenses whose rim bends too sharply
    for four. Trailing terms left at 0 give the shorter ones.
    """

    f: float
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    k7: float = 0.0
    k8: float = 0.0
    k9: float = 0.0
    hard_limit: ClassVar[float] = np.pi

    def radius(self, theta: Floats) -> Floats:
        t2 = theta * theta
        odd = np.zeros_like(t2)
        for k in (
            self.k9, self.k8, self.k7, self.k6, self.k5, self.k4, self.k3, self.k2, self.k1
        ):  # fmt: skip
            odd = t2 * (k + odd)
        return self.f * theta * (1 + odd)


@dataclass(frozen=True)
class Sony:
    """r = f (k0 theta + k1 theta^2 + k2 theta^3 + ... + k5 theta^6), until it stops growing.

    What Sony cameras record of their lens, and GoPro's form too, as Gyroflow uses it
    (`distortion_models/sony.rs`: theta_d = theta k0 + ...), which itself ends at 90 degrees.
    f and k0 say one thing twice, so fits leave k0 alone.
    """

    f: float
    k0: float = field(default=1.0, metadata=FIXED)
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    hard_limit: ClassVar[float] = np.pi

    def radius(self, theta: Floats) -> Floats:
        rest = theta * (self.k3 + theta * (self.k4 + theta * self.k5))
        return self.f * theta * (self.k0 + theta * (self.k1 + theta * (self.k2 + rest)))
