"""Every lens profile in a folder and below it: what it is, or why it is refused."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ...errors import ProfileError
from ...formats import (
    FORMATS,
    Choice,
    Document,
    Profile,
    format_module,
    format_of,
    parse_profile,
    read_document,
)

SUFFIXES = {".json", ".yaml", ".yml", ".xml", ".txt"}
NO_PROFILE = "no profile"  # in place of a format


@dataclass(frozen=True)
class Found:
    """One camera in one file, or none and the reason.

    path    from the folder on, with `#NAME` behind it for one of several cameras
    format  the format's name, or NO_PROFILE for a file that none takes for its own
    """

    path: str
    format: str
    profile: Profile | None = None
    reason: str = ""


@dataclass(frozen=True)
class _Nth(Choice):
    """Takes the n-th camera of a file, and remembers what they are called."""

    n: int = 0
    names: list[str] = field(default_factory=list)

    def of(self, names: Sequence[str]) -> int:
        self.names[:] = names
        return self.n


def candidates(folder: Path) -> tuple[list[Path], int]:
    """(files that may hold profiles, sorted; how many other files there are)."""
    suffixes = SUFFIXES | {format_module(name).SUFFIX for name in FORMATS}
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    chosen = [path for path in files if path.suffix.lower() in suffixes]
    return chosen, len(files) - len(chosen)


def read_folder(
    folder: Path,
    files: Sequence[Path],
    size: tuple[int, int] | None,
    advance: Callable[[], None],
) -> list[Found]:
    """All cameras in these files; `advance` is called after each file."""
    found: list[Found] = []
    for file in files:
        found += _cameras_in(file, file.relative_to(folder).as_posix(), size)
        advance()
    return found


def _cameras_in(file: Path, name: str, size: tuple[int, int] | None) -> Iterator[Found]:
    try:
        document = read_document(file)
        kind = format_of(document)
    except ProfileError as error:
        yield Found(name, NO_PROFILE, reason=str(error))
        return
    first = _Nth(None, size)
    yield _camera(document, name, kind, first)
    for n in range(1, len(first.names)):
        yield _camera(document, name, kind, _Nth(None, size, n))


def _camera(document: Document, name: str, kind: str, choice: _Nth) -> Found:
    profile, reason = None, ""
    try:
        profile = parse_profile(document, choice, format=kind)
    except ProfileError as error:
        reason = str(error)
    several = len(choice.names) > 1
    return Found(f"{name}#{choice.names[choice.n]}" if several else name, kind, profile, reason)


def reasons(found: Sequence[Found]) -> list[tuple[str, int, Found]]:
    """(reason with its numbers left out, how often, the first of them), the most frequent first."""
    refused = [each for each in found if each.profile is None]
    first = {general(each.reason): each for each in reversed(refused)}
    counts = Counter(general(each.reason) for each in refused)
    return [(reason, count, first[reason]) for reason, count in counts.most_common()]


def general(reason: str) -> str:
    """The reason up to the first advice, with # for each number and for each quoted text."""
    text = reason.split("; ")[0]
    text = re.sub(r"'[^']*'", "'#'", text)
    return re.sub(r"(?<![\w.])[-+]?\d+(\.\d+)?(e[-+]?\d+)?(?![\w])", "#", text)
