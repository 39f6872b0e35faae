"""Chessboards in strongly bent pictures.

    corner candidates -> the largest grid of them -> corners too faint to be found alone, where the
    grid expects them -> every corner placed to a fraction of a pixel -> those that look like none
    dropped

First in the picture made small, where noise and blur count for little, then finer for as long as
the squares are small.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..lens import Floats
from ._corners import SEARCH, find_corners, grid_of
from ._lattice import Bools, Cells, Lattice, LocalMaps, in_squares
from ._saddles import ENOUGH_PX, LIKE, Gray, Slopes, Window, edge_blur_px, likeness, placed

FEWEST = 12  # corners; below that a grid is chance
FEWEST_LINES = 3
FAINT_SEARCH = 0.6
STRAY = 0.35  # of a square: how far from where its neighbours expect it a corner may be
FAINT = 0.1  # of the usual contrast; what is fainter is no corner of this board
COARSEST = 150  # pixels along the shorter side
LARGEST = 6_000_000  # pixels: larger pictures are looked at only if smaller ones show a board
ROUGH_PX = 0.05  # how exactly corners are placed while the board is looked for
TINY_PX = 5.0  # squares that are looked at enlarged
DOUBLED = 2_000_000  # pixels: pictures up to that, enlarged, are looked at before giving up
SHARP_PX = 2.0  # blur below which nothing has to be done about it
USUAL_ROWS = 800
RESOLVED_PX = 12.0  # wide enough a square that a finer picture shows no more corners


@dataclass(frozen=True)
class Grid:
    """Corners of one board: `pixels` (n, 2) and `cells` (n, 2), column and row, from 0.

    Rows are clockwise (y down) of columns, as seen in the picture.
    """

    cells: NDArray[np.int64]
    pixels: Floats

    @property
    def size(self) -> tuple[int, int]:
        """Inner corners across and down."""
        columns, rows = self.cells.max(axis=0) + 1
        return int(columns), int(rows)


def find_chessboard(gray: Gray, inner: tuple[int, int] | None = None) -> Grid | None:
    """The largest chessboard in a picture (rows, columns) of uint8; None if there is none.

    `inner` is the number of inner corners, across and down in either order: a grid that is larger
    is cut to the part of that size that has most corners; a smaller one is taken as it is.
    """
    best: Lattice | None = None
    for level, scale in _levels(gray):
        if not _worthwhile(level, gray, best):
            break
        lattice = _board(level)
        if lattice is not None and (best is None or len(lattice) > len(best)):
            cells = lattice.cells()
            best = Lattice.of(cells, (lattice.pixels(cells) + 0.5) / scale - 0.5)
    if best is None:
        return None
    slopes = Slopes.of(gray)
    best = _checked(best, slopes, _suited(slopes, best))
    if best is None:
        return None
    alike, _ = _alike(slopes, best.cells(), _corner_maps(best))
    return _as_grid(best, inner, float(alike.mean()))


def _worthwhile(level: Gray, gray: Gray, found: Lattice | None) -> bool:
    """Whether to look at this size of the picture after a smaller one showed `found`."""
    if found is None:
        return level.size <= (DOUBLED if level.size > gray.size else LARGEST)
    narrowest = float(_corner_maps(found).shortest_step().min())
    if level.size > gray.size:
        return narrowest < TINY_PX
    return narrowest * np.sqrt(level.size / gray.size) / 2 < RESOLVED_PX


def _board(level: Gray) -> Lattice | None:
    """The largest board in one size of the picture."""
    lattice = grid_of(find_corners(level))
    if lattice is None or len(lattice) < FEWEST:
        return None
    slopes = Slopes.of(level)
    lattice.grow(_Faint(slopes, lattice))
    return _checked(lattice, slopes, Window(), ROUGH_PX)


def _levels(gray: Gray) -> Iterator[tuple[Gray, Floats]]:
    """The picture at growing sizes, the smallest first, and its scale along x and y."""
    rows, columns = gray.shape
    halvings = max(0, int(np.log2(max(1.0, min(rows, columns) / COARSEST))))
    for halved in range(halvings, 0, -1):
        size = (columns >> halved, rows >> halved)
        scale = np.array(size) / (columns, rows)
        yield cv2.resize(gray, size, interpolation=cv2.INTER_AREA), scale
    yield gray, np.ones(2)
    if 4 * gray.size <= LARGEST:
        size = (2 * columns, 2 * rows)
        yield cv2.resize(gray, size, interpolation=cv2.INTER_LINEAR), np.full(2, 2.0)


class _Faint:
    """Finds corners by the picture alone where a grid expects them."""

    def __init__(self, slopes: Slopes, lattice: Lattice) -> None:
        self.slopes = slopes
        alike, contrast = _alike(slopes, lattice.cells(), _corner_maps(lattice))
        self.sign = np.sign(alike.mean())
        self.least = FAINT * float(np.median(contrast))

    def __call__(self, cells: Cells, maps: LocalMaps) -> Floats:
        at, good = placed(self.slopes, maps.place, maps, Window(), ROUGH_PX)
        good &= in_squares(maps.axes, at - maps.place) < FAINT_SEARCH
        here = LocalMaps(np.where(good[:, None], at, maps.place), maps.axes, maps.bend, maps.known)
        alike, contrast = _alike(self.slopes, cells, here)
        good &= (self.sign * alike > LIKE) & (contrast > self.least)
        return np.where(good[:, None], at, np.nan)


def _corner_maps(lattice: Lattice) -> LocalMaps:
    """The local maps around the known corners, from exactly there."""
    cells = lattice.cells()
    maps = lattice.maps(cells, own=True)
    return LocalMaps(lattice.pixels(cells), maps.axes, maps.bend, maps.known)


def _alike(slopes: Slopes, cells: Cells, maps: LocalMaps) -> tuple[Floats, Floats]:
    """As `likeness`, with one sign for a whole board: that of cell (0, 0)."""
    alike, contrast = likeness(slopes.level, maps)
    return alike * np.where(cells.sum(axis=1) % 2 == 1, -1.0, 1.0), contrast


def _suited(slopes: Slopes, lattice: Lattice) -> Window:
    """A window as wide as edges are blurred, and as the picture is large.

    Smoothing a blurred picture would only bring the next squares nearer.
    """
    blur = edge_blur_px(slopes, _corner_maps(lattice))
    wide = 12.0 * max(1.0, min(slopes.level.shape) / USUAL_ROWS)
    return Window(widest_px=max(wide, 10 * blur if blur > SHARP_PX else 0.0))


def _checked(
    lattice: Lattice, slopes: Slopes, window: Window, enough_px: float = ENOUGH_PX
) -> Lattice | None:
    """Corners placed finely; without those that look like none or are where none should be."""
    cells, maps = lattice.cells(), _corner_maps(lattice)
    at, good = placed(slopes, maps.place, maps, window, enough_px)
    good &= maps.known & (in_squares(maps.axes, at - maps.place) < SEARCH)
    fine = _kept(cells, at, good)
    if len(fine) < FEWEST:
        return None
    cells, maps = fine.cells(), _corner_maps(fine)
    alike, contrast = _alike(slopes, cells, maps)
    good = (np.sign(alike.mean()) * alike > LIKE) & (contrast > FAINT * np.median(contrast))
    fine = _kept(cells, maps.place, good)
    fine.drop_strays(STRAY)
    fine.drop_thin_lines(2)
    lines = [len(np.unique(line)) for line in fine.cells().T]
    return fine if len(fine) >= FEWEST and min(lines) >= FEWEST_LINES else None


def _kept(cells: Cells, pixels: Floats, good: Bools) -> Lattice:
    return Lattice.of(cells[good], pixels[good])


def _as_grid(lattice: Lattice, inner: tuple[int, int] | None, alike: float) -> Grid | None:
    """`alike`: positive if the square before cell (0, 0), up and left of it, is light."""
    cells = lattice.cells()
    if inner is not None:
        cells = cells[_cut(cells - cells.min(axis=0), inner)]
    if len(cells) < FEWEST:
        return None
    pixels = lattice.pixels(cells)
    first = cells.min(axis=0)
    light = (alike > 0) == (first.sum() % 2 == 0)
    return _turned(Grid(cells - first, pixels), inner, light)


def _turned(grid: Grid, inner: tuple[int, int] | None, light: bool) -> Grid:
    """The grid so that it lies as alike as can be in all pictures of one board.

    As `inner` says where it fits only so; a whole board that looks different upside down with its
    dark corner first; and then with its rows to the right. `light`: the square before cell (0, 0).
    """
    turns = []
    for _ in range(4):
        turns.append((grid, light))
        last = grid.cells[:, 0].max()
        # the first cell was the last of its row, and the square before it that above on the right
        light = light != (last % 2 == 0)
        grid = Grid(np.stack([grid.cells[:, 1], last - grid.cells[:, 0]], axis=-1), grid.pixels)
    if inner is not None:
        turns = [t for t in turns if t[0].size[0] <= inner[0] and t[0].size[1] <= inner[1]]
    if sum(grid.size) % 2 == 1 and inner in (None, turns[0][0].size):
        turns = [turn for turn in turns if not turn[1]]
    return max(turns, key=lambda turn: _rightward(turn[0]))[0]


def _rightward(grid: Grid) -> float:
    """How far to the right the picture's x grows with the columns."""
    columns = grid.cells[:, 0] - grid.cells[:, 0].mean()
    return float(columns @ grid.pixels[:, 0])


def _cut(cells: Cells, inner: tuple[int, int]) -> Bools:
    """Which cells lie in the part of the board's size that has most of them."""
    best = np.zeros(len(cells), bool)
    last = cells.max(axis=0)
    for columns, rows in {inner, inner[::-1]}:
        for i in range(max(1, int(last[0]) - columns + 2)):
            for j in range(max(1, int(last[1]) - rows + 2)):
                x, y = cells[:, 0] - i, cells[:, 1] - j
                inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
                if inside.sum() > best.sum():
                    best = inside
    return best
