"""Ground and sky along the rays of one tile, compiled by Numba.

A tile's rays and colours lie in rows of a scratch array (ROWS, 256), so that each step is one
short loop over all of them.
"""

from __future__ import annotations

import numpy as np

from .compiled import jit
from .pyramid import sample
from .ramps import dashes, glyph_cover, ramp, stretched, strip, stroke
from .scene import DISC, GLYPH, RECT, SHADOW

F = np.float32
# unit ray, colour, distance along it to the ground, place there, blur there along the axes
DN, DE, DD, RED, GREEN, BLUE, T, NORTH, EAST, BLUR_N, BLUR_E, COVER, LIGHT = range(13)
ROWS = 13

HORIZON = (F(0.80), F(0.86), F(0.91))
ZENITH = (F(0.20), F(0.43), F(0.77))
HAZE = (F(0.74), F(0.80), F(0.86))
HILLS = (F(0.30), F(0.42), F(0.46))
SUN_COLOR = (F(1.0), F(0.95), F(0.82))
HAZE_M2 = F(2600.0**2)  # half of the colour is haze at this distance, squared
CLOUD_HEIGHT_M = F(1500.0)
SUN_RADIUS = F(0.022)
SHADE = F(0.50)
LOWEST = F(2e-4)  # rays that go down less than this meet the sky
GRAIN_LEVELS = F(4)  # blurred more than this, the grain is gone
FARTHEST_PAINT_M = F(5000.0)


@jit(inline="always")
def mix(s, k, cover, color):  # type: ignore[no-untyped-def]
    """Lay a colour over the one there is."""
    s[RED, k] += cover * (color[0] - s[RED, k])
    s[GREEN, k] += cover * (color[1] - s[GREEN, k])
    s[BLUE, k] += cover * (color[2] - s[BLUE, k])


@jit(inline="always")
def blend(below, above, cover):  # type: ignore[no-untyped-def]
    """One colour (red, green, blue) laid over another."""
    return (
        below[0] + cover * (above[0] - below[0]),
        below[1] + cover * (above[1] - below[1]),
        below[2] + cover * (above[2] - below[2]),
    )


@jit(inline="always")
def haze_at(t):  # type: ignore[no-untyped-def]
    """How much of a colour `t` metres away is haze."""
    return t * t / (t * t + HAZE_M2)


@jit()
def shade_ground(landscape, position, softness, s):  # type: ignore[no-untyped-def]
    """Ground, paint, shadows and haze for all rays, right for those that go down."""
    low_n, high_n, low_e, high_e = _places(position, softness, s)
    _textures(landscape.ground, landscape.detail, softness, s)
    scene = landscape.scene
    for k in range(s.shape[1]):
        s[LIGHT, k] = F(1)
    for index in range(scene.flat):
        row = scene.rows[index]
        if row[0] > high_n or row[1] < low_n or row[2] > high_e or row[3] < low_e:
            continue
        kind = scene.kinds[index]
        _cover(kind, row, scene.glyphs, position, softness, s)
        if kind in (SHADOW, DISC):
            for k in range(s.shape[1]):
                s[LIGHT, k] = min(s[LIGHT, k], F(1) - (F(1) - SHADE) * s[COVER, k])
        else:
            for k in range(s.shape[1]):
                mix(s, k, s[COVER, k], (row[8], row[9], row[10]))
    for k in range(s.shape[1]):
        light = s[LIGHT, k]
        s[RED, k], s[GREEN, k], s[BLUE, k] = (
            s[RED, k] * light,
            s[GREEN, k] * light,
            s[BLUE, k] * light,
        )
        mix(s, k, haze_at(s[T, k]), HAZE)


@jit()
def _places(p, softness, s):  # type: ignore[no-untyped-def]
    """Where the rays meet the ground, and the bounds of all that matters there."""
    low_n, high_n, low_e, high_e = F(1e9), F(-1e9), F(1e9), F(-1e9)
    for k in range(s.shape[1]):
        down = max(s[DD, k], LOWEST)
        t = -p[2] / down
        n, e = p[0] + t * s[DN, k], p[1] + t * s[DE, k]
        bn = stretched(softness * t, s[DN, k] / down)
        be = stretched(softness * t, s[DE, k] / down)
        s[T, k], s[NORTH, k], s[EAST, k], s[BLUR_N, k], s[BLUR_E, k] = t, n, e, bn, be
        if t < FARTHEST_PAINT_M:
            low_n, high_n = min(low_n, n - bn), max(high_n, n + bn)
            low_e, high_e = min(low_e, e - be), max(high_e, e + be)
    return low_n, high_n, low_e, high_e


@jit()
def _textures(ground, detail, softness, s):  # type: ignore[no-untyped-def]
    """The ground's colour, and close up its grain."""
    finer = np.log2(detail.per_m / ground.per_m)
    for k in range(s.shape[1]):
        down = max(s[DD, k], LOWEST)
        spot = softness * s[T, k] / (down * np.sqrt(np.sqrt(down)))
        level = np.log2(spot * ground.per_m)
        x, y = s[EAST, k], s[NORTH, k]
        r = sample(ground, 0, x, y, level)
        g = sample(ground, 1, x, y, level)
        b = sample(ground, 2, x, y, level)
        level += finer
        grain = F(1)
        if level < GRAIN_LEVELS:
            grain += min(GRAIN_LEVELS - level, F(1)) * sample(detail, 0, x, y, level)
        s[RED, k], s[GREEN, k], s[BLUE, k] = r * grain, g * grain, b * grain


