"""Checked values from parsed profiles: everything wrong is a ProfileError that says where."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..errors import ProfileError


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
        raise ProfileError(f"{where} must be a number, not {value!r:.80}")
    if not (value == 0 or 1e-30 < abs(value) < 1e12):
        raise ProfileError(f"{where} = {value!r:.80} is not a number a lens can have")
    return float(value)


def numbers(value: Any, count: int | range, where: str) -> list[float]:
    """A list of `count` (or one of a range of counts) finite floats, or ProfileError."""
    wanted = range(count, count + 1) if isinstance(count, int) else count
    if not isinstance(value, list) or len(value) not in wanted:
        how_many = f"{count}" if isinstance(count, int) else f"{wanted[0]} to {wanted[-1]}"
        raise ProfileError(f"{where} must be a list of {how_many} numbers, not {value!r:.80}")
    return [number(item, f"{where}[{i}]") for i, item in enumerate(value)]


def picture_size(value: Any, where: str) -> tuple[int, int]:
    """(width, height) as whole pixels of a picture that can exist, or ProfileError."""
    width, height = numbers(value, 2, where)
    for side in (width, height):
        if side != int(side) or not 2 <= side <= 65536:
            raise ProfileError(
                f"{where} must be two whole numbers of 2 to 65536, not {value!r:.80}"
            )
    return int(width), int(height)
