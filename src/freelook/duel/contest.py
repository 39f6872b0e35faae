"""A duel: both sides driven by one head, and what was measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..clock import NS_PER_S
from ..errors import TrackerError
from . import measure
from .chains import Advance, MotorTrace, Shown, freelook_chain, gimbal_chain, nothing
from .figures import Settings
from .head import HeadMotion, turns_head
from .predictors import Predictor

Floats = NDArray[np.float64]
MakePredictor = Callable[[], Predictor] | None
LEAST_NS = 4 * NS_PER_S


@dataclass(frozen=True)
class Side:
    """One side's numbers.

    Errors in degrees: `direction` between where the head looks and what is shown, `turned` with
    roll. `lag_ms` is by cross-correlation, `turn_ms` medians and 95th percentiles of how late 10,
    50 and 90 % of a turn of 60 degrees in 0.4 s are shown. `picture_age_ms` is how old the content
    is when it is seen.
    """

    direction: measure.Spread
    turned: measure.Spread
    lag_ms: float
    turn_ms: dict[str, tuple[float, float]]
    picture_age_ms: measure.Spread


@dataclass(frozen=True)
class Duel:
    """Both sides of one head, with what was shown when, of its motion and of the `turns`."""

    head: HeadMotion
    settings: Settings
    freelook: Side
    gimbal: Side
    shown: dict[str, Shown] = field(repr=False)
    motors: MotorTrace = field(repr=False)
    turns: HeadMotion
    turned: dict[str, Shown] = field(repr=False)

    def errors_deg(self) -> tuple[Floats, dict[str, Floats]]:
        """Seconds (m,) and both sides' direction errors (m,) at every millisecond."""
        t_ns = measure.moments(self.head)
        errors = {
            name: measure.direction_error_deg(self.head, shown, t_ns)
            for name, shown in self.shown.items()
        }
        return t_ns / NS_PER_S, errors

    def beyond(self, field_deg: float) -> float:
        """The share of the time in which the head looks outside a lens of this field that looks
        straight ahead: there freelook has nothing to show in the middle of the view."""
        directions = measure.direction_of(self.head.at(measure.moments(self.head)))
        ahead = np.broadcast_to([1.0, 0.0, 0.0], directions.shape)
        return float(np.mean(measure.angle_deg(directions, ahead) > field_deg / 2))

    def numbers(self) -> dict[str, Any]:
        """Everything measured, for JSON: what never happened is None."""
        return {
            "head": self.head.name,
            "seconds": self.head.duration_ns / NS_PER_S,
            "freelook": _plain(asdict(self.freelook)),
            "gimbal": _plain(asdict(self.gimbal)),
        }


def fight(
    head: HeadMotion,
    settings: Settings,
    freelook_predictor: MakePredictor = None,
    gimbal_predictor: MakePredictor = None,
    advance: Advance = nothing,
) -> Duel:
    """Drive both sides and measure. The makers give a new predictor each time they are called.

    TrackerError for a head that is watched for less than four seconds.
    """
    if head.duration_ns < LEAST_NS:
        raise TrackerError(
            f"{head.name} lasts {head.duration_ns / NS_PER_S:g} s; "
            "a duel needs four seconds or more"
        )
    turns = turns_head()
    shown, motors = _both(head, settings, freelook_predictor, gimbal_predictor, advance)
    turned, _ = _both(turns, settings, freelook_predictor, gimbal_predictor, advance)
    sides = {name: _side(head, shown[name], turns, turned[name]) for name in shown}
    return Duel(head, settings, sides["freelook"], sides["gimbal"], shown, motors, turns, turned)


def _both(
    head: HeadMotion,
    settings: Settings,
    freelook_predictor: MakePredictor,
    gimbal_predictor: MakePredictor,
    advance: Advance,
) -> tuple[dict[str, Shown], MotorTrace]:
    ours = freelook_chain(head, settings, freelook_predictor and freelook_predictor(), advance)
    advance()
    theirs, motors = gimbal_chain(head, settings, gimbal_predictor and gimbal_predictor(), advance)
    advance()
    return {"freelook": ours, "gimbal": theirs}, motors


def steps(head: HeadMotion, settings: Settings, freelook: bool, gimbal: bool) -> int:
    """How often `fight` calls `advance`, about: for every prediction and every chain."""
    total_ms = (head.duration_ns + turns_head().duration_ns) / 1e6
    asked = freelook * total_ms / settings.refresh_ms
    return 4 + round(asked + gimbal * total_ms / settings.trainer_period_ms)


def _side(head: HeadMotion, shown: Shown, turns: HeadMotion, turned: Shown) -> Side:
    t_ns = measure.moments(head)
    delays = measure.turn_delays_ms(turns, turned)
    percent = {
        f"{level * 100:.0f}": (_of_sorted(column, 0.5), _of_sorted(column, 0.95))
        for level, column in zip(measure.LEVELS, delays.T, strict=True)
    }
    return Side(
        direction=measure.spread(measure.direction_error_deg(head, shown, t_ns)),
        turned=measure.spread(measure.turned_error_deg(head, shown, t_ns)),
        lag_ms=measure.lag_ms(head, shown, t_ns),
        turn_ms=percent,
        picture_age_ms=measure.spread(shown.age_ms(t_ns)),
    )


def _of_sorted(values: Floats, share: float) -> float:
    """The value that this share of all reaches at most; one of them, so that it may be infinite."""
    return float(np.sort(values)[round(share * (len(values) - 1))])


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    return value if not isinstance(value, float) or np.isfinite(value) else None
