"""What a target looks like on paper: black shapes on white."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..lens import Floats


@dataclass(frozen=True)
class Drawing:
    """Black shapes, in the target's unit (metres), x right and y down from the top left corner.

    size        (width, height) of the target with the light margin it needs to be found
    rectangles  (n, 4): x, y, width, height
    circles     (n, 3): x, y of the middle, radius
    """

    size: tuple[float, float]
    rectangles: Floats = field(default_factory=lambda: np.empty((0, 4)))
    circles: Floats = field(default_factory=lambda: np.empty((0, 3)))


def squares(dark: NDArray[np.bool_], side: float, x: float, y: float) -> Floats:
    """(n, 4) rectangles for the dark cells of a grid (rows, columns) whose corner is at (x, y).

    Neighbours in a row are one rectangle: fewer seams that a printer could show.
    """
    found = []
    for row, line in enumerate(dark):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], line.astype(np.int8), [0]])))
        for start, end in edges.reshape(-1, 2):
            found.append((x + start * side, y + row * side, (end - start) * side, side))
    return np.array(found).reshape(-1, 4)
