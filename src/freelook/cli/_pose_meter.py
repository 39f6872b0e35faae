"""What can be said about a stream of poses: angles, rate, jitter, gaps. No thread, no clock."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from ..clock import NS_PER_MS, NS_PER_S
from ..rotations import head_angles_deg
from ..types import Pose

WINDOW_NS = NS_PER_S
LONGEST_WINDOW = 4096
DROPOUT_INTERVALS = 3.0
SHORTEST_DROPOUT_NS = 50 * NS_PER_MS

Angles = tuple[float, float, float]


@dataclass(frozen=True)
class Reading:
    """A stream of poses at one time; None where there is not enough to say.

    angles_deg     (yaw, pitch, roll) of the newest pose
    spread_deg     rms about the mean of the last second, per angle: noise if the head is still
    rate_hz        poses in the last second, by their spacing
    interval_ms    median time between poses
    jitter_ms      rms of those times about their mean
    longest_ms     the longest of them since the start
    dropouts       gaps of more than three usual intervals (and 50 ms) since the start
    age_ms         since the newest pose
    """

    poses: int
    dropouts: int
    angles_deg: Angles | None = None
    spread_deg: Angles | None = None
    rate_hz: float | None = None
    interval_ms: float | None = None
    jitter_ms: float | None = None
    longest_ms: float | None = None
    age_ms: float | None = None


class PoseMeter:
    """Told every pose, asked now and then. Not safe between threads."""

    def __init__(self) -> None:
        self._times_ns: deque[int] = deque(maxlen=LONGEST_WINDOW)
        self._angles_deg: deque[Angles] = deque(maxlen=LONGEST_WINDOW)
        self._poses = 0
        self._dropouts = 0
        self._longest_ns: int | None = None

    def add(self, pose: Pose) -> None:
        if self._times_ns:
            self._note_gap(pose.t_ns - self._times_ns[-1])
        self._times_ns.append(pose.t_ns)
        self._angles_deg.append(head_angles_deg(pose.body_from_view))
        self._poses += 1
        while pose.t_ns - self._times_ns[0] > WINDOW_NS and len(self._times_ns) > 2:
            self._times_ns.popleft()
            self._angles_deg.popleft()

    def read(self, now_ns: int) -> Reading:
        if not self._times_ns:
            return Reading(0, 0)
        recent = [n for n, t in enumerate(self._times_ns) if now_ns - t <= WINDOW_NS]
        angles = [self._angles_deg[n] for n in recent]
        gaps_ns = np.diff([self._times_ns[n] for n in recent])
        known = len(gaps_ns) > 0 and gaps_ns.sum() > 0
        longest_ns = self._longest_ns
        return Reading(
            poses=self._poses,
            dropouts=self._dropouts,
            angles_deg=self._angles_deg[-1],
            spread_deg=_spread_deg(angles),
            rate_hz=len(gaps_ns) * NS_PER_S / float(gaps_ns.sum()) if known else None,
            interval_ms=float(np.median(gaps_ns)) / NS_PER_MS if known else None,
            jitter_ms=float(np.std(gaps_ns)) / NS_PER_MS if len(gaps_ns) > 1 else None,
            longest_ms=None if longest_ns is None else longest_ns / NS_PER_MS,
            age_ms=max(0, now_ns - self._times_ns[-1]) / NS_PER_MS,
        )

    def _note_gap(self, gap_ns: int) -> None:
        self._longest_ns = max(gap_ns, self._longest_ns or 0)
        if len(self._times_ns) > 2:
            usual_ns = (self._times_ns[-1] - self._times_ns[0]) / (len(self._times_ns) - 1)
            self._dropouts += gap_ns > max(DROPOUT_INTERVALS * usual_ns, SHORTEST_DROPOUT_NS)


def _spread_deg(angles: list[Angles]) -> Angles | None:
    """Turned to the newest first, so that +179 and -179 are two degrees apart."""
    if len(angles) < 2:
        return None
    offsets = (np.array(angles) - angles[-1] + 180.0) % 360.0 - 180.0
    yaw, pitch, roll = offsets.std(axis=0)
    return float(yaw), float(pitch), float(roll)
