"""The text of a profile, and what it is when it is JSON or YAML; both are read safely."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NoReturn

import yaml

from ..errors import ProfileError

LARGEST_BYTES = 16 * 2**20  # with all its optimisation inputs an mrcal model has a few MiB
LARGEST_YAML = 2**20  # YAML takes seconds per MiB, and no calibration has more than some kB


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

        The reason is in `why_not_yaml`. JSON is no YAML here.
        """
        return self._yaml[0]

    @property
    def why_not_json(self) -> str:
        return self._json[1]

    @property
    def why_not_yaml(self) -> str:
        return self._yaml[1]

    @property
    def looks_like_json(self) -> bool:
        return self.text.lstrip("\ufeff \t\r\n")[:1] in ("{", "[")

    @cached_property
    def _json(self) -> tuple[Any, str]:
        try:
            text = self.text.removeprefix("\ufeff")
            return json.loads(text, parse_constant=_no_constant, object_pairs_hook=_no_twins), ""
        except _NoProfileError as error:
            return None, str(error)
        except RecursionError:
            return None, "nested too deeply to be a lens profile"
        except json.JSONDecodeError as error:
            return None, f"not JSON: {error.msg} in line {error.lineno}, column {error.colno}"
        except ValueError as error:  # an integer of thousands of digits
            return None, f"not JSON: {error}"

    @cached_property
    def _yaml(self) -> tuple[Any, str]:
        if self.looks_like_json:
            return None, "it is JSON"
        if len(self.text) > LARGEST_YAML:
            return None, f"more than {LARGEST_YAML >> 20} MiB of YAML are no lens profile"
        try:
            return yaml.load(_plain_yaml(self.text), Loader=_Loader), ""
        except _NoProfileError as error:
            return None, str(error)
        except RecursionError:
            return None, "nested too deeply to be a lens profile"
        except yaml.MarkedYAMLError as error:
            mark = error.problem_mark
            where = f" in line {mark.line + 1}, column {mark.column + 1}" if mark else ""
            return None, f"not YAML: {error.problem}{where}"
        except (yaml.YAMLError, ValueError) as error:
            return None, f"not YAML: {error}"


class _NoProfileError(Exception):
    """The text is well formed and still cannot be a profile."""


def _no_constant(text: str) -> NoReturn:
    raise _NoProfileError(f"{text} is not a number a lens can have")


def _no_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    seen = set()
    for name, _ in pairs:
        if name in seen:
            raise _NoProfileError(f"key '{name}' is given twice")
        seen.add(name)
    return dict(pairs)


def _plain_yaml(text: str) -> str:
    """OpenCV writes "%YAML:1.0" where YAML wants a space; the line says nothing, so it goes."""
    text = text.removeprefix("\ufeff")
    return text.partition("\n")[2] if text.startswith("%YAML") else text


class _Loader(yaml.SafeLoader):
    """Plain values and OpenCV's matrices; no aliases (a small file could grow without end)."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.events.AliasEvent):
            raise _NoProfileError("YAML aliases (*name) are not read in lens profiles")
        return super().compose_node(parent, index)

    def construct_pairs_checked(self, node: Any) -> dict[Any, Any]:
        pairs = self.construct_pairs(node, deep=True)
        for key, _ in pairs:
            if not isinstance(key, (str, int, float)):
                raise _NoProfileError(f"{key!r} is not a key a lens profile can have")
        return _no_twins([(str(key), value) for key, value in pairs])


_Loader.add_constructor("tag:yaml.org,2002:map", _Loader.construct_pairs_checked)
_Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", _Loader.construct_pairs_checked)


def expect_mapping(value: Any, where: str) -> dict[str, Any]:
    """The value if it is a JSON object or YAML mapping, or ProfileError."""
    if not isinstance(value, dict):
        raise ProfileError(f"{where} must be an object, not {value!r:.80}")
    return value
