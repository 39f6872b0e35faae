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
    """How much of a glyph's strokes covers (x, y); (dx, dy): the ray's slant along its axes.

    A stroke is a rectangle that reaches half its width beyond its end points.
    """
    cover = F(0)
    for i in range(first, last):
        sx, sy = strokes[i, 2] - strokes[i, 0], strokes[i, 3] - strokes[i, 1]
        length = np.sqrt(sx * sx + sy * sy)
        sx, sy = sx / length, sy / length
        px, py = x - strokes[i, 0], y - strokes[i, 1]
        along_blur = stretched(blur, sx * dx + sy * dy)
        across_blur = stretched(blur, sx * dy - sy * dx)
        along = strip(px * sx + py * sy, -half_width, length + half_width, along_blur)
        cover = max(cover, along * strip(sx * py - sy * px, -half_width, half_width, across_blur))
    return cover
