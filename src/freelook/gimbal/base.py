"""The base in which a head turns: what the stabiliser answers for a frame."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.spatial.transform import Rotation

from .easing import NOTHING

MODES = ("body", "horizon", "world", "follow", "point")


@dataclass(frozen=True)
class Base:
    """What the stabiliser answers.

    `mode` is the one that was asked for, `effective` the one that is: body when the other is not
    possible, and `notice` says why. `moving`: a change is being eased. `turned`: not the body's
    own axes.
    """

    body_from_base: Rotation = NOTHING
    mode: str = "body"
    effective: str = "body"
    notice: str = ""
    moving: bool = False
    turned: bool = False

    @property
    def state(self) -> str:
        """steady, easing or degraded."""
        if self.effective != self.mode:
            return "degraded"
        return "easing" if self.moving else "steady"


BODY = Base()


def level(heading_deg: float, elevation_deg: float = 0.0) -> Rotation:
    """North, east, down from axes that head there without roll, the first one so far above the
    horizon."""
    yaw, pitch = math.radians(heading_deg) / 2, math.radians(elevation_deg) / 2
    (sin_y, cos_y), (sin_p, cos_p) = ((math.sin(half), math.cos(half)) for half in (yaw, pitch))
    return Rotation.from_quat([-sin_y * sin_p, cos_y * sin_p, sin_y * cos_p, cos_y * cos_p])
