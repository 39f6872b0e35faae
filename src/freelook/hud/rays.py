"""The directions that a HUD draws, as rays (x right, y down, z forward) of unit length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..lens import Floats
from .definition import definition
from .words import bearing, compass, signed

NOSE = 27  # straight pieces
Degrees = float | Sequence[float] | Floats


def directions(yaw_deg: Degrees, pitch_deg: Degrees) -> Floats:
    """(n, 3), to the right and up."""
    yaw, pitch = np.broadcast_arrays(np.radians(yaw_deg), np.radians(pitch_deg))
    level = np.cos(pitch)
    return np.stack([np.sin(yaw) * level, -np.sin(pitch), np.cos(yaw) * level], axis=-1)


def around(step_deg: int) -> list[int]:
    """From -180 on, once around."""
    return list(range(-180, 180, step_deg))


@dataclass(frozen=True)
class Grid:
    """What is drawn of the level frame, as one array to be turned at once, and its labels.

    The parts, one after the other: lines of equal elevation, labels on them, the level line, feet
    and tops of its ticks, its labels. `between_labels`: the dashes of a line of equal elevation
    that give way to no label.
    """

    all: Floats
    counts: tuple[int, ...]
    elevations: tuple[str, ...]
    bearings: tuple[str, ...]
    headings: tuple[str, ...]
    between_labels: NDArray[np.bool_]

    def split(self, values: Floats) -> list[Floats]:
        """Of something for each ray and for those of `nose`, the part for each part."""
        return np.split(values, np.cumsum([*self.counts, NOSE]))


@cache
def grid() -> Grid:
    look = definition()["horizon"]
    ladder = look["ladder_deg"]
    circle = np.arange(-180, 181, look["step_deg"])
    ticks = [yaw for yaw in around(look["tick_deg"]) if yaw != 0]
    long = [yaw % look["long_tick_deg"] == 0 for yaw in ticks]
    heights = [look["long_tick_up_deg"] if one else look["tick_up_deg"] for one in long]
    marks, named = around(look["ladder_labels_deg"]), around(look["label_deg"])
    elevations = [f"{signed(pitch)}°" for _ in marks for pitch in ladder]
    parts = [
        np.concatenate([directions(circle, pitch) for pitch in ladder]),
        np.concatenate([directions(yaw + look["step_deg"] / 2, ladder) for yaw in marks]),
        directions(circle, 0.0),
        directions(ticks, 0.0),
        directions(ticks, heights),
        directions(named, look["label_up_deg"]),
    ]
    return Grid(
        np.concatenate(parts),
        tuple(len(part) for part in parts),
        tuple(elevations),
        tuple(bearing(yaw) for yaw in named),
        tuple(compass(yaw) for yaw in named),
        circle[:-1:2] % look["ladder_labels_deg"] != 0,
    )


@cache
def nose() -> Floats:
    """The vehicle's: a ring, two wings and a fin, as starts of straight pieces and then their ends,
    (2 * NOSE, 3)."""
    look = definition()["nose"]
    turn = np.linspace(0, 2 * np.pi, NOSE - 2)
    ring, wing, fin = look["ring_deg"], look["wing_deg"], look["fin_deg"]
    round_ = directions(ring * np.cos(turn), ring * np.sin(turn))
    starts = directions([-wing, ring, 0], [0, 0, ring])
    ends = directions([-ring, wing, 0], [0, 0, fin])
    return np.concatenate([round_[:-1], starts, round_[1:], ends])


@cache
def circle(theta: float) -> Floats:
    """So far from the axis z, radians; the first comes again as the last."""
    turn = np.radians(np.arange(0, 361, definition()["edge"]["step_deg"]))
    sine = np.sin(theta)
    return np.stack(
        [sine * np.cos(turn), sine * np.sin(turn), np.full_like(turn, np.cos(theta))], -1
    )


@cache
def border(steps: int) -> Floats:
    """Round a square from -1 to 1, clockwise from its top left; closed."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)], dtype=np.float64)
    along = np.arange(steps)[:, None] / steps
    sides = [a + (b - a) * along for a, b in pairwise(corners)]
    return np.concatenate([*sides, corners[:1]])
