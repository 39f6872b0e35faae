"""Where the parts of a HUD go. Points: so many pixels that letters stay as large as they should."""

from __future__ import annotations

from dataclasses import dataclass

from .definition import definition

POINTS_HIGH = 540  # of a view's shorter side: larger ones get larger letters
MOST_PER_POINT = 8.0
STEPS_PER_POINT = 8  # a window that is being resized needs new letters only now and then

MOVING = ("horizon", "edge", "tape", "field")
RESTING = ("state", "dials", "warnings")
ALL = (*MOVING, *RESTING)


@dataclass(frozen=True)
class Rect:
    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True)
class Place:
    """A view of width x height points, (0, 0) its top left corner; where the tape goes; from
    where down there is room at the sides and in the middle; the parts that are drawn; what is
    left free on each side, across and down."""

    width: float
    height: float
    tape: Rect
    sides_y: float
    middle_y: float
    parts: tuple[str, ...] = ALL
    inset: tuple[float, float] = (0.0, 0.0)


def pixels_per_point(size: tuple[int, int]) -> float:
    """Of a view of this size in pixels; 1 at least."""
    ratio = round(STEPS_PER_POINT * min(size) / POINTS_HIGH) / STEPS_PER_POINT
    return min(max(ratio, 1.0), MOST_PER_POINT)


def place_of(
    width: float,
    height: float,
    parts: tuple[str, ...] = ALL,
    inset: tuple[float, float] = (0.0, 0.0),
) -> Place:
    """With nothing else on the view."""
    known = definition()
    tape, margin = known["tape"], known.margin
    free = width - 2 * inset[0]
    narrow = free < tape["narrow"]
    wanted = free - 2 * margin if narrow else free * tape["share"]
    across = min(tape["most"], max(wanted, min(tape["least"], free - 2 * margin)))
    rect = Rect((width - across) / 2, tape["top"] + inset[1], across, tape["height"])
    below = rect.y + rect.height
    sides_y = below if narrow else inset[1]
    # the tallest at the sides is the state
    sides = margin + known["state"]["most"] * known["state"]["line"] - known["warnings"]["gap"] / 2
    taken = below + sides if narrow else below
    return Place(width, height, rect, sides_y, taken, parts, inset)
