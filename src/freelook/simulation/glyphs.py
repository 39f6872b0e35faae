"""Letters and digits as strokes: in a box of height 1, x right, y up, origin in the middle."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .pyramid import Float32s

# corners of each glyph on a grid of 4 x 6 cells, (0, 0) bottom left; '|' lifts the pen
_PENS = {
    "F": "00 06 46 | 03 33",
    "R": "00 06 46 43 03 | 23 40",
    "7": "06 46 20",
    "L": "06 00 40",
    "3": "06 46 40 00 | 13 43",
    "6": "46 06 00 40 43 03",
    "1": "15 26 20 | 10 30",
    "8": "00 06 46 40 00 | 03 43",
    "H": "00 06 | 40 46 | 03 43",
}
NAMES = tuple(_PENS)


class Glyphs(NamedTuple):
    """Strokes (total, 4) as x0, y0, x1, y1; glyph i owns starts[i] to starts[i + 1]."""

    strokes: Float32s
    starts: NDArray[np.int32]


def make_glyphs() -> Glyphs:
    """All glyphs, in the order of `NAMES`."""
    strokes = [_strokes(pens) for pens in _PENS.values()]
    starts = np.concatenate([[0], np.cumsum([len(s) for s in strokes])]).astype(np.int32)
    return Glyphs(np.concatenate(strokes), starts)


def _strokes(pens: str) -> Float32s:
    found = []
    for line in pens.split("|"):
        points = [(int(p[0]) / 6 - 1 / 3, int(p[1]) / 6 - 1 / 2) for p in line.split()]
        found += [(*a, *b) for a, b in pairwise(points)]
    return np.asarray(found, dtype=np.float32)
