"""A camera with a real lens model, flying over the simulated world, with the truth beside it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..color import rgb24_from_rgb, yuv_from_rgb_matrix
from ..lens import radius_slope
from ..types import ColorSpace, Frame, Picture, Plane
from ..viewport import Viewport
from .flight import FigureEight, Floats, State
from .scratch import SIDE, TILE
from .tiles import RayTiles, in_threads, make_tiles, make_view, shade_planes
from .world import World, checked_position, landscape


class Flight(Protocol):
    """A motion: any time in nanoseconds to a state."""

    def at(self, t_ns: int) -> State: ...


@dataclass
class SimulatedCamera:
    """Frames of `camera` on a vehicle in `flight` over `world`; black outside the lens's field.

    Every pixel is the world's exact colour along the ray through its centre, rounded once; the
    same time gives the same frame, bit for bit. `threads` share one frame.
    """

    camera: Camera
    world: World = field(default_factory=World)
    flight: Flight = field(default_factory=FigureEight)
    color: ColorSpace = field(default_factory=ColorSpace)
    threads: int = 1

    def __post_init__(self) -> None:
        self._corners, self._tiles = _pixel_tiles(self.camera)
        matrix, offset = yuv_from_rgb_matrix(self.color)
        self._yuv = np.column_stack([matrix, offset]).astype(np.float32)

    def truth(self, t_ns: int) -> State:
        """Where the vehicle was and how it was turned when frame(t_ns) was taken."""
        return self.flight.at(t_ns)

    def frame(self, t_ns: int) -> Frame:
        """The i420 frame taken at `t_ns` of the flight (capture_ns and media_ns are t_ns)."""
        return Frame(self.picture(t_ns), t_ns, t_ns)

    def picture(self, t_ns: int) -> Picture:
        """The picture of `frame`."""
        state = self.flight.at(t_ns)
        world_from_camera = state.world_from_body * self.camera.camera_from_body.inv()
        view = make_view(
            landscape(),
            checked_position(state.position),
            world_from_camera.as_matrix(),
            np.radians(self.world.softness_deg),
        )
        planes = self._black_planes()

        def work(first: int, last: int) -> None:
            shade_planes(
                landscape(), self._tiles, view, first, last, self._corners, self._yuv, *planes
            )

        in_threads(work, len(self._corners), self.threads)
        return Picture("i420", planes, self.color)

    def exact_rgb(self, t_ns: int, body_from_view: Rotation, viewport: Viewport) -> Floats:
        """RGB (height, width, 3) of the ideal view: no lens, no frame, no resampling."""
        state = self.flight.at(t_ns)
        rotation = state.world_from_body * body_from_view
        rays = viewport.rays() @ rotation.as_matrix().T
        return self.world.render_rays(rays, state.position, threads=self.threads)

    def exact_view(self, t_ns: int, body_from_view: Rotation, viewport: Viewport) -> Picture:
        """`exact_rgb` as an rgb24 picture."""
        return rgb24_from_rgb(self.exact_rgb(t_ns, body_from_view, viewport))

    def _black_planes(self) -> tuple[Plane, Plane, Plane]:
        width, height = self.camera.size
        half = ((height + 1) // 2, (width + 1) // 2)
        black = np.uint8(self._yuv[0, 3])
        return (
            np.full((height, width), black),
            np.full(half, 128, np.uint8),
            np.full(half, 128, np.uint8),
        )


def pixel_deg(camera: Camera) -> float:
    """How wide one pixel is in the middle of the picture, in degrees."""
    return float(np.degrees(1 / radius_slope(camera.lens, np.zeros(1))[0]))


def _pixel_tiles(camera: Camera) -> tuple[NDArray[np.int64], RayTiles]:
    """Corners (tiles, 2) and rays of all 16x16 tiles that see anything."""
    width, height = camera.size
    columns, rows = -(-width // SIDE), -(-height // SIDE)
    y, x = np.mgrid[0 : rows * SIDE, 0 : columns * SIDE]
    rays = camera.ray(np.stack([x, y], axis=-1).astype(np.float64))
    rays[height:], rays[:, width:] = np.nan, np.nan
    rays = rays.reshape(rows, SIDE, columns, SIDE, 3).swapaxes(1, 2).reshape(-1, TILE, 3)
    valid = np.isfinite(rays[..., 2])
    seen = valid.any(axis=1)
    corner_y, corner_x = np.mgrid[0:rows, 0:columns] * SIDE
    corners = np.stack([corner_x.ravel(), corner_y.ravel()], axis=-1)[seen]
    return corners, make_tiles(np.nan_to_num(rays[seen]), valid[seen])
