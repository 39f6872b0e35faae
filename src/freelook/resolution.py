"""How finely a camera resolves what lies around it: sensor pixels per degree.

From a ray two small turns are possible, away from the axis and around it. With the pixel p of
`Camera.project`, and angles measured on the sphere,

    radial      |dp / d(angle away from the axis)|    r'(theta)              for a round lens with
    tangential  |dp / d(angle around the axis)|       r(theta) / sin(theta)  square pixels

On the axis itself "away" is to the right and "around" is down. Where the lens is bent or the
pixels are not square, some other direction may be finer or coarser still: `least` and `most`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .camera import Camera
from .lens import Floats

# of the differences below, radians: truncation errs by 1e-10, rounding by 1e-8, relatively
STEP_RAD = 1e-5


@dataclass(frozen=True)
class Resolution:
    """Sensor pixels per degree at some rays; every array has the rays' shape.

    radial, tangential  along the two directions above
    least, most         in the coarsest and in the finest direction
    NaN where the lens does not see.
    """

    radial: Floats
    tangential: Floats
    least: Floats
    most: Floats

    @property
    def mean(self) -> Floats:
        """The side of a square of as many pixels as there are in one square degree."""
        return np.sqrt(self.least * self.most)


def angles(ray: Floats) -> tuple[Floats, Floats]:
    """(theta, phi) of rays (..., 3): from the axis, and around it from x right to y down."""
    x, y, z = np.moveaxis(np.asarray(ray, dtype=np.float64), -1, 0)
    return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)


def ray_at(theta: Floats, phi: Floats) -> Floats:
    """The unit rays (..., 3) at these angles; the reverse of `angles`."""
    theta, phi = np.broadcast_arrays(theta, phi)
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)


def resolution_at(camera: Camera, ray: Floats) -> Resolution:
    """Pixels per degree at rays (..., 3) of any length; NaN where the lens does not see."""
    return resolution_towards(camera, *angles(ray))


def resolution_towards(camera: Camera, theta: Floats, phi: Floats) -> Resolution:
    """The same at angles; on the axis itself "away from it" is then towards `phi`."""
    theta, phi = np.broadcast_arrays(theta, phi)
    slopes = _slopes(camera, np.minimum(theta, camera.theta_max - 2 * STEP_RAD), phi)
    slopes = np.where((theta <= camera.theta_max + 1e-9)[..., None, None], slopes, np.nan)
    per_degree = np.radians(1.0) * slopes
    radial, tangential = np.moveaxis(np.linalg.norm(per_degree, axis=-2), -1, 0)
    return Resolution(radial, tangential, *least_and_most(per_degree))


def _slopes(camera: Camera, theta: Floats, phi: Floats) -> Floats:
    """dp / d(turn away from the axis, turn around it), (..., 2, 2), pixels per radian."""
    ray = ray_at(theta, phi)
    away = np.stack(
        [np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), -np.sin(theta)], axis=-1
    )
    around = np.stack([-np.sin(phi), np.cos(phi), np.zeros_like(phi)], axis=-1)
    columns = [
        camera.project(ray + STEP_RAD * turn) - camera.project(ray - STEP_RAD * turn)
        for turn in (away, around)
    ]
    return np.stack(columns, axis=-1) / (2 * STEP_RAD)


def around_axis(count: int) -> Floats:
    """`count` directions phi, evenly spread, the first to the right, radians."""
    return np.linspace(0, 2 * np.pi, count, endpoint=False, dtype=np.float64)


def inside_picture(pixel: Floats, size: tuple[int, int]) -> NDArray[np.bool_]:
    """Which pixels (..., 2) lie on a picture of this size, its outer edges included."""
    inside = (pixel >= -0.5) & (pixel <= np.array(size) - 0.5)
    return np.asarray(inside[..., 0] & inside[..., 1])


def least_and_most(matrices: Floats) -> tuple[Floats, Floats]:
    """The singular values of 2 x 2 matrices (..., 2, 2): how much they stretch at least, at most.

    With the conformal and anticonformal parts as in Blinn, "Consider the lowly 2x2 matrix",
    IEEE Computer Graphics and Applications 16 (1996).
    """
    (a, b), (c, d) = (np.moveaxis(matrices[..., row, :], -1, 0) for row in (0, 1))
    same, mirrored = np.hypot(a + d, b - c) / 2, np.hypot(a - d, b + c) / 2
    return np.abs(same - mirrored), same + mirrored


@dataclass(frozen=True)
class PictureMap:
    """Samples spread evenly over a picture, each the middle of one of many equal cells.

    x_px, y_px  where they stand: (columns,) and (rows,)
    theta       their angle from the axis, radians, (rows, columns); NaN outside the field
    resolution  there, the same shape
    """

    x_px: Floats
    y_px: Floats
    theta: Floats
    resolution: Resolution

    @property
    def seen(self) -> float:
        """The share of the picture on which the lens puts an image."""
        return float(np.isfinite(self.theta).mean())


def sample_places(size: tuple[int, int], columns: int) -> tuple[Floats, Floats]:
    """x (columns,) and y (rows,) in pixels: the middles of equal, nearly square cells.

    Never more than there are pixels.
    """
    width, height = size
    columns = min(columns, width)
    rows = min(max(1, round(columns * height / width)), height)
    x = (np.arange(columns, dtype=np.float64) + 0.5) * (width / columns) - 0.5
    y = (np.arange(rows, dtype=np.float64) + 0.5) * (height / rows) - 0.5
    return x, y


def places(x: Floats, y: Floats) -> Floats:
    """All (x, y) of these columns and rows, (rows, columns, 2)."""
    return np.stack(np.meshgrid(x, y), axis=-1)


def over_picture(camera: Camera, columns: int = 240) -> PictureMap:
    """Pixels per degree over the whole picture."""
    x, y = sample_places(camera.size, columns)
    ray = camera.ray(places(x, y))
    theta, _ = angles(ray)
    return PictureMap(x, y, theta, resolution_at(camera, ray))


def image_pixels(camera: Camera, columns: int = 240) -> float:
    """On how many of its pixels the lens puts an image."""
    ray = camera.ray(places(*sample_places(camera.size, columns)))
    return float(np.isfinite(ray[..., 0]).mean()) * camera.size[0] * camera.size[1]


@dataclass(frozen=True)
class Fields:
    """Fields of view in degrees.

    left, right, top, bottom  from the axis to the outer edges of the picture, along the row and
                              the column through the centre; to the rim of the field where that
                              comes first; negative for an edge on the far side of the axis
    horizontal, vertical      from edge to edge
    diagonal                  from corner to opposite corner past the centre, the wider of the two
    corner                    from the axis to the farthest corner
    circle                    the whole field, also where it lies outside the picture
    """

    left: float
    right: float
    top: float
    bottom: float
    diagonal: float
    corner: float
    circle: float

    @property
    def horizontal(self) -> float:
        return self.left + self.right

    @property
    def vertical(self) -> float:
        return self.top + self.bottom


def fields_of_view(camera: Camera) -> Fields:
    """What the picture shows, edge to edge, and what the lens sees."""
    width, height = camera.size
    x, y = np.clip(camera.center, -0.5, (width - 0.5, height - 0.5))
    ends_x, ends_y = (-0.5, width - 0.5), (-0.5, height - 0.5)
    left, right = _angles_to(camera, [(end, y) for end in ends_x])
    top, bottom = _angles_to(camera, [(x, end) for end in ends_y])
    one, two, three, four = _angles_to(camera, [(x, y) for x in ends_x for y in ends_y])
    return Fields(
        left=float(left if camera.center[0] >= ends_x[0] else -left),
        right=float(right if camera.center[0] <= ends_x[1] else -right),
        top=float(top if camera.center[1] >= ends_y[0] else -top),
        bottom=float(bottom if camera.center[1] <= ends_y[1] else -bottom),
        diagonal=float(max(one + four, two + three)),
        corner=float(max(one, two, three, four)),
        circle=float(np.degrees(2 * camera.theta_max)),
    )


def _angles_to(camera: Camera, pixels: list[tuple[float, float]]) -> Floats:
    """Degrees from the axis, at most to the rim."""
    theta, _ = angles(camera.ray(np.array(pixels)))
    return np.degrees(np.where(np.isnan(theta), camera.theta_max, theta))
