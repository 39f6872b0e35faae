"""What can be chosen about a gimbal."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from ..errors import TrackerError
from .shaping import Shape

LONGEST_S = 3600.0
LONGEST_AHEAD_S = 0.5
SLOWEST_DEG_S, FASTEST_DEG_S = 1.0, 36_000.0
RATE_DEG_S = 240.0


@dataclass(frozen=True)
class GimbalSettings:
    """Times in seconds, 0 to 3600 (TrackerError).

    lost_after_s  silence of the tracker that counts as lost
    hold_s        how long the last aim is then held
    ease_s        how long the way forward takes at least
    blend_s       how long any other change takes at least: a returning tracker, on and off
    rate_deg_s    no such change ever turns the view faster, 1 to 36000; it takes longer instead
    ahead_s       how long after the asked time the view is seen, 0 to 0.5: the head is predicted
                  for then
    jump_deg_s    a head faster than this did not turn: its tracker jumped, and is approached
    shape         dead zone, gain and sense of each axis
    """

    lost_after_s: float = 0.3
    hold_s: float = 1.0
    ease_s: float = 1.5
    blend_s: float = 0.3
    rate_deg_s: float = RATE_DEG_S
    ahead_s: float = 0.0
    jump_deg_s: float = 1500.0
    shape: Shape = field(default_factory=Shape)

    def __post_init__(self) -> None:
        for name in ("lost_after_s", "hold_s", "ease_s", "blend_s"):
            _check(name, getattr(self, name), 0, LONGEST_S, "seconds")
        _check("ahead_s", self.ahead_s, 0, LONGEST_AHEAD_S, "seconds")
        for name in ("rate_deg_s", "jump_deg_s"):
            _check(name, getattr(self, name), SLOWEST_DEG_S, FASTEST_DEG_S, "degrees per second")


@dataclass(frozen=True)
class StabiliserSettings:
    """How the vehicle's turning is taken out of the view (TrackerError for what cannot be).

    blend_s     how long a change of mode takes at least, 0 to 3600 s
    rate_deg_s  no change of mode turns the view faster, 1 to 36000
    follow_s    time constant of *follow*: a turn of the vehicle is followed to 63 % in this time
    settle_s    an attitude that comes back must last so long before it is used again
    jump_deg_s  an attitude that changes faster did not turn: it jumped, and is approached
    fresh_s     a position older than this is not known any more
    """

    blend_s: float = 0.5
    rate_deg_s: float = RATE_DEG_S
    follow_s: float = 1.0
    settle_s: float = 0.5
    jump_deg_s: float = 800.0
    fresh_s: float = 2.0

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if one.name.endswith("_deg_s"):
                _check(one.name, value, SLOWEST_DEG_S, FASTEST_DEG_S, "degrees per second")
            else:
                _check(one.name, value, 0, LONGEST_S, "seconds")
        if self.follow_s == 0:
            raise TrackerError("follow_s must be above 0; the mode 'horizon' follows at once")


def _check(name: str, value: float, least: float, most: float, unit: str) -> None:
    if not least <= value <= most:
        raise TrackerError(f"{name} must be {least:g} to {most:g} {unit}, not {value}")
