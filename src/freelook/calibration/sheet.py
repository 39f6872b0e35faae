"""A target on a sheet of paper at its true size, with a ruler to measure what the printer did.

Everything is in millimetres, x right and y down from the sheet's top left corner.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import CalibrationError
from ..lens import Floats
from .drawing import Drawing
from .targets import KINDS, Target, parse_target, simple_target

PAPERS = {
    "a5": (148.0, 210.0),
    "a4": (210.0, 297.0),
    "a3": (297.0, 420.0),
    "a2": (420.0, 594.0),
    "a1": (594.0, 841.0),
    "a0": (841.0, 1189.0),
    "letter": (215.9, 279.4),
    "legal": (215.9, 355.6),
    "tabloid": (279.4, 431.8),
}
SMALLEST, LARGEST = 100.0, 5000.0  # sides of a sheet; a PDF page ends at 5080 mm
EDGE = 6.0  # along which printers put nothing
STRIP = 22.0  # below the target, for the ruler and its words
RULERS = (100.0, 50.0)  # the first that fits
COUNTS = {  # where only a kind is said
    "chessboard": (9, 6),
    "charuco": (10, 7),
    "circles": (9, 6),
    "acircles": (4, 11),
    "aprilgrid": (6, 6),
}


@dataclass(frozen=True)
class Text:
    """Words that begin at (x, y), on their base line; `height` is that of the font."""

    x: float
    y: float
    height: float
    words: str
    typed: bool = False


@dataclass(frozen=True)
class Sheet:
    """What is to be printed, in black.

    size        (width, height) of the paper
    rectangles  (n, 4): x, y, width, height; of the target alone
    circles     (n, 3): x, y of the middle, radius
    marks       (n, 4): rectangles of the ruler
    """

    size: tuple[float, float]
    rectangles: Floats
    circles: Floats
    marks: Floats
    texts: tuple[Text, ...]


def paper_size(text: str) -> tuple[float, float]:
    """A name in PAPERS, or WIDTHxHEIGHT in millimetres; CalibrationError lists the names."""
    if text.lower() in PAPERS:
        return PAPERS[text.lower()]
    match = re.fullmatch(r"(\d+(?:\.\d+)?)x(\d+(?:\.\d+)?)", text)
    if not match:
        raise CalibrationError(
            f"unknown paper '{text}'; give one of {', '.join(PAPERS)}, or WIDTHxHEIGHT in "
            "millimetres, such as 600x400"
        )
    width, height = float(match[1]), float(match[2])
    if not SMALLEST <= min(width, height) <= max(width, height) <= LARGEST:
        raise CalibrationError(
            f"paper of {width:g} x {height:g} mm; sides can be {SMALLEST:g} to {LARGEST:g} mm"
        )
    return width, height


def target_for(
    text: str,
    paper: tuple[float, float],
    counts: tuple[int, int] | None = None,
    side: float | None = None,
) -> Target:
    """The target a text describes; of a kind alone, the largest that the paper holds.

    `counts` and `side` (metres) are those of a kind alone: inner corners, squares, circles or tags
    across and down; the side of a square or tag, or the spacing. Sides are whole millimetres.
    """
    if text not in KINDS:
        return parse_target(text)
    counts = counts or COUNTS[text]
    if side is not None:
        return simple_target(text, counts, side)
    room = _largest_scale(simple_target(text, counts, 1.0).drawing, paper)
    whole = int(room * 1000)
    if whole < 1:
        raise CalibrationError(
            f"{counts[0]} x {counts[1]} are too many for a sheet of {_size(paper)}: they would be "
            "smaller than a millimetre"
        )
    return simple_target(text, counts, whole / 1000)


def sheet_of(target: Target, paper: tuple[float, float]) -> Sheet:
    """The target in the middle of the paper, whichever way round it fits.

    CalibrationError says what it needs, and what would fit, if it does not.
    """
    drawing = target.drawing
    for page, turned in _ways(drawing, paper):
        if _scale(turned, page) >= 1 - 1e-9:
            return _sheet(turned, page, target)
    raise CalibrationError(_too_large(target, drawing, paper))


def _ways(
    drawing: Drawing, paper: tuple[float, float]
) -> Iterator[tuple[tuple[float, float], Drawing]]:
    """The paper and the drawing, each as it is and turned by a quarter."""
    for turned in (drawing, _turned(drawing)):
        yield paper, turned
        yield paper[::-1], turned


def _turned(drawing: Drawing) -> Drawing:
    """By a quarter: what was at the bottom is on the left."""
    width, height = drawing.size
    x, y, w, h = drawing.rectangles.T
    circles = drawing.circles[:, [1, 0, 2]] * [-1, 1, 1] + [height, 0, 0]
    return Drawing((height, width), np.stack([height - y - h, x, h, w], axis=-1), circles)


def _scale(drawing: Drawing, page: tuple[float, float]) -> float:
    """How many times as large it could be."""
    width, height = (1000 * side for side in drawing.size)
    return min(page[0] / width, (page[1] - STRIP) / height)


def _largest_scale(drawing: Drawing, paper: tuple[float, float]) -> float:
    return max(_scale(turned, page) for page, turned in _ways(drawing, paper))


def _too_large(target: Target, drawing: Drawing, paper: tuple[float, float]) -> str:
    width, height = (1000 * side for side in drawing.size)
    fitting = [name for name, size in PAPERS.items() if _largest_scale(drawing, size) >= 1 - 1e-9]
    smallest = min(fitting, key=lambda name: np.prod(PAPERS[name]), default="")
    enough = "x".join(f"{np.ceil(round(side, 3)):.0f}" for side in (width, height + STRIP))
    share = _largest_scale(drawing, paper)
    return (
        f"{target.text} with its light margin is {width:.0f} x {height:.0f} mm, and {STRIP:.0f} mm "
        f"are for the ruler: too large for {_size(paper)}. It fits on "
        f"{f'--paper {smallest} or ' if smallest else ''}--paper {enough}; on this paper, sizes up "
        f"to {share:.2f} of these do"
    )


def _size(paper: tuple[float, float]) -> str:
    name = next((name for name, size in PAPERS.items() if size == paper), "")
    return f"{name + ' (' if name else ''}{paper[0]:g} x {paper[1]:g} mm{')' if name else ''}"


def _sheet(drawing: Drawing, page: tuple[float, float], target: Target) -> Sheet:
    width, height = page
    corner = (width - 1000 * drawing.size[0]) / 2, (height - STRIP - 1000 * drawing.size[1]) / 2
    ruler = next(length for length in RULERS if length <= width - 2 * EDGE - 10)
    bottom = height - EDGE
    texts = (
        Text(EDGE, bottom - 11.5, 3.5, f"--target {target.text}", typed=True),
        Text(EDGE, bottom - 6.5, 3.0, f"Print at 100 %, measure this: {ruler:g} mm"),
        Text(EDGE + ruler + 2, bottom - 0.5, 3.0, f"{ruler:g} mm"),
    )
    return Sheet(
        page,
        1000 * drawing.rectangles + [*corner, 0, 0],
        1000 * drawing.circles + [*corner, 0],
        _ruler(EDGE, bottom, ruler),
        texts,
    )


def _ruler(x: float, y: float, length: float) -> Floats:
    """A line of `length` that ends at the outer edges of its first and last tick."""
    line, thin = 0.3, 0.2
    marks = [(x, y - line, length, line), (x, y - 4, thin, 4), (x + length - thin, y - 4, thin, 4)]
    between = np.arange(10, length - 5, 10)
    marks += [(x + at - thin / 2, y - 2.5, thin, 2.5) for at in between]
    return np.array(marks)
