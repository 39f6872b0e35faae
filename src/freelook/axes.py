"""Which tracker angle feeds which head angle: swap, sign and scale, as short text.

    yaw=-yaw        the other way round
    pitch=roll*0.5  the tracker's roll, at half, is the head's pitch
    roll=0          never roll

An axis that is not named keeps the tracker's own default.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from scipy.spatial.transform import Rotation

from .errors import TrackerError
from .rotations import body_from_view, head_angles_deg

AXES = ("yaw", "pitch", "roll")
LARGEST_DEG = 36_000.0  # a hundred turns; more than that is not a head
LARGEST_SCALE = 100.0

_TERM = re.compile(r"([+-]?)(yaw|pitch|roll)(?:\*(\d+\.?\d*|\.\d+))?", re.ASCII)


@dataclass(frozen=True)
class Axis:
    """One head angle: `scale` times the tracker's angle called `source`."""

    source: str
    scale: float = 1.0


@dataclass(frozen=True)
class AxisMap:
    """What a tracker reports to head angles (degrees, signs as in `freelook.rotations`)."""

    yaw: Axis = Axis("yaw")
    pitch: Axis = Axis("pitch")
    roll: Axis = Axis("roll")

    def __call__(
        self, yaw_deg: float, pitch_deg: float, roll_deg: float
    ) -> tuple[float, float, float]:
        """Head (yaw, pitch, roll) in degrees. ValueError for an angle no head can have."""
        given = {"yaw": yaw_deg, "pitch": pitch_deg, "roll": roll_deg}
        for name, value in given.items():
            if not abs(value) <= LARGEST_DEG:
                raise ValueError(f"{name} = {value} degrees is not an angle a head can have")
        yaw, pitch, roll = (a.scale * given[a.source] for a in (self.yaw, self.pitch, self.roll))
        return yaw, pitch, roll

    def body_from_view(self, yaw_deg: float, pitch_deg: float, roll_deg: float) -> Rotation:
        """The head's rotation from what the tracker reports. ValueError as above."""
        # nine decimals: numbers so small that their squares underflow are not angles
        return body_from_view(*(round(a, 9) for a in self(yaw_deg, pitch_deg, roll_deg)))

    def remap(self, rotation: Rotation) -> Rotation:
        """The same for a tracker that reports `body_from_view` itself."""
        if self == AxisMap():
            return rotation
        return self.body_from_view(*head_angles_deg(rotation))


def parse_axes(terms: Mapping[str, str], default: AxisMap | None = None) -> AxisMap:
    """The map described by texts such as {"pitch": "-roll*0.5"}, over the tracker's default.

    TrackerError for text that is not understood; the message says what is.
    """
    axes = AxisMap() if default is None else default
    for name, text in terms.items():
        if name not in AXES:
            raise TrackerError(f"unknown axis '{name}'; known: {', '.join(AXES)}")
        axes = replace(axes, **{name: _parse_axis(name, text.strip())})
    return axes


def _parse_axis(name: str, text: str) -> Axis:
    if text == "0":
        return Axis(name, 0.0)
    term = _TERM.fullmatch(text)
    if term is None:
        raise TrackerError(
            f"{name}={text} is not understood; write 0, or one of {', '.join(AXES)}, "
            f"with a sign before and a factor behind where wanted: {name}=-{name}*0.5"
        )
    sign, source, factor = term.groups()
    scale = float(factor) if factor else 1.0
    if scale > LARGEST_SCALE:
        raise TrackerError(f"{name}={text}: a factor can be at most {LARGEST_SCALE:.0f}")
    return Axis(source, -scale if sign == "-" else scale)
