"""The sky along the rays of one tile, compiled by Numba: gradient, sun, clouds, hills."""

from __future__ import annotations

import numpy as np

from .compiled import jit
from .pyramid import log2, sample
from .ramps import ramp, stroke
from .scratch import (
    BLUE,
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
    blend,
    mix,
)

HORIZON = (F(0.80), F(0.86), F(0.91))
ZENITH = (F(0.20), F(0.43), F(0.77))
HILLS = (F(0.30), F(0.42), F(0.46))
SUNSHINE = (F(1.0), F(0.95), F(0.82))
DISC = (F(1.0), F(0.98), F(0.90))
SUN_RADIUS = F(0.022)
CLOUD_HEIGHT_M = F(1500.0)
LOWEST_CLOUD = F(0.03)
HIGHEST_HILL = F(0.16)


@jit()
def shade_sky(landscape, position, softness, lowest, s):  # type: ignore[no-untyped-def]
    """Colours of the rays that do not go down; `lowest` is the least upward part of any ray."""
    _gradient_and_sun(landscape.scene.sun, softness, s)
    _clouds(landscape.clouds, position, softness, s)
    if lowest < HIGHEST_HILL + F(2) * softness:
        for k in range(TILE):
            if s[DD + k] <= LOWEST and -s[DD + k] < HIGHEST_HILL + F(2) * softness:
                _hills(landscape.hills, softness, s, k)


@jit()
def _gradient_and_sun(sun, softness, s):  # type: ignore[no-untyped-def]
    """The clear sky; how bright the air shines into s[LIGHT]."""
    sn, se, sd = sun[0], sun[1], sun[2]
    for k in range(TILE):
        up = max(-s[DD + k], F(0))
        off = max(F(1) - s[DN + k] * sn - s[DE + k] * se + up * sd, F(0))
        wide = F(1) - F(0.5) * off
        glow = F(0.0225) / (off + F(0.034)) + F(0.18) * wide * wide * wide * wide * wide * wide
        disc = stroke(np.sqrt(F(2) * off), SUN_RADIUS, softness)
        color = blend(HORIZON, ZENITH, F(1.3) * up / (up + F(0.3)))
        color = blend(blend(color, SUNSHINE, glow), DISC, disc)
        above = s[DD + k] <= LOWEST  # the others keep the ground's colour
        s[RED + k] = color[0] if above else s[RED + k]
        s[GREEN + k] = color[1] if above else s[GREEN + k]
        s[BLUE + k] = color[2] if above else s[BLUE + k]
        s[LIGHT + k] = glow


@jit()
def _clouds(clouds, position, softness, s):  # type: ignore[no-untyped-def]
    north, east, per_m = position[0], position[1], clouds.per_m
    for k in range(TILE):
        up = max(-s[DD + k], LOWEST_CLOUD)
        t = CLOUD_HEIGHT_M / up
        s[NORTH + k], s[EAST + k] = north + t * s[DN + k], east + t * s[DE + k]
        s[LEVEL + k] = log2(softness * t * per_m / np.sqrt(up))
        s[COVER + k] = ramp(up * F(12) - F(1.4))
    for k in range(TILE):
        if s[COVER + k] > 0:
            thick = sample(clouds, s[EAST + k], s[NORTH + k], s[LEVEL + k])
            # thick ones are grey below, and all are bright where the sun is near
            bright = F(1) - F(0.14) * max(thick - F(0.6), F(0))
            bright = min(bright * (F(0.96) + F(0.4) * s[LIGHT + k]), F(1))
            mix(s, k, min(thick, F(1)) * s[COVER + k], (bright, bright, bright))


@jit()
def _hills(hills, softness, s, k):  # type: ignore[no-untyped-def]
    """Two ridges, so far away that only directions count."""
    dn, de = s[DN + k], s[DE + k]
    slope = max(-s[DD + k], F(0)) / np.sqrt(dn * dn + de * de)
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
