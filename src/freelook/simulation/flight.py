"""A smooth closed flight over the airfield: position and attitude as functions of time alone.

The path is a figure of eight round both ends of the runway, flown with the nose along the path
and banked as a coordinated turn asks for: tan(bank) = speed * turn rate / gravity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S

Floats = NDArray[np.float64]
GRAVITY_M_S2 = 9.81


@dataclass(frozen=True)
class State:
    """Where the vehicle is (north, east, down in metres) and how it is turned.

    `world_from_body`: body axes (forward, right, down) to north, east, down.
    """

    position: Floats
    world_from_body: Rotation


@dataclass(frozen=True)
class FigureEight:
    """One round takes `period_s`; north over the runway's middle at the start."""

    period_s: float = 72.0
    north_m: float = 330.0
    east_m: float = 210.0
    height_m: float = 62.0
    climb_m: float = 20.0

    def at(self, t_ns: int) -> State:
        """The state at a time in nanoseconds; any time, the flight never ends."""
        angle = 2 * np.pi * ((t_ns / NS_PER_S / self.period_s) % 1.0)
        velocity, acceleration = self._derivatives(angle)
        north, east, down = velocity
        level = float(np.hypot(north, east))
        turn_rate = (north * acceleration[1] - east * acceleration[0]) / level**2
        yaw = np.arctan2(east, north)
        pitch = np.arctan2(-down, level)
        roll = np.arctan(level * turn_rate / GRAVITY_M_S2)
        return State(self._position(angle), Rotation.from_euler("ZYX", [yaw, pitch, roll]))

    def _position(self, angle: float) -> Floats:
        height = self.height_m - self.climb_m * np.cos(2 * angle)
        return np.array(
            [self.north_m * np.sin(angle), self.east_m / 2 * np.sin(2 * angle), -height]
        )

    def _derivatives(self, angle: float) -> tuple[Floats, Floats]:
        """Velocity in m/s and acceleration in m/s^2."""
        rate = 2 * np.pi / self.period_s
        double = 2 * angle
        first = [
            self.north_m * np.cos(angle),
            self.east_m * np.cos(double),
            -2 * self.climb_m * np.sin(double),
        ]
        second = [
            -self.north_m * np.sin(angle),
            -2 * self.east_m * np.sin(double),
            -4 * self.climb_m * np.cos(double),
        ]
        return rate * np.array(first), rate**2 * np.array(second)


@dataclass(frozen=True)
class Hover:
    """Stands still: level, at one place, the nose at one azimuth."""

    position: tuple[float, float, float] = (0.0, 0.0, -60.0)
    azimuth_deg: float = 0.0

    def at(self, t_ns: int) -> State:
        turned = Rotation.from_euler("Z", self.azimuth_deg, degrees=True)
        return State(np.array(self.position), turned)
