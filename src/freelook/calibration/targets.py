"""What is held in front of the camera, and where its points are.

A target is a frozen dataclass that finds itself in pictures and knows how it is printed. Its points
are in metres if its sizes were given in metres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import yaml

from ..errors import CalibrationError
from ..lens import Floats
from ._saddles import Gray
from .aprilgrid import AprilGrid
from .charuco import Charuco
from .chessboard import FEWEST, FEWEST_LINES, find_chessboard
from .circles import Circles
from .drawing import Drawing, squares
from .views import View

__all__ = [
    "AprilGrid",
    "Charuco",
    "Chessboard",
    "Circles",
    "Finder",
    "Gray",
    "Target",
    "parse_target",
    "simple_target",
]

MARKER = 0.75  # of a square, if it is not said


class Finder(Protocol):
    """What looks for one target in pictures."""

    def find(self, gray: Gray, name: str) -> View | None:
        """Its view in a picture (rows, columns) of that name; None if it is not there."""
        ...


class Target(Finder, Protocol):
    """What every target supplies."""

    @property
    def named(self) -> bool:
        """Whether its points can be told from each other; else they are numbered anyhow."""
        ...

    @property
    def text(self) -> str:
        """What `parse_target` reads."""
        ...

    @property
    def points(self) -> Floats:
        """(n, 3), all of them, z = 0. CalibrationError if its size is not known."""
        ...

    @property
    def drawing(self) -> Drawing:
        """How it is printed. CalibrationError if its size is not known."""
        ...


@dataclass(frozen=True)
class Chessboard:
    """A chessboard: side of a square, `inner` corners across and down (None: as many as are found).

    Neither which corner is which nor the whole board is needed, and any number of rows and
    columns may be hidden.
    """

    square: float = 1.0
    inner: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        if not 0 < self.square < np.inf:
            raise CalibrationError(f"the side of a square must be positive, not {self.square:g}")
        if self.inner and (min(self.inner) < FEWEST_LINES or np.prod(self.inner) < FEWEST):
            raise CalibrationError(
                f"{self.inner[0]} x {self.inner[1]} inner corners are too few; take a board of at "
                "least 4 x 3 (5 x 4 squares)"
            )

    named = False

    @property
    def text(self) -> str:
        size = "" if self.inner is None else f":{self.inner[0]}x{self.inner[1]}"
        return f"chessboard{size}:{self.square:g}"

    @property
    def points(self) -> Floats:
        columns, rows = self._known()
        y, x = (a.ravel() for a in np.mgrid[:rows, :columns])
        return np.column_stack([x, y, np.zeros(len(x))]) * self.square

    @property
    def drawing(self) -> Drawing:
        columns, rows = (count + 1 for count in self._known())
        dark = np.indices((rows, columns)).sum(axis=0) % 2 == 0
        size = (columns + 2) * self.square, (rows + 2) * self.square
        return Drawing(size, squares(dark, self.square, self.square, self.square))

    def find(self, gray: Gray, name: str) -> View | None:
        grid = find_chessboard(gray, self.inner)
        if grid is None:
            return None
        flat = grid.cells * self.square
        return View(name, np.column_stack([flat, np.zeros(len(flat))]), grid.pixels)

    def _known(self) -> tuple[int, int]:
        if self.inner is None:
            raise CalibrationError("how many inner corners? give COLUMNSxROWS, such as 9x6")
        return self.inner


@dataclass(frozen=True)
class _Kind:
    """How a target is written down."""

    usage: str
    example: str
    read: Callable[[list[str]], Target]


def parse_target(text: str) -> Target:
    """The target that a text describes: KIND:COLUMNSxROWS:..., or a target file of Kalibr (YAML).

    CalibrationError says what the kinds are, and what each takes.
    """
    if text.lower().endswith((".yaml", ".yml")):
        return _from_kalibr(Path(text))
    kind, *rest = text.split(":")
    known = KINDS.get(kind)
    if known is None:
        usages = ", ".join(one.usage for one in KINDS.values())
        raise CalibrationError(f"unknown target '{kind}'; give one of: {usages}; or Kalibr's YAML")
    try:
        return known.read(rest)
    except (ValueError, IndexError):
        raise CalibrationError(
            f"'{text}' is not {known.usage}; an example, in metres: {known.example}"
        ) from None


def simple_target(kind: str, board: tuple[int, int] | None, square: float | None) -> Target:
    """A target of usual proportions; `square` is the side of a square or tag, or the spacing."""
    if kind not in KINDS:
        return parse_target(kind)  # which says what is known
    if board is None and kind in ("charuco", "aprilgrid"):
        raise CalibrationError(
            f"how many? give --board COLUMNSxROWS, or --target {KINDS[kind].usage}"
        )
    side = 1.0 if square is None else square
    if not 0 < side < np.inf:
        raise CalibrationError(f"the side of a square must be positive, not {side:g}")
    if kind == "chessboard":
        return Chessboard(side, board)
    if kind in ("circles", "acircles"):
        return Circles(side, board, kind == "acircles")
    assert board is not None
    return Charuco(board, side, MARKER * side) if kind == "charuco" else AprilGrid(board, side)


def _counts(text: str) -> tuple[int, int]:
    columns, rows = text.lower().split("x")
    return int(columns), int(rows)


def _at_most(parts: list[str], most: int) -> None:
    if len(parts) > most:
        raise ValueError


def _chessboard(parts: list[str]) -> Chessboard:
    _at_most(parts, 2)
    inner = _counts(parts.pop(0)) if parts and "x" in parts[0].lower() else None
    _at_most(parts, 1)
    return Chessboard(float(parts[0]) if parts else 1.0, inner)


def _circles(parts: list[str], asymmetric: bool) -> Circles:
    _at_most(parts, 3)
    count = _counts(parts.pop(0)) if parts and "x" in parts[0].lower() else None
    _at_most(parts, 2)
    sizes = [float(part) for part in parts]
    return Circles(sizes[0] if sizes else 1.0, count, asymmetric, sizes[1] if sizes[1:] else None)


def _charuco(parts: list[str]) -> Charuco:
    _at_most(parts, 4)
    size, square, marker = _counts(parts[0]), float(parts[1]), float(parts[2])
    return Charuco(size, square, marker, *parts[3:])


def _aprilgrid(parts: list[str]) -> AprilGrid:
    _at_most(parts, 3)
    return AprilGrid(_counts(parts[0]), float(parts[1]), *map(float, parts[2:]))


KINDS = {
    "chessboard": _Kind("chessboard[:CxR][:SQUARE]", "chessboard:9x6:0.025", _chessboard),
    "charuco": _Kind(
        "charuco:CxR:SQUARE:MARKER[:DICTIONARY]", "charuco:9x7:0.024:0.018:5x5_1000", _charuco
    ),
    "circles": _Kind(
        "circles[:CxR][:SPACING[:DIAMETER]]",
        "circles:9x6:0.025",
        lambda parts: _circles(parts, False),
    ),
    "acircles": _Kind(
        "acircles[:CxR][:SPACING[:DIAMETER]]",
        "acircles:4x11:0.02",
        lambda parts: _circles(parts, True),
    ),
    "aprilgrid": _Kind("aprilgrid:CxR:TAG[:SPACING]", "aprilgrid:6x6:0.088:0.3", _aprilgrid),
}


def _from_kalibr(path: Path) -> Target:
    """A target file as Kalibr's tools take it."""
    try:
        document = yaml.safe_load(path.read_text("utf-8"))
    except OSError as error:
        raise CalibrationError(f"{path}: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise CalibrationError(f"{path}: not YAML: {' '.join(str(error).split())}") from None
    kind = document.get("target_type") if isinstance(document, dict) else None
    try:
        return _of_kalibr(kind, document)
    except KeyError as error:
        raise CalibrationError(f"{path}: a target of type {kind} has no {error} here") from None
    except (TypeError, ValueError) as error:
        raise CalibrationError(f"{path}: {error}") from None


def _of_kalibr(kind: object, document: dict[str, Any]) -> Target:
    if kind == "aprilgrid":
        tags = int(document["tagCols"]), int(document["tagRows"])
        return AprilGrid(tags, float(document["tagSize"]), float(document["tagSpacing"]))
    if kind == "checkerboard":
        across, down = (float(document[f"{way}SpacingMeters"]) for way in ("col", "row"))
        if across != down:
            raise ValueError(f"squares of {across:g} x {down:g}; only square ones can be used")
        return Chessboard(across, (int(document["targetCols"]), int(document["targetRows"])))
    if kind == "circlegrid":
        count = int(document["targetCols"]), int(document["targetRows"])
        return Circles(
            float(document["spacingMeters"]), count, bool(document.get("asymmetricGrid", False))
        )
    raise ValueError(f"target_type is {kind!r}; known: aprilgrid, checkerboard, circlegrid")
