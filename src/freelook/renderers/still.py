"""Coordinates of a view that stands still: computed once and kept, until it moves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..viewport import Viewport

FloatMap = NDArray[np.float32]
Band = tuple[FloatMap, FloatMap, bool]
"""x, y, t of a band of rows for luma, and for chroma; whether the lens's rim is in it. Without a
rim t may be missing."""


class StillView:
    """What is computed for the second of two views in the same direction is kept for those after.

    A view that moves keeps nothing: it pays with the comparison of two quaternions. To the last bit
    the pictures are the same. What is kept takes 10 bytes for each pixel of the view, half as much
    again in bands with the rim; several views in turn keep nothing either.
    """

    def __init__(self) -> None:
        self._seen: tuple[Camera, Viewport, bytes, bool] | None = None
        self._keeps = False
        self._bands: dict[int, Band] = {}

    def look(
        self, camera: Camera, viewport: Viewport, camera_from_view: Rotation, halves: bool
    ) -> None:
        """Say before every view where it looks, and whether it has chroma of half the size."""
        seen = (camera, viewport, camera_from_view.as_quat().tobytes(), halves)
        last = self._seen
        self._keeps = (
            last is not None
            and last[0] is camera  # not equal: comparing whole lenses would take longer
            and last[1] is viewport
            and last[2:] == seen[2:]
        )
        if not self._keeps:
            self._seen, self._bands = seen, {}

    def band(self, first_row: int, compute: Callable[[], Band]) -> Band:
        """The band that begins at this row, kept or computed; may be called from many threads."""
        if (kept := self._bands.get(first_row)) is not None:
            return kept
        luma, chroma, rim = compute()
        if self._keeps:
            needed = 3 if rim else 2
            luma, chroma = luma[:needed].copy(), chroma[:needed].copy()
            self._bands[first_row] = luma, chroma, rim
        return luma, chroma, rim
