"""Polynomials of the angle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .base import Floats


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
