"""The two predictions that anything better is measured against."""

from __future__ import annotations

from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S
from ..rotations import FRD_FROM_RDF
from ..types import Counters, Pose
from .history import PoseHistory

LONGEST_S = 0.2  # further ahead nothing is known, and the head rarely goes on so far


class _LooksBack:
    """What both are: a history of poses."""

    def __init__(self) -> None:
        self._history = PoseHistory()

    @property
    def counters(self) -> Counters:
        return self._history.counters

    def push(self, pose: Pose) -> None:
        self._history.push(pose)

    def reset(self) -> None:
        self._history.clear()


class Hold(_LooksBack):
    """The newest pose, whatever the time: no prediction."""

    def at(self, t_ns: int) -> Rotation:
        newest = self._history.newest
        return FRD_FROM_RDF if newest is None else newest.body_from_view


class ConstantRate(_LooksBack):
    """Turns on as from the pose before to the newest one, for at most 0.2 seconds."""

    def at(self, t_ns: int) -> Rotation:
        newest, before = self._history.newest, self._history.before_newest
        if newest is None:
            return FRD_FROM_RDF
        if before is None:
            return newest.body_from_view
        ahead_s = min(max(0, t_ns - newest.t_ns) / NS_PER_S, LONGEST_S)
        turn = (before.body_from_view.inv() * newest.body_from_view).as_rotvec()
        elapsed_s = (newest.t_ns - before.t_ns) / NS_PER_S
        return newest.body_from_view * Rotation.from_rotvec(turn * (ahead_s / elapsed_s))
