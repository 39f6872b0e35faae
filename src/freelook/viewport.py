"""The virtual camera: a view of any size, field of view and projection.

The field of view runs from outer edge to outer edge of the outermost pixels, through the middle of
the view: for a perspective one f = (width/2) / tan(hfov/2). The centre is at
((width-1)/2, (height-1)/2). The projections are in `freelook.projections`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .errors import RenderError
from .lens import Floats
from .projections import PROJECTIONS, Projection, projection_named

NARROWEST_DEG = PROJECTIONS["perspective"].narrowest_deg
WIDEST_DEG = PROJECTIONS["perspective"].widest_deg


@dataclass(frozen=True)
class Viewport:
    """A view: `size` (width, height) in pixels, horizontal field in degrees, projection by name.

    RenderError for a size below 2 x 2, an unknown projection, or a field beyond its limits.
    """

    size: tuple[int, int]
    hfov_deg: float = 90.0
    projection: str = "perspective"

    def __post_init__(self) -> None:
        if min(self.size) < 2:
            raise RenderError(f"a view of {self.size[0]} x {self.size[1]} pixels is too small")
        kind = projection_named(self.projection)
        if not kind.narrowest_deg <= self.hfov_deg <= kind.widest_deg:
            of = "" if kind.name == "perspective" else f" of {kind.name} views"
            raise RenderError(
                f"horizontal field of view{of} must be {kind.narrowest_deg:.0f} to "
                f"{kind.widest_deg:.0f} degrees, not {self.hfov_deg}"
            )
        if kind.tallest_deg is not None:
            self._check_height(kind, kind.tallest_deg)

    def _check_height(self, kind: Projection, tallest_deg: float) -> None:
        most = int(2 * kind.half_height(tallest_deg / 2) * self.focal_px + 1e-6)
        if self.size[1] > most:
            raise RenderError(
                f"a view of {self.size[0]} x {self.size[1]} pixels with {self.hfov_deg:g} degrees "
                f"across is higher than the {tallest_deg:g} degrees of {kind.name} views: "
                f"make it at most {most} pixels high"
            )

    @cached_property
    def kind(self) -> Projection:
        return projection_named(self.projection)

    @cached_property
    def focal_px(self) -> float:
        """Pixels per radian in the middle of the view."""
        return self.size[0] / 2 / self.kind.half_width(self.hfov_deg / 2)

    @property
    def vfov_deg(self) -> float:
        """From outer edge to outer edge of the middle column."""
        return 2 * self.kind.angle_deg(0.0, self.size[1] / 2 / self.focal_px)

    def rays(self) -> Floats:
        """Rays in the view frame through all pixel centres, (height, width, 3), of any length;
        those of a perspective view have z = 1. RenderError for a crop."""
        width, height = self.size
        return self.rays_at(np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1))

    def rays_at(self, pixel: Floats) -> Floats:
        """The rays (..., 3) through pixels (..., 2) of the view, whole or between.

        RenderError for a crop, whose rays depend on the lens.
        """
        if self.kind.cut:
            raise RenderError(
                f"which way the pixels of a {self.projection} look depends on the lens; "
                "take another projection here"
            )
        x, y = np.moveaxis(self.places(pixel), -1, 0)
        return self.kind.ray(x, y)

    def places(self, pixel: Floats) -> Floats:
        """Pixels (..., 2) of the view from its middle, in focal lengths (see `projections`)."""
        middle = (np.array(self.size) - 1) / 2
        return (np.asarray(pixel, dtype=np.float64) - middle) / self.focal_px

    def border(self, per_side: int) -> Floats:
        """Rays (4 per_side, 3) round the outer edge of the view. RenderError for a crop."""
        along, ends = np.linspace(-0.5, 0.5, per_side), np.full(per_side, 0.5)
        sides = [(along, -ends), (along, ends), (-ends, along), (ends, along)]
        edge = np.concatenate([np.stack(side, axis=-1) for side in sides])
        return self.rays_at((edge + 0.5) * self.size - 0.5)


def fitting(size: tuple[int, int], hfov_deg: float, projection: str) -> Viewport:
    """The view with the field nearest to this that its projection allows in this size.

    RenderError where none is: a strip in a window that is too high for it.
    """
    kind = projection_named(projection)
    widest_deg = kind.widest_deg
    if kind.tallest_deg is not None:
        focal_px = size[1] / 2 / kind.half_height(kind.tallest_deg / 2)
        widest_deg = min(widest_deg, 2 * kind.angle_deg(size[0] / 2 / focal_px, 0.0))
    return Viewport(size, max(kind.narrowest_deg, min(widest_deg, hfov_deg)), projection)
