"""Corners that another program found: Deltille's `.orpc` files, as the BabelCalib data have them.

A header (file name, width, height, number of corners, encoding), then a line for each corner:
board, number, a type that is not used, x, y. What corner has which number is in a board
description beside them or in the folder above, `NAME.dsc`: a first line with the board's size, one
with the tag family, then `tag,column,row,x,y,z` for each corner in the order of the numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ..errors import CalibrationError
from ..lens import Floats
from .views import View

SUFFIX = ".orpc"
LARGEST_BYTES = 2**22


def is_corner_file(name: str) -> bool:
    """By its name."""
    return name.lower().endswith(SUFFIX)


def read_corner_files(names: Sequence[str]) -> tuple[list[View], tuple[int, int]]:
    """The views in the files, and the size (width, height) of all their pictures.

    CalibrationError names the file and line that cannot be read, and files of another size.
    """
    views = []
    size: tuple[int, int] | None = None
    boards: dict[Path, Floats] = {}
    for name in names:
        path = _board_of(Path(name))
        if path not in boards:
            boards[path] = _read_board(path)
        view, its_size = _read_corners(name, boards[path], path.name)
        if size is not None and its_size != size:
            raise CalibrationError(
                f"{name}: its picture is {its_size[0]} x {its_size[1]} pixels, those before it "
                f"{size[0]} x {size[1]}; a lens is calibrated for one size"
            )
        size = its_size
        views.append(view)
    assert size is not None
    return views, size


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
    for number, line in _lines(path):
        fields = line.split(",")
        if len(fields) == 6:  # of the two lines before them, neither has six
            points.append(_numbers(path, number, fields[3:], "x,y,z"))
    if not points:
        raise CalibrationError(f"{path}: no line of the kind tag,column,row,x,y,z")
    return np.array(points)


def _read_corners(name: str, board: Floats, board_name: str) -> tuple[View, tuple[int, int]]:
    path = Path(name)
    header: dict[str, str] = {}
    chosen, pixels = [], []
    for number, line in _lines(path):
        if ":" in line:
            key, _, value = line.partition(":")
            header[key.strip()] = value.strip()
            continue
        fields = line.split(",")
        if len(fields) != 5:
            raise CalibrationError(f"{name}, line {number}: expected board,number,type,x,y")
        which, x, y = _numbers(path, number, [fields[1], *fields[3:]], "number, x and y")
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


def _numbers(path: Path, line: int, fields: Sequence[str], what: str) -> list[float]:
    try:
        values = [float(field) for field in fields]
    except ValueError:
        values = [float("nan")]
    if not np.isfinite(values).all():
        raise CalibrationError(f"{path}, line {line}: {what} must be numbers, not {fields!r:.80}")
    return values


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """Numbered lines that are not empty."""
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_BYTES + 1)
        text = data.decode("utf-8")
    except OSError as error:
        raise CalibrationError(f"{path}: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise CalibrationError(f"{path}: not a text file") from None
    if len(data) > LARGEST_BYTES:
        raise CalibrationError(f"{path}: more than {LARGEST_BYTES >> 20} MiB; no file of corners")
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip():
            yield number, line.strip()
