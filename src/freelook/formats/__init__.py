"""Lens profiles: one file per format, found by what the text looks like.

A format module has a one-line docstring (its row in docs/lenses.md) and two functions:
`recognises(data)` says whether this JSON object is its own, `read(data)` makes the camera or
raises `ProfileError`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib import import_module, resources
from pathlib import Path
from typing import Any, NoReturn

from ..camera import Camera
from ..errors import ProfileError

FORMATS = ("freelook", "opencv")


def builtin_names() -> list[str]:
    """Names of the profiles that come with the package; `load_camera` takes them too."""
    folder = resources.files("freelook.lenses")
    return sorted(
        p.name.removesuffix(".json") for p in folder.iterdir() if p.name.endswith(".json")
    )


def load_camera(name: str | Path) -> Camera:
    """Read a lens profile from a file, or one that comes with the package by its name.

    ProfileError when there is no such thing or when it is wrong; the message says where.
    """
    try:
        return parse_camera(_read_text(name))
    except ProfileError as error:
        raise ProfileError(f"lens profile {name}: {error}") from None


def parse_camera(text: str) -> Camera:
    """A camera from the text of a profile in any known format."""
    try:
        data = json.loads(text, parse_constant=_no_constant, object_pairs_hook=_no_twins)
    except RecursionError:
        raise ProfileError("nested too deeply to be a lens profile") from None
    except json.JSONDecodeError as error:
        raise ProfileError(
            f"not JSON: {error.msg} in line {error.lineno}, column {error.colno}"
        ) from None
    if not isinstance(data, dict):
        raise ProfileError(f"expected a JSON object, not a {type(data).__name__}")
    for name in FORMATS:
        module = import_module(f".{name}", __name__)
        if module.recognises(data):
            camera: Camera = module.read(data)
            return camera
    raise ProfileError(
        f"not a format known here ({', '.join(FORMATS)}); its keys are: {', '.join(data) or 'none'}"
    )


def _read_text(name: str | Path) -> str:
    path = Path(name)
    if not path.is_file() and str(name) in builtin_names():
        return (resources.files("freelook.lenses") / f"{name}.json").read_text("utf-8")
    try:
        return path.read_text("utf-8")
    except UnicodeDecodeError:
        raise ProfileError("not a text file") from None
    except OSError as error:
        known = ", ".join(builtin_names())
        raise ProfileError(
            f"{error.strerror or error}; give a profile file or one of: {known}"
        ) from None


def _no_constant(text: str) -> NoReturn:
    raise ProfileError(f"{text} is not a number a lens can have")


def _no_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise ProfileError(f"key '{name}' is given twice")
    return dict(pairs)


def check_keys(data: Mapping[str, Any], required: set[str], optional: set[str], where: str) -> None:
    """ProfileError for a missing or an unknown key, listing the known ones."""
    known = sorted(required | optional)
    for key in data:
        if key not in known:
            raise ProfileError(f"unknown key '{key}' in {where}; known: {', '.join(known)}")
    for key in sorted(required - set(data)):
        raise ProfileError(
            f"key '{key}' is missing in {where}; needed: {', '.join(sorted(required))}"
        )


def number(value: Any, where: str) -> float:
    """A float of a sane size, or ProfileError."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ProfileError(f"{where} must be a number, not {value!r}")
    if not (value == 0 or 1e-30 < abs(value) < 1e12):
        raise ProfileError(f"{where} = {value} is not a number a lens can have")
    return float(value)


def numbers(value: Any, count: int, where: str) -> list[float]:
    """A list of `count` finite floats, or ProfileError."""
    if not isinstance(value, list) or len(value) != count:
        raise ProfileError(f"{where} must be a list of {count} numbers, not {value!r}")
    return [number(item, f"{where}[{i}]") for i, item in enumerate(value)]


def picture_size(value: Any, where: str) -> tuple[int, int]:
    """(width, height) as whole pixels of a picture that can exist, or ProfileError."""
    width, height = numbers(value, 2, where)
    for side in (width, height):
        if side != int(side) or not 2 <= side <= 65536:
            raise ProfileError(f"{where} must be two whole numbers of 2 to 65536, not {value}")
    return int(width), int(height)
