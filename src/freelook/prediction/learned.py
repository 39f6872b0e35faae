"""Where a head goes on to, learned from heads: the predictor that is used.

To the constant rate of the newest poses a correction is added that small networks find in the
last 0.4 seconds (`features`): how turns begin, end and bend. Over h seconds ahead

    turn = h (rate + speed (c0 + c1 u + c2 u^2)),   u = h / 0.1 s,

with three vectors c in the frame of the movement. While the head rests there is nothing to
predict: the turn fades out below a few degrees per second, and the pose it starts from is smoothed
(`smoothing`), so that the tracker's noise is not multiplied but taken away.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S
from ..lens import Floats
from ..rotations import FRD_FROM_RDF
from ..types import Counters, Pose
from .features import Features, features
from .history import PoseHistory
from .network import trained
from .smoothing import SpeedAdaptiveFilter

LONGEST_S = 0.15  # as far as it was trained
SCALE_S = 0.1
POWERS = 3
# What counts as the head's speed for smoothing and fading: over a time long enough that noise of a
# few hundredths of a degree is no speed.
SPEED_WINDOW_S = 0.06
FADE_DEG_S = 4.0


class HeadPredictor:
    """The best there is here; `lag_s` is how late its smoothing was at the newest pose."""

    def __init__(self) -> None:
        self._history = PoseHistory()
        self._filter = SpeedAdaptiveFilter()
        self._start = FRD_FROM_RDF
        self._strength = 0.0
        # of the turn in degrees, by powers of the time ahead in units of SCALE_S; None: not yet
        self._course: Floats | None = None

    @property
    def counters(self) -> Counters:
        return self._history.counters

    @property
    def lag_s(self) -> float:
        return self._filter.lag_s

    def push(self, pose: Pose) -> None:
        if not self._history.push(pose):
            return
        if len(self._history) == 1:
            self._filter.reset()
        speed = self._speed_deg_s()
        self._start = self._filter.push(pose.body_from_view, pose.t_ns, speed)
        self._strength = fade(speed)
        self._course = None

    def at(self, t_ns: int) -> Rotation:
        newest = self._history.newest
        if newest is None:
            return FRD_FROM_RDF
        ahead_s = min(max(0, t_ns - newest.t_ns) / NS_PER_S, LONGEST_S)
        if ahead_s == 0.0 or self._strength == 0.0:
            return self._start
        if self._course is None:
            found = features(self._history)
            self._course = np.zeros((POWERS, 3)) if found is None else course(found)
        turn_deg = (ahead_s / SCALE_S) ** np.arange(1, POWERS + 1) @ self._course
        return self._start * Rotation.from_rotvec(np.radians(self._strength * turn_deg))

    def reset(self) -> None:
        self._history.clear()
        self._filter.reset()
        self._course = None

    def _speed_deg_s(self) -> float:
        past = self._history.past_deg(np.array([SPEED_WINDOW_S]))
        return float(np.linalg.norm(past)) / SPEED_WINDOW_S


def fade(speed_deg_s: float) -> float:
    """0 at rest, half at `FADE_DEG_S`, 1 well above."""
    ratio = (speed_deg_s / FADE_DEG_S) ** 4
    return ratio / (1.0 + ratio)


def course(found: Features) -> Floats:
    """Degrees of turn in axes of the newest view, (POWERS, 3): times u, u^2, u^3."""
    corrections = trained()(found.inputs).reshape(POWERS, 3) @ found.axes
    turn: Floats = found.speed_deg_s * corrections
    turn[0] += found.rate_deg_s
    return SCALE_S * turn
