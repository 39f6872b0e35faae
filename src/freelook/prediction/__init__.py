"""Where the head will point when the picture is seen: `make_predictor("head")`.

A predictor takes poses as they come and says where the head is expected at a time, usually the one
at which the next picture is shown. All of them ignore what cannot be (NaN, times that do not
advance), begin anew after a gap or a jump, and never look further ahead than 0.2 seconds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from scipy.spatial.transform import Rotation

from ..errors import TrackerError
from ..types import Counters, Pose
from .baselines import ConstantRate, Hold
from .learned import HeadPredictor

__all__ = [
    "DEFAULT",
    "PREDICTORS",
    "ConstantRate",
    "HeadPredictor",
    "Hold",
    "Predictor",
    "make_predictor",
]


class Predictor(Protocol):
    """Head poses in, expected head poses out. Not safe between threads.

    `push` takes a pose; what cannot be used is counted in `counters`, never raised.
    `at` gives body_from_view expected at a time: that of the newest pose, moved on; straight ahead
    before the first pose; the newest pose itself for times before it. It changes nothing.
    `reset` forgets all poses.
    """

    @property
    def counters(self) -> Counters: ...

    def push(self, pose: Pose) -> None: ...

    def at(self, t_ns: int) -> Rotation: ...

    def reset(self) -> None: ...


PREDICTORS: dict[str, Callable[[], Predictor]] = {
    "hold": Hold,
    "constant_rate": ConstantRate,
    "head": HeadPredictor,
}
DEFAULT = "head"


def make_predictor(name: str = DEFAULT) -> Predictor:
    """A new predictor by its name; TrackerError for a name that is not known."""
    if name not in PREDICTORS:
        raise TrackerError(f"no predictor is called '{name}'; known: {', '.join(PREDICTORS)}")
    return PREDICTORS[name]()
