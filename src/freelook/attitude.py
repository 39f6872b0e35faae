"""The vehicle's attitude at any recent time, between the times at which it was reported.

A frame is aimed with the attitude at its capture, which lies some tens of milliseconds back:
between two reported attitudes, the vehicle is taken to turn at one rate about one axis (slerp).
"""

from __future__ import annotations

from bisect import bisect_left

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .clock import NS_PER_S
from .rotations import slerp
from .types import Attitude, Counters

_FORGOTTEN_AT_ONCE = 256  # so that forgetting costs nothing per attitude


class AttitudeBuffer:
    """The attitudes of the last `span_s` seconds, and what lies between them.

    Between two that are more than `longest_gap_s` apart nothing is known. After the newest the
    last rate is taken to go on, for `extrapolate_s`; where no rate is known (a single attitude,
    or the first after a gap) the newest is held for as long.

    `counters`: "late" attitudes (older than the newest), "repeated" (of its time) and "broken"
    (not finite) ones, all of which are ignored. Not safe between threads.
    """

    def __init__(
        self, span_s: float = 10.0, longest_gap_s: float = 0.5, extrapolate_s: float = 0.1
    ) -> None:
        if not (span_s > 0 and longest_gap_s > 0 and extrapolate_s >= 0):
            raise ValueError("span_s and longest_gap_s must be above 0, extrapolate_s 0 or above")
        self.counters = Counters()
        self._span_s = span_s
        self._gap_ns = longest_gap_s * NS_PER_S
        self._extrapolate_ns = extrapolate_s * NS_PER_S
        self._times: list[int] = []
        self._rotations: list[Rotation] = []

    @property
    def newest(self) -> Attitude | None:
        """The newest attitude, None before the first."""
        return Attitude(self._times[-1], self._rotations[-1]) if self._times else None

    def push(self, attitude: Attitude) -> None:
        """A new attitude (one rotation, not a stack of them)."""
        if self._times and attitude.t_ns <= self._times[-1]:
            self.counters.add("repeated" if attitude.t_ns == self._times[-1] else "late")
            return
        if not np.isfinite(attitude.world_from_body.as_quat()).all():
            self.counters.add("broken")
            return
        self._times.append(attitude.t_ns)
        self._rotations.append(attitude.world_from_body)
        self._forget()

    def clear(self) -> None:
        """Forget all attitudes: the source was restarted and its times may begin anew."""
        self._times.clear()
        self._rotations.clear()

    def at(self, t_ns: int) -> Rotation | None:
        """`world_from_body` at a time; None where it is not known (before the oldest, in a gap,
        long after the newest)."""
        place = bisect_left(self._times, t_ns)
        if place < len(self._times) and self._times[place] == t_ns:
            return self._rotations[place]
        if place == 0:
            return None
        if place == len(self._times):
            return self._beyond(t_ns)
        if not self._joined(place):
            return None
        start_ns, end_ns = self._times[place - 1 : place + 1]
        fraction = (t_ns - start_ns) / (end_ns - start_ns)
        return slerp(self._rotations[place - 1], self._rotations[place], fraction)

    def rate_at(self, t_ns: int) -> NDArray[np.float64] | None:
        """Body rates (3,) in rad/s about forward, right and down: those of the way that `at` goes,
        so constant between two attitudes (at an attitude, those before it; at the oldest, those
        after it). None where `at` gives None or no rate is known."""
        if self.at(t_ns) is None:
            return None
        place = min(bisect_left(self._times, t_ns), len(self._times) - 1)
        place = max(place, 1)
        return self._rate(place) if self._joined(place) else None

    def _beyond(self, t_ns: int) -> Rotation | None:
        ahead_ns = t_ns - self._times[-1]
        if ahead_ns > self._extrapolate_ns:
            return None
        last = len(self._times) - 1
        if not self._joined(last):
            return self._rotations[-1]
        turned = Rotation.from_rotvec(self._rate(last) * (ahead_ns / NS_PER_S))
        return self._rotations[-1] * turned

    def _joined(self, place: int) -> bool:
        """Whether the attitude at `place` and the one before it are near enough in time."""
        if not 1 <= place < len(self._times):
            return False
        return self._times[place] - self._times[place - 1] <= self._gap_ns

    def _rate(self, place: int) -> NDArray[np.float64]:
        turn = self._rotations[place - 1].inv() * self._rotations[place]
        elapsed_s = (self._times[place] - self._times[place - 1]) / NS_PER_S
        rate: NDArray[np.float64] = turn.as_rotvec() / elapsed_s
        return rate

    def _forget(self) -> None:
        """Drop what is too old, but never the neighbour that reaches back to the span's start."""
        oldest_ns = self._times[-1] - self._span_s * NS_PER_S
        old = bisect_left(self._times, oldest_ns) - 1
        if old >= _FORGOTTEN_AT_ONCE:
            del self._times[:old], self._rotations[:old]
