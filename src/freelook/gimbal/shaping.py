"""What the pilot wants made of a head's angles: dead zone, gain, sense; for each axis apart.

    shaped = sense * gain * (angle beyond the dead zone)

so that nothing jumps at the edge of the dead zone. Yaw and roll count on past half a turn: with
another gain than 1 they would jump behind the pilot's back otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from scipy.spatial.transform import Rotation

from ..axes import AXES
from ..errors import TrackerError
from ..rotations import body_from_view, head_angles_deg

MOST_GAIN = 10.0
MOST_DEAD_DEG = 90.0
Angles = tuple[float, float, float]
STRAIGHT: Angles = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class AxisShape:
    """gain 0 to 10, dead_zone_deg 0 to 90 (TrackerError), invert: the other way round."""

    gain: float = 1.0
    dead_zone_deg: float = 0.0
    invert: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.gain <= MOST_GAIN:
            raise TrackerError(f"a gain must be 0 to {MOST_GAIN:g}, not {self.gain}")
        if not 0 <= self.dead_zone_deg <= MOST_DEAD_DEG:
            raise TrackerError(
                f"a dead zone must be 0 to {MOST_DEAD_DEG:g} degrees, not {self.dead_zone_deg}"
            )

    def __call__(self, angle_deg: float) -> float:
        beyond = max(0.0, abs(angle_deg) - self.dead_zone_deg) * self.gain
        return -beyond if (angle_deg < 0) != self.invert else beyond


@dataclass(frozen=True)
class Shape:
    """One for each head angle; the default changes nothing."""

    yaw: AxisShape = field(default_factory=AxisShape)
    pitch: AxisShape = field(default_factory=AxisShape)
    roll: AxisShape = field(default_factory=AxisShape)

    @property
    def plain(self) -> bool:
        """Whether it changes nothing."""
        return self == Shape()

    @property
    def most_gain(self) -> float:
        return max(self.yaw.gain, self.pitch.gain, self.roll.gain)

    def __call__(self, head: Rotation, near: Angles = STRAIGHT) -> tuple[Rotation, Angles]:
        """The shaped head, and its angles before that, yaw and roll within half a turn of `near`.

        Pitch ends at straight up and down.
        """
        if self.plain:
            return head, near
        angles = unwrapped(head_angles_deg(head), near)
        yaw, pitch, roll = self.yaw(angles[0]), self.pitch(angles[1]), self.roll(angles[2])
        return body_from_view(yaw, min(90.0, max(-90.0, pitch)), roll), angles


def unwrapped(angles: Angles, near: Angles) -> Angles:
    """The same angles, yaw and roll by whole turns as near to others as can be."""
    (yaw, pitch, roll), (near_yaw, _, near_roll) = angles, near
    return (
        yaw - 360.0 * round((yaw - near_yaw) / 360.0),
        pitch,
        roll - 360.0 * round((roll - near_roll) / 360.0),
    )


def parse_shape(gain: str = "", dead_zone: str = "", invert: str = "") -> Shape:
    """A shape from texts such as "yaw=2,pitch=1.5", "3" (every axis) and "pitch,roll".

    TrackerError for text that is not understood; the message says what is.
    """
    gains, dead_zones = _numbers("gain", gain), _numbers("dead zone", dead_zone)
    inverted = {_axis("invert", axis) for axis in filter(None, invert.split(","))}
    return Shape(
        *(
            AxisShape(gains.get(axis, 1.0), dead_zones.get(axis, 0.0), axis in inverted)
            for axis in AXES
        )
    )


def _numbers(what: str, text: str) -> Mapping[str, float]:
    if not text:
        return {}
    if "=" not in text:
        return dict.fromkeys(AXES, _number(what, text))
    terms = (term.partition("=") for term in text.split(","))
    return {_axis(what, axis): _number(what, value) for axis, _, value in terms}


def _axis(what: str, text: str) -> str:
    if text.strip() not in AXES:
        raise TrackerError(f"{what}: unknown axis '{text}'; known: {', '.join(AXES)}")
    return text.strip()


def _number(what: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise TrackerError(
            f"{what}: '{text}' is not understood; write one number for all axes, "
            "or for instance yaw=2,pitch=1.5"
        ) from None
