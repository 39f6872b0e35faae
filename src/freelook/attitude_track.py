"""A whole record of attitudes, as arrays: for work on recordings, many times at once.

While flying there is `freelook.attitude.AttitudeBuffer`, which answers alike for one time.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .clock import NS_PER_S
from .errors import AttitudeError
from .types import Attitude

Floats = NDArray[np.float64]
Times = NDArray[np.int64]
LONGEST_GAP_S = 0.5
_TOO_FEW = "at least two attitudes in the order of time are needed; usable here: {}"


@dataclass(frozen=True)
class AttitudeTrack:
    """`world_from_body`: n rotations at `times_ns` (n,), strictly increasing; two at least."""

    times_ns: Times
    world_from_body: Rotation

    def __post_init__(self) -> None:
        if len(self.times_ns) < 2 or np.any(np.diff(self.times_ns) <= 0):
            raise AttitudeError(_TOO_FEW.format(len(self.times_ns)))

    @property
    def start_ns(self) -> int:
        return int(self.times_ns[0])

    @property
    def duration_s(self) -> float:
        return float(self.times_ns[-1] - self.times_ns[0]) / NS_PER_S

    def part(self, start_ns: int, end_ns: int) -> AttitudeTrack:
        """What is needed to answer for times from start to end, two attitudes at least."""
        first = int(np.searchsorted(self.times_ns, start_ns, "right")) - 1
        last = int(np.searchsorted(self.times_ns, end_ns, "left")) + 1
        first = min(max(first, 0), len(self.times_ns) - 2)
        last = max(last, first + 2)
        return AttitudeTrack(self.times_ns[first:last], self.world_from_body[first:last])

    def known(self, times_ns: Times, longest_gap_s: float = LONGEST_GAP_S) -> NDArray[np.bool_]:
        """Whether there is an attitude at each time: within the record and not inside a gap."""
        after = self._after(times_ns)
        gap = np.diff(self.times_ns)[after - 1] > longest_gap_s * NS_PER_S
        # the ends of a gap are known, what lies between is not
        ends = (times_ns == self.times_ns[after]) | (times_ns == self.times_ns[after - 1])
        inside = (times_ns >= self.times_ns[0]) & (times_ns <= self.times_ns[-1])
        return inside & (~gap | ends)

    def at(self, times_ns: Times) -> Rotation:
        """`world_from_body` at each time (m,), the short way between neighbours; the first before
        the first, the last after the last. `known` says where that means anything."""
        clipped = np.clip(times_ns, self.times_ns[0], self.times_ns[-1])
        after = self._after(clipped)
        start, end = self.times_ns[after - 1], self.times_ns[after]
        fraction = (clipped - start) / (end - start)
        return self.world_from_body[after - 1] * Rotation.from_rotvec(
            fraction[:, None] * self._steps[after - 1]
        )

    def rates(self) -> tuple[Times, Floats]:
        """Body rates (n-1, 3) in rad/s about forward, right, down, each over the interval between
        two attitudes, and the middles of the intervals (n-1,)."""
        steps_ns = np.diff(self.times_ns)
        return self.times_ns[:-1] + steps_ns // 2, self._steps / (steps_ns / NS_PER_S)[:, None]

    @cached_property
    def _steps(self) -> Floats:
        """The turns from each attitude to the next, rotation vectors (n-1, 3) in the body."""
        return (self.world_from_body[:-1].inv() * self.world_from_body[1:]).as_rotvec()

    def _after(self, times_ns: Times) -> NDArray[np.intp]:
        """Index of the end of the interval that each time lies in, 1 to n-1."""
        return np.clip(
            np.searchsorted(self.times_ns, times_ns, side="right"), 1, len(self.times_ns) - 1
        )


def collected(attitudes: Iterable[Attitude]) -> AttitudeTrack:
    """The track of all that a source yields; `track_of` says what is left out.

    AttitudeError for fewer than two attitudes.
    """
    kept = list(attitudes)
    return track_of(
        np.array([a.t_ns for a in kept], np.int64),
        np.array([a.world_from_body.as_quat() for a in kept]).reshape(-1, 4),
    )


def track_of(times_ns: Times, xyzw: Floats) -> AttitudeTrack:
    """The track of quaternions (n, 4) as SciPy orders them, of any length but zero.

    Rows that are not finite, of no length, or not after the row before are left out.
    AttitudeError when fewer than two are left.
    """
    times_ns, xyzw = np.asarray(times_ns, np.int64), np.asarray(xyzw, float)
    fine = np.asarray(np.isfinite(xyzw).all(axis=1))
    # between these bounds squares neither under- nor overflow
    largest = np.abs(np.where(fine[:, None], xyzw, 0.0)).max(axis=1, initial=0.0)
    kept = np.flatnonzero(fine & (largest > 1e-3) & (largest < 1e3))
    times_ns, xyzw = times_ns[kept], xyzw[kept]
    newest = np.maximum.accumulate(times_ns)
    forward = np.concatenate([[True], times_ns[1:] > newest[:-1]])[: len(times_ns)]
    times_ns, xyzw = times_ns[forward], xyzw[forward]
    if len(times_ns) < 2:
        raise AttitudeError(_TOO_FEW.format(len(times_ns)))
    return AttitudeTrack(times_ns, Rotation.from_quat(xyzw))