@jit()
def _cover(kind, row, glyphs, p, softness, s):  # type: ignore[no-untyped-def]
    """How much a thing lying on the ground covers each ray's spot, into s[COVER]."""
    if kind in (RECT, SHADOW):
        for k in range(s.shape[1]):
            cover = strip(s[NORTH, k], row[4], row[5], s[BLUR_N, k])
            cover *= strip(s[EAST, k], row[6], row[7], s[BLUR_E, k])
            s[COVER, k] = cover if s[T, k] < FARTHEST_PAINT_M else F(0)
        _refine(kind, row, softness, s)
        return
    first, last = glyphs.starts[int(row[11])], glyphs.starts[int(row[11]) + 1]
    for k in range(s.shape[1]):
        n, e = s[NORTH, k], s[EAST, k]
        s[COVER, k] = F(0)
        bn, be = s[BLUR_N, k], s[BLUR_E, k]
        outside = n + bn < row[0] or n - bn > row[1] or e + be < row[2] or e - be > row[3]
        if outside or s[T, k] > FARTHEST_PAINT_M:
            continue
        n, e = n - F(0.5) * (row[0] + row[1]), e - F(0.5) * (row[2] + row[3])
        x, y = row[4] * e - row[5] * n, row[4] * n + row[5] * e  # right, up
        slant_n, slant_e = s[DN, k] / s[DD, k], s[DE, k] / s[DD, k]
        dx, dy = row[4] * slant_e - row[5] * slant_n, row[4] * slant_n + row[5] * slant_e
        blur = softness * s[T, k]
        if kind == GLYPH:
            x, y, blur = x / row[6], y / row[6], blur / row[6]
            s[COVER, k] = glyph_cover(glyphs.strokes, first, last, x, y, row[7], dx, dy, blur)
        else:
            x, y = x / row[7], y / row[6]
            blur = blur * (F(1) + F(0.5) * (abs(dx) + abs(dy))) / row[7]
            s[COVER, k] = stroke(np.sqrt(x * x + y * y), F(1), blur)


@jit()
def _refine(kind, row, softness, s):  # type: ignore[no-untyped-def]
    """Dashes of paint; the third pair of edges of a shadow."""
    for k in range(s.shape[1]):
        if s[COVER, k] <= 0:
            continue
        if kind == SHADOW:
            slant = (row[8] * s[DN, k] + row[9] * s[DE, k]) / s[DD, k]
            across = row[8] * s[NORTH, k] + row[9] * s[EAST, k]
            blur = stretched(softness * s[T, k], slant)
            s[COVER, k] *= strip(across, row[10], row[11], blur)
        elif row[11] > 0:
            s[COVER, k] *= dashes(s[NORTH, k] - row[4], row[11], s[BLUR_N, k])
        elif row[12] > 0:
            s[COVER, k] *= dashes(s[EAST, k] - row[6], row[12], s[BLUR_E, k])


@jit()
def shade_sky(landscape, position, softness, s):  # type: ignore[no-untyped-def]
    """Sky, sun, clouds and hills, for the rays that do not go down."""
    sun = landscape.scene.sun
    clouds = landscape.clouds
    for k in range(s.shape[1]):
        if s[DD, k] > LOWEST:
            continue
        up = max(-s[DD, k], F(0))
        high = F(1.3) * up / (up + F(0.3))
        for c in range(3):
            s[RED + c, k] = HORIZON[c] + high * (ZENITH[c] - HORIZON[c])
        off = F(1) - s[DN, k] * sun[0] - s[DE, k] * sun[1] + up * sun[2]
        off = max(off, F(0))
        wide = F(1) - F(0.5) * off
        wide *= wide * wide
        glow = F(0.0225) / (off + F(0.034)) + F(0.18) * wide * wide
        mix(s, k, glow, SUN_COLOR)
        if up > F(0.03):
            t = CLOUD_HEIGHT_M / up
            level = np.log2(softness * t / np.sqrt(up) * clouds.per_m)
            x, y = position[1] + t * s[DE, k], position[0] + t * s[DN, k]
            thick = sample(clouds, 0, x, y, level)
            cover = min(thick, F(1)) * ramp(up * F(12) - F(1.4))
            # thick ones are grey below, and all are bright where the sun is near
            bright = F(1) - F(0.14) * max(thick - F(0.6), F(0))
            bright = min(bright * (F(0.96) + F(0.4) * glow), F(1))
            mix(s, k, cover, (bright, bright, bright))
        disc = stroke(np.sqrt(F(2) * off), SUN_RADIUS, softness)
        mix(s, k, disc, (F(1), F(0.98), F(0.90)))
        if up < F(0.16) + F(2) * softness:
            _hills(landscape.hills, softness, s, k)


@jit()
def _hills(hills, softness, s, k):  # type: ignore[no-untyped-def]
    """Two ridges, so far away that only directions count."""
    dn, de = s[DN, k], s[DE, k]
    slope = max(-s[DD, k], F(0)) / np.sqrt(dn * dn + de * de)
    samples = hills.shape[1]
    place = np.arctan2(de, dn) * F(samples / (2 * np.pi)) + F(samples)
    low = np.int32(place)
    part = place - F(low)
    here, there = low & (samples - 1), (low + 1) & (samples - 1)
    for ridge in range(2):
        top = hills[ridge, here] * (F(1) - part) + hills[ridge, there] * part
        cover = ramp((top - slope) / softness)
        dark = (F(0.30) + F(0.38) * F(ridge)) * min(slope / top, F(1))
        mix(s, k, cover, blend(HAZE, HILLS, dark))
