"""The fast renderer for CPUs: our own coordinates, OpenCV's sampling, on the decoded planes.

The view is made in bands of rows, small enough that a band's coordinates (`kernels.fill_band`)
are still in the cache when OpenCV reads them. Threads take band by band.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..types import Picture, Plane
from ..viewport import Viewport
from . import kernels
from .blank import black_of, check_fits, plane_scales

BAND_PIXELS = 160_000  # measured: the least time between cache misses and calls

FloatMap = NDArray[np.float32]
_Band = Callable[[int, int, "_Scratch"], None]


class CpuRenderer:
    """Renders views on `threads` cores (default: all).

    Keeps its buffers, so one renderer serves one caller at a time. The returned planes are the
    caller's to keep.
    """

    def __init__(self, threads: int | None = None) -> None:
        self._threads = threads or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(self._threads - 1) if self._threads > 1 else None
        self._scratch = [_Scratch() for _ in range(self._threads)]

    def render(
        self, picture: Picture, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> Picture:
        check_fits(picture, camera)
        fill = _band_filler(camera, camera_from_view, viewport)
        scales = plane_scales(picture)
        view = tuple(
            np.empty((*_shape(viewport.size, scale), *plane.shape[2:]), np.uint8)
            for plane, scale in zip(picture.planes, scales, strict=True)
        )
        planes = list(zip(picture.planes, view, scales, black_of(picture), strict=True))

        def render_band(first_row: int, rows: int, scratch: _Scratch) -> None:
            luma = scratch.maps(0, viewport.size[0], rows)
            chroma = scratch.maps(1, *(_half(viewport.size[0], rows) if 2 in scales else (0, 0)))
            rim = fill(first_row, luma, chroma)
            for plane, out, scale, black in planes:
                maps = luma if scale == 1 else chroma
                band = out[first_row // scale :][: maps.shape[1]]
                _sample(plane, maps, black, band)
                if rim:
                    _feather(band, maps[2], camera.table.t_max, black)

        self._run(render_band, _bands(viewport.size, self._threads))
        return Picture(picture.layout, view, picture.color)

    def _run(self, band: _Band, bands: list[tuple[int, int]]) -> None:
        """All bands, taken one by one by this thread and those of the pool."""
        left = iter(bands)

        def work(scratch: _Scratch) -> None:
            for first_row, rows in left:  # list iterators are safe between threads
                band(first_row, rows, scratch)

        others = [self._pool.submit(work, s) for s in self._scratch[1:]] if self._pool else []
        work(self._scratch[0])
        for other in others:
            other.result()


def coordinates(camera: Camera, camera_from_view: Rotation, viewport: Viewport) -> FloatMap:
    """Where each view pixel looks, as rendered: float32 (2, height, width); NaN where unseen."""
    fill = _band_filler(camera, camera_from_view, viewport)
    width, height = viewport.size
    pixels = np.empty((2, height, width), np.float32)
    for first_row, rows in _bands(viewport.size, 1):
        maps = np.zeros((3, rows, width), np.float32)
        fill(first_row, maps, np.empty((3, 0, 0), np.float32))
        maps[:2, maps[2] > camera.table.t_max] = np.nan
        pixels[:, first_row : first_row + rows] = maps[:2]
    return pixels


class _Scratch:
    """One thread's buffers for coordinates, kept between bands and views: fresh memory is slow."""

    def __init__(self) -> None:
        self._buffers = [np.empty(0, np.float32), np.empty(0, np.float32)]

    def maps(self, which: int, width: int, height: int) -> FloatMap:
        """x, y, t for a band: (3, height, width)."""
        needed = 3 * width * height
        if len(self._buffers[which]) < needed:
            self._buffers[which] = np.empty(needed, np.float32)
        return self._buffers[which][:needed].reshape(3, height, width)


def _band_filler(
    camera: Camera, camera_from_view: Rotation, viewport: Viewport
) -> Callable[[int, FloatMap, FloatMap], bool]:
    """`kernels.fill_band` for one view: (first row, luma maps, chroma maps) -> rim in the band."""
    constants = (
        viewport.size,
        viewport.focal_px,
        camera_from_view.as_matrix().astype(np.float32),
        camera.table.g,
        np.float32(camera.table.t_max),
        np.asarray(camera.center, dtype=np.float32),
        np.asarray(camera.stretch, dtype=np.float32),
    )
    return lambda first_row, luma, chroma: kernels.fill_band(first_row, *constants, luma, chroma)


def _bands(size: tuple[int, int], threads: int) -> list[tuple[int, int]]:
    """(first row, rows) of the bands, as many for each thread; all start at an even row."""
    width, height = size
    count = threads * -(-width * height // (BAND_PIXELS * threads))
    rows = -(-height // (2 * count)) * 2
    return [(first, min(rows, height - first)) for first in range(0, height, rows)]


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


def _shape(size: tuple[int, int], scale: int) -> tuple[int, int]:
    return -(-size[1] // scale), -(-size[0] // scale)


def _half(width: int, height: int) -> tuple[int, int]:
    return -(-width // 2), -(-height // 2)
