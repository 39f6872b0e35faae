"""What a section of the report is made of: words, and figures drawn from tables of numbers.

A figure is drawn from its table and from nothing else, so that the CSV file beside it always
holds what it shows. Figures made of pictures are the exception: they carry their pixels along.
"""

from __future__ import annotations

import csv
import io
import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..lens import Floats

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIGITS = 12  # significant ones in CSV files: far more than any of these numbers has

Verdict = Literal["holds", "holds in part", "does not hold"]


@dataclass(frozen=True)
class Settings:
    """How much work to put in, and the seed of everything random.

    draws       of each Monte Carlo
    pictures    in which the image circle is sought together
    threads     for drawing simulated pictures
    """

    seed: int = 2011
    draws: int = 20_000
    pictures: int = 8
    threads: int = 2

    def rng(self, name: str) -> np.random.Generator:
        """Random numbers of their own for each experiment: others may come and go."""
        return np.random.default_rng([self.seed, zlib.crc32(name.encode())])


class Table:
    """Columns of one length, by name. Columns are numbers (NaN: there is none) or words."""

    def __init__(self, columns: Mapping[str, Floats | Sequence[float] | Sequence[str]]) -> None:
        self.numbers: dict[str, Floats] = {}
        self.words: dict[str, tuple[str, ...]] = {}
        self.names = tuple(columns)
        for name, values in columns.items():
            if all(isinstance(value, str) for value in values):
                self.words[name] = tuple(str(value) for value in values)
            else:
                self.numbers[name] = np.array(values, dtype=np.float64)
        if len({len(values) for values in columns.values()}) > 1:
            raise ValueError(f"columns of different lengths: {list(columns)}")

    def __len__(self) -> int:
        return len(self.rows())

    def __getitem__(self, name: str) -> Floats:
        return self.numbers[name]

    def where(self, name: str, word: str) -> Table:
        """Only the rows that have this word in that column."""
        kept = [index for index, value in enumerate(self.words[name]) if value == word]
        columns: dict[str, Floats | Sequence[str]] = {}
        for column in self.names:
            if column in self.words:
                columns[column] = [self.words[column][index] for index in kept]
            else:
                columns[column] = self.numbers[column][kept]
        return Table(columns)

    def rows(self) -> list[list[str | float]]:
        columns = [
            self.words[name] if name in self.words else self.numbers[name] for name in self.names
        ]
        return [
            [value if isinstance(value, str) else float(value) for value in row]
            for row in zip(*columns, strict=True)
        ]

    def csv(self) -> str:
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.names)
        for row in self.rows():
            writer.writerow([v if isinstance(v, str) else _digits(v) for v in row])
        return text.getvalue()


def _digits(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.{DIGITS}g}"


def read_table(text: str) -> Table:
    """The table that `Table.csv` wrote; an empty cell among numbers is NaN."""
    names, *rows = csv.reader(io.StringIO(text))
    columns: dict[str, list[float] | list[str]] = {}
    for name, values in zip(names, zip(*rows, strict=True), strict=True):
        try:
            columns[name] = [float(value) if value else math.nan for value in values]
        except ValueError:
            columns[name] = list(values)
    return Table(columns)


@dataclass(frozen=True)
class Exhibit:
    """A figure (with `draw`) or a table on the page (without), and its numbers.

    name        of its files, without suffix
    digits      decimals per column where the table itself is shown; 2 where nothing is said
    picture     made of photographs, not of lines: dark pages must not invert it
    """

    name: str
    caption: str
    table: Table
    draw: Callable[[Table], Figure] | None = None
    digits: Mapping[str, int] = field(default_factory=dict)
    picture: bool = False


@dataclass(frozen=True)
class Section:
    """One thing the paper shows.

    places      where in the paper
    paper       what it shows, in our words
    ours        what we get, one paragraph each
    verdict     whether the paper's statement or number holds, and `because` why
    basis       what ours rests on: printed numbers, or a simulation with its noise
    """

    name: str
    title: str
    places: str
    paper: str
    ours: tuple[str, ...]
    verdict: Verdict
    because: str
    basis: str
    exhibits: tuple[Exhibit, ...]
