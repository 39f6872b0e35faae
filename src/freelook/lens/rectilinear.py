"""Lenses described by what they do to a straight picture: a function of tan(theta)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ._bent import decentring
from ._roots import first_zero
from .base import Floats


@dataclass(frozen=True)
class Poly3:
    """r = f (t + k1 t^3), t = tan(theta), below 90 degrees.

    lensfun's `poly3` with its coefficient scaled to units of f, as Gyroflow uses it
    (`distortion_models/poly3.rs`).
    """

    f: float
    k1: float = 0.0
    hard_limit: ClassVar[float] = np.pi / 2

    def radius(self, theta: Floats) -> Floats:
        t = np.tan(theta)
        return self.f * t * (1 + self.k1 * t * t)


@dataclass(frozen=True)
class Poly5:
    """r = f (t + k1 t^3 + k2 t^5), t = tan(theta), below 90 degrees.

    lensfun's `poly5` with its coefficients scaled to units of f, as Gyroflow uses it
    (`distortion_models/poly5.rs`).
    """

    f: float
    k1: float = 0.0
    k2: float = 0.0
    hard_limit: ClassVar[float] = np.pi / 2

    def radius(self, theta: Floats) -> Floats:
        t = np.tan(theta)
        t2 = t * t
        return self.f * t * (1 + t2 * (self.k1 + t2 * self.k2))


@dataclass(frozen=True)
class PTLens:
    """r = f (t + c t^2 + b t^3 + a t^4), t = tan(theta), below 90 degrees.

    lensfun's `ptlens` (Panorama Tools' a, b, c) with its coefficients scaled to units of f, as
    Gyroflow uses it (`distortion_models/ptlens.rs`; k = a, b, c).
    """

    f: float
    a: float = 0.0
    b: float = 0.0
    c: float = 0.0
    hard_limit: ClassVar[float] = np.pi / 2

    def radius(self, theta: Floats) -> Floats:
        t = np.tan(theta)
        return self.f * t * (1 + t * (self.c + t * (self.b + t * self.a)))


@dataclass(frozen=True)
class FieldOfView:
    """r = f atan(2 tan(theta) tan(w/2)) / w, to 180 degrees: w is the lens's ideal full field.

    Devernay and Faugeras, "Straight lines have to be straight", Machine Vision and Applications 13
    (2001); COLMAP's FOV and Kalibr's `fov`, which themselves end at 90 degrees: beyond, the arc
    tangent goes on growing here. w is in radians, between 0 and pi.
    """

    f: float
    w: float = 1.0

    @cached_property
    def hard_limit(self) -> float:
        return float(np.pi) if 0 < self.w < np.pi else 0.0

    def radius(self, theta: Floats) -> Floats:
        return self.f * np.arctan2(2 * np.tan(self.w / 2) * np.sin(theta), np.cos(theta)) / self.w


@dataclass(frozen=True)
class OpenCVRational:
    """r = f t (1 + k1 t^2 + k2 t^4 + k3 t^6) / (1 + k4 t^2 + k5 t^4 + k6 t^6), t = tan(theta).

    And decentred: with (x, y) = t (cos phi, sin phi) these are added, in units of f,

        2 p1 x y + p2 (t^2 + 2 x^2) + s1 t^2 + s2 t^4
        2 p2 x y + p1 (t^2 + 2 y^2) + s3 t^2 + s4 t^4

    and then the sensor is tilted about x by tau_x and about y by tau_y, radians. OpenCV's ordinary
    model ("Camera Calibration and 3D Reconstruction"), parameters in its order; with k4 and all
    behind it 0 it is the plumb-bob model. It ends where the denominator first becomes 0, at
    90 degrees at the latest.
    """

    f: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    k5: float = 0.0
    k6: float = 0.0
    s1: float = 0.0
    s2: float = 0.0
    s3: float = 0.0
    s4: float = 0.0
    tau_x: float = 0.0
    tau_y: float = 0.0

    @cached_property
    def hard_limit(self) -> float:
        return float(np.arctan(np.sqrt(first_zero(self.k4, self.k5, self.k6))))

    def _plane(self, theta: Floats) -> tuple[Floats, Floats]:
        """(tan(theta), radius in units of f)."""
        t = np.tan(theta)
        t2 = t * t
        above = 1 + t2 * (self.k1 + t2 * (self.k2 + t2 * self.k3))
        below = 1 + t2 * (self.k4 + t2 * (self.k5 + t2 * self.k6))
        return t, t * (above / below)

    def radius(self, theta: Floats) -> Floats:
        return self.f * self._plane(theta)[1]

    def offset(self, theta: Floats, phi: Floats) -> Floats:
        t, q = self._plane(theta)
        cosine, sine, t2 = np.cos(phi), np.sin(phi), t * t
        x, y = decentring(t * cosine, t * sine, self.p2, self.p1)
        x = x + t2 * (self.s1 + t2 * self.s2)
        y = y + t2 * (self.s3 + t2 * self.s4)
        if self.tau_x or self.tau_y:
            round_x, round_y = q * cosine, q * sine
            tilted = np.stack([x + round_x, y + round_y, np.ones_like(x)], axis=-1) @ self._tilt.T
            x = tilted[..., 0] / tilted[..., 2] - round_x
            y = tilted[..., 1] / tilted[..., 2] - round_y
        return self.f * np.stack([x, y], axis=-1)

    @cached_property
    def _tilt(self) -> NDArray[np.float64]:
        """The homography of a sensor turned about x, then y, that leaves the axis where it is."""
        (sx, sy), (cx, cy) = np.sin([self.tau_x, self.tau_y]), np.cos([self.tau_x, self.tau_y])
        about_x = np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
        about_y = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]])
        turn = about_y @ about_x
        back = np.array([[turn[2, 2], 0, -turn[0, 2]], [0, turn[2, 2], -turn[1, 2]], [0, 0, 1]])
        return np.asarray(back @ turn)
