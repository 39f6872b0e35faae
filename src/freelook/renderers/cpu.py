"""The fast renderer for CPUs: our own coordinates, OpenCV's sampling, on the decoded planes.

Coordinates are computed exactly on a grid of nodes every 16 view pixels and interpolated by
cubics between. The fourth differences of the nodes measure what that costs; where it would be
more than `TOLERANCE_PX` the grid is made finer.

The view is made in bands of rows, small enough that a band's coordinates are still in the cache
when OpenCV reads them. Threads take band by band.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..types import Picture, Plane
from ..viewport import Viewport
from . import kernels
from .blank import black_of, check_fits, plane_scales

TOLERANCE_PX = 0.005
COARSEST, FINEST = 16, 2
RIM = 0.98  # of t_max: below it, no pixel of the view is feathered
BAND_PIXELS = 160_000  # measured: the least time between cache misses and calls

FloatMap = NDArray[np.float32]
_Buffers = dict[int, FloatMap]


class CpuRenderer:
    """Renders views on `threads` cores (default: all).

    Keeps its buffers, so one renderer serves one caller at a time. The returned planes are the
    caller's to keep.
    """

    def __init__(self, threads: int | None = None) -> None:
        self._threads = threads or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(self._threads - 1) if self._threads > 1 else None
        self._buffers: list[_Buffers] = [{} for _ in range(self._threads)]

    def render(
        self, picture: Picture, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> Picture:
        check_fits(picture, camera)
        grid = make_grid(camera, camera_from_view, viewport)
        scales = plane_scales(picture)
        view = tuple(
            np.empty((*_plane_shape(viewport.size, scale), *plane.shape[2:]), np.uint8)
            for plane, scale in zip(picture.planes, scales, strict=True)
        )
        planes = list(zip(picture.planes, view, scales, black_of(picture), strict=True))

        def render_band(first_row: int, rows: int, buffers: _Buffers) -> None:
            maps = {s: _expand(grid, first_row, rows, s, buffers) for s in set(scales)}
            for plane, out, scale, black in planes:
                band = out[first_row // scale :][: maps[scale].shape[1]]
                _sample(plane, maps[scale], black, band)
                if grid.rim:
                    _feather(band, maps[scale][2], camera.table.t_max, black)

        self._run(render_band, _bands(viewport.size, self._threads))
        return Picture(picture.layout, view, picture.color)

    def _run(
        self, band: Callable[[int, int, _Buffers], None], bands: list[tuple[int, int]]
    ) -> None:
        """All bands, taken one by one by this thread and those of the pool."""
        left = iter(bands)

        def work(buffers: _Buffers) -> None:
            for first_row, rows in left:  # list iterators are safe between threads
                band(first_row, rows, buffers)

        others = [self._pool.submit(work, b) for b in self._buffers[1:]] if self._pool else []
        work(self._buffers[0])
        for other in others:
            other.result()


def coordinates(camera: Camera, camera_from_view: Rotation, viewport: Viewport) -> FloatMap:
    """Where each view pixel looks, as rendered: float32 (2, height, width); NaN where unseen."""
    grid = make_grid(camera, camera_from_view, viewport)
    x, y, *t = np.concatenate(
        [_expand(grid, first_row, rows, 1, {}) for first_row, rows in _bands(viewport.size, 1)],
        axis=1,
    )
    pixels = np.stack([x, y])
    if t:
        pixels[:, t[0] > camera.table.t_max] = np.nan
    return pixels


@dataclass(frozen=True)
class Grid:
    """x, y and t (3, rows, columns) at nodes `step` view pixels apart, one ring to spare.

    `rim` tells whether the edge of the lens's field comes into the view.
    """

    nodes: FloatMap
    step: int
    size: tuple[int, int]
    rim: bool


def make_grid(camera: Camera, camera_from_view: Rotation, viewport: Viewport) -> Grid:
    """The exact coordinates, at as few nodes as the tolerance allows."""
    nodes = _project(camera, camera_from_view, viewport, COARSEST)
    # The error shrinks with the fourth power of the step: one look at the coarsest grid tells.
    error = kernels.interpolation_error(nodes, camera.table.t_max)
    step = COARSEST
    while step > FINEST and error > TOLERANCE_PX:
        step, error = step // 2, error / 16
    if step < COARSEST:
        nodes = _project(camera, camera_from_view, viewport, step)
    rim = bool(nodes[2].max() > camera.table.t_max * RIM)
    return Grid(nodes, step, viewport.size, rim)


def _project(camera: Camera, camera_from_view: Rotation, viewport: Viewport, step: int) -> FloatMap:
    width, height = viewport.size
    nodes = np.empty((3, (height - 1) // step + 4, (width - 1) // step + 4), np.float32)
    kernels.project_nodes(
        nodes,
        step,
        viewport.size,
        viewport.focal_px,
        camera_from_view.as_matrix().astype(np.float32),
        camera.table.g,
        np.float32(camera.table.t_max),
        np.asarray(camera.center, dtype=np.float32),
        np.asarray(camera.stretch, dtype=np.float32),
    )
    return nodes


def _bands(size: tuple[int, int], threads: int) -> list[tuple[int, int]]:
    """(first row, rows) of the bands, as many for each thread; each starts at a row of nodes."""
    width, height = size
    count = threads * -(-width * height // (BAND_PIXELS * threads))
    rows = -(-height // (count * COARSEST)) * COARSEST
    return [(first, min(rows, height - first)) for first in range(0, height, rows)]


def _expand(grid: Grid, first_row: int, rows: int, scale: int, buffers: _Buffers) -> FloatMap:
    """x, y and, if the rim is in view, t for a band of a plane `scale` times smaller than luma."""
    height, width = _plane_shape((grid.size[0], rows), scale)
    values = 3 if grid.rim else 2
    needed = values * height * width
    if scale not in buffers or len(buffers[scale]) < needed:
        buffers[scale] = np.empty(needed, np.float32)
    maps = buffers[scale][:needed].reshape(values, height, width)
    kernels.expand(grid.nodes, first_row, grid.step, scale, maps)
    return maps


def _sample(plane: Plane, maps: FloatMap, black: int, out: Plane) -> None:
    cv2.remap(
        plane,
        maps[0],
        maps[1],
        cv2.INTER_LINEAR,
        dst=out,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(black,) * 4,
    )


def _feather(view: Plane, t: FloatMap, t_max: float, black: int) -> None:
    channels = view if view.ndim == 3 else view[..., None]
    kernels.feather(channels, t, t_max, np.float32(black))


def _plane_shape(size: tuple[int, int], scale: int) -> tuple[int, int]:
    return -(-size[1] // scale), -(-size[0] // scale)
