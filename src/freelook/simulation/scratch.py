"""One tile of 256 rays while it is being shaded, and colours laid over one another.

All that is known about the rays lies in one flat array, quantity by quantity: the value of
ray k for quantity Q is s[Q + k]. With offsets fixed at compile time, loops over k turn into
vector instructions.
"""

from __future__ import annotations

import numpy as np

from .compiled import jit

F = np.float32
SIDE = 16
TILE = SIDE * SIDE

# unit ray; colour; distance to the ground, place there and blur there along the axes
DN, DE, DD, RED, GREEN, BLUE, T, NORTH, EAST, BLUR_N, BLUR_E = (TILE * i for i in range(11))
LEVEL, COVER, LIGHT = (TILE * i for i in range(11, 14))
SCRATCH = TILE * 14

HAZE = (F(0.74), F(0.80), F(0.86))
HAZE_M2 = F(2600.0**2)  # half of the colour is haze at this distance, squared
LOWEST = F(2e-4)  # rays that go down less than this meet the sky


@jit(inline="always")
def mix(s, k, cover, color):  # type: ignore[no-untyped-def]
    """Lay a colour over that of ray k."""
    s[RED + k] += cover * (color[0] - s[RED + k])
    s[GREEN + k] += cover * (color[1] - s[GREEN + k])
    s[BLUE + k] += cover * (color[2] - s[BLUE + k])


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
