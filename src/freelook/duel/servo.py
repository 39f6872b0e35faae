"""A motor that follows commands: as fast and as quickly speeding up as it can, no more.

The model is a servo at its best: it knows how far it has still to go and brakes in time, it
never overshoots a command that stands still, has no load, no friction and no play. What is left
are the limits that its data sheet states.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, copysign, inf, isinf, sqrt

import numpy as np
from numpy.typing import NDArray

from ..clock import NS_PER_MS, NS_PER_S
from .stages import newest

Floats = NDArray[np.float64]
Times = NDArray[np.int64]
STEP_NS = NS_PER_MS
THERE_DEG, AT_REST_DEG_S = 1e-9, 1e-6  # rounding, not motion


@dataclass(frozen=True)
class Motor:
    """What one axis can do. `slew_deg_s` and `accel_deg_s2` may be infinite.

    `dead_band_deg`: at rest it does not answer a command nearer than this.
    """

    slew_deg_s: float = inf
    accel_deg_s2: float = inf
    dead_band_deg: float = 0.0


def drive(motor: Motor, command_ns: Times, command_deg: Floats, end_ns: int) -> Floats:
    """The angle at every millisecond from 0 to `end_ns`, in degrees.

    It begins at rest at the first command. A command counts from its time on.
    """
    steps = np.arange(end_ns // STEP_NS, dtype=np.int64) * STEP_NS
    # what comes within a step counts from its beginning: no time is lost to the steps on average
    targets = command_deg[newest(command_ns, steps + STEP_NS - 1)]
    return np.array(_follow(motor, float(command_deg[0]), targets.tolist()))


def _follow(motor: Motor, position: float, targets: list[float]) -> list[float]:
    """One position more than there are steps: the first is where it begins."""
    dt = STEP_NS / NS_PER_S
    slew, accel, dead_band = motor.slew_deg_s, motor.accel_deg_s2, motor.dead_band_deg
    gain = accel * dt  # by how much the speed can change in a step
    unlimited = isinf(accel)
    speed, moving = 0.0, False
    positions = [position]
    for target in targets:
        error = target - position
        moving = moving or abs(error) > dead_band
        if moving:
            wanted = min(slew, abs(error) / dt)
            if not unlimited:
                wanted = min(wanted, gain * _stoppable(abs(error) / (gain * dt)))
            change = copysign(wanted, error) - speed
            speed += change if unlimited else min(max(change, -gain), gain)
            position += speed * dt
            moving = abs(speed) > AT_REST_DEG_S or abs(target - position) > THERE_DEG
            speed = speed if moving else 0.0
        positions.append(position)
    return positions


def _stoppable(distance: float) -> float:
    """The fastest speed from which, slowing down by 1 each step, one stops after `distance` > 0.

    From speed u in n = ceil(u) steps: u + (u - 1) + ... = n u - n (n - 1) / 2.
    """
    count = max(1, ceil(sqrt(0.25 + 2 * distance) - 0.5))
    return distance / count + (count - 1) / 2


def angle_at(positions_deg: Floats, t_ns: Times) -> Floats:
    """The angle between the milliseconds of `drive`, in degrees; the last after the end."""
    return np.interp(t_ns / STEP_NS, np.arange(len(positions_deg)), positions_deg)
