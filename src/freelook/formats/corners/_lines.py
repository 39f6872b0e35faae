"""Lines of text files, and the numbers in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from ...errors import CalibrationError

LARGEST_BYTES = 2**24
MOST_VALUE = 1e6  # beyond any pixel, and any target


def text_of(path: Path, largest: int = LARGEST_BYTES) -> str:
    """CalibrationError for what cannot be read, is no text, or is too long."""
    try:
        with path.open("rb") as file:
            data = file.read(largest + 1)
        text = data.decode("utf-8")
    except (OSError, ValueError) as error:
        if isinstance(error, UnicodeDecodeError):
            raise CalibrationError(f"{path}: not a text file") from None
        why = error.strerror if isinstance(error, OSError) else error
        raise CalibrationError(f"{path}: {why or error}") from None
    if len(data) > largest:
        raise CalibrationError(f"{path}: more than {largest >> 20} MiB; no file of corners")
    return text


def lines_of(path: Path) -> Iterator[tuple[int, str]]:
    """Numbered lines that are not empty."""
    for number, line in enumerate(text_of(path).splitlines(), 1):
        if line.strip():
            yield number, line.strip()


def numbers(path: Path | str, line: int, fields: Sequence[str], what: str) -> list[float]:
    """CalibrationError where one is no number that a pixel or a point can have."""
    try:
        values = [float(field) for field in fields]
    except ValueError:
        values = [float("nan")]
    if not all(abs(value) < MOST_VALUE for value in values) or not np.isfinite(values).all():
        raise CalibrationError(f"{path}, line {line}: {what} must be numbers, not {fields!r:.80}")
    return values
