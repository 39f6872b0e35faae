"""YAML that other programs read back: floats with all their digits, rows of numbers in one line."""

from __future__ import annotations

from typing import Any

import yaml

from ._profile import Profile


def dump(data: dict[str, Any]) -> str:
    """Keys in the given order. Every float has a point: PyYAML takes 1e-05 for a text."""
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=100)


def real(value: float) -> str:
    """A float with all its digits, and a point."""
    mantissa, e, exponent = repr(float(value)).partition("e")
    return f"{mantissa}{'' if '.' in mantissa or not e else '.0'}{e}{exponent}"


def heading(profile: Profile) -> str:
    """Name and source as comment lines, for formats that have no field for them."""
    lines = [line for text in (profile.name, profile.source) for line in text.splitlines()]
    return "".join(f"# {_printable(line)}\n" for line in lines if line.strip())


def _printable(line: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in line).strip()
