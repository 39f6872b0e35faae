"""A free-form lens: a stereographic one plus a smooth surface of corrections."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ProfileError
from .base import FIXED, Floats

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# The mean over rings of directions is the round part. It only has to be near: the offset is
# whatever is missing.
DIRECTIONS = np.radians(np.arange(0, 180, 5.0))
RINGS = 65
PADDING = 2


@dataclass(frozen=True)
class SplinedStereographic:
    """point = f (u + du(u)), u = 2 tan(theta/2) (cos(phi), sin(phi)): du is a B-spline surface.

    mrcal's LENSMODEL_SPLINED_STEREOGRAPHIC (its documentation, "Splined stereographic lens
    model", and `mrcal.c`). du has nx by ny control points, `control` = x and y of each in turn,
    row after row, as in mrcal's intrinsics behind fx fy cx cy. Their places are equally spaced by

        4 tan(fov_x_deg / 4) / (nx - order)

    in both directions and centred on the axis: the surface covers fov_x_deg horizontally and
    what ny gives vertically. order is 2 or 3. f is fx; fy is in the camera's `stretch`.

    The round part is the mean over all directions in which there are control points, the offset
    what is missing. Beyond the covered part mrcal continues the last polynomial; so does this as
    far as there are control points. Farther out it holds the offset, and the lens ends at the
    corner of the control points. Only `control` is free in fits: f would say the same twice.
    """

    f: float = field(metadata=FIXED)
    order: int = field(metadata=FIXED)
    nx: int = field(metadata=FIXED)
    ny: int = field(metadata=FIXED)
    fov_x_deg: float = field(metadata=FIXED)
    control: tuple[float, ...]

    def __post_init__(self) -> None:
        for name in ("order", "nx", "ny"):
            value = getattr(self, name)
            if value != int(value):
                raise ProfileError(f"{name} of a splined lens must be a whole number, not {value}")
            object.__setattr__(self, name, int(value))  # JSON's 3.0 is 3
        if self.order not in (2, 3):
            raise ProfileError(f"order of a splined lens must be 2 or 3, not {self.order}")
        if min(self.nx, self.ny) <= self.order:
            raise ProfileError(
                f"nx and ny of a splined lens of order {self.order} must be at least "
                f"{self.order + 1}, not {self.nx} and {self.ny}"
            )
        if not 1 <= self.fov_x_deg <= 355:
            raise ProfileError(f"fov_x_deg must be 1 to 355, not {self.fov_x_deg}")
        if not isinstance(self.control, tuple) or len(self.control) != 2 * self.nx * self.ny:
            raise ProfileError(
                f"control of a {self.nx} x {self.ny} splined lens must be a list of "
                f"{2 * self.nx * self.ny} numbers (x and y in turn)"
            )

    @cached_property
    def spacing(self) -> float:
        """Between neighbouring control points, in units of u."""
        return float(4 * np.tan(np.radians(self.fov_x_deg) / 4) / (self.nx - self.order))

    @cached_property
    def hard_limit(self) -> float:
        reach = np.hypot(*self._edge)
        return float(2 * np.arctan(reach / 2))

    def radius(self, theta: Floats) -> Floats:
        return self.f * np.asarray(self._round(np.tan(theta / 2)))

    def offset(self, theta: Floats, phi: Floats) -> Floats:
        direction = np.stack([np.cos(phi), np.sin(phi)], axis=-1)
        u = np.clip(2 * np.tan(theta / 2)[..., None] * direction, -self._edge, self._edge)
        distance = np.hypot(u[..., 0], u[..., 1])
        # u goes to zero with the distance, so on the axis any direction is as good as another
        outwards = np.divide(
            u, distance[..., None], out=np.zeros_like(u), where=distance[..., None] > 0
        )
        round_part = np.asarray(self._round(distance / 2))[..., None] * outwards
        return self.f * (u + self._surface(u) - round_part)

    @cached_property
    def _edge(self) -> Floats:
        """Where the outermost control points are, (x, y), units of u."""
        return np.array([self.nx - 1, self.ny - 1]) * self.spacing / 2

    @cached_property
    def _round(self) -> CubicSpline:
        """Mean distance from the axis, units of f, as a function of tan(theta/2), odd."""
        from scipy.interpolate import CubicSpline

        # as far as the corner of the covered part; its last piece goes on from there
        inner = self._edge - self.spacing * (self.order - 1) / 2
        tangent = np.linspace(0.0, np.hypot(*inner) / 2, RINGS)
        direction = np.stack([np.cos(DIRECTIONS), np.sin(DIRECTIONS)], axis=-1)
        u = 2 * tangent[:, None, None] * np.append(direction, [inner / np.hypot(*inner)], axis=0)
        # opposite directions together: exactly 0 on the axis
        across = (self._surface(u) - self._surface(-u)) / 2
        radial = (across * u).sum(axis=-1) / np.maximum(2 * tangent, 1e-9)[:, None]
        # 1 where the surface is covered, falling to 0 where the control points end
        weight = np.clip((self._edge - np.abs(u)) / (self._edge - inner), 0.0, 1.0).prod(axis=-1)
        mean = 2 * tangent + (radial * weight).sum(axis=-1) / weight.sum(axis=-1)
        return CubicSpline(
            np.concatenate([-tangent[:0:-1], tangent]), np.concatenate([-mean[:0:-1], mean])
        )

    def _surface(self, u: Floats) -> Floats:
        """du at u, both (..., 2)."""
        from scipy.ndimage import map_coordinates

        place = u.reshape(-1, 2) / self.spacing + (np.array([self.nx, self.ny]) - 1) / 2
        known = np.isfinite(place)  # NaN comes out where it goes in
        rows_columns = np.where(known, place, 0.0).T[::-1] + PADDING
        du = [
            map_coordinates(layer, rows_columns, order=self.order, prefilter=False)
            for layer in self._padded
        ]
        return np.where(known, np.stack(du, axis=-1), np.nan).reshape(u.shape)

    @cached_property
    def _padded(self) -> Floats:
        """Control points (2, rows, columns), continued so that the outermost polynomials go on."""
        control = np.reshape(self.control, (self.ny, self.nx, 2))
        return np.moveaxis(_continued(_continued(control, self.order, 0), self.order, 1), -1, 0)


def _continued(control: Floats, order: int, axis: int) -> Floats:
    """PADDING more control points at both ends: the next difference of the last ones is 0."""
    last = np.array({2: [1.0, -3.0, 3.0], 3: [-1.0, 4.0, -6.0, 4.0]}[order])
    points = list(np.moveaxis(control, axis, 0))
    for _ in range(PADDING):
        points.insert(0, np.tensordot(last[::-1], points[: order + 1], axes=1))
        points.append(np.tensordot(last, points[-order - 1 :], axes=1))
    return np.moveaxis(np.array(points), 0, axis)
