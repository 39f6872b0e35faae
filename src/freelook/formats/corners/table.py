"""Corners by number: a table with the columns name, corner, x, y, one line for each corner.

Kalibr's detections are written down so by those who need them: Kalibr itself writes none (its issue
727 asks for it). `corner` is the number of the target's point from 0: row by row; of an AprilGrid
from the bottom left, as in Kalibr. Fields stand between commas or blanks; the first line has their
names, after a `#` or not, and may have others, which are passed over.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...calibration.views import View
from ...errors import CalibrationError
from ._corners import Choice, Corners
from ._lines import lines_of, numbers

SUFFIXES = (".csv", ".txt")
COLUMNS = {  # as people call them
    "name": ("name", "filename", "file", "image", "picture", "timestamp", "time", "frame"),
    "corner": ("corner", "corner_id", "corner_index", "id", "index", "point"),
    "x": ("x", "u", "px"),
    "y": ("y", "v", "py"),
}


def read(name: str, choice: Choice) -> Corners:
    """Its views; the target says where the corners are, pictures or user how large those are."""
    points = choice.points(name)
    corners = _corners(Path(name), len(points))
    views = [
        View(picture, points[list(at)], np.array(list(at.values())))
        for picture, at in corners.items()
    ]
    return Corners(views, choice.size_of(name, next(iter(corners))))


def _corners(path: Path, count: int) -> dict[str, dict[int, tuple[float, float]]]:
    """Where the corners are, by picture and number."""
    lines = iter(lines_of(path))
    first = next(lines, None)
    if first is None:
        raise CalibrationError(f"{path}: it is empty")
    separator = "," if "," in first[1] else None
    where = _columns(path, first, separator)
    found: dict[str, dict[int, tuple[float, float]]] = {}
    for number, line in lines:
        if line.startswith("#"):
            continue
        fields = [field.strip() for field in line.split(separator)]
        if len(fields) <= max(where.values()):
            raise CalibrationError(
                f"{path}, line {number}: {len(fields)} fields; x, y, corner and name are not all "
                "there"
            )
        which, x, y = numbers(
            path, number, [fields[where[key]] for key in ("corner", "x", "y")], "corner, x and y"
        )
        corner = int(which)
        if which != corner or not 0 <= corner < count:
            raise CalibrationError(
                f"{path}, line {number}: corner {which:g}; the target has 0 to {count - 1}: is it "
                "the right one?"
            )
        picture = found.setdefault(fields[where["name"]], {})
        if corner in picture:
            raise CalibrationError(f"{path}, line {number}: corner {corner} of this picture again")
        picture[corner] = x, y
    if not found:
        raise CalibrationError(f"{path}: no corner in it")
    return found


def _columns(path: Path, first: tuple[int, str], separator: str | None) -> dict[str, int]:
    """Which field is which."""
    number, line = first
    names = [name.strip().lower() for name in line.lstrip("# \ufeff").split(separator)]
    where = {}
    for column, known in COLUMNS.items():
        there = [i for i, name in enumerate(names) if name in known]
        if len(there) != 1:
            raise CalibrationError(
                f"{path}, line {number}: it must name one column '{column}' "
                f"({', '.join(known)}); it names {', '.join(names)[:80]}"
            )
        where[column] = there[0]
    return where
