"""The simulated world: colour as a pure function of where one is and where one looks.

All edges have the same angular width, so a fisheye frame and an ideal view, each sampled at its
own pixel centres, are both exact samples of one smooth function: whatever a renderer makes of
the one can be compared with the other, pixel by pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..errors import RenderError
from . import terrain
from .scene import airfield
from .scratch import TILE
from .tiles import Landscape, in_threads, make_tiles, make_view, shade_tiles

Floats = NDArray[np.float64]
SHARP_DEG = 0.2  # about one pixel of the demo's camera


@dataclass(frozen=True)
class World:
    """An airfield among fields, the same every time.

    `softness_deg` is half the width of every edge, as an angle: about one pixel makes sharp
    pictures; four pixels of the coarsest part of a fisheye frame keep resampling errors small.
    """

    softness_deg: float = SHARP_DEG

    def __post_init__(self) -> None:
        if not 0.01 <= self.softness_deg <= 20:
            raise RenderError(f"softness must lie in 0.01 to 20 degrees, not {self.softness_deg}")

    def render_rays(self, ray_in_world: Floats, position: Floats, *, threads: int = 1) -> Floats:
        """RGB (..., 3) in 0..1 along rays (..., 3) of any length, in north-east-down axes.

        `position` is north, east, down in metres, above the ground (down < 0; RenderError).
        NaN rays and the zero ray are black.
        """
        position = checked_position(position)
        rays = np.asarray(ray_in_world, dtype=np.float64).reshape(-1, 3)
        length = np.linalg.norm(np.nan_to_num(rays), axis=1)
        valid = (length > 0) & np.isfinite(rays).all(axis=1)
        unit = np.zeros((-(-len(rays) // TILE) * TILE, 3))
        unit[: len(rays)][valid] = rays[valid] / length[valid, None]
        padded = np.zeros(len(unit), dtype=np.bool_)
        padded[: len(rays)] = valid
        tiles = make_tiles(unit.reshape(-1, TILE, 3), padded.reshape(-1, TILE))
        view = make_view(landscape(), position, np.eye(3), np.radians(self.softness_deg))
        colors = np.empty(tiles.rays.shape, dtype=np.float32)

        def work(first: int, last: int) -> None:
            shade_tiles(landscape(), tiles, view, first, last, colors)

        in_threads(work, len(colors), threads)
        flat = colors.reshape(-1, 3)[: len(rays)]
        return flat.reshape(np.shape(ray_in_world)).astype(np.float64)


@cache
def landscape() -> Landscape:
    """What there is to see, computed once (about a second)."""
    return Landscape(
        terrain.ground(), terrain.detail(), terrain.clouds(), terrain.hills(), airfield()
    )


def checked_position(position: Floats) -> Floats:
    position = np.asarray(position, dtype=np.float64)
    if position.shape != (3,) or not np.isfinite(position).all() or position[2] > -0.1:
        raise RenderError(
            f"a position is north, east, down in metres, at least 0.1 above ground (down < 0), "
            f"not {position.tolist()}"
        )
    return position
