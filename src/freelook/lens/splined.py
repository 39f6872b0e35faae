"""A free-form lens: a stereographic one plus a smooth surface of corrections."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from ..errors import ProfileError
from .base import FIXED, Floats

# The mean over rings of directions is the round part. It only has to be near: the offset is
# whatever is missing.
DIRECTIONS = np.radians(np.arange(0, 180, 5.0))
RINGS = 65


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
        # as far as the corner of the covered part; a straight line from there on
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
        control = np.reshape(self.control, (self.ny, self.nx, 2))
        column, across = self._weights(u[..., 0], self.nx)
        row, down = self._weights(u[..., 1], self.ny)
        du = np.zeros_like(u)
        for j, weight_y in enumerate(down):
            for i, weight_x in enumerate(across):
                du += (weight_x * weight_y)[..., None] * control[row + j, column + i]
        return du

    def _weights(self, u: Floats, count: int) -> tuple[np.ndarray, list[Floats]]:
        """The first control point that has a say at u along one axis, and all their weights."""
        place = np.clip(u / self.spacing + (count - 1) / 2, 0, count - 1)
        nearest = np.floor(place + 0.5) if self.order == 2 else np.floor(place)
        # NaN goes through, by its distance from the middle
        middle = np.clip(np.nan_to_num(nearest), 1, count - self.order).astype(int)
        x = place - middle
        weights = (
            [(x - 0.5) ** 2 / 2, 0.75 - x * x, (x + 0.5) ** 2 / 2]
            if self.order == 2
            else [
                (1 - x) ** 3 / 6,
                2 / 3 - x * x * (1 - x / 2),
                (1 + 3 * x * (1 + x * (1 - x))) / 6,
                x**3 / 6,
            ]
        )
        return middle - 1, weights
