"""ChArUco boards: chessboards with markers in their light squares, as OpenCV prints them.

Which corner is which is known, so that any part of the board will do, and two cameras may see
different parts. The markers stand close to the corners, though: those are placed by a quarter of
the pixels that a plain chessboard's are.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from ..errors import CalibrationError
from ..lens import Floats
from ._markers import Plan, dictionary, find_corners, find_markers, marker_bits
from ._saddles import Gray
from .drawing import Drawing, squares
from .views import FEWEST_POINTS, View

SEARCH = 0.3  # of a square: how far from its expected place a corner may be


@dataclass(frozen=True)
class Charuco:
    """`squares` across and down (not corners), side of a square and of a marker, dictionary.

    Patterns with an even number of rows that were printed by OpenCV before 4.6 begin with a light
    square; both are recognised.
    """

    squares: tuple[int, int]
    square: float
    marker: float
    dictionary: str = "5x5_1000"

    def __post_init__(self) -> None:
        columns, rows = self.squares
        if columns < 3 or rows < 3:
            raise CalibrationError(f"{columns} x {rows} squares are too few; at least 3 x 3")
        if not 0 < self.marker < self.square < np.inf:
            raise CalibrationError(
                f"markers of {self.marker:g} do not fit into squares of {self.square:g}"
            )
        there = len(dictionary(self.dictionary).bytesList)
        needed = columns * rows // 2 + 1
        if there < needed:
            raise CalibrationError(
                f"{columns} x {rows} squares take {needed} markers, {self.dictionary} has {there}"
            )

    named = True

    @property
    def text(self) -> str:
        columns, rows = self.squares
        size = f"{columns}x{rows}:{self.square:g}:{self.marker:g}"
        return f"charuco:{size}:{self.dictionary}"

    @cached_property
    def points(self) -> Floats:
        """(n, 3): all inner corners, row by row, from the board's corner, y down."""
        columns, rows = self.squares
        x, y = np.meshgrid(np.arange(1, columns), np.arange(1, rows))
        flat = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=-1)
        return np.asarray(flat * self.square)

    def find(self, gray: Gray, name: str) -> View | None:
        columns, rows = self.squares
        numbers, seen = find_markers(gray, self.dictionary, columns * rows // 2)
        best: View | None = None
        for plan in self._plans:
            which, pixels = find_corners(gray, plan, numbers, seen)
            if len(which) >= FEWEST_POINTS and (best is None or len(which) > len(best.pixels)):
                best = View(name, self.points[which], pixels)
        return best

    @property
    def drawing(self) -> Drawing:
        columns, rows = self.squares
        margin = self.square / 2
        dark = np.indices((rows, columns)).sum(axis=0) % 2 == 0
        shapes = [squares(dark, self.square, margin, margin)]
        for number, corners in enumerate(self._board(legacy=False).getObjPoints()):
            bits = marker_bits(self.dictionary, number)
            x, y = corners[0][:2] + margin
            shapes.append(squares(bits, self.marker / len(bits), float(x), float(y)))
        size = columns * self.square + 2 * margin, rows * self.square + 2 * margin
        return Drawing(size, np.concatenate(shapes))

    def _board(self, *, legacy: bool) -> cv2.aruco.CharucoBoard:
        kind = dictionary(self.dictionary)
        board = cv2.aruco.CharucoBoard(self.squares, self.square, self.marker, kind)
        board.setLegacyPattern(legacy)
        return board

    @cached_property
    def _plans(self) -> list[Plan]:
        legacies = (False, True) if self.squares[1] % 2 == 0 else (False,)
        return [self._plan(legacy=legacy) for legacy in legacies]

    def _plan(self, *, legacy: bool) -> Plan:
        markers = np.array(self._board(legacy=legacy).getObjPoints())[..., :2] / self.square
        corners = self.points[:, :2] / self.square
        # beyond a corner, on both axes, lies square (x, y): with markers if it is light
        odd = corners.sum(axis=1).round().astype(int) % 2 == 1
        signs = np.where(odd != legacy, 1.0, -1.0)
        to_marker = (1 - self.marker / self.square) / np.sqrt(2)
        return Plan(markers, corners, signs, to_marker, SEARCH)
