"""The last poses of one uninterrupted movement: what every predictor looks back on.

Poses come as they may: twice, late, with NaN, after a gap, or from a tracker that was recentred in
between. `PoseHistory.push` sorts that out once, so that no predictor extrapolates nonsense.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

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
CLOSEST_NS = 2_500_000  # between poses that are kept: more often tells nothing more


@dataclass(frozen=True)
class HistorySettings:
    """span_s         how far back poses are kept, beyond the one that is just older
    longest_gap_s  silence after which older poses say nothing about the rate"""

    span_s: float = 0.5
    longest_gap_s: float = 0.2


class PoseHistory:
    """Poses in order of time, from after the last jump or gap: all of a tracker up to 400 Hz, of a
    faster one so many, and always the newest.

    `counters`: `not finite`, `not newer` (ignored), `jumps`, `gaps` (history begun anew).
    """

    def __init__(self, settings: HistorySettings | None = None) -> None:
        self.settings = HistorySettings() if settings is None else settings
        self.counters = Counters()
        self._poses: deque[Pose] = deque()
        self._quats: deque[Floats] = deque()  # of the poses, each the nearer of q and -q
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
        self._quats.clear()
        self._rate_deg_s = None

    def push(self, pose: Pose) -> bool:
        """Take a pose; False for one that is ignored: not finite, or not newer than the newest.

        After a jump or a gap it is the only one left.
        """
        quat = pose.body_from_view.as_quat()
        if not np.isfinite(quat).all():
            self.counters.add("not finite")
            return False
        if self._poses:
            before = self._poses[-1]
            if pose.t_ns <= before.t_ns:
                self.counters.add("not newer")
                return False
            self._break_off(before, pose)
            self._thin()
        self._poses.append(pose)
        self._quats.append(-quat if self._quats and quat @ self._quats[-1] < 0 else quat)
        self._forget(pose.t_ns)
        return True

    def ages_s(self) -> Floats:
        """How much older than the newest each pose is, oldest first; the last is 0."""
        times_ns = np.array([pose.t_ns for pose in self._poses])
        return (times_ns[-1:] - times_ns) / NS_PER_S

    def past_deg(self, ages_s: Floats) -> Floats:
        """Where the head was, seen from where it is: rotation vectors in degrees, (n, 3).

        Row k is that of newest_from_then, `ages_s[k]` >= 0 before the newest pose. Between poses
        it goes along the chord, which is slerp but for thousandths of the small step. Before the
        oldest pose the head is taken to have turned at its mean rate since; with a single pose,
        not at all. RuntimeError without any.
        """
        if not self._poses:
            raise RuntimeError("no pose yet")
        if len(self._poses) == 1:
            return np.zeros((len(ages_s), 3))
        known_s, quats = self.ages_s(), np.array(self._quats)
        after = np.searchsorted(-known_s, -ages_s).clip(1, len(quats) - 1)
        share = (ages_s - known_s[after]) / (known_s[after - 1] - known_s[after])
        share = share.clip(0.0, 1.0)[:, None]
        then = quats[after] * (1.0 - share) + quats[after - 1] * share
        past = np.degrees(_turns(quats[-1], then))
        beyond = ages_s > known_s[0]
        past[beyond] *= (ages_s[beyond] / known_s[0])[:, None]
        return past

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

    def _thin(self) -> None:
        """Let the newest go, before the next comes, where it was close to the one before it."""
        if len(self._poses) > 1 and self._poses[-1].t_ns - self._poses[-2].t_ns < CLOSEST_NS:
            self._poses.pop()
            self._quats.pop()

    def _forget(self, now_ns: int) -> None:
        oldest_ns = now_ns - round(self.settings.span_s * NS_PER_S)
        while len(self._poses) > 2 and self._poses[1].t_ns <= oldest_ns:
            self._poses.popleft()
            self._quats.popleft()


def _turns(from_quat: Floats, to_quats: Floats) -> Floats:
    """Rotation vectors of from^-1 * to, (n, 3); scalar last, `to` of any length and near `from`."""
    x, y, z, w = from_quat
    inverse_times = np.array([[w, z, -y, -x], [-z, w, x, -y], [y, -x, w, -z], [x, y, z, w]])
    turned = to_quats @ inverse_times.T
    sine = np.sqrt((turned[:, :3] ** 2).sum(axis=1))
    angle = 2.0 * np.arctan2(sine, turned[:, 3])
    # an angle so small has no direction, and its vector no length
    return turned[:, :3] * (angle / np.maximum(sine, 1e-300))[:, None]
