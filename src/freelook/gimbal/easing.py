"""From an old aim to a new one without a jump: what is left of the old fades away.

At the moment of a change the old aim differs from the new by a rotation; that is kept, and taken
off over time: aim = (what is left) * (new aim), while the new aim goes on turning as it will.

    share gone  s(x) = 6 x^5 - 15 x^4 + 10 x^3,  x = elapsed / duration

the polynomial of lowest degree that starts and ends without speed and without acceleration (the
minimum-jerk way of Flash and Hogan, "The coordination of arm movements", J. Neuroscience 5, 1985).
It is fastest in the middle, 15/8 of its mean; the duration is chosen for that.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S

PEAK = 15 / 8
NOTHING: Rotation = Rotation.identity()
ALIKE_DEG = 1e-7
LONG_AGO_NS = -(1 << 62)


def smooth(x: float) -> float:
    """s(x); 0 before 0, 1 after 1."""
    x = min(1.0, max(0.0, x))
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


@dataclass(frozen=True)
class Blend:
    """A rotation that fades to none, from `start_ns` on, in `duration_s`; whole before."""

    leftover: Rotation = NOTHING
    start_ns: int = LONG_AGO_NS
    duration_s: float = 0.0

    @property
    def end_ns(self) -> int:
        return self.start_ns + round(self.duration_s * NS_PER_S)

    @cached_property
    def _rotvec(self) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        rotvec: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = self.leftover.as_rotvec()
        return rotvec

    def active(self, now_ns: int) -> bool:
        return now_ns < self.end_ns

    def left(self, now_ns: int) -> Rotation:
        """What is left of the rotation."""
        if not self.active(now_ns):
            return NOTHING
        if now_ns <= self.start_ns:
            return self.leftover
        elapsed_s = (now_ns - self.start_ns) / NS_PER_S
        return Rotation.from_rotvec((1.0 - smooth(elapsed_s / self.duration_s)) * self._rotvec)


def blend(
    before: Rotation, after: Rotation, now_ns: int, *, at_least_s: float, rate_deg_s: float
) -> Blend:
    """The way from `before` to `after`: the short one, in `at_least_s` seconds, or as many more as
    keep it from ever being faster than `rate_deg_s`."""
    leftover = before * after.inv()
    angle_deg = float(np.degrees(leftover.magnitude()))
    if angle_deg < ALIKE_DEG:
        return Blend(NOTHING, now_ns)
    return Blend(leftover, now_ns, max(at_least_s, PEAK * angle_deg / rate_deg_s))
