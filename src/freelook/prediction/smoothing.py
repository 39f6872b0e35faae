"""Smoothing that depends on speed: steady while the head rests, no lag while it turns.

A first-order low-pass on rotations whose cut-off frequency rises with the speed of the head, which
is the idea of the One Euro filter (Casiez, Roussel, Vogel, CHI 2012). There it rises linearly,
and the angle by which the output is late,

    speed / (2 pi cut-off),

tends to a constant other than zero; here it rises with the square of the speed, and the angle goes
back to zero as the head turns faster.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S
from ..rotations import slerp


@dataclass(frozen=True)
class SmoothingSettings:
    """still_hz    cut-off while the head rests
    knee_deg_s  speed at which the cut-off has doubled"""

    still_hz: float = 1.0
    knee_deg_s: float = 1.5

    def cutoff_hz(self, speed_deg_s: float) -> float:
        return self.still_hz * (1.0 + (speed_deg_s / self.knee_deg_s) ** 2)


class SpeedAdaptiveFilter:
    """Rotations in, smoother rotations out. Who calls it says how fast the head turns."""

    def __init__(self, settings: SmoothingSettings | None = None) -> None:
        self.settings = SmoothingSettings() if settings is None else settings
        self._smooth: Rotation | None = None
        self._t_ns = 0
        self._lag_s = 0.0

    @property
    def lag_s(self) -> float:
        """How late the newest output is on a head that turns on at its present speed."""
        return self._lag_s

    def reset(self) -> None:
        self._smooth = None
        self._lag_s = 0.0

    def push(self, rotation: Rotation, t_ns: int, speed_deg_s: float) -> Rotation:
        """The smoothed rotation at `t_ns`, which must be later than the last one (ValueError).

        The first rotation, and the first after `reset`, comes back as it is.
        """
        if self._smooth is None:
            self._smooth, self._t_ns = rotation, t_ns
            return rotation
        elapsed_s = (t_ns - self._t_ns) / NS_PER_S
        if elapsed_s <= 0:
            raise ValueError(f"time must advance, not go by {elapsed_s} s")
        cutoff_hz = self.settings.cutoff_hz(speed_deg_s)
        share = -np.expm1(-2 * np.pi * cutoff_hz * elapsed_s)
        self._lag_s = float(elapsed_s * (1.0 - share) / share)
        self._smooth, self._t_ns = slerp(self._smooth, rotation, float(share)), t_ns
        return self._smooth
