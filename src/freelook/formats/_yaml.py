"""YAML as calibrations use it, built straight from the parser's events.

A plain scalar is null, true, false, a number or a text. PyYAML's own loaders would make dates,
base-60 and octal numbers of what merely looks like it, take 1e-5 for a text, and build whatever a
tag asks for. Here no tag means anything but OpenCV's matrices. Aliases (*name) may stand for a few
thousand letters in all, as they do where a program had one list twice: without such a bound a few
lines of them stand for more than any memory holds.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import yaml

from ..errors import ProfileError

LARGEST = 2**19  # characters; OpenCV writes every corner it saw into its files, which are larger
DEEPEST = 32
MOST_ALIASED = 10_000  # characters that all aliases stand for together

INTEGER = re.compile(r"[-+]?[0-9]{1,400}")  # Python refuses to read thousands of digits
FLOAT = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?")
CONSTANTS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
NOT_FINITE = re.compile(r"[-+]?\.(?:inf|nan)", re.IGNORECASE)
STANDARD = "tag:yaml.org,2002:"
KINDS = ("str", "int", "float", "bool", "null", "seq", "map")
TAGS = frozenset([None, "!", *(STANDARD + kind for kind in KINDS)])  # they say nothing new
AS_TEXT = ("!", STANDARD + "str")
MATRIX = STANDARD + "opencv-"
# the parser in C is ten times as fast; wheels have it, some systems' packages do not
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def parse_yaml(text: str) -> Any:
    """What the only document of a text says; ProfileError says what is wrong and where.

    A mapping with OpenCV's tag has it as `type_id`, as OpenCV's JSON does.
    """
    if len(text) > LARGEST:
        raise ProfileError(f"more than {LARGEST >> 10} kB of YAML are no lens profile")
    try:
        return _Reading(yaml.parse(_without_version(text), Loader=_LOADER)).only_document()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        where = f" in line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        raise ProfileError(f"not YAML: {error.problem}{where}") from None
    except yaml.YAMLError as error:
        raise ProfileError(f"not YAML: {' '.join(str(error).split())}") from None
    except ValueError as error:  # half a surrogate pair
        raise ProfileError(f"not YAML: {error}") from None


def _without_version(text: str) -> str:
    """OpenCV writes "%YAML:1.0" where YAML wants a space; as a comment it does no harm."""
    text = text.removeprefix("\ufeff")
    return "#" + text[1:] if text.startswith("%YAML") else text


class _Reading:
    """One pass over the events of a text."""

    def __init__(self, events: Iterator[Any]) -> None:
        self.events = events
        self.letters = 0  # of all scalars so far
        self.anchors: dict[str, tuple[Any, int]] = {}  # value, and how many letters it has
        self.aliased = 0

    def only_document(self) -> Any:
        """The first document; what follows may only be empty, as behind a last `---`."""
        values = (self.value(next(self.events), 0) for e in self.events if _starts_document(e))
        first = next(values, None)
        if any(value is not None for value in values):
            raise ProfileError("more than one YAML document; a lens profile is one")
        if self.aliased and is_deep(first, DEEPEST):
            raise ProfileError("nested too deeply to be a lens profile")
        return first

    def value(self, event: Any, depth: int) -> Any:
        if isinstance(event, yaml.AliasEvent):
            return self.alias(event)
        before = self.letters
        value = self.new_value(event, depth)
        if event.anchor is not None:
            self.anchors[event.anchor] = value, self.letters - before
        return value

    def alias(self, event: Any) -> Any:
        if event.anchor not in self.anchors:
            raise ProfileError(f"*{event.anchor:.40}{_line(event)} stands for nothing before it")
        value, letters = self.anchors[event.anchor]
        self.letters += letters  # it may stand in another anchor's value
        self.aliased += letters
        if self.aliased > MOST_ALIASED:
            raise ProfileError(f"YAML aliases{_line(event)} make it too long for a lens profile")
        return value

    def new_value(self, event: Any, depth: int) -> Any:
        _check_tag(event)
        if isinstance(event, yaml.ScalarEvent):
            self.letters += len(event.value) + 1
            return _scalar(event)
        if depth == DEEPEST:
            raise ProfileError("nested too deeply to be a lens profile")
        self.letters += 1
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(depth)
        mapping = self.mapping(depth)
        if event.tag and event.tag.startswith(MATRIX):
            mapping["type_id"] = event.tag.removeprefix(STANDARD)
        return mapping

    def sequence(self, depth: int) -> list[Any]:
        items = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            items.append(self.value(event, depth + 1))
        return items

    def mapping(self, depth: int) -> dict[str, Any]:
        items: dict[str, Any] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent):
                raise ProfileError(f"a key must be a word{_line(event)}")
            if event.value in items:
                raise ProfileError(f"key '{event.value:.80}' is given twice{_line(event)}")
            self.letters += len(event.value) + 1
            items[event.value] = self.value(next(self.events), depth + 1)
        return items


def _starts_document(event: Any) -> bool:
    return isinstance(event, yaml.DocumentStartEvent)


def _scalar(event: Any) -> Any:
    quoted = event.tag is None and not event.implicit[0]
    return event.value if quoted or event.tag in AS_TEXT else plain_value(event.value)


def is_deep(value: Any, levels: int) -> bool:
    """Whether lists and mappings stand in each other more than so many times."""
    level = [value]
    for _ in range(levels):
        level = [child for item in level for child in _children(item)]
        if not level:
            return False
    return True


def _children(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []


def plain_value(text: str) -> Any:
    """Null, true, false, a number, or the text itself."""
    if text in CONSTANTS:
        return CONSTANTS[text]
    if INTEGER.fullmatch(text):
        return int(text)
    if FLOAT.fullmatch(text):
        return float(text)
    return float(text.replace(".", "")) if NOT_FINITE.fullmatch(text) else text


def _check_tag(event: Any) -> None:
    if event.tag in TAGS:
        return
    if not (isinstance(event, yaml.MappingStartEvent) and str(event.tag).startswith(MATRIX)):
        raise ProfileError(f"the YAML tag {event.tag:.80}{_line(event)} is not read here")


def _line(event: Any) -> str:
    return f" in line {event.start_mark.line + 1}"
