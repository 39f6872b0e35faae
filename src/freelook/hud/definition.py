"""`hud.json`: themes, sizes, words and letters, for Python as for the page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ..errors import RenderError

DEFINITION = Path(__file__).parent / "hud.json"
PEN = Path(__file__).parent / "pen.glsl"
ROLES = ("line", "bright", "chosen", "alert", "box")

Color = tuple[float, float, float, float]


@dataclass(frozen=True)
class Theme:
    """How it looks. Colours are red, green, blue, opacity, 0 to 1; `rim` is the dark one around
    lines and letters, `rim_width` wide; `weight` is by what widths of lines are multiplied."""

    name: str
    about: str
    colors: Mapping[str, Color]
    rim: Color
    rim_width: float
    weight: float

    def color(self, role: str, opacity: float = 1.0) -> Color:
        red, green, blue, alpha = self.colors[role]
        return red, green, blue, alpha * opacity


@dataclass(frozen=True)
class Definition:
    """`values` is the file as it is; sizes in it are in points (see `freelook.hud.place`)."""

    values: Mapping[str, Any]
    themes: Mapping[str, Theme]

    def __getitem__(self, part: str) -> Mapping[str, Any]:
        found: Mapping[str, Any] = self.values[part]
        return found

    @property
    def margin(self) -> float:
        return float(self.values["margin"])

    def say(self, word: str, **values: object) -> str:
        """One of its words, filled in."""
        return str(self.values["words"][word]).format(**values)


@cache
def definition() -> Definition:
    values = json.loads(DEFINITION.read_text("utf-8"))
    themes = {name: _theme(name, entry) for name, entry in values["themes"].items()}
    return Definition(values, themes)


def _theme(name: str, entry: Mapping[str, Any]) -> Theme:
    colors = {role: _color(entry[role]) for role in ROLES}
    rim = _color(entry["rim"])
    return Theme(name, entry["about"], colors, rim, entry["rim_width"], entry["weight"])


def _color(values: list[float]) -> Color:
    red, green, blue, alpha = (*values, 1.0)[:4]
    return red, green, blue, alpha


@cache
def pen_source() -> str:
    """The text of pen.glsl, which the page gets too."""
    return PEN.read_text("utf-8")


THEMES = tuple(json.loads(DEFINITION.read_text("utf-8"))["themes"])


def theme_named(name: str) -> Theme:
    """RenderError for an unknown name lists the known ones."""
    if name not in THEMES:
        raise RenderError(f"unknown HUD theme {name!r}; known: {', '.join(THEMES)}")
    return definition().themes[name]
