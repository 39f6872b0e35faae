"""Deltille's corners, a file for each picture, with their board description (.dsc) beside them.

A header (file name, width, height, number of corners, encoding), then a line for each corner:
board, number, a type that is not used, x, y. What corner has which number is in a board
description beside them or in the folder above, `NAME.dsc`: a first line with the board's size, one
with the tag family, then `tag,column,row,x,y,z` for each corner in the order of the numbers. The
data of BabelCalib are such files.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...calibration.views import View
from ...errors import CalibrationError
from ...lens import Floats
from ._corners import Choice, Corners
from ._lines import lines_of, numbers

SUFFIXES = (".orpc",)


def read(name: str, choice: Choice) -> Corners:
    """The one view; the user's target is not asked: the board description has the points."""
    path = _board_of(Path(name))
    view, size = _read_corners(name, _read_board(path), path.name)
    return Corners([view], size)


def _board_of(path: Path) -> Path:
    """The one board description beside the corners or above them."""
    for folder in (path.parent, path.parent.parent):
        found = sorted(folder.glob("*.dsc"))
        if len(found) == 1:
            return found[0]
        if found:
            listed = ", ".join(p.name for p in found)
            raise CalibrationError(f"{path}: which board is it? {folder} has {listed}")
    raise CalibrationError(
        f"{path}: no board description (*.dsc) beside it or in the folder above; it says where the "
        "corners are on the board"
    )


def _read_board(path: Path) -> Floats:
    """The board's points (n, 3) in the order of their numbers."""
    points = []
    for number, line in lines_of(path):
        fields = line.split(",")
        if len(fields) == 6:  # of the two lines before them, neither has six
            points.append(numbers(path, number, fields[3:], "x,y,z"))
    if not points:
        raise CalibrationError(f"{path}: no line of the kind tag,column,row,x,y,z")
    return np.array(points)


def _read_corners(name: str, board: Floats, board_name: str) -> tuple[View, tuple[int, int]]:
    path = Path(name)
    header: dict[str, str] = {}
    chosen, pixels = [], []
    for number, line in lines_of(path):
        if ":" in line:
            key, _, value = line.partition(":")
            header[key.strip()] = value.strip()
            continue
        fields = line.split(",")
        if len(fields) != 5:
            raise CalibrationError(f"{name}, line {number}: expected board,number,type,x,y")
        which, x, y = numbers(path, number, [fields[1], *fields[3:]], "number, x and y")
        if which != int(which) or not 0 <= which < len(board):
            raise CalibrationError(
                f"{name}, line {number}: corner {fields[1]}; {board_name} has 0 to {len(board) - 1}"
            )
        chosen.append(int(which))
        pixels.append((x, y))
    if header.get("encoding", "ascii") != "ascii":
        raise CalibrationError(f"{name}: encoding {header['encoding']}; only ascii is read")
    size = tuple(_side(name, header, key) for key in ("width", "height"))
    return View(name, board[chosen], np.array(pixels).reshape(-1, 2)), (size[0], size[1])


def _side(name: str, header: dict[str, str], key: str) -> int:
    text = header.get(key, "")
    if not text.isascii() or not text.isdigit() or not 2 <= int(text) <= 65536:
        raise CalibrationError(f"{name}: its header must say {key}: a whole number of pixels")
    return int(text)
