"""The terms that are not round which several models share."""

from __future__ import annotations

from .base import Floats


def decentring(x: Floats, y: Floats, px: float, py: float) -> tuple[Floats, Floats]:
    """Brown's tangential terms: px (r^2 + 2 x^2) + 2 py x y, and py (r^2 + 2 y^2) + 2 px x y.

    px is p2 and py is p1 in OpenCV's and most others' names.
    """
    r2, cross = x * x + y * y, 2 * x * y
    return px * (r2 + 2 * x * x) + py * cross, py * (r2 + 2 * y * y) + px * cross
