"""Lines of numbers from a port: cut where they end, split into named columns."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from ..errors import TrackerError
from ..types import Counters

LONGEST_LINE = 512
SKIP = "-"

_SEPARATOR = re.compile(rb"\s*[,;\t ]\s*")
_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?")


class LineBuffer:
    """Whole lines out of pieces. The first line after `clear` is left out: it may lack its
    beginning. Lines that are too long are counted as `invalid`."""

    def __init__(self, counters: Counters) -> None:
        self._counters = counters
        self.clear()

    def clear(self) -> None:
        self._rest = b""
        self._skip = True

    def feed(self, data: bytes) -> list[bytes]:
        """Every line that is now complete, without its end; blank ones are left out."""
        *lines, self._rest = (self._rest + data.replace(b"\r", b"\n")).split(b"\n")
        if self._skip and lines:
            self._skip = False
            lines = lines[1:]
        if len(self._rest) > LONGEST_LINE:
            self._rest = b""
            self._counters.add("invalid", int(not self._skip))
            self._skip = True
        return [line.strip() for line in lines if line.strip()]


def parse_columns(text: str, known: Sequence[str]) -> tuple[str, ...]:
    """Names of columns, separated by commas; `-` skips one. TrackerError lists the known ones."""
    columns = tuple(name.strip() for name in text.split(","))
    for name in columns:
        if name != SKIP and name not in known:
            raise TrackerError(
                f"columns={text}: '{name}' is not a column; known: {', '.join(known)}, "
                f"and {SKIP} for one to skip"
            )
        if name != SKIP and columns.count(name) > 1:
            raise TrackerError(f"columns={text}: '{name}' is there twice")
    return columns


def parse_line(line: bytes, columns: Sequence[str]) -> dict[str, float] | None:
    """The numbers of a line by column; None unless there are as many, all finite."""
    fields = _SEPARATOR.split(line)
    if len(fields) != len(columns):
        return None
    values = {}
    for name, field in zip(columns, fields, strict=True):
        if name == SKIP:
            continue
        if not _NUMBER.fullmatch(field):
            return None
        values[name] = float(field)
    return values if all(map(math.isfinite, values.values())) else None
