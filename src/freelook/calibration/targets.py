"""What is held in front of the camera, and where its points are.

A target is a frozen dataclass with `find(gray, name)`: the `View` of it in a picture, or None when
it is not there. Its points are in metres if its sizes were given in metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .chessboard import find_chessboard
from .views import View

Gray = NDArray[np.uint8]


class Target(Protocol):
    """What every target supplies."""

    def find(self, gray: Gray, name: str) -> View | None: ...


@dataclass(frozen=True)
class Chessboard:
    """A chessboard: `inner` corners across and down (None: as many as are found), square size.

    Neither which corner is which nor the whole board is needed, and any number of rows and
    columns may be hidden.
    """

    square: float = 1.0
    inner: tuple[int, int] | None = None

    def find(self, gray: Gray, name: str) -> View | None:
        grid = find_chessboard(gray, self.inner)
        if grid is None:
            return None
        flat = grid.cells * self.square
        return View(name, np.column_stack([flat, np.zeros(len(flat))]), grid.pixels)
