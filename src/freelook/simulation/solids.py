"""Blocks and balls along the rays of one tile, compiled by Numba. Farther ones come first."""

from __future__ import annotations

import numpy as np

from .compiled import jit
from .ramps import dashes, glyph_cover, stretched, strip, stroke
from .scene import BANDS, BOX, WINDOWS
from .scratch import COVER, DD, DE, DN, HAZE, TILE, F, blend, haze_at, mix

NORTH_FACE, SOUTH_FACE, EAST_FACE, WEST_FACE = range(4)
PAINT = (F(0.96), F(0.96), F(0.94))
GLASS = (F(0.22), F(0.27), F(0.34))
NOTHING = (F(0), F(0), F(0), F(1), F(1), F(1))


@jit()
def shade_solids(scene, view, listed, count, s):  # type: ignore[no-untyped-def]
    """Lay the listed things (places in view.order) over what lies behind them."""
    for i in range(count):
        index, cone = view.order[listed[i]], view.cones[listed[i]]
        row = scene.rows[index]
        cn, ce, cd = row[0] - view.position[0], row[1] - view.position[1], row[2] - view.position[2]
        away2 = cn * cn + ce * ce + cd * cd
        axis_n, axis_e, axis_d, least = cone[0], cone[1], cone[2], cone[3]
        for k in range(TILE):
            s[COVER + k] = s[DN + k] * axis_n + s[DE + k] * axis_e + s[DD + k] * axis_d
        is_box = scene.kinds[index] == BOX
        for k in range(TILE):
            if s[COVER + k] < least:
                continue
            if is_box:
                _box(row, scene.glyphs, view.position, view.softness, scene.sun, s, k)
            elif s[COVER + k] > 0:
                along = s[COVER + k] * np.sqrt(away2)
                _ball(row, cn, ce, cd, along, away2, view.softness, scene.sun, s, k)


@jit(inline="always")
def _face(dk, du, dv, to_plane, pu, pv, u0, u1, v0, v1, softness):  # type: ignore[no-untyped-def]
    """(cover, u, v, blur along u, blur along v, distance) of a rectangle at right angles to k."""
    if dk * to_plane <= 0 or abs(dk) < F(1e-6):
        return NOTHING
    t = to_plane / dk
    u, v = pu + t * du, pv + t * dv
    bu, bv = stretched(softness * t, du / dk), stretched(softness * t, dv / dk)
    return strip(u, u0, u1, bu) * strip(v, v0, v1, bv), u, v, bu, bv, t


@jit(inline="always")
def _to_plane(p, low, high):  # type: ignore[no-untyped-def]
    """Signed way to the side of the block that is turned to us; 0 from between the planes."""
    return low - p if p < low else (high - p if p > high else F(0))


@jit()
def _wall(row, glyphs, face, u, v, bu, bv, u0, du, dv, t, softness):  # type: ignore[no-untyped-def]
    """(white, dark): paint and windows on a wall; u runs along it, v down."""
    if row[16] == WINDOWS:
        dark = dashes(u - u0 + F(1), F(4), bu) * dashes(v - row[9] - F(1), F(3.6), bv)
        return F(0), dark
    if row[16] == BANDS:
        return dashes(v - row[9], F(18), bv), F(0)
    if int(row[18]) != face:
        return F(0), F(0)
    # seen from outside, u (north or east) runs to the right on the south and the east face
    right = F(1) if face in (SOUTH_FACE, EAST_FACE) else F(-1)
    middle = row[0] if face in (EAST_FACE, WEST_FACE) else row[1]
    size = F(0.72) * (row[9] - row[8])
    x, y = right * (u - middle) / size, (row[2] - v) / size
    index = int(row[17])
    first, last = glyphs.starts[index], glyphs.starts[index + 1]
    white = glyph_cover(
        glyphs.strokes, first, last, x, y, F(0.085), right * du, -dv, softness * t / size
    )
    return white, F(0)


@jit()
def _box(row, glyphs, p, softness, sun, s, k):  # type: ignore[no-untyped-def]
    """Up to three faces; along a shared edge their covers add up to one."""
    dn, de, dd = s[DN + k], s[DE + k], s[DD + k]
    n0, n1, e0, e1, d0, d1 = row[4], row[5], row[6], row[7], row[8], row[9]
    total, nearest, r, g, b = F(0), F(1e9), F(0), F(0), F(0)
    for axis in range(3):
        if axis == 0:
            to = _to_plane(p[0], n0, n1)
            cover, u, v, bu, bv, t = _face(dn, de, dd, to, p[1], p[2], e0, e1, d0, d1, softness)
            face, u0, du, dv, lit = SOUTH_FACE if to > 0 else NORTH_FACE, e0, de, dd, sun[0]
        elif axis == 1:
            to = _to_plane(p[1], e0, e1)
            cover, u, v, bu, bv, t = _face(de, dn, dd, to, p[0], p[2], n0, n1, d0, d1, softness)
            face, u0, du, dv, lit = WEST_FACE if to > 0 else EAST_FACE, n0, dn, dd, sun[1]
        else:
            to = _to_plane(p[2], d0, d1)
            cover, u, v, bu, bv, t = _face(dd, dn, de, to, p[0], p[1], n0, n1, e0, e1, softness)
            face, u0, du, dv, lit = -1, n0, dn, de, sun[2]
        if cover <= 0:
            continue
        white, dark = F(0), F(0)
        first = 13 if axis == 2 and to > 0 else 10
        if axis < 2:
            dk = dn if axis == 0 else de
            white, dark = _wall(row, glyphs, face, u, v, bu, bv, u0, du / dk, dv / dk, t, softness)
        light = F(0.62) + F(0.48) * max(lit if to < 0 else -lit, F(0))
        color = blend((row[first], row[first + 1], row[first + 2]), PAINT, white)
        color = blend(color, GLASS, dark)
        light *= cover
        r, g, b = r + light * color[0], g + light * color[1], b + light * color[2]
        total += cover
        nearest = min(nearest, t)
    if total > 0:
        color = blend((r / total, g / total, b / total), HAZE, haze_at(nearest))
        mix(s, k, min(total, F(1)), color)


@jit()
def _ball(row, cn, ce, cd, t, away2, softness, sun, s, k):  # type: ignore[no-untyped-def]
    """A ball whose middle lies (cn, ce, cd) from us, nearest to the ray at distance t."""
    radius = row[4]
    off2 = max(away2 - t * t, F(0))
    blur = softness * t
    cover = stroke(np.sqrt(off2), radius, blur)
    if cover <= 0:
        return
    rise = np.sqrt(max(radius * radius - off2, F(0)) + radius * blur)
    mn, me, md = (
        (t - rise) * s[DN + k] - cn,
        (t - rise) * s[DE + k] - ce,
        (t - rise) * s[DD + k] - cd,
    )
    size = F(1) / np.sqrt(mn * mn + me * me + md * md)
    mn, me, md = mn * size, me * size, md * size
    lit = mn * sun[0] + me * sun[1] + md * sun[2]
    light = F(0.72) + F(0.34) * lit - F(0.08) * md
    stripe = F(0)
    if row[11] > 0:
        ring = max(mn * mn + me * me, F(0.01))
        spot = blur / (rise * np.sqrt(ring))
        stripe = dashes(np.arctan2(me, mn) + F(3.2), F(2 * np.pi) / row[11], spot)
    color = blend((row[5], row[6], row[7]), (row[8], row[9], row[10]), stripe)
    color = (light * color[0], light * color[1], light * color[2])
    mix(s, k, cover, blend(color, HAZE, haze_at(t)))
