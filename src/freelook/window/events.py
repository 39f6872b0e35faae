"""What a window tells: keys by name, the mouse, a gamepad. No window library in here."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Key:
    """`name`: a small letter, +, -, or left, right, up, down, escape."""

    name: str
    pressed: bool


@dataclass(frozen=True)
class Drag:
    """The mouse moved by so many window pixels (right, down) with its first button held."""

    dx_px: float
    dy_px: float


@dataclass(frozen=True)
class Wheel:
    """Turned by so many steps; away from the hand is positive."""

    steps: float


@dataclass(frozen=True)
class Left:
    """Another window has the keyboard now: keys that are held will be released unseen."""


@dataclass(frozen=True)
class Damaged:
    """Its size changed, or what was shown is gone: it must be drawn anew."""


@dataclass(frozen=True)
class Closed:
    """The window was asked to close."""


Event = Key | Drag | Wheel | Left | Damaged | Closed


@dataclass(frozen=True)
class Pad:
    """The right stick, each way -1 to 1 (right, down), and the names of the buttons held:
    recentre, toggle, narrower, wider."""

    x: float
    y: float
    held: frozenset[str] = field(default_factory=frozenset)
