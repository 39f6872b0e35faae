"""What is drawn over a view: the numbers, and the lines, boxes and words made of them.

`hud.json` says how it looks and what it says; the page gets the same file, and makes the same
shapes of the same numbers (web/static/hud.js). `pen.glsl` draws them in both.
"""

from .conditions import Situation, conditions
from .definition import THEMES, Definition, Theme, definition, theme_named
from .place import Place, place_of
from .shapes import Box, Lines, Shape, Text, shapes
from .state import Dial, HudState, LensField, Link, Recording, TrackerState, Warned

__all__ = [
    "THEMES",
    "Box",
    "Definition",
    "Dial",
    "HudState",
    "LensField",
    "Lines",
    "Link",
    "Place",
    "Recording",
    "Shape",
    "Situation",
    "Text",
    "Theme",
    "TrackerState",
    "Warned",
    "conditions",
    "definition",
    "place_of",
    "shapes",
    "theme_named",
]
