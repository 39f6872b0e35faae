"""Shapes to what a pen draws: straight pieces and letters with colours, in pixels of the view.

A piece's rim lies under it and over everything that came before it; letters lie over all pieces.
The page's pen (web/static/pen.js) does the same.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import floor

import numpy as np
from numpy.typing import NDArray

from ..lens import Floats
from .definition import Color, Theme
from .letters import Sheet, Sheets
from .shapes import Box, Lines, Shape, Text

Float32s = NDArray[np.float32]
PIECE = 9  # x0, y0, x1, y1, half width, red, green, blue, opacity
LETTER = 10  # left, top, width, height, place in the sheet (left, top), colour


@dataclass(frozen=True)
class Ink:
    """What the two draw calls need: pieces (n, 9) and letters (m, 10), each in its order."""

    pieces: Float32s
    letters: Float32s

    def __add__(self, over: Ink) -> Ink:
        return Ink(
            np.concatenate([self.pieces, over.pieces]), np.concatenate([self.letters, over.letters])
        )


class Inker:
    """For one theme at so many pixels per point; `sheets` has all letters that ink was made of."""

    def __init__(self, theme: Theme, ratio: float) -> None:
        self.sheets = Sheets(theme.rim_width * ratio, theme.weight)
        self._theme, self._ratio = theme, ratio

    def ink(self, shapes: Iterable[Shape]) -> Ink:
        pieces: list[Float32s] = []
        letters: list[tuple[float, ...]] = []
        for shape in shapes:
            if isinstance(shape, Lines):
                pieces += self._lines(shape)
            elif isinstance(shape, Box):
                pieces.append(self._box(shape))
            else:
                letters += self._text(shape)
        return Ink(
            np.concatenate(pieces) if pieces else np.zeros((0, PIECE), np.float32),
            np.array(letters, np.float32).reshape(-1, LETTER),
        )

    def _lines(self, shape: Lines) -> list[Float32s]:
        theme, ratio = self._theme, self._ratio
        ends, half = shape.pieces * ratio, shape.width * theme.weight * ratio / 2
        red, green, blue, alpha = theme.rim
        rim = (red, green, blue, alpha * shape.opacity)
        color = theme.color(shape.role, shape.opacity)
        return [_pieces(ends, half + theme.rim_width * ratio, rim), _pieces(ends, half, color)]

    def _box(self, shape: Box) -> Float32s:
        rect, ratio = shape.rect, self._ratio
        middle = rect.y + rect.height / 2
        ends = np.array([(rect.x, middle, rect.x + rect.width, middle)]) * ratio
        return _pieces(ends, rect.height / 2 * ratio, self._theme.color(shape.role, shape.opacity))

    def _text(self, shape: Text) -> list[tuple[float, ...]]:
        """Letters on whole pixels: they stay crisp."""
        sheet, row = self.sheets.at(shape.size * self._ratio)
        color = self._theme.color(shape.role, shape.opacity)
        left, top = corner_of(shape, sheet, self._ratio)
        return [
            (left + floor(i * sheet.step + 0.5), top, *sheet.cell, column, row, *color)
            for i, column in enumerate(sheet.columns(shape.text))
            if column >= 0
        ]


def corner_of(shape: Text, sheet: Sheet, ratio: float) -> tuple[int, int]:
    """The top left pixel of the first letter's cell."""
    share = {"left": 0.0, "middle": 0.5, "right": 1.0}[shape.anchor]
    start = shape.x * ratio - share * len(shape.text) * sheet.step
    left = start - (sheet.cell[0] - sheet.step) / 2
    return floor(left + 0.5), floor(shape.y * ratio - sheet.cell[1] / 2 + 0.5)


def _pieces(ends: Floats, half: float, color: Color) -> Float32s:
    made = np.empty((len(ends), PIECE), np.float32)
    made[:, :4], made[:, 4], made[:, 5:] = ends, half, color
    return made
