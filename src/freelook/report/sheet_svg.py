"""A printed target as SVG, in millimetres."""

from __future__ import annotations

from xml.sax.saxutils import escape

from ..calibration.sheet import Sheet, Text


def svg(sheet: Sheet) -> str:
    """A page of the sheet's true size; the target is in the groups `squares` and `circles`."""
    width, height = sheet.size
    circles = (
        f'<circle cx="{x:.4f}" cy="{y:.4f}" r="{r:.4f}"/>' for x, y, r in sheet.circles.tolist()
    )
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:g}mm" '
        f'viewBox="0 0 {width:g} {height:g}">',
        f'<rect width="{width:g}" height="{height:g}" fill="white"/>',
        '<g id="squares" shape-rendering="crispEdges">',  # no seams between neighbours
        *(_rectangle(*shape) for shape in sheet.rectangles.tolist()),
        "</g>",
        '<g id="circles">',
        *circles,
        "</g>",
        '<g id="ruler">',
        *(_rectangle(*mark) for mark in sheet.marks.tolist()),
        "</g>",
        *map(_text, sheet.texts),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _rectangle(x: float, y: float, width: float, height: float) -> str:
    return f'<rect x="{x:.4f}" y="{y:.4f}" width="{width:.4f}" height="{height:.4f}"/>'


def _text(text: Text) -> str:
    family = "monospace" if text.typed else "sans-serif"
    return (
        f'<text x="{text.x:g}" y="{text.y:g}" font-size="{text.height:g}" '
        f'font-family="{family}">{escape(text.words)}</text>'
    )
