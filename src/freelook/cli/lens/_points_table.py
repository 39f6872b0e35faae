"""Tables of measured points: angle and radius, or 3-D point and pixel."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import FitError
from ...lens import Floats

CURVE = ("angle_deg", "radius_px")
POINTS = ("x", "y", "z", "u", "v")
SIGMA = "sigma_px"
KINDS = f"{','.join(CURVE)} (and perhaps {SIGMA}) or {','.join(POINTS)}"
LARGEST_BYTES = 64 * 2**20


@dataclass(frozen=True)
class Table:
    """Columns by name, (n,) each, and the line of the file that each row is from."""

    columns: dict[str, Floats]
    lines: tuple[int, ...]

    @property
    def is_curve(self) -> bool:
        return "angle_deg" in self.columns

    def stack(self, *names: str) -> Floats:
        """(n, len(names))."""
        return np.stack([self.columns[name] for name in names], axis=-1)


def read_table(name: str) -> Table:
    """The table in a CSV file with a header; empty lines and lines that begin with # are left out.

    FitError that says in which line what is wrong.
    """
    rows = _rows(name)
    if not rows:
        raise FitError(f"{name} is empty; a table needs a header: {KINDS}")
    (line, header), *body = rows
    columns = [cell.strip().lower() for cell in header]
    _check_header(f"{name}, line {line}", columns)
    values = [_numbers(f"{name}, line {line}", columns, cells) for line, cells in body]
    if not values:
        raise FitError(f"{name} has a header and no points")
    return Table(
        dict(zip(columns, np.array(values).T, strict=True)), tuple(line for line, _ in body)
    )


def _rows(name: str) -> list[tuple[int, list[str]]]:
    path = Path(name)
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise FitError(f"{name} has more than {LARGEST_BYTES >> 20} MiB")
        text = path.read_text("utf-8-sig")
    except OSError as error:
        raise FitError(f"cannot read {name}: {error.strerror or error}") from None
    except ValueError:
        raise FitError(f"{name} is not a text file") from None
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1)]
    kept = [(i, line) for i, line in lines if line.strip() and not line.lstrip().startswith("#")]
    try:
        return [(i, next(csv.reader([line]))) for i, line in kept]
    except csv.Error as error:
        raise FitError(f"{name} is not a CSV file: {error}") from None


def _check_header(where: str, columns: list[str]) -> None:
    if len(columns) == 1 and (";" in columns[0] or "\t" in columns[0]):
        raise FitError(f"{where}: put commas between the columns, and points in the numbers")
    if all(_is_number(cell) for cell in columns):
        raise FitError(f"{where}: the first line must be a header: {KINDS}")
    for wanted in (CURVE, POINTS):
        optional = {SIGMA} if wanted is CURVE else set()
        if set(columns) - optional == set(wanted) and len(set(columns)) == len(columns):
            return
    raise FitError(f"{where}: the columns are {','.join(columns)}; they must be {KINDS}")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _numbers(where: str, columns: list[str], cells: list[str]) -> list[float]:
    if len(cells) != len(columns):
        raise FitError(
            f"{where}: {len(cells)} values, but there are {len(columns)} columns "
            f"({','.join(columns)})"
        )
    values = []
    for column, cell in zip(columns, cells, strict=True):
        if not _is_number(cell) or not np.isfinite(float(cell)):
            raise FitError(f"{where}: {column} is {cell.strip()!r:.40}, which is no number")
        values.append(float(cell))
    return values
