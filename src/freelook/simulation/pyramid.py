"""Periodic textures with all their coarser levels, sampled at any blur.

A level halves the one below it, so a texture looked at from far away fades to its mean instead
of glittering. Sampling is bilinear inside a level and fades from one level to the next: one
continuous function of place and blur.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import jit

F, I, U, Q = np.float32, np.int32, np.uint32, np.uint64  # noqa: E741 - the usual letters
Float32s = NDArray[np.float32]

# three channels of 10 bits in one word, with room for weights that add up to 2048
FIELD, STEPS, LARGEST = 21, 2048, 1023
MASK = Q((1 << FIELD) - 1)


class Pyramid(NamedTuple):
    """All levels one behind the other, finest first.

    texels: float32, or uint64 with three channels in one word. `offsets`: where a level starts.
    """

    texels: NDArray[Any]
    offsets: NDArray[np.uint32]
    per_m: np.float32  # finest texels per metre


def make_pyramid(texture: NDArray[Any], texel_m: float) -> Pyramid:
    """All levels of a square texture whose side is a power of two, down to a single texel.

    (side, side): one channel, any values. (side, side, 3): three channels of 0 to 1.
    """
    levels: list[NDArray[Any]] = [np.asarray(texture, dtype=np.float32)]
    while len(levels[-1]) > 1:
        fine = levels[-1]
        levels.append((fine[::2, ::2] + fine[1::2, ::2] + fine[::2, 1::2] + fine[1::2, 1::2]) / 4)
    if texture.ndim == 3:
        levels = [_packed(level) for level in levels]
    offsets = np.cumsum([0] + [level.size for level in levels[:-1]]).astype(U)
    return Pyramid(np.concatenate([level.ravel() for level in levels]), offsets, F(1 / texel_m))


def _packed(texture: Float32s) -> NDArray[np.uint64]:
    codes = np.rint(np.clip(texture, 0, 1) * LARGEST).astype(Q)
    return np.asarray(codes[..., 0] | codes[..., 1] << Q(FIELD) | codes[..., 2] << Q(2 * FIELD))


@jit(inline="always")
def log2(x):  # type: ignore[no-untyped-def]
    """log2 of a positive number to 0.005, continuous, and fit for vector instructions."""
    bits = F(x).view(np.int32)
    exponent = F((bits >> I(23)) - I(127))
    part = I((bits & I(0x7FFFFF)) | I(0x3F800000)).view(np.float32) - F(1)  # 0 to 1
    return exponent + part * (F(1.3465) - F(0.3465) * part)


@jit(inline="always")
def _levels(pyramid, level):  # type: ignore[no-untyped-def]
    """(finer of two levels, how much of the coarser): pure in half of the range between two."""
    last = I(len(pyramid.offsets) - 1)
    level = min(max(level, F(0)), F(last))
    low = min(I(level), last - I(1))
    return low, min(max(F(2) * (level - F(low)) - F(0.5), F(0)), F(1))


@jit(inline="always")
def _cell(pyramid, low, x, y):  # type: ignore[no-untyped-def]
    """Four indices and the place between them, in one level; texel centres lie at halves."""
    # unsigned indices spare a test for negative ones at each texel
    shift = U(len(pyramid.offsets) - 1 - low)
    last = (U(1) << shift) - U(1)
    scale = pyramid.per_m / F(I(1) << I(low))
    x, y = x * scale - F(0.5), y * scale - F(0.5)
    low_x, low_y = np.floor(x), np.floor(y)
    left, top = U(I(low_x)) & last, U(I(low_y)) & last
    right, bottom = (left + U(1)) & last, (top + U(1)) & last
    start = pyramid.offsets[low]
    top, bottom = start + (top << shift), start + (bottom << shift)
    return U(top + left), U(top + right), U(bottom + left), U(bottom + right), x - low_x, y - low_y


@jit(inline="always")
def _bilinear(pyramid, low, x, y):  # type: ignore[no-untyped-def]
    a, b, c, d, x, y = _cell(pyramid, low, x, y)
    t = pyramid.texels
    above, below = t[a] + x * (t[b] - t[a]), t[c] + x * (t[d] - t[c])
    return above + y * (below - above)


@jit(inline="always")
def sample(pyramid, x, y, level):  # type: ignore[no-untyped-def]
    """A one-channel texture at a place in metres.

    `level` is log2 of the blur in finest texels; outside the levels there are, the nearest.
    """
    low, part = _levels(pyramid, level)
    value = _bilinear(pyramid, low, x, y) if part < F(1) else F(0)
    if part > F(0):
        value += part * (_bilinear(pyramid, low + 1, x, y) - value)
    return value


@jit(inline="always")
def _bilinear_color(pyramid, low, x, y):  # type: ignore[no-untyped-def]
    a, b, c, d, x, y = _cell(pyramid, low, x, y)
    wx, wy = U(x * F(STEPS)), U(y * F(STEPS))
    wd = (wx * wy) // U(STEPS)
    wa, wb, wc = U(U(STEPS) + wd - wx - wy), U(wx - wd), U(wy - wd)
    t = pyramid.texels
    word = Q(wa) * t[a] + Q(wb) * t[b] + Q(wc) * t[c] + Q(wd) * t[d]
    unit = F(1 / (STEPS * LARGEST))
    return (
        F(I(word & MASK)) * unit,
        F(I((word >> Q(FIELD)) & MASK)) * unit,
        F(I(word >> Q(2 * FIELD))) * unit,
    )


@jit(inline="always")
def sample_color(pyramid, x, y, level):  # type: ignore[no-untyped-def]
    """The same for three channels in one word: (red, green, blue), good to 0.001."""
    low, part = _levels(pyramid, level)
    r, g, b = F(0), F(0), F(0)
    if part < F(1):
        r, g, b = _bilinear_color(pyramid, low, x, y)
    if part > F(0):
        r2, g2, b2 = _bilinear_color(pyramid, low + 1, x, y)
        r, g, b = r + part * (r2 - r), g + part * (g2 - g), b + part * (b2 - b)
    return r, g, b
