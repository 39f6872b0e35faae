"""mrcal's and mrgingham's corners: a table `# filename x y level`, one line for each corner.

All corners of a picture in the order of the target's points, row by row; `-` where one is missing,
one line `filename - -` for a picture without the target. A corner whose level is `-` or below 0, or
whose weight is not above 0, does not count. Levels and weights say no more than that here. Facts
from the documentation of mrgingham and of mrcal.compute_chessboard_corners().
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...calibration.views import View
from ...errors import CalibrationError
from ...lens import Floats
from ._corners import Choice, Corners
from ._lines import lines_of, numbers

SUFFIXES = (".vnl",)
NONE = "-"
MISSING = (np.nan, np.nan)


@dataclass
class _Picture:
    """Its corners in their order, NaN where they are missing, and the line they end in."""

    at: list[tuple[float, float]] = field(default_factory=list)
    line: int = 0


def read(name: str, choice: Choice) -> Corners:
    """Its views; the target says where the corners are, pictures or user how large those are."""
    points = choice.points(name)
    pictures = _pictures(Path(name))
    views, without = [], []
    for picture, found in pictures.items():
        at = np.array(found.at)
        there = np.isfinite(at[:, 0])
        if not there.any():
            without.append(picture)
            continue
        _check_count(name, picture, found, points)
        views.append(View(picture, points[there], at[there]))
    return Corners(views, choice.size_of(name, next(iter(pictures))), without)


def _check_count(name: str, picture: str, found: _Picture, points: Floats) -> None:
    if len(found.at) != len(points):
        raise CalibrationError(
            f"{name}, line {found.line}: {picture} has {len(found.at)} corners, the target "
            f"{len(points)}; is --board right? mrgingham looks for 10x10 if it is not told"
        )


def _pictures(path: Path) -> dict[str, _Picture]:
    """By the names of the pictures, which stand together."""
    columns: list[str] | None = None
    pictures: dict[str, _Picture] = {}
    last = ""
    for number, line in lines_of(path):
        if line.startswith("#"):
            if columns is None and not line.startswith(("##", "#!")):
                columns = _legend(path, number, line)
            continue
        if columns is None:
            raise CalibrationError(f"{path}, line {number}: no legend before it: # filename x y")
        fields = line.split()
        if len(fields) not in (len(columns), 3):  # mrgingham leaves out the level of no corner
            raise CalibrationError(
                f"{path}, line {number}: {len(fields)} fields, the legend has {len(columns)}"
            )
        row = dict(zip(columns, fields, strict=False))
        picture = row["filename"]
        if picture != last and picture in pictures:
            raise CalibrationError(
                f"{path}, line {number}: {picture} again, after another picture; the corners of "
                "one must stand together"
            )
        last = picture
        found = pictures.setdefault(picture, _Picture())
        found.at.append(_place(path, number, row))
        found.line = number
    if not pictures:
        raise CalibrationError(f"{path}: no corner in it")
    return pictures


def _legend(path: Path, number: int, line: str) -> list[str]:
    columns = line[1:].split()
    if columns[:3] != ["filename", "x", "y"] or len(set(columns)) < len(columns):
        raise CalibrationError(f"{path}, line {number}: the legend must begin with # filename x y")
    return columns


def _place(path: Path, line: int, row: dict[str, str]) -> tuple[float, float]:
    if NONE in (row["x"], row["y"], row.get("level"), row.get("weight")):
        return MISSING
    x, y = numbers(path, line, [row["x"], row["y"]], "x and y")
    level, weight = numbers(path, line, [row.get("level", "0"), row.get("weight", "1")], "level")
    return MISSING if min(x, y, level) < 0 or weight <= 0 else (x, y)
