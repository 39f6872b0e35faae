"""Fisheye lenses whose elements are decentred or tilted: round terms and some that are not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .base import Floats


@dataclass(frozen=True)
class ThinPrismFisheye:
    """r = f theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8), plus decentring.

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
        u, v, t2 = theta * np.cos(phi), theta * np.sin(phi), theta * theta
        x = 2 * self.p1 * u * v + self.p2 * (t2 + 2 * u * u) + self.sx1 * t2
        y = 2 * self.p2 * u * v + self.p1 * (t2 + 2 * v * v) + self.sy1 * t2
        return self.f * np.stack([x, y], axis=-1)
