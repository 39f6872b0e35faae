"""Where points land, and how that changes with the point and with what is solved for.

Round lenses need nothing but r(theta): its slope and what each parameter does to it are central
differences of one curve, the rest is geometry. Splined ones are known in closed form (`_surface`).
Other lenses that are not round are differenced whole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from ..camera import Camera
from ..lens import Floats, Lens, RadialSpline, radius_slope
from ._surface import Surface, control_of, is_surface, stereographic, stereographic_slopes
from .parameters import Parameters, difference_step, lens_values, with_lens_values

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

INSIDE = 1 - 1e-6  # of the angle where a formula ends


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
    camera, free = parameters.camera_of(values), parameters.free
    if is_surface(camera.lens):
        return _surface_slopes(camera, points) if free.lens else np.zeros((len(points), 2, 0))
    bent, polar = _is_bent(type(camera.lens)), _Polar.of(points)
    columns: list[Floats] = []
    if free.lens:
        columns += [s @ camera.stretch.T for s in _lens_slopes(camera.lens, bent, polar)]
    if free.center:
        columns += [np.broadcast_to(axis, (len(points), 2)) for axis in np.eye(2)]
    if free.aspect or free.skew:
        down, nothing = _lands(camera.lens, bent, polar)[:, 1], np.zeros(len(points))
        columns += [np.stack([nothing, down], axis=-1)] if free.aspect else []
        columns += [np.stack([down, nothing], axis=-1)] if free.skew else []
    return np.stack(columns, axis=-1) if columns else np.zeros((len(points), 2, 0))


def point_slopes(camera: Camera, points: Floats) -> Floats:
    """d pixel / d point (n, 2, 3) of points (n, 3) in the camera frame."""
    if is_surface(lens := camera.lens):
        surface = Surface.of(lens, stereographic(points))
        if surface.inside.all():
            by_u = np.eye(2) + surface.offset_slopes(control_of(lens))
            return np.asarray(lens.f * camera.stretch @ by_u @ stereographic_slopes(points))
    if _is_bent(type(camera.lens)):
        return _differences(lambda p: project(camera, p), points)
    return np.asarray(camera.stretch @ _round_slopes(camera.lens, _Polar.of(points)))


def cross_matrices(v: Floats) -> Floats:
    """[v]x for many v (n, 3): [v]x @ w = v x w."""
    zero = np.zeros(len(v))
    x, y, z = v.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)


def _surface_slopes(camera: Camera, points: Floats) -> Floats:
    """d pixel / d control (n, 2, 2 nx ny); beyond the control points, what their edge does."""
    lens = camera.lens
    assert is_surface(lens)
    count = lens.nx * lens.ny
    weights = Surface.of(lens, stereographic(points)).spread(count)
    slopes = np.zeros((len(points), 2, count, 2))
    for i, j in np.argwhere(camera.stretch):
        slopes[:, i, :, j] = (lens.f * camera.stretch[i, j]) * weights
    return slopes.reshape(len(points), 2, 2 * count)


@dataclass(frozen=True)
class _Polar:
    """Points by angle from the axis, direction around it (unit vector, 0 on the axis itself)."""

    across: Floats
    along: Floats
    theta: Floats
    outwards: Floats  # (n, 2)

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
        around = np.arctan2(polar.outwards[:, 1], polar.outwards[:, 0])
        place += lens.offset(_within(lens, polar.theta), around)  # type: ignore[attr-defined]
    return np.asarray(place)


def _lens_slopes(lens: Lens, bent: bool, polar: _Polar) -> list[Floats]:
    """d (landing place) / d (parameter) (n, 2), for each parameter of the lens."""
    if isinstance(lens, RadialSpline):  # its radius is linear in its radii
        bumps = _bumps(lens.angles_deg)(_within(lens, polar.theta))
        return [bump[:, None] * polar.outwards for bump in bumps.T]
    values, slopes = lens_values(lens), []
    for i, value in enumerate(values):
        step = np.zeros(len(values))
        step[i] = difference_step(value)
        ahead, behind = with_lens_values(lens, values + step), with_lens_values(lens, values - step)
        if bent:
            change = _lands(ahead, bent, polar) - _lands(behind, bent, polar)
        else:
            longer = _radius(ahead, polar.theta) - _radius(behind, polar.theta)
            change = longer[:, None] * polar.outwards
        slopes.append(change / (2 * step[i]))
    return slopes


def _within(lens: Lens, theta: Floats) -> Floats:
    return np.minimum(theta, lens.hard_limit * INSIDE)


def _radius(lens: Lens, theta: Floats) -> Floats:
    return lens.radius(_within(lens, theta))


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


def _differences(function: Callable[[Floats], Floats], points: Floats) -> Floats:
    h = 1e-6 * np.linalg.norm(points, axis=1, keepdims=True)
    columns = [
        (function(points + h * axis) - function(points - h * axis)) / (2 * h) for axis in np.eye(3)
    ]
    return np.stack(columns, axis=-1)
