"""The vehicle's heading: where its nose points over the ground, and two ways to follow it.

Straight up and down there is none, and just beside that it turns half around in no time: in a
loop the nose passes the vertical and then points backward. There the heading is held to a
stated rate, and what was missed is made up, at the same rate, once the nose is down again.
"""

from __future__ import annotations

import math

from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S

STEEP_DEG = 70.0
STEEP_DEG_S = 180.0


def nose(world_from_body: Rotation) -> tuple[float, float]:
    """(heading, elevation) of the body's x axis, degrees: from north through east, and up."""
    x, y, z, w = (float(value) for value in world_from_body.as_quat())
    # the first column of the rotation's matrix
    north, east, down = 1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)
    level = math.hypot(north, east)
    heading = math.degrees(math.atan2(east, north)) if level > 1e-9 else 0.0
    return heading, math.degrees(math.atan2(-down, level))


def wrapped(degrees: float) -> float:
    """The same direction in (-180, 180]."""
    return degrees - 360.0 * math.ceil((degrees - 180.0) / 360.0)


class Heading:
    """The heading at times that grow, without a jump next to the vertical.

    And `followed`, the same through a low-pass filter of first order with time constant
    `follow_s`: after a step of the vehicle's heading, what is missing falls to 1/e in that time.
    """

    def __init__(self, follow_s: float) -> None:
        self._follow_s = follow_s
        self._t_ns: int | None = None
        self._raw_deg = 0.0
        self._missed_deg = 0.0
        self.followed_deg = 0.0

    def restart(self) -> None:
        """What comes next has nothing to do with what was."""
        self._t_ns = None
        self._missed_deg = 0.0

    def jumped(self, world_from_body: Rotation) -> None:
        """The attitude jumped: the heading with it, none of which is to be made up."""
        heading = nose(world_from_body)[0]
        self.followed_deg = wrapped(self.followed_deg + heading - self._raw_deg)
        self._raw_deg = heading

    def at(self, t_ns: int, world_from_body: Rotation) -> float:
        """The heading in degrees; a time before the last one leaves everything as it was."""
        heading, elevation = nose(world_from_body)
        if self._t_ns is None:
            self.followed_deg = heading
            self._t_ns, self._raw_deg = t_ns, heading
        elif t_ns > self._t_ns:
            elapsed_s = (t_ns - self._t_ns) / NS_PER_S
            self._advance(elapsed_s, heading, abs(elevation) > STEEP_DEG)
            self._t_ns, self._raw_deg = t_ns, heading
        return wrapped(heading + self._missed_deg)

    def _advance(self, elapsed_s: float, heading: float, steep: bool) -> None:
        most = STEEP_DEG_S * elapsed_s
        if steep:
            turned = wrapped(heading - self._raw_deg)
            self._missed_deg = wrapped(self._missed_deg - turned + _within(turned, most))
        else:
            self._missed_deg -= _within(self._missed_deg, most)
        behind = wrapped(heading + self._missed_deg - self.followed_deg)
        share = -math.expm1(-elapsed_s / self._follow_s)
        self.followed_deg = wrapped(self.followed_deg + share * behind)


def _within(value: float, most: float) -> float:
    return max(-most, min(most, value))
