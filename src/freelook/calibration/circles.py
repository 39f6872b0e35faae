"""Grids of circles, in rows one above the other or, asymmetric, every other row shifted.

The middle of a circle's picture is not quite where its centre is seen: perspective and the lens
move it, more the larger the circle; by 0.2 pixel for circles 26 pixels wide in a fisheye picture
of 260 pixels per radian. How the grid bends there tells by how much, and it is taken off again.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from ..errors import CalibrationError
from ..lens import Floats
from ._blobs import find_blobs, grid_of
from ._discs import centres, weighed
from ._lattice import Cells, Lattice
from ._saddles import Gray
from .drawing import Drawing
from .views import View

FEWEST = 12
FEWEST_LINES = 3
STRAY = 0.3  # of a step
SMALL_PX = 25.0  # steps below that are looked at enlarged too
DOUBLED = 2_000_000  # pixels: pictures up to that are looked at enlarged before giving up


@dataclass(frozen=True)
class Circles:
    """`spacing` between rows, and within a row: twice that if every other row is shifted.

    `count` circles across and down, as OpenCV counts them (asymmetric: in one row, and rows);
    None: as many as are found. `diameter` is for printing only; None: half of what they stand
    apart.
    """

    spacing: float = 1.0
    count: tuple[int, int] | None = None
    asymmetric: bool = False
    diameter: float | None = None

    def __post_init__(self) -> None:
        if not (0 < self.spacing < np.inf and 0 < (self.diameter or 1.0) < np.inf):
            raise CalibrationError("spacing and diameter of circles must be positive")

    named = False

    @property
    def text(self) -> str:
        kind = "acircles" if self.asymmetric else "circles"
        size = "" if self.count is None else f":{self.count[0]}x{self.count[1]}"
        diameter = "" if self.diameter is None else f":{self.diameter:g}"
        return f"{kind}{size}:{self.spacing:g}{diameter}"

    def find(self, gray: Gray, name: str) -> View | None:
        lattice = _found(gray, lone=self.asymmetric)
        if lattice is None:
            return None
        cells = lattice.cells()
        grid = self._upright(cells)
        if grid is None:
            return None
        kept, where = grid
        if len(kept) < FEWEST or min(len(np.unique(line)) for line in where.T) < FEWEST_LINES:
            return None
        flat = where * self.spacing
        points = np.column_stack([flat, np.zeros(len(flat))])
        return View(name, points, lattice.pixels(kept))

    @property
    def _apart(self) -> float:
        """Between neighbours."""
        return self.spacing * (np.sqrt(2.0) if self.asymmetric else 1.0)

    @property
    def points(self) -> Floats:
        """(n, 3): all circles, row by row, y down."""
        flat = self.places * self.spacing
        return np.column_stack([flat, np.zeros(len(flat))])

    @property
    def places(self) -> Cells:
        """(n, 2): all circles, in units of `spacing`, row by row."""
        if self.count is None:
            raise CalibrationError("how many circles? give COLUMNSxROWS")
        columns, rows = self.count
        j, i = (a.ravel() for a in np.mgrid[:rows, :columns])
        return np.stack([2 * i + j % 2 if self.asymmetric else i, j], axis=-1)

    @property
    def drawing(self) -> Drawing:
        radius = (self._apart / 2 if self.diameter is None else self.diameter) / 2
        if 2 * radius >= self._apart:
            raise CalibrationError(
                f"circles of {2 * radius:g} at {self._apart:g} from each other run into each other"
            )
        places = self.places * self.spacing
        margin = self._apart * 0.75
        width, height = places.max(axis=0) + 2 * margin
        circles = np.column_stack([places + margin, np.full(len(places), radius)])
        return Drawing((float(width), float(height)), circles=circles)

    def _upright(self, cells: Cells) -> tuple[Cells, Cells] | None:
        """Which cells are the target's, and where they are on it in units of `spacing`.

        The turn, by quarters, that most fit in; the size is cut to the target's if that is known.
        """
        best: tuple[Cells, Cells] | None = None
        for turned in _quarter_turns(cells):
            i, j = turned.T
            # of an asymmetric grid, neighbours lie diagonally
            where = np.stack([i - j, i + j], axis=-1) if self.asymmetric else turned
            kept, where = self._cut(where - where.min(axis=0))
            if best is None or len(kept) > len(best[0]):
                best = cells[kept], where
        return best

    def _cut(self, where: Cells) -> tuple[Cells, Cells]:
        """Numbers of the places in the part of the target's size that has most, and these."""
        everything = np.arange(len(where))
        if self.count is None:
            return everything, where
        target = {tuple(place) for place in self.places}
        width, height = self.places.max(axis=0)
        last = where.max(axis=0)
        best, corner = everything[:0], (0, 0)
        for x in range(min(0, int(last[0] - width)), max(0, int(last[0] - width)) + 1):
            for y in range(min(0, int(last[1] - height)), max(0, int(last[1] - height)) + 1):
                shifted = where - (x, y)
                inside = np.array([tuple(place) in target for place in shifted])
                if inside.sum() > len(best):
                    best, corner = np.flatnonzero(inside), (x, y)
        return best, where[best] - corner


def _quarter_turns(cells: Cells) -> list[Cells]:
    turns = [cells]
    for _ in range(3):
        turns.append(np.stack([turns[-1][:, 1], -turns[-1][:, 0]], axis=-1))
    return turns


def _found(gray: Gray, *, lone: bool) -> Lattice | None:
    """The largest grid of dark blobs, or if there is none, of light ones.

    `lone`: whether a blob may be the only one of its line of the grid, as at the corners of
    asymmetric ones.
    """
    for picture in (gray, 255 - gray):
        lattice = _grid(picture, 1.0, lone=lone)
        if gray.size <= DOUBLED and (lattice is None or _step_px(lattice) < SMALL_PX):
            enlarged = cv2.resize(picture, None, fx=2, fy=2, interpolation=cv2.INTER_LINEAR)
            finer = _grid(enlarged, 2.0, lone=lone)
            if finer is not None and (lattice is None or len(finer) > len(lattice)):
                cells = finer.cells()
                lattice = Lattice.of(cells, (finer.pixels(cells) + 0.5) / 2 - 0.5)
        if lattice is not None:
            return lattice
    return None


def _step_px(lattice: Lattice) -> float:
    """The narrowest step between circles."""
    return float(lattice.maps(lattice.cells(), own=True).shortest_step().min())


def _grid(gray: Gray, scale: float, *, lone: bool) -> Lattice | None:
    blobs = weighed(gray, find_blobs(gray, scale))
    lattice = grid_of(blobs)
    if lattice is None:
        return None
    lattice.drop_strays(STRAY)
    if not lone:
        lattice.drop_thin_lines(2)
    if len(lattice) < FEWEST:
        return None
    lattice.put(lattice.cells(), centres(blobs, lattice))
    return lattice
