"""The last poses of one uninterrupted movement: what every predictor looks back on.

Poses come as they may: twice, late, with NaN, after a gap, or from a tracker that was recentred in
between. `PoseHistory.push` sorts that out once, so that no predictor extrapolates nonsense.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S
from ..lens import Floats
from ..types import Counters, Pose

# Heads do not turn faster than about 800 deg/s, nor change their rate by 250 deg/s from one sample
# to the next: in nine minutes of two people looking around at 60 Hz that happened 12 times, mostly
# in hiccups of the recording. Noise on samples close in time can look like it: so a jump must also
# be an angle that one sees.
FASTEST_DEG_S = 1200.0
RATE_CHANGE_DEG_S = 250.0
SMALLEST_JUMP_DEG = 3.0


@dataclass(frozen=True)
class HistorySettings:
    """span_s         how far back poses are kept, beyond the one that is just older
    longest_gap_s  silence after which older poses say nothing about the rate"""

    span_s: float = 0.5
    longest_gap_s: float = 0.2


class PoseHistory:
    """Poses in order of time, from after the last jump or gap.

    `counters`: `not finite`, `not newer` (ignored), `jumps`, `gaps` (history begun anew).
    """

    def __init__(self, settings: HistorySettings | None = None) -> None:
        self.settings = HistorySettings() if settings is None else settings
        self.counters = Counters()
        self._poses: deque[Pose] = deque()
        self._rate_deg_s: Floats | None = None

    def __len__(self) -> int:
        return len(self._poses)

    @property
    def newest(self) -> Pose | None:
        return self._poses[-1] if self._poses else None

    @property
    def before_newest(self) -> Pose | None:
        return self._poses[-2] if len(self._poses) > 1 else None

    def clear(self) -> None:
        self._poses.clear()
        self._rate_deg_s = None

    def push(self, pose: Pose) -> bool:
        """Take a pose; False for one that is ignored: not finite, or not newer than the newest.

        After a jump or a gap it is the only one left.
        """
        if not np.isfinite(pose.body_from_view.as_quat()).all():
            self.counters.add("not finite")
            return False
        if self._poses:
            before = self._poses[-1]
            if pose.t_ns <= before.t_ns:
                self.counters.add("not newer")
                return False
            self._break_off(before, pose)
        self._poses.append(pose)
        self._forget(pose.t_ns)
        return True

    def past(self, ages_s: Floats) -> tuple[Floats, float]:
        """Where the head was, seen from where it is: (angles in deg (n, 3), age of the oldest, s).

        Row k is the rotation vector of newest_from_then, in axes of the newest view, at
        `ages_s[k]` >= 0 before the newest pose, between poses by slerp; beyond the oldest pose its
        value stays, as if the head had rested before. RuntimeError on an empty history.
        """
        if not self._poses:
            raise RuntimeError("no pose yet")
        newest = self._poses[-1]
        known_s = np.array([newest.t_ns - pose.t_ns for pose in self._poses]) / NS_PER_S
        quats = np.stack([pose.body_from_view.as_quat() for pose in self._poses])
        index = np.clip(np.searchsorted(-known_s, -ages_s), 1, max(1, len(quats) - 1))
        if len(quats) == 1:
            return np.zeros((len(ages_s), 3)), 0.0
        younger, older = Rotation.from_quat(quats[index]), Rotation.from_quat(quats[index - 1])
        step_s = known_s[index - 1] - known_s[index]
        share = np.clip((ages_s - known_s[index]) / step_s, 0.0, 1.0)
        turn = (younger.inv() * older).as_rotvec()
        then = younger * Rotation.from_rotvec(share[:, None] * turn)
        relative = newest.body_from_view.inv() * then
        return np.degrees(relative.as_rotvec()), float(known_s[0])

    def _break_off(self, before: Pose, pose: Pose) -> None:
        elapsed_s = (pose.t_ns - before.t_ns) / NS_PER_S
        if elapsed_s > self.settings.longest_gap_s:
            self.counters.add("gaps")
            self.clear()
            return
        turn = before.body_from_view.inv() * pose.body_from_view
        rate_deg_s = np.degrees(turn.as_rotvec()) / elapsed_s
        if self._is_jump(np.degrees(turn.magnitude()), rate_deg_s):
            self.counters.add("jumps")
            self.clear()
        else:
            self._rate_deg_s = rate_deg_s

    def _is_jump(self, angle_deg: float, rate_deg_s: Floats) -> bool:
        if angle_deg < SMALLEST_JUMP_DEG:
            return False
        if np.linalg.norm(rate_deg_s) > FASTEST_DEG_S:
            return True
        known = self._rate_deg_s
        return known is not None and bool(np.linalg.norm(rate_deg_s - known) > RATE_CHANGE_DEG_S)

    def _forget(self, now_ns: int) -> None:
        oldest_ns = now_ns - round(self.settings.span_s * NS_PER_S)
        while len(self._poses) > 2 and self._poses[1].t_ns <= oldest_ns:
            self._poses.popleft()
