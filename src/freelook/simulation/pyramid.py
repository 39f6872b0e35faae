"""Periodic textures with all their coarser levels, sampled at any blur.

A level halves the one below it, so a texture looked at from far away fades to its mean instead
of glittering. Sampling is bilinear inside a level and linear between two levels: one continuous
function of place and blur.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import jit

F, U = np.float32, np.uint32
Float32s = NDArray[np.float32]


class Pyramid(NamedTuple):
    """All levels one behind the other, finest first: texels (total, channels)."""

    texels: Float32s
    offsets: NDArray[np.uint32]
    per_m: np.float32  # finest texels per metre


def make_pyramid(texture: NDArray[Any], texel_m: float) -> Pyramid:
    """All levels of a square texture (side, side, channels), side a power of two, to 1 x 1."""
    levels: list[NDArray[Any]] = [np.asarray(texture, dtype=np.float32)]
    while len(levels[-1]) > 1:
        fine = levels[-1]
        levels.append((fine[::2, ::2] + fine[1::2, ::2] + fine[::2, 1::2] + fine[1::2, 1::2]) / 4)
    sizes = [level.shape[0] ** 2 for level in levels]
    offsets = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(U)
    texels = np.concatenate([level.reshape(-1, level.shape[2]) for level in levels])
    return Pyramid(np.ascontiguousarray(texels), offsets, F(1 / texel_m))


@jit(inline="always")
def _bilinear(texels, channel, offset, side, x, y):  # type: ignore[no-untyped-def]
    # unsigned indices spare a test for negative ones at each texel
    low_x, low_y = np.floor(x), np.floor(y)
    last = U(side - U(1))
    left, top = U(np.int32(low_x)) & last, U(np.int32(low_y)) & last
    right, bottom = (left + U(1)) & last, (top + U(1)) & last
    x, y = x - low_x, y - low_y
    top, bottom = offset + top * side, offset + bottom * side
    above = (F(1) - x) * texels[U(top + left), channel] + x * texels[U(top + right), channel]
    below = (F(1) - x) * texels[U(bottom + left), channel] + x * texels[U(bottom + right), channel]
    return (F(1) - y) * above + y * below


@jit(inline="always")
def sample(pyramid, channel, x_m, y_m, level):  # type: ignore[no-untyped-def]
    """One channel at a place in metres; texel centres lie at half texels.

    `level` is log2 of the blur in finest texels; outside the levels there are, the nearest.
    """
    last = len(pyramid.offsets) - 1
    level = min(max(level, F(0)), F(last))
    low = min(np.int32(level), np.int32(last - 1))
    mix = level - F(low)
    side = U(1) << U(last - low)
    scale = pyramid.per_m / F(np.int32(1) << low)
    half = F(0.5)
    x, y = x_m * scale, y_m * scale
    fine = _bilinear(pyramid.texels, channel, pyramid.offsets[low], U(side), x - half, y - half)
    x, y = x * half - half, y * half - half
    coarse = _bilinear(pyramid.texels, channel, pyramid.offsets[low + 1], U(side >> U(1)), x, y)
    return fine + mix * (coarse - fine)
