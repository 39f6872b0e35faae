"""A gently moving head that needs no hardware: what the demo shows until somebody takes over."""

from __future__ import annotations

import math
from collections.abc import Mapping

from scipy.spatial.transform import Rotation

from ..axes import AxisMap
from ..clock import NS_PER_S, Clock
from ..errors import TrackerError
from ..types import Counters
from . import number_option
from ._polled import PolledTracker

KIND = "wander"
OPTIONS = ("rate",)
AXES = AxisMap()
DEFAULT_RATE_HZ = 100.0

# (amplitude in degrees, period in seconds); the periods share no short common multiple
YAW = ((38.0, 17.0), (12.0, 7.3))
PITCH = ((10.0, 11.0), (5.0, 4.9))
ROLL = ((5.0, 13.0), (2.0, 5.9))


def open(
    argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock
) -> PolledTracker:
    """A head that looks straight ahead at first and then around."""
    if argument:
        raise TrackerError(f"it takes no argument, but was given '{argument}'")
    rate_hz = number_option(options, "rate", DEFAULT_RATE_HZ, 1, 1000)
    return PolledTracker(Wander(axes), rate_hz, clock)


def wander_deg(t_s: float) -> tuple[float, float, float]:
    """(yaw, pitch, roll) in degrees `t_s` seconds after the start; all 0 at 0."""
    yaw, pitch, roll = (
        sum(a * math.sin(2 * math.pi * t_s / period) for a, period in sines)
        for sines in (YAW, PITCH, ROLL)
    )
    return yaw, pitch, roll


class Wander:
    """`wander_deg` on the clock; it starts at the first sample."""

    message = "not started"

    def __init__(self, axes: AxisMap) -> None:
        self._axes = axes
        self._start_ns: int | None = None
        self.counters = Counters()

    def sample(self, now_ns: int) -> Rotation:
        if self._start_ns is None:
            self._start_ns = now_ns
        return self._axes.body_from_view(*wander_deg((now_ns - self._start_ns) / NS_PER_S))
