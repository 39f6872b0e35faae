"""YAML as calibrations use it, built straight from the parser's events.

A plain scalar is null, true, false, a number or a text. PyYAML's own loaders would make dates,
base-60 and octal numbers of what merely looks like it, take 1e-5 for a text, and build whatever a
tag asks for. Here no tag means anything but OpenCV's matrices, and there are no aliases: a few
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
        return _only_document(yaml.parse(_without_version(text), Loader=_LOADER))
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


def _only_document(events: Iterator[Any]) -> Any:
    """The first document; what follows may only be empty, as behind a last `---`."""
    values = (_value(next(events), events, 0) for e in events if _starts_document(e))
    first = next(values, None)
    if any(value is not None for value in values):
        raise ProfileError("more than one YAML document; a lens profile is one")
    return first


def _starts_document(event: Any) -> bool:
    return isinstance(event, yaml.DocumentStartEvent)


def _value(event: Any, events: Iterator[Any], depth: int) -> Any:
    if isinstance(event, yaml.ScalarEvent):
        return _scalar(event)
    if isinstance(event, yaml.AliasEvent):
        raise ProfileError(
            f"YAML aliases (*{event.anchor}{_line(event)}) are not read in lens profiles; "
            "write out what it stands for"
        )
    if depth == DEEPEST:
        raise ProfileError("nested too deeply to be a lens profile")
    _check_tag(event)
    if isinstance(event, yaml.SequenceStartEvent):
        return _sequence(events, depth)
    mapping = _mapping(events, depth)
    if event.tag and event.tag.startswith(MATRIX):
        mapping["type_id"] = event.tag.removeprefix(STANDARD)
    return mapping


def _sequence(events: Iterator[Any], depth: int) -> list[Any]:
    items = []
    while not isinstance(event := next(events), yaml.SequenceEndEvent):
        items.append(_value(event, events, depth + 1))
    return items


def _mapping(events: Iterator[Any], depth: int) -> dict[str, Any]:
    items: dict[str, Any] = {}
    while not isinstance(event := next(events), yaml.MappingEndEvent):
        if not isinstance(event, yaml.ScalarEvent):
            raise ProfileError(f"a key must be a word{_line(event)}")
        if event.value in items:
            raise ProfileError(f"key '{event.value:.80}' is given twice{_line(event)}")
        items[event.value] = _value(next(events), events, depth + 1)
    return items


def _scalar(event: Any) -> Any:
    _check_tag(event)
    quoted = event.tag is None and not event.implicit[0]
    return event.value if quoted or event.tag in AS_TEXT else plain_value(event.value)


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
