"""Letters as strokes, and a sheet of them at one size: how much of each pixel they cover.

The strokes are in hud.json, on a grid of 8 x 12 cells, (0, 0) top left, both coordinates a
hexadecimal digit; "|" lifts the pen. The page makes its sheets of them in the same way
(web/static/letters.js). All letters are equally wide.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from ..lens import Floats
from .definition import definition

GRID = (8, 12)


@dataclass(frozen=True)
class Sheet:
    """All letters at one size side by side, in the order of hud.json.

    `covered` (height, width, 2) is how much of a pixel the strokes cover, and how much the strokes
    with the rim, 0 to 255. `cell` is a letter's (width, height) there, `margin` of it on every
    side for the rim; letters are written `step` apart. All in pixels.
    """

    covered: NDArray[np.uint8]
    cell: tuple[int, int]
    step: float
    margin: int

    def columns(self, text: str) -> list[int]:
        """Where each letter begins in the sheet; -1 for a blank."""
        return [-1 if letter == " " else self.cell[0] * numbers()[letter] for letter in text]


def numbers() -> dict[str, int]:
    return {letter: number for number, letter in enumerate(definition()["letters"])}


def strokes(letter: str) -> Floats:
    """(n, 4) as x0, y0, x1, y1 on the grid."""
    found = []
    for line in definition()["letters"][letter].split("|"):
        points = [(int(point[0], 16), int(point[1], 16)) for point in line.split()]
        found += [(*a, *b) for a, b in pairwise(points)]
    return np.array(found, dtype=np.float64)


def make_sheet(size_px: float, rim_px: float, weight: float) -> Sheet:
    """Letters so many pixels large, with lines as heavy as `weight` says (1: usual)."""
    look = definition()["text"]
    half = max(0.5, size_px * look["stroke"] * weight / 2)
    step = size_px * look["advance"]
    # whole pixels, so that upright and level strokes are as crisp as can be
    wide = max(2, floor(size_px * look["width"] + 0.5))
    high = 2 * max(1, floor(size_px * look["height"] / 2 + 0.5))
    margin = ceil(rim_px + half + 0.5)
    cell = (wide + 1 + 2 * margin, high + 1 + 2 * margin)
    scale = np.array([wide, high]) / GRID
    corner = np.array([margin + 0.5, margin + 0.5])
    letters = [
        _covered(strokes(letter) * np.tile(scale, 2) + np.tile(corner, 2), cell, half, rim_px)
        for letter in definition()["letters"]
    ]
    return Sheet(np.concatenate(letters, axis=1), cell, step, margin)


def _covered(ends: Floats, cell: tuple[int, int], half: float, rim_px: float) -> NDArray[np.uint8]:
    """By how far the middle of each pixel is from the nearest stroke."""
    y, x = np.mgrid[0 : cell[1], 0 : cell[0]] + 0.5
    away = np.full_like(x, np.inf)
    for x0, y0, x1, y1 in ends:
        dx, dy = x1 - x0, y1 - y0
        length2 = dx * dx + dy * dy
        along = ((x - x0) * dx + (y - y0) * dy) / length2 if length2 > 0 else np.zeros_like(x)
        along = np.clip(along, 0, 1)
        away = np.minimum(away, np.hypot(x - x0 - along * dx, y - y0 - along * dy))
    shares = [np.clip(width + 0.5 - away, 0, 1) for width in (half, half + rim_px)]
    return np.floor(np.stack(shares, axis=-1) * 255 + 0.5).astype(np.uint8)


class Sheets:
    """Of one theme, made when a size is first wanted, and lying one below the other."""

    def __init__(self, rim_px: float, weight: float) -> None:
        self._rim_px, self._weight = rim_px, weight
        self._made: dict[float, tuple[Sheet, int]] = {}
        self._rows = 0

    def __len__(self) -> int:
        return len(self._made)

    def at(self, size_px: float) -> tuple[Sheet, int]:
        """The sheet, and in which row of them all it begins."""
        if size_px not in self._made:
            sheet = make_sheet(size_px, self._rim_px, self._weight)
            self._made[size_px] = (sheet, self._rows)
            self._rows += len(sheet.covered)
        return self._made[size_px]

    def together(self) -> NDArray[np.uint8]:
        """All of them, (rows, columns of the widest, 2)."""
        covered = [sheet.covered for sheet, _ in self._made.values()]
        width = max(one.shape[1] for one in covered)
        wide = [np.pad(one, ((0, 0), (0, width - one.shape[1]), (0, 0))) for one in covered]
        return np.ascontiguousarray(np.concatenate(wide))
