"""The text of a profile, and what it says as JSON, YAML or XML; all three are read safely."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NoReturn
from xml.etree import ElementTree

from ..errors import ProfileError
from ._yaml import is_deep, parse_yaml

LARGEST_BYTES = 16 * 2**20  # with all its optimisation inputs an mrcal model has a few MiB
LARGEST_TREE = 2 * 2**20  # JSON and XML take up to a second per MiB; profiles are far smaller
DEEPEST = 64


@dataclass(frozen=True)
class Document:
    """A profile's text. `name` is that of its file, "" without one."""

    text: str
    name: str = ""

    @cached_property
    def json(self) -> Any:
        """What the text says if it is JSON, else None; the reason is in `why_not_json`."""
        return self._json[0]

    @cached_property
    def yaml(self) -> Any:
        """What the text says if it is YAML (OpenCV's kind too), else None.

        The reason is in `why_not_yaml`. JSON and XML are no YAML here.
        """
        return self._yaml[0]

    @cached_property
    def xml(self) -> ElementTree.Element | None:
        """The root if the text is XML, without a document type, else None.

        The reason is in `why_not_xml`.
        """
        root: ElementTree.Element | None = self._xml[0]
        return root

    @property
    def why_not_json(self) -> str:
        return self._json[1]

    @property
    def why_not_yaml(self) -> str:
        return self._yaml[1]

    @property
    def why_not_xml(self) -> str:
        return self._xml[1]

    @property
    def looks_like_json(self) -> bool:
        return self._first in ("{", "[")

    @property
    def looks_like_xml(self) -> bool:
        return self._first == "<"

    @cached_property
    def _first(self) -> str:
        return self.text.lstrip("\ufeff \t\r\n")[:1]

    @cached_property
    def _json(self) -> tuple[Any, str]:
        return _tried(parse_json, self.text)

    @cached_property
    def _yaml(self) -> tuple[Any, str]:
        if self.looks_like_json or self.looks_like_xml:
            return None, "it is JSON" if self.looks_like_json else "it is XML"
        return _tried(parse_yaml, self.text)

    @cached_property
    def _xml(self) -> tuple[Any, str]:
        return _tried(parse_xml, self.text) if self.looks_like_xml else (None, "not XML")


def _tried(parse: Callable[[str], Any], text: str) -> tuple[Any, str]:
    try:
        return parse(text), ""
    except ProfileError as error:
        return None, str(error)


def parse_json(text: str) -> Any:
    """What a JSON text says; ProfileError says why it is none, or none that can be a profile.

    Lines that begin with `//` are left out: OpenCV writes comments so.
    """
    _check_length(text, "JSON")
    text = re.sub(r"^[ \t]*//.*$", "", text.removeprefix("\ufeff"), flags=re.M)
    try:
        value = json.loads(text, parse_constant=_no_constant, object_pairs_hook=_no_twins)
    except RecursionError:
        raise ProfileError("nested too deeply to be a lens profile") from None
    except json.JSONDecodeError as error:
        where = f"in line {error.lineno}, column {error.colno}"
        raise ProfileError(f"not JSON: {error.msg} {where}") from None
    except ValueError as error:  # an integer of thousands of digits
        raise ProfileError(f"not JSON: {error}") from None
    if is_deep(value, DEEPEST):
        raise ProfileError("nested too deeply to be a lens profile")
    return value


def parse_xml(text: str) -> ElementTree.Element:
    """The root of an XML text; ProfileError says why it is none, or none that is read here.

    A document type is refused: entities, which grow without end or fetch files, live only there.
    """
    _check_length(text, "XML")
    if re.search(r"<!(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise ProfileError("XML with a document type (<!DOCTYPE ...>) is not read; remove it")
    parser = ElementTree.XMLParser(target=_ShallowTree())
    try:
        parser.feed(text.lstrip("\ufeff \t\r\n"))
        root: ElementTree.Element = parser.close()
        return root
    except ElementTree.ParseError as error:
        raise ProfileError(f"not XML: {error}") from None
    except (ValueError, LookupError) as error:  # half a surrogate pair, an unknown encoding
        raise ProfileError(f"not XML: {error}") from None


class _ShallowTree(ElementTree.TreeBuilder):
    """The usual tree, not deeper than any profile: safe to walk, and quickly refused."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = 0

    def start(self, tag: str, attrs: dict[str, str], /) -> ElementTree.Element:
        self._depth += 1
        if self._depth > DEEPEST:
            raise ProfileError("nested too deeply to be a lens profile")
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> ElementTree.Element:
        self._depth -= 1
        return super().end(tag)


def _check_length(text: str, what: str) -> None:
    if len(text) > LARGEST_TREE:
        raise ProfileError(f"more than {LARGEST_TREE >> 20} MiB of {what} are no lens profile")


def _no_constant(text: str) -> NoReturn:
    raise ProfileError(f"{text} is not a number a lens can have")


def _no_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    seen = set()
    for name, _ in pairs:
        if name in seen:
            raise ProfileError(f"key '{name:.80}' is given twice")
        seen.add(name)
    return dict(pairs)


def expect_mapping(value: Any, where: str, why_none: str = "") -> dict[str, Any]:
    """The value if it is a JSON object or YAML mapping, or ProfileError.

    `why_none` is a document's reason for having no value at all.
    """
    if value is None and why_none:
        raise ProfileError(f"{where} cannot be read: {why_none}")
    if not isinstance(value, dict):
        raise ProfileError(f"{where} must be an object, not {value!r:.80}")
    return value
