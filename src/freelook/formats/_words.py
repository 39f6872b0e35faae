"""Numbers in formats that are plain words and not JSON or YAML."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from io import StringIO

from ..errors import ProfileError
from ._numbers import number

NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")  # no "nan", no "1_000"


def word_number(word: str, where: str) -> float:
    """The float that a word spells, or ProfileError."""
    if not NUMBER.fullmatch(word) or len(word) > 400:
        raise ProfileError(f"{where} must be a number, not {word!r:.80}")
    return number(float(word), where)


def word_numbers(words: Sequence[str], where: str) -> list[float]:
    return [word_number(word, f"{where}[{i}]") for i, word in enumerate(words)]


def without_comments(text: str) -> Iterator[str]:
    """The lines that say something: not empty, and not begun with `#`."""
    for line in StringIO(text.removeprefix("\ufeff")):
        stripped = line.strip()
        if stripped and not stripped.startswith("#"):
            yield stripped
