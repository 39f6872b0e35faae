"""The ground along the rays of one tile, compiled by Numba: fields, paint, shadows, haze."""

from __future__ import annotations

import numpy as np

from .compiled import jit
from .pyramid import log2, sample, sample_color
from .ramps import dashes, glyph_cover, stretched, strip, stroke
from .scene import DISC, GLYPH, RECT, SHADOW
from .scratch import (
    BLUE,
    BLUR_E,
    BLUR_N,
    COVER,
    DD,
    DE,
    DN,
    EAST,
    GREEN,
    HAZE,
    LEVEL,
    LIGHT,
    LOWEST,
    NORTH,
    RED,
    TILE,
    F,
    T,
    haze_at,
    mix,
)

SHADE = F(0.50)
GRAIN_LEVELS = F(4)  # blurred more than this, the grain is gone
EDGES = F(2)  # no soft edge reaches farther than this, in blurs along both axes together
FARTHEST_PAINT_M = F(5000.0)


@jit()
def shade_ground(landscape, position, softness, s):  # type: ignore[no-untyped-def]
    """Colours of all rays, right for those that go down."""
    low_n, high_n, low_e, high_e, edge = _places(position, softness, landscape.ground.per_m, s)
    _textures(landscape.ground, landscape.detail, s)
    scene = landscape.scene
    for index in range(scene.flat):
        kind = scene.kinds[index]
        straight = kind in (RECT, SHADOW)
        reach = F(0) if straight else edge
        if scene.rows[index, 0] - reach > high_n or scene.rows[index, 1] + reach < low_n:
            continue
        if scene.rows[index, 2] - reach > high_e or scene.rows[index, 3] + reach < low_e:
            continue
        row = scene.rows[index]
        if not straight:
            _shape(kind, row, scene.glyphs, softness, s)
        elif _rectangle(row[4], row[5], row[6], row[7], s) > 0:
            _refine(kind, row, softness, s)
        else:
            continue
        if kind in (SHADOW, DISC):
            for k in range(TILE):
                s[LIGHT + k] = min(s[LIGHT + k], F(1) - (F(1) - SHADE) * s[COVER + k])
        else:
            color = (row[8], row[9], row[10])
            for k in range(TILE):
                mix(s, k, s[COVER + k], color)
    for k in range(TILE):
        for channel in (RED, GREEN, BLUE):
            s[channel + k] *= s[LIGHT + k]
        mix(s, k, haze_at(s[T + k]), HAZE)


@jit()
def _places(p, softness, per_m, s):  # type: ignore[no-untyped-def]
    """Where the rays meet the ground; returns the bounds there, and how far round edges reach."""
    pn, pe, height = p[0], p[1], -p[2]
    for k in range(TILE):
        down = max(s[DD + k], LOWEST)
        t = height / down
        n, e = pn + t * s[DN + k], pe + t * s[DE + k]
        blur = softness * t
        bn, be = stretched(blur, s[DN + k] / down), stretched(blur, s[DE + k] / down)
        s[T + k], s[NORTH + k], s[EAST + k], s[BLUR_N + k], s[BLUR_E + k] = t, n, e, bn, be
        s[LEVEL + k] = log2(blur * per_m / (down * np.sqrt(np.sqrt(down))))
        s[LIGHT + k] = F(1)
    low_n, high_n, low_e, high_e, edge = F(1e9), F(-1e9), F(1e9), F(-1e9), F(0)
    for k in range(TILE):  # apart, because the compiler makes no vector code of minima
        if s[T + k] < FARTHEST_PAINT_M:
            n, e, bn, be = s[NORTH + k], s[EAST + k], s[BLUR_N + k], s[BLUR_E + k]
            low_n, high_n = min(low_n, n - bn), max(high_n, n + bn)
            low_e, high_e = min(low_e, e - be), max(high_e, e + be)
            edge = max(edge, EDGES * (bn + be))
    return low_n, high_n, low_e, high_e, edge


