"""Poses written down in a CSV file (`freelook.pose_script`), played from the start.

`script:poses.csv?loop=1&rate=100`: interpolated `rate` times a second; without `loop` the tracker
ends with the script.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from scipy.spatial.transform import Rotation

from ..axes import AxisMap
from ..clock import Clock
from ..errors import TrackerError
from ..pose_script import PoseScript, read_script
from ..types import Counters
from . import flag_option, number_option
from ._polled import PolledTracker

KIND = "script"
OPTIONS = ("loop", "rate")
AXES = AxisMap()
DEFAULT_RATE_HZ = 100.0


def open(
    argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock
) -> PolledTracker:
    """Read the script now, play it when poses are asked for. TrackerError says what is wrong."""
    loop = flag_option(options, "loop")
    rate_hz = number_option(options, "rate", DEFAULT_RATE_HZ, 1, 1000)
    if not argument:
        raise TrackerError("which script? write script:poses.csv")
    script = read_script(os.path.expanduser(argument), axes)
    return PolledTracker(Player(script, loop=loop), rate_hz, clock)


class Player:
    """A script on the clock; it starts at the first sample."""

    def __init__(self, script: PoseScript, *, loop: bool) -> None:
        self._script = script
        self._loop = loop
        self._start_ns: int | None = None
        self._ended = False
        self.counters = Counters()

    @property
    def message(self) -> str:
        return "the script has ended" if self._ended else "the script has not started"

    def sample(self, now_ns: int) -> Rotation | None:
        if self._start_ns is None:
            self._start_ns = now_ns
        if self._ended:
            raise StopIteration
        t_ns = now_ns - self._start_ns
        if self._loop:
            t_ns %= max(self._script.duration_ns, 1)
        self._ended = not self._loop and t_ns >= self._script.duration_ns
        return self._script.pose_at(t_ns)
