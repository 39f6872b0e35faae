"""Where points land, and how that changes with the point and with what is solved for.

Round lenses need nothing but r(theta): its slope and what each parameter does to it are central
differences of one curve, the rest is geometry. Splined ones are known in closed form (`_surface`).
Other lenses that are not round are differenced whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..camera import Camera
from ..lens import Floats, Lens, RadialSpline, radius_slope
from ._surface import Surface, control_of, is_surface, stereographic, stereographic_slopes
from .parameters import Freedom, Parameters, difference_step, lens_values, with_lens_values

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

INSIDE = 1 - 1e-6  # of the angle where a formula ends
ON_AXIS = 1e-4  # off the axis by so much of the way along it: too near for directions around it


@cache
def _is_bent(model: type[Lens]) -> bool:
    """As isinstance(lens, BentLens), which asks the lens for all it has every time."""
    return hasattr(model, "offset")


def project(camera: Camera, points: Floats) -> Floats:
    """Pixels (n, 2) as `Camera.project`, but never NaN: beyond the formula's end a point stays
    at its end.

    What lies out there is wrong anyway; a solver has to find its way back from it.
    """
    if is_surface(lens := camera.lens):
        surface = Surface.of(lens, u := stereographic(points))
        if surface.inside.all():
            at = lens.f * (u + surface.offset(control_of(lens)))
            return np.asarray(camera.center) + at @ camera.stretch.T
    at = _lands(camera.lens, _is_bent(type(camera.lens)), _Polar.of(points))
    return np.asarray(camera.center) + at @ camera.stretch.T


def value_slopes(parameters: Parameters, values: Floats, points: Floats) -> Floats:
    """d pixel / d values (n, 2, k) of points (n, 3) in the camera frame."""
    return _by_values(_Seen(parameters.camera_of(values), points), parameters.free)


def point_slopes(camera: Camera, points: Floats) -> Floats:
    """d pixel / d point (n, 2, 3) of points (n, 3) in the camera frame."""
    return _by_points(_Seen(camera, points))


def both_slopes(parameters: Parameters, values: Floats, points: Floats) -> tuple[Floats, Floats]:
    """`value_slopes` and `point_slopes`; what both need is worked out once."""
    seen = _Seen(parameters.camera_of(values), points)
    return _by_values(seen, parameters.free), _by_points(seen)


@dataclass(frozen=True)
class _Seen:
    """Points (n, 3) in the frame of a camera."""

    camera: Camera
    points: Floats

    @cached_property
    def polar(self) -> _Polar:
        return _Polar.of(self.points)

    @cached_property
    def surface(self) -> Surface:
        lens = self.camera.lens
        assert is_surface(lens)
        return Surface.of(lens, stereographic(self.points))


def _by_values(seen: _Seen, free: Freedom) -> Floats:
    camera, count = seen.camera, len(seen.points)
    if is_surface(camera.lens):
        return _surface_slopes(seen) if free.lens else np.zeros((count, 2, 0))
    polar, bent = seen.polar, _is_bent(type(camera.lens))
    parts: list[Floats] = []
    if free.lens and bent:
        parts.append(camera.stretch @ _bent_slopes(camera.lens, polar))
    elif free.lens:
        outwards = polar.outwards @ camera.stretch.T
        parts.append(outwards[:, :, None] * _radius_slopes(camera.lens, polar.theta)[:, None, :])
    if free.center:
        parts.append(np.broadcast_to(np.eye(2), (count, 2, 2)))
    if free.aspect or free.skew:
        down = _lands(camera.lens, bent, polar)[:, 1, None, None]
        parts += [down * [[0.0], [1.0]]] if free.aspect else []
        parts += [down * [[1.0], [0.0]]] if free.skew else []
    return np.concatenate(parts, axis=-1) if parts else np.zeros((count, 2, 0))


def _by_points(seen: _Seen) -> Floats:
    camera = seen.camera
    if is_surface(lens := camera.lens) and seen.surface.inside.all():
        by_u = np.eye(2) + seen.surface.offset_slopes(control_of(lens))
        return np.asarray(lens.f * camera.stretch @ by_u @ stereographic_slopes(seen.points))
    if _is_bent(type(camera.lens)):
        if (seen.polar.across <= ON_AXIS * np.abs(seen.polar.along)).any():
            return _differences(lambda p: project(camera, p), seen.points)
        slopes = _round_slopes(camera.lens, seen.polar) + _offset_slopes(camera.lens, seen.polar)
    else:
        slopes = _round_slopes(camera.lens, seen.polar)
    # as `camera.stretch @ slopes`, which is slow for many small matrices
    return np.stack([row[0] * slopes[:, 0] + row[1] * slopes[:, 1] for row in camera.stretch], 1)


def turn_slopes(by_point: Floats, v: Floats) -> Floats:
    """d pixel / d (small rotation) (n, 2, 3) of vectors v (n, 3), from d pixel / d point.

    -by_point @ [v]x, row by row the cross product of v and the row.
    """
    x, y, z = v.T[:, :, None]
    a, b, c = by_point[..., 0], by_point[..., 1], by_point[..., 2]
    return np.stack([y * c - z * b, z * a - x * c, x * b - y * a], axis=-1)


def cross_matrices(v: Floats) -> Floats:
    """[v]x for many v (n, 3): [v]x @ w = v x w."""
    zero = np.zeros(len(v))
    x, y, z = v.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)


def _surface_slopes(seen: _Seen) -> Floats:
    """d pixel / d control (n, 2, 2 nx ny); beyond the control points, what their edge does."""
    lens, points, stretch = seen.camera.lens, seen.points, seen.camera.stretch
    assert is_surface(lens)
    count = lens.nx * lens.ny
    weights = seen.surface.spread(count)
    slopes = np.zeros((len(points), 2, count, 2))
    for i, j in np.argwhere(stretch):
        slopes[:, i, :, j] = (lens.f * stretch[i, j]) * weights
    return slopes.reshape(len(points), 2, 2 * count)


@dataclass(frozen=True)
class _Polar:
    """Points by angle from the axis, direction around it (unit vector, 0 on the axis itself)."""

    across: Floats
    along: Floats
    theta: Floats
    outwards: Floats  # (n, 2)

    @cached_property
    def around(self) -> Floats:
        """The direction as an angle from x to y, radians (n,)."""
        return np.arctan2(self.outwards[:, 1], self.outwards[:, 0])

    @classmethod
    def of(cls, points: Floats) -> _Polar:
        across, along = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
        outwards = np.zeros((len(points), 2))
        np.divide(points[:, :2], across[:, None], out=outwards, where=across[:, None] > 0)
        return cls(across, along, np.arctan2(across, along), outwards)


def _lands(lens: Lens, bent: bool, polar: _Polar) -> Floats:
    """(n, 2) pixels from the axis, before the stretch."""
    place = _radius(lens, polar.theta)[:, None] * polar.outwards
    if bent:
        place += _offset(lens, polar.theta, polar.around)
    return np.asarray(place)


def _radius_slopes(lens: Lens, theta: Floats) -> Floats:
    """d r(theta) / d (parameter) (n, k) of a round lens."""
    within = _within(lens, theta)
    if isinstance(lens, RadialSpline):  # its radius is linear in its radii
        return np.asarray(_bumps(lens.angles_deg)(within))
    changes = [
        (_radius(ahead, theta) - _radius(behind, theta)) / (2 * step)
        for ahead, behind, step in _neighbours(lens)
    ]
    return np.stack(changes, axis=-1)


def _bent_slopes(lens: Lens, polar: _Polar) -> Floats:
    """d (landing place) / d (parameter) (n, 2, k) of a lens that is not round."""
    changes = [
        (_lands(ahead, True, polar) - _lands(behind, True, polar)) / (2 * step)
        for ahead, behind, step in _neighbours(lens)
    ]
    return np.stack(changes, axis=-1)


def _neighbours(lens: Lens) -> Iterator[tuple[Lens, Lens, float]]:
    """For each parameter the lenses with a little more and a little less of it, and how much."""
    values = lens_values(lens)
    for i, value in enumerate(values):
        step = np.zeros(len(values))
        step[i] = difference_step(value)
        more, less = with_lens_values(lens, values + step), with_lens_values(lens, values - step)
        yield more, less, float(step[i])


def _within(lens: Lens, theta: Floats) -> Floats:
    return np.minimum(theta, lens.hard_limit * INSIDE)


def _radius(lens: Lens, theta: Floats) -> Floats:
    return lens.radius(_within(lens, theta))


def _offset(lens: Lens, theta: Floats, around: Floats) -> Floats:
    return lens.offset(_within(lens, theta), around)  # type: ignore[attr-defined]


@cache
def _bumps(angles_deg: tuple[float, ...]) -> CubicSpline:
    """d r(theta) / d radii_px of a radial spline with these knots: (n,) to (n, knots)."""
    from scipy.interpolate import CubicSpline

    knots = np.radians(angles_deg)
    each = np.eye(len(knots))
    if knots[0] == 0:  # stays 0
        knots, each = knots[1:], each[1:]
    middle = np.zeros((1, each.shape[1]))
    return CubicSpline(
        np.concatenate([-knots[::-1], [0.0], knots]), np.concatenate([-each[::-1], middle, each])
    )


def _round_slopes(lens: Lens, polar: _Polar) -> Floats:
    """d (landing place) / d point (n, 2, 3) of a round lens."""
    end = lens.hard_limit * INSIDE
    theta = np.minimum(polar.theta, end)
    radius, slope = lens.radius(theta), radius_slope(lens, theta)
    # on the axis r / across is r'(0) / z
    near = slope / np.maximum(np.abs(polar.along), 1e-300)
    around = np.divide(radius, polar.across, out=near, where=polar.across > 1e-9 * polar.along)
    slope = np.where(polar.theta < end, slope, 0.0)
    squared = polar.across**2 + polar.along**2
    by_across, by_along = slope * polar.along / squared, -slope * polar.across / squared
    u = polar.outwards
    slopes = np.empty((len(radius), 2, 3))
    slopes[:, :, :2] = (by_across - around)[:, None, None] * (u[:, :, None] * u[:, None, :])
    slopes[:, 0, 0] += around
    slopes[:, 1, 1] += around
    slopes[:, :, 2] = by_along[:, None] * u
    return slopes


def _offset_slopes(lens: Lens, polar: _Polar) -> Floats:
    """d offset / d point (n, 2, 3), by central differences of the two angles; off the axis."""
    h = 1e-6
    high, low = polar.theta + h, np.maximum(polar.theta - h, 0.0)
    further = _offset(lens, high, polar.around) - _offset(lens, low, polar.around)
    turned = _offset(lens, polar.theta, polar.around + h) - _offset(
        lens, polar.theta, polar.around - h
    )
    squared, (x, y) = polar.across**2 + polar.along**2, polar.outwards.T
    by_theta = np.stack([polar.along * x, polar.along * y, -polar.across], axis=-1)
    by_theta /= (squared * (high - low))[:, None]
    by_around = np.stack([-y, x, 0 * x], axis=-1) / (2 * h * polar.across)[:, None]
    return further[:, :, None] * by_theta[:, None, :] + turned[:, :, None] * by_around[:, None, :]


def _differences(function: Callable[[Floats], Floats], points: Floats) -> Floats:
    h = 1e-6 * np.linalg.norm(points, axis=1, keepdims=True)
    columns = [
        (function(points + h * axis) - function(points - h * axis)) / (2 * h) for axis in np.eye(3)
    ]
    return np.stack(columns, axis=-1)
