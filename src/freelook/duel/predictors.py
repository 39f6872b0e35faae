"""Asking a predictor all along a head's motion, as a station would."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..types import Pose
from .stages import newest

Times = NDArray[np.int64]


class Predictor(Protocol):
    """What is needed of `freelook.prediction`: `at(t_ns)` is the `body_from_view` expected at that
    time from the poses pushed so far."""

    def push(self, pose: Pose) -> None: ...

    def at(self, t_ns: int) -> Rotation: ...


def expected(
    predictor: Predictor,
    poses: Rotation,
    pose_ns: Times,
    there_ns: Times,
    asked_ns: Times,
    wanted_ns: Times,
    advance: Callable[[], None] = lambda: None,
) -> Rotation:
    """For every time asked (m,), growing: what is expected for `wanted_ns` (m,) from the poses
    (n) taken at `pose_ns` and there from `there_ns` on. `advance` after each."""
    known = newest(there_ns, asked_ns)
    pushed, found = -1, []
    for last, wanted in zip(known.tolist(), wanted_ns.tolist(), strict=True):
        while pushed < last:
            pushed += 1
            predictor.push(Pose(poses[pushed], int(pose_ns[pushed])))
        found.append(predictor.at(wanted).as_quat())
        advance()
    return Rotation.from_quat(np.array(found))
