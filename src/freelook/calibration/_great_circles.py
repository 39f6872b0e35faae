"""Great circles through the rays of points, and how far points are from them in pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..lens import Floats, radius_slope

GRID = 1024  # angles between which r(theta) is inverted
BEYOND = 1.1  # of the field: points a little outside must not be lost while a lens is sought
TIMES = 3  # that weights are found anew


@dataclass(frozen=True)
class Line:
    """Points (n, 2) along something straight, in pixels of one picture.

    along  a name that parallel lines of one picture share; lines of different names are at right
           angles in space. Empty where nothing is known.
    """

    name: str
    pixels: Floats
    picture: str = ""
    along: str = ""


@dataclass(frozen=True)
class LinePoints:
    """Points of many lines, one line after the other.

    pixels   (n, 2)
    first    (lines,): where each line's points begin
    line_of  (n,): whose point it is
    """

    pixels: Floats
    first: NDArray[np.int64]
    line_of: NDArray[np.int64]

    @classmethod
    def of(cls, lines: Sequence[Line]) -> LinePoints:
        """Of at least one line, and none without points."""
        parts = [line.pixels for line in lines]
        counts = np.array([len(part) for part in parts])
        first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        return cls(np.concatenate(parts), first, np.repeat(np.arange(len(parts)), counts))


@dataclass(frozen=True)
class _Rays:
    """Unit rays (n, 3), and how they change with the pixel (n, 3, 2)."""

    ray: Floats
    by_pixel: Floats


def best_circles(
    camera: Camera, points: LinePoints, straggling_px: float, along: Floats | None = None
) -> tuple[Floats, Floats]:
    """The great circles nearest to each line's points, and how far the points are from them.

    Unit normals (lines, 3) of the circles' planes, and signed distances (n,) in pixels of the
    picture, to first order. Points off by more than `straggling_px` count less. `along` (lines, 3):
    unit directions in space, whose vanishing points the circles have to go through; zeros for none.
    """
    rays = _rays_of(camera, points.pixels)
    normal = _normals(rays, points, straggling_px, along)
    return normal, _distances(rays, normal[points.line_of])


def _normals(rays: _Rays, points: LinePoints, straggling_px: float, along: Floats | None) -> Floats:
    outer = rays.ray[:, :, None] * rays.ray[:, None, :]
    weight = np.ones(len(outer))
    for _ in range(TIMES):
        scatter = np.add.reduceat(weight[:, None, None] * outer, points.first, axis=0)
        if along is not None:
            scatter = _across(scatter, along)
        normal = np.linalg.eigh(scatter)[1][:, :, 0][points.line_of]
        slope = np.maximum(_slope(rays, normal), 1e-12)
        off = np.sum(rays.ray * normal, axis=1) / slope
        weight = 1 / (slope**2 * (1 + (off / straggling_px) ** 2))
        weight /= weight.max()
    return np.asarray(normal[points.first])


def _across(scatter: Floats, along: Floats) -> Floats:
    """Scatter matrices whose least direction is at right angles to `along`."""
    aside = np.eye(3) - along[:, :, None] * along[:, None, :]
    trace = np.trace(scatter, axis1=1, axis2=2)[:, None, None]
    return np.asarray(aside @ scatter @ aside + trace * (np.eye(3) - aside))


def _distances(rays: _Rays, normal: Floats) -> Floats:
    return np.asarray(np.sum(rays.ray * normal, axis=1) / np.maximum(_slope(rays, normal), 1e-12))


def _slope(rays: _Rays, normal: Floats) -> Floats:
    """How fast the sine to the plane changes per pixel, across the line."""
    gradient = np.einsum("ni,nij->nj", normal, rays.by_pixel)
    return np.hypot(gradient[:, 0], gradient[:, 1])


def _rays_of(camera: Camera, pixels: Floats) -> _Rays:
    """As `Camera.ray` for the round part of the lens, but never NaN."""
    inverse = np.linalg.inv(camera.stretch)
    point = (pixels - camera.center) @ inverse.T
    radius = np.hypot(point[:, 0], point[:, 1])
    theta, slope = _angles(camera, radius)
    near = radius < 1e-9
    safe = np.where(near, 1.0, radius)
    outward = np.where(near[:, None], [1.0, 0.0], point / safe[:, None])
    across = np.stack([-outward[:, 1], outward[:, 0]], axis=-1)
    sine, cosine = np.sin(theta), np.cos(theta)
    turn = np.where(near, 1 / slope, sine / safe)
    by_radius = np.column_stack([cosine[:, None] * outward, -sine]) / slope[:, None]
    by_turn = np.column_stack([across, np.zeros(len(across))]) * turn[:, None]
    by_point = by_radius[:, :, None] * outward[:, None] + by_turn[:, :, None] * across[:, None]
    return _Rays(np.column_stack([sine[:, None] * outward, cosine]), by_point @ inverse)


def _angles(camera: Camera, radius: Floats) -> tuple[Floats, Floats]:
    """theta and dr/dtheta at a radius; straight on beyond the end of the lens."""
    lens = camera.lens
    last_angle = float(np.nextafter(lens.hard_limit, 0.0))
    grid = np.linspace(0, min(BEYOND * camera.theta_max, last_angle), GRID)
    at = lens.radius(grid)
    grows = np.diff(at) > 0
    end = len(grid) if grows.all() else max(int(np.argmin(grows)) + 1, 20)
    grid, at = grid[:end], np.maximum.accumulate(at[:end])
    last = max(float(radius_slope(lens, grid[-1:])[0]), 1e-3 * float(at[-1]) + 1e-6)
    theta = np.interp(radius, at, grid)
    beyond = np.maximum(radius - at[-1], 0.0)
    slope = np.maximum(radius_slope(lens, theta), last * 1e-3)
    theta = theta + np.where(beyond > 0, 0.0, (radius - lens.radius(theta)) / slope)  # one step
    slope = np.where(beyond > 0, last, slope)
    return np.clip(theta + beyond / last, 0.0, np.pi), slope