@jit()
def _textures(ground, detail, s):  # type: ignore[no-untyped-def]
    """The ground's colour, and close up its grain."""
    finer = log2(detail.per_m / ground.per_m)
    for k in range(TILE):
        level, x, y = s[LEVEL + k], s[EAST + k], s[NORTH + k]
        r, g, b = sample_color(ground, x, y, level)
        grain, level = F(1), level + finer
        if level < GRAIN_LEVELS:
            grain += min(GRAIN_LEVELS - level, F(1)) * sample(detail, x, y, level)
        s[RED + k], s[GREEN + k], s[BLUE + k] = r * grain, g * grain, b * grain


@jit()
def _rectangle(n0, n1, e0, e1, s):  # type: ignore[no-untyped-def]
    """How much of each ray's spot lies between these bounds, into s[COVER]; returns the sum."""
    total = F(0)
    for k in range(TILE):
        cover = strip(s[NORTH + k], n0, n1, s[BLUR_N + k])
        cover *= strip(s[EAST + k], e0, e1, s[BLUR_E + k])
        cover = cover if s[T + k] < FARTHEST_PAINT_M else F(0)
        s[COVER + k] = cover
        total += cover
    return total


@jit()
def _refine(kind, row, softness, s):  # type: ignore[no-untyped-def]
    """Dashes of paint; the third pair of edges of a shadow."""
    if kind == RECT and row[11] == 0 and row[12] == 0:
        return
    for k in range(TILE):
        if s[COVER + k] <= 0:
            continue
        if kind == SHADOW:
            slant = (row[8] * s[DN + k] + row[9] * s[DE + k]) / s[DD + k]
            across = row[8] * s[NORTH + k] + row[9] * s[EAST + k]
            blur = stretched(softness * s[T + k], slant)
            s[COVER + k] *= strip(across, row[10], row[11], blur)
        elif row[11] > 0:
            s[COVER + k] *= dashes(s[NORTH + k] - row[4], row[11], s[BLUR_N + k])
        else:
            s[COVER + k] *= dashes(s[EAST + k] - row[6], row[12], s[BLUR_E + k])


@jit()
def _shape(kind, row, glyphs, softness, s):  # type: ignore[no-untyped-def]
    """How much of a letter or of a ball's shadow covers each ray's spot, into s[COVER]."""
    first, last = glyphs.starts[int(row[11])], glyphs.starts[int(row[11]) + 1]
    middle_n, middle_e = F(0.5) * (row[0] + row[1]), F(0.5) * (row[2] + row[3])
    reach_n, reach_e = row[1] - middle_n, row[3] - middle_e
    for k in range(TILE):
        n, e, t = s[NORTH + k] - middle_n, s[EAST + k] - middle_e, s[T + k]
        edge = EDGES * (s[BLUR_N + k] + s[BLUR_E + k])
        outside = abs(n) > reach_n + edge or abs(e) > reach_e + edge
        s[COVER + k] = F(0)
        if outside or t > FARTHEST_PAINT_M:
            continue
        x, y = row[4] * e - row[5] * n, row[4] * n + row[5] * e  # right, up
        slant_n, slant_e = s[DN + k] / s[DD + k], s[DE + k] / s[DD + k]
        dx, dy = row[4] * slant_e - row[5] * slant_n, row[4] * slant_n + row[5] * slant_e
        blur = softness * t
        if kind == GLYPH:
            x, y, blur = x / row[6], y / row[6], blur / row[6]
            s[COVER + k] = glyph_cover(glyphs.strokes, first, last, x, y, row[7], dx, dy, blur)
        else:
            a2, b2 = row[6] * row[6], row[7] * row[7]
            blur *= np.sqrt(F(0.5) * ((F(1) + dx * dx) / b2 + (F(1) + dy * dy) / a2))
            s[COVER + k] = stroke(np.sqrt(x * x / b2 + y * y / a2), F(1), blur)
