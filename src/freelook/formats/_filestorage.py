"""OpenCV's FileStorage: YAML, JSON or XML that say the same, under keys all spell their own way."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element

from ..errors import ProfileError
from ._document import Document
from ._terms import matrix_data
from ._yaml import plain_value


def storage(document: Document) -> dict[str, Any]:
    """What a file says, in whichever of the three ways it is written; {} if it is none."""
    data = document.json if document.looks_like_json else document.yaml
    root = document.xml
    if root is not None and root.tag == "opencv_storage":
        return {child.tag: _xml_value(child) for child in root}
    return data if isinstance(data, dict) else {}


def _xml_value(element: Element) -> Any:
    if "type_id" in element.attrib:
        inside = {child.tag: _words(child.text or "") for child in element}
        for name in ("data", "sizes"):
            if name in inside and not isinstance(inside[name], list):
                inside[name] = [inside[name]]
        return inside | element.attrib
    return _words(element.text or "") if len(element) == 0 else None


def _words(text: str) -> Any:
    """A number, a list of them, or a text."""
    values = [plain_value(word) for word in text.split()]
    if not values or any(isinstance(value, str) for value in values):
        return text.strip().strip('"')
    return values if len(values) > 1 else values[0]


def plain_key(key: str) -> str:
    return key.lower().replace("_", "")


def found(data: dict[str, Any], keys: tuple[str, ...]) -> tuple[str, Any]:
    """(key, value) of the only key among these spellings; ("", None) if there is none."""
    there = [key for key in data if plain_key(key) in keys]
    if len(there) > 1:
        raise ProfileError(f"'{there[0]}' and '{there[1]}' mean the same thing; remove one")
    return (there[0], data[there[0]]) if there else ("", None)


def needed(data: dict[str, Any], keys: tuple[str, ...], what: str) -> tuple[str, Any]:
    key, value = found(data, keys)
    if not key:
        there = ", ".join(list(data)[:20])
        raise ProfileError(f"no {what} ({', '.join(keys)}) in it; its keys are: {there}")
    return key, value


def flat(value: Any, where: str) -> Any:
    """The numbers of a matrix or of nested lists, row by row; a single number as a list."""
    value = matrix_data(value, where)
    if isinstance(value, list) and all(isinstance(row, list) for row in value):
        return [item for row in value for item in row]
    return [value] if isinstance(value, (int, float)) else value
