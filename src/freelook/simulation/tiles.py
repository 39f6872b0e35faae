"""Rays in tiles: each tile first finds what it can meet, then shades its 256 rays.

The compiled loops release the GIL and take a range of tiles, so that plain threads can share a
frame (Numba's own parallel loops must not be entered from two threads at once).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled import jit, sources_digest
from .ground import shade_ground
from .pyramid import Float32s, Pyramid
from .scene import Scene
from .scratch import BLUE, DD, DE, DN, GREEN, LOWEST, RED, SCRATCH, SIDE, TILE, F
from .sky import shade_sky
from .solids import shade_solids

Floats = NDArray[np.floating[Any]]


class Landscape(NamedTuple):
    """All that can be seen, in the form the compiled code takes."""

    ground: Pyramid
    detail: Pyramid
    clouds: Pyramid
    hills: Float32s
    scene: Scene


class RayTiles(NamedTuple):
    """Unit rays (tiles, 256, 3), which of them count (tiles, 256), and a cone round each tile.

    Rays that do not count look along the axis. Cones (tiles, 5): axis, cosine and sine
    of the half angle.
    """

    rays: Float32s
    valid: NDArray[np.bool_]
    cones: Float32s


class View(NamedTuple):
    """From where and how the rays are looked along.

    `order` lists the scene's solid things far to near; `cones` (n, 5) the directions in which
    each can be met: axis in the world, cosine and sine of the half angle.
    """

    position: Float32s
    world_from_rays: Float32s
    softness: np.float32
    order: NDArray[np.int32]
    cones: Float32s


def make_tiles(rays: Floats, valid: NDArray[np.bool_]) -> RayTiles:
    """Tiles of unit rays (tiles, 256, 3); only the `valid` ones (tiles, 256) count."""
    weights = valid[..., None].astype(float)
    axis = (rays * weights).sum(axis=1)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.where(length > 1e-9, axis / np.maximum(length, 1e-9), (0.0, 0.0, 1.0))
    cosines = np.where(valid, np.einsum("tkc,tc->tk", rays, axis), 1.0).min(axis=1)
    cosines = np.where(length[:, 0] > 1e-9, np.clip(cosines, -1, 1), -1.0)
    sines = np.sqrt(1 - cosines**2)
    rays = np.where(valid[..., None], rays, axis[:, None])
    cones = np.column_stack([axis, cosines, sines]).astype(F)
    return RayTiles(np.ascontiguousarray(rays, dtype=F), np.ascontiguousarray(valid), cones)


def make_view(
    landscape: Landscape, position: Floats, world_from_rays: Floats, softness: float
) -> View:
    """What all tiles of one picture share; `softness` in radians."""
    rows = landscape.scene.rows[landscape.scene.flat :]
    towards = rows[:, :3] - position
    away = np.linalg.norm(towards, axis=1)
    # the bounding ball and the blur round it; from inside it is met in all directions
    sine = np.minimum(rows[:, 3] / away + 2 * softness, 1.0)
    cosine = np.where(sine < 1, np.sqrt(1 - sine**2), -2.0)
    order = np.argsort(rows[:, 3] - away, kind="stable")
    cones = np.column_stack([towards / away[:, None], cosine, np.where(sine < 1, sine, 0.0)])
    return View(
        np.asarray(position, dtype=F),
        np.asarray(world_from_rays, dtype=F),
        F(softness),
        (landscape.scene.flat + order).astype(np.int32),
        cones[order].astype(F),
    )


@jit()
def _find(view, cone, listed):  # type: ignore[no-untyped-def]
    """List the solid things that may touch the tile, far to near; returns how many."""
    m = view.world_from_rays
    ax = m[0, 0] * cone[0] + m[0, 1] * cone[1] + m[0, 2] * cone[2]
    ay = m[1, 0] * cone[0] + m[1, 1] * cone[1] + m[1, 2] * cone[2]
    az = m[2, 0] * cone[0] + m[2, 1] * cone[1] + m[2, 2] * cone[2]
    count = 0
    for k in range(len(view.order)):
        other = view.cones[k]
        # the angle between the axes against the sum of both half angles, each below 90 degrees
        along = ax * other[0] + ay * other[1] + az * other[2]
        meets = along >= other[3] * cone[3] - other[4] * cone[4]
        if meets or cone[3] <= 0 or other[3] < F(-1):
            listed[count] = k
            count += 1
    return count


@jit()
def _shade_tile(landscape, tiles, view, tile, s, listed):  # type: ignore[no-untyped-def]
    """Colours of one tile into the scratch rows RED, GREEN, BLUE; black where rays do not count."""
    m = view.world_from_rays
    lowest, highest = F(1), F(-1)
    for k in range(TILE):
        x, y, z = tiles.rays[tile, k, 0], tiles.rays[tile, k, 1], tiles.rays[tile, k, 2]
        s[DN + k] = m[0, 0] * x + m[0, 1] * y + m[0, 2] * z
        s[DE + k] = m[1, 0] * x + m[1, 1] * y + m[1, 2] * z
        s[DD + k] = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z
        lowest, highest = min(lowest, s[DD + k]), max(highest, s[DD + k])
    if highest > LOWEST:
        shade_ground(landscape, view.position, view.softness, s)
    if lowest <= LOWEST:
        shade_sky(landscape, view.position, view.softness, -highest, s)
    count = _find(view, tiles.cones[tile], listed)
    shade_solids(landscape.scene, view, listed, count, s)
    for k in range(TILE):
        seen = F(tiles.valid[tile, k])
        for c in (RED, GREEN, BLUE):
            s[c + k] = seen * min(max(s[c + k], F(0)), F(1))


@jit()
def _shade_tiles(landscape, tiles, view, first, last, out):  # type: ignore[no-untyped-def]
    """Colours of the tiles first to last (excluded) into out (tiles, 256, 3)."""
    listed, s = np.empty(len(view.order), np.int32), np.empty(SCRATCH, np.float32)
    for tile in range(first, last):
        _shade_tile(landscape, tiles, view, tile, s, listed)
        for k in range(TILE):
            out[tile, k, 0], out[tile, k, 1], out[tile, k, 2] = (
                s[RED + k],
                s[GREEN + k],
                s[BLUE + k],
            )


@jit()
def _shade_planes(landscape, tiles, view, first, last, corners, yuv, y, u, v):  # type: ignore[no-untyped-def]
    """The same into i420 planes; tile k has its corner at pixel corners[k] = (x, y), both even.

    `yuv` (3, 4): code values = yuv[:, :3] @ rgb + yuv[:, 3]. Chroma is the mean of 2x2 pixels.
    """
    listed, s = np.empty(len(view.order), np.int32), np.empty(SCRATCH, np.float32)
    for tile in range(first, last):
        _shade_tile(landscape, tiles, view, tile, s, listed)
        left, top = corners[tile, 0], corners[tile, 1]
        for row in range(min(SIDE, y.shape[0] - top)):
            for column in range(min(SIDE, y.shape[1] - left)):
                k = row * SIDE + column
                luma = yuv[0, 0] * s[RED + k] + yuv[0, 1] * s[GREEN + k] + yuv[0, 2] * s[BLUE + k]
                y[top + row, left + column] = np.uint8(np.int32(luma + yuv[0, 3] + F(0.5)))
        left, top = left // 2, top // 2
        for row in range(min(SIDE // 2, u.shape[0] - top)):
            for column in range(min(SIDE // 2, u.shape[1] - left)):
                k = 2 * (row * SIDE + column)
                red = _mean_of_four(s, RED, k)
                green = _mean_of_four(s, GREEN, k)
                blue = _mean_of_four(s, BLUE, k)
                cb = yuv[1, 0] * red + yuv[1, 1] * green + yuv[1, 2] * blue + yuv[1, 3]
                cr = yuv[2, 0] * red + yuv[2, 1] * green + yuv[2, 2] * blue + yuv[2, 3]
                u[top + row, left + column] = np.uint8(np.int32(cb + F(0.5)))
                v[top + row, left + column] = np.uint8(np.int32(cr + F(0.5)))


@jit(inline="always")
def _mean_of_four(s, c, k):  # type: ignore[no-untyped-def]
    return F(0.25) * (s[c + k] + s[c + k + 1] + s[c + k + SIDE] + s[c + k + SIDE + 1])


def _entry_points(digest: int) -> tuple[Callable[..., None], Callable[..., None]]:
    """The two functions called from outside, the only ones that Numba keeps on disk."""

    @jit(cache=True)
    def shade_tiles(landscape, tiles, view, first, last, out):  # type: ignore[no-untyped-def]
        digest  # noqa: B018 - enclosed
        _shade_tiles(landscape, tiles, view, first, last, out)

    @jit(cache=True)
    def shade_planes(landscape, tiles, view, first, last, corners, yuv, y, u, v):  # type: ignore[no-untyped-def]
        digest  # noqa: B018 - enclosed
        _shade_planes(landscape, tiles, view, first, last, corners, yuv, y, u, v)

    return shade_tiles, shade_planes


shade_tiles, shade_planes = _entry_points(sources_digest())


def in_threads(work: Callable[[int, int], None], tiles: int, threads: int) -> None:
    """Call `work(first, last)` for a few ranges that together cover all tiles."""
    if threads <= 1:
        work(0, tiles)
        return
    edges = np.linspace(0, tiles, threads * 4 + 1).astype(int)
    done = _pool(threads).map(work, edges[:-1].tolist(), edges[1:].tolist())
    for _ in done:  # fetches errors
        pass


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="simulate")
