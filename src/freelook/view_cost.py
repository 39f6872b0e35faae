"""What a view costs: how much of the sensor's resolution arrives in it.

A view takes only part of the picture and stretches it to its own size. Source pixels are those
of the camera's picture, view pixels those that a pilot sees. Where there is less than one source
pixel to a view pixel, in whatever direction, the view is enlarged: larger, but not sharper.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from .camera import Camera
from .lens import Floats
from .resolution import (
    image_pixels,
    inside_picture,
    least_and_most,
    places,
    resolution_at,
    sample_places,
)
from .viewport import Viewport

STEP_PX = 1e-3
SAME = 1e-6  # a view pixel this close to one source pixel is neither enlarged nor shrunk


@dataclass(frozen=True)
class Spot:
    """One place of a view: (least, most) over all directions there; NaN where it sees nothing.

    per_degree      source pixels per degree
    per_view_pixel  source pixels per view pixel
    """

    per_degree: tuple[float, float]
    per_view_pixel: tuple[float, float]


@dataclass(frozen=True)
class ViewCost:
    """A view against the sensor; shares are 0 to 1.

    source_pixels     how many pixels of the picture lie under the view
    picture_pixels    how many the picture has; `image_pixels`, how many of them the lens lights
    seen              share of the view that shows a part of the picture
    enlarged, shrunk  shares of what is seen with less than one source pixel per view pixel in
                      some direction, and with more than one in every direction
    largest_size      (width, height) up to which nothing of this view is enlarged; (0, 0) if it
                      sees nothing
    spots             by name: centre, left, right, top, bottom (the middles of the edges), corners
    """

    viewport: Viewport
    source_pixels: float
    picture_pixels: int
    image_pixels: float
    seen: float
    enlarged: float
    shrunk: float
    largest_size: tuple[int, int]
    spots: dict[str, Spot]

    @property
    def view_pixels(self) -> int:
        width, height = self.viewport.size
        return width * height

    @property
    def view_px_per_degree(self) -> float:
        """The view's own, in its middle."""
        return float(self.viewport.focal_px * np.radians(1.0))


def view_cost(
    camera: Camera, camera_from_view: Rotation, viewport: Viewport, *, columns: int = 240
) -> ViewCost:
    """Measured on `columns` x rows samples of the view, on every pixel of a smaller one.

    RenderError for a crop, whose pixels are the picture's own.
    """
    place = places(*sample_places(viewport.size, columns))
    least, most = _per_view_pixel(camera, camera_from_view, viewport, place)
    seen = np.isfinite(least)
    least, most = least[seen], most[seen]
    width, height = viewport.size
    spots = _spots(camera, camera_from_view, viewport)
    coarsest = min([*least, *(spot.per_view_pixel[0] for spot in spots.values())], default=0.0)
    return ViewCost(
        viewport,
        source_pixels=float((least * most).sum()) * width * height / seen.size,
        picture_pixels=camera.size[0] * camera.size[1],
        image_pixels=image_pixels(camera),
        seen=float(seen.mean()),
        enlarged=_share(least < 1 - SAME),
        shrunk=_share(least > 1 + SAME),
        largest_size=_scaled(viewport.size, coarsest) if seen.any() else (0, 0),
        spots=spots,
    )


def _share(true: np.ndarray) -> float:
    return float(true.mean()) if true.size else 0.0


def _scaled(size: tuple[int, int], scale: float) -> tuple[int, int]:
    return int(size[0] * scale + SAME), int(size[1] * scale + SAME)


def _project(camera: Camera, turn: Rotation, viewport: Viewport, place: Floats) -> Floats:
    """Pixels of the picture under places of the view, NaN where it sees nothing."""
    ray = turn.apply(viewport.rays_at(place).reshape(-1, 3)).reshape(*place.shape[:-1], 3)
    return camera.project(ray)


def _per_view_pixel(
    camera: Camera, turn: Rotation, viewport: Viewport, place: Floats
) -> tuple[Floats, Floats]:
    """(least, most) source pixels per view pixel; NaN where there is no picture."""
    columns = [
        _project(camera, turn, viewport, place + step)
        - _project(camera, turn, viewport, place - step)
        for step in STEP_PX * np.eye(2)
    ]
    pixel = _project(camera, turn, viewport, place)
    inside = inside_picture(pixel, camera.size)
    slopes = np.where(inside[..., None, None], np.stack(columns, axis=-1), np.nan)
    return least_and_most(slopes / (2 * STEP_PX))


def _spots(camera: Camera, turn: Rotation, viewport: Viewport) -> dict[str, Spot]:
    right, bottom = viewport.size[0] - 1.0, viewport.size[1] - 1.0
    by_name = {
        "centre": [(right / 2, bottom / 2)],
        "left": [(0.0, bottom / 2)],
        "right": [(right, bottom / 2)],
        "top": [(right / 2, 0.0)],
        "bottom": [(right / 2, bottom)],
        "corners": [(x, y) for x in (0.0, right) for y in (0.0, bottom)],
    }
    return {name: _spot(camera, turn, viewport, np.array(place)) for name, place in by_name.items()}


def _spot(camera: Camera, turn: Rotation, viewport: Viewport, place: Floats) -> Spot:
    least, most = _per_view_pixel(camera, turn, viewport, place)
    seen = np.isfinite(least)
    if not seen.any():
        return Spot((np.nan, np.nan), (np.nan, np.nan))
    there = resolution_at(camera, turn.apply(viewport.rays_at(place[seen])))
    return Spot(
        (float(there.least.min()), float(there.most.max())),
        (float(least[seen].min()), float(most[seen].max())),
    )
