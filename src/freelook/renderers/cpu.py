"""The fast renderer for CPUs: our own coordinates, OpenCV's sampling, on the decoded planes.

The view is made in bands of rows, small enough that a band's coordinates (`kernels.fill_band`)
are still in the cache when OpenCV reads them. Threads take band by band.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..types import Picture, Plane
from ..viewport import Viewport
from . import kernels
from .blank import Sampling, black_of, check_fits, plane_scales
from .still import Band, StillView
from .window import rim_px, window_of

BAND_ROWS = 112  # about; measured

ROUND = np.empty((0, 0, 2), np.float32)  # the offset grid of a round lens

FloatMap = NDArray[np.float32]
_Band = Callable[[int, int, "_Scratch"], None]
_Fill = Callable[[int, FloatMap, FloatMap], bool]  # first row, luma's maps, chroma's
_Filler = Callable[[Rotation], _Fill]


class CpuRenderer:
    """Renders views on `threads` cores (default: all), with one sample for each pixel.

    Keeps its buffers, so one renderer serves one caller at a time. The returned planes are the
    caller's to keep.
    """

    def __init__(self, threads: int | None = None, *, sampling: Sampling = "bilinear") -> None:
        self._flags = {"bilinear": cv2.INTER_LINEAR, "bicubic": cv2.INTER_CUBIC}[sampling]
        self._threads = threads or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(self._threads - 1) if self._threads > 1 else None
        self._scratch = [_Scratch() for _ in range(self._threads)]
        self._made_for: tuple[Camera | None, Viewport | None] = (None, None)
        self._filler: _Filler | None = None
        self._still = StillView()

    def render(
        self, picture: Picture, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> Picture:
        check_fits(picture, camera)
        fill = self._filler_of(camera, viewport)(camera_from_view)
        scales = plane_scales(picture)
        width, height = viewport.size
        view = tuple(
            np.empty((-(-height // scale), -(-width // scale), *plane.shape[2:]), np.uint8)
            for plane, scale in zip(picture.planes, scales, strict=True)
        )
        planes = list(zip(picture.planes, view, scales, black_of(picture), strict=True))
        halves = 2 in scales
        self._still.look(camera, viewport, camera_from_view, halves)

        def render_band(first_row: int, rows: int, scratch: _Scratch) -> None:
            def compute() -> Band:
                luma, chroma = scratch.maps(width, rows, halves)
                return luma, chroma, fill(first_row, luma, chroma)

            luma, chroma, rim = self._still.band(first_row, compute)
            for plane, out, scale, black in planes:
                maps = luma if scale == 1 else chroma
                band = out[first_row // scale :][: maps.shape[1]]
                _sample(plane, maps, self._flags, black, band)
                if rim:
                    _feather(band, maps[2], camera.table.t_max, black)

        self._run(render_band, _bands(viewport.size[1], self._threads))
        return Picture(picture.layout, view, picture.color)

    def _filler_of(self, camera: Camera, viewport: Viewport) -> _Filler:
        """Kept from view to view: usually only the direction changes."""
        made_for = self._made_for
        if self._filler is None or made_for[0] is not camera or made_for[1] is not viewport:
            self._made_for = (camera, viewport)
            self._filler = _filler(camera, viewport)
        return self._filler

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
    fill = _filler(camera, viewport)(camera_from_view)
    width, height = viewport.size
    pixels = np.empty((2, height, width), np.float32)
    for first_row, rows in _bands(height, 1):
        maps, none = _Scratch().maps(width, rows, False)
        if fill(first_row, maps, none):
            maps[:2, maps[2] > camera.table.t_max] = np.nan
        pixels[:, first_row : first_row + rows] = maps[:2]
    return pixels


class _Scratch:
    """One thread's buffers for coordinates, kept between bands and views: fresh memory is slow."""

    def __init__(self) -> None:
        self._luma = self._chroma = np.empty(0, np.float32)

    def maps(self, width: int, rows: int, halves: bool) -> tuple[FloatMap, FloatMap]:
        """x, y, t of a band for luma (3, rows, width), and for chroma half as large, or empty."""
        half_width, half_rows = (-(-width // 2), -(-rows // 2)) if halves else (0, 0)
        needed, half_needed = 3 * rows * width, 3 * half_rows * half_width
        if len(self._luma) < needed:
            self._luma = np.empty(needed, np.float32)
        if len(self._chroma) < half_needed:
            self._chroma = np.empty(half_needed, np.float32)
        return (
            self._luma[:needed].reshape(3, rows, width),
            self._chroma[:half_needed].reshape(3, half_rows, half_width),
        )


def _filler(camera: Camera, viewport: Viewport) -> _Filler:
    """What fills bands of views in any direction with coordinates."""
    return _window_filler(camera, viewport) if viewport.kind.cut else _ray_filler(camera, viewport)


def _ray_filler(camera: Camera, viewport: Viewport) -> _Filler:
    constants: tuple[Any, ...] = (
        viewport.size,
        viewport.focal_px,
        viewport.kind.code,
        camera.table.g,
        np.float32(camera.table.t_max),
        np.asarray(camera.center, dtype=np.float32),
        np.asarray(camera.stretch, dtype=np.float32),
        camera.grid.offsets if camera.grid else ROUND,
        np.float32(camera.grid.p_max if camera.grid else 1.0),
    )

    def towards(camera_from_view: Rotation) -> _Fill:
        rotation = camera_from_view.as_matrix().astype(np.float32)
        return lambda row, luma, chroma: kernels.fill_band(row, rotation, *constants, luma, chroma)

    return towards


def _window_filler(camera: Camera, viewport: Viewport) -> _Filler:
    t_max = np.float32(camera.table.t_max)
    constants: tuple[Any, ...] = (
        np.asarray(camera.center, dtype=np.float32),
        np.linalg.inv(camera.stretch).astype(np.float32),
        np.float32(t_max / rim_px(camera) ** 2),
        t_max,
    )

    def towards(camera_from_view: Rotation) -> _Fill:
        window = window_of(camera, camera_from_view, viewport)
        corner = window.at(np.zeros(2)).astype(np.float32)
        slopes = window.slopes.astype(np.float32)
        return lambda row, luma, chroma: kernels.fill_window(
            row, corner, slopes, *constants, luma, chroma
        )

    return towards


@lru_cache
def _bands(height: int, threads: int) -> list[tuple[int, int]]:
    """(first row, rows) of the bands of a view: as many for every thread, nearly equally large.

    Only the last may break off between nodes, so that no node is computed twice.
    """
    each = max(1, round(height / BAND_ROWS / threads))
    cells = -(-height // kernels.COARSEST)
    count = min(each * threads, cells)
    edges = [kernels.COARSEST * (cells * i // count) for i in range(count)]
    return [(row, after - row) for row, after in pairwise([*edges, height])]


def _sample(plane: Plane, maps: FloatMap, flags: int, black: int, out: Plane) -> None:
    value = (black,) * 4
    x, y = maps[0], maps[1]
    cv2.remap(plane, x, y, flags, dst=out, borderMode=cv2.BORDER_CONSTANT, borderValue=value)


def _feather(view: Plane, t: FloatMap, t_max: float, black: int) -> None:
    channels = view if view.ndim == 3 else view[..., None]
    kernels.feather(channels, t, t_max, np.float32(black))
