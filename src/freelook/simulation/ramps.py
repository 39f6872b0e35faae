"""Soft edges: how much of a blurred spot lies inside a shape, compiled by Numba.

Every edge is a smooth ramp whose half width is an angle, the same for all edges. At distance t
on a plane met at a slant, one radian covers t sqrt(1 + (d_u / d_k)^2) metres along the direction
u in the plane (d the unit ray, d_k its part along the plane's normal). Shapes narrower than their
ramps fade by themselves.
"""

from __future__ import annotations

import numpy as np

from .compiled import jit

F = np.float32


@jit(inline="always")
def ramp(x):  # type: ignore[no-untyped-def]
    """0 below -1, 1 above 1, smooth between."""
    x = min(max(F(0.5) * x + F(0.5), F(0)), F(1))
    return x * x * (F(3) - F(2) * x)


@jit(inline="always")
def strip(x, low, high, blur):  # type: ignore[no-untyped-def]
    """How much of a spot of +-blur at x lies between low and high."""
    return ramp((x - low) / blur) - ramp((x - high) / blur)


@jit(inline="always")
def stroke(away, half_width, blur):  # type: ignore[no-untyped-def]
    """The same for a line or a disc, `away` from its middle."""
    return ramp((half_width - away) / blur) + ramp((half_width + away) / blur) - F(1)


@jit(inline="always")
def stretched(blur, slant):  # type: ignore[no-untyped-def]
    """The blur along a direction in a plane that the ray meets with this slant d_u / d_k."""
    return blur * np.sqrt(F(1) + slant * slant)


@jit()
def dashes(x, period, blur):  # type: ignore[no-untyped-def]
    """Half-filled dashes starting at 0, seen through a box of +-blur: fades to one half."""
    high, low = (x + blur) / period, (x - blur) / period
    above, below = np.floor(high), np.floor(low)
    covered = F(0.5) * (above - below) + min(high - above, F(0.5)) - min(low - below, F(0.5))
    return covered / (high - low)


@jit()
def glyph_cover(strokes, first, last, x, y, half_width, dx, dy, blur):  # type: ignore[no-untyped-def]
    """How much of a glyph's strokes covers (x, y); (dx, dy): the ray's slant along its axes."""
    cover = F(0)
    for i in range(first, last):
        x0, y0 = strokes[i, 0], strokes[i, 1]
        sx, sy = strokes[i, 2] - x0, strokes[i, 3] - y0
        along = ((x - x0) * sx + (y - y0) * sy) / (sx * sx + sy * sy)
        along = min(max(along, F(0)), F(1))
        ox, oy = x - x0 - along * sx, y - y0 - along * sy
        away = np.sqrt(ox * ox + oy * oy) + F(1e-9)
        slant = (ox * dx + oy * dy) / away
        cover = max(cover, stroke(away, half_width, stretched(blur, slant)))
    return cover
