"""The five classical projections.

Formulas: Kannala and Brandt, "A generic camera model and calibration method for conventional,
wide-angle, and fish-eye lenses", IEEE PAMI 28 (2006), equations 1 to 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .base import Floats


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
