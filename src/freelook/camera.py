"""The camera, and THE definition of the projection.

Every renderer in every language does the same few operations with one table:

    p = d.xy / (|d| + d.z)             stereographic coordinate, |p| = tan(theta/2)
    t = p . p                          = tan^2(theta/2)
    pixel = center + stretch @ (p * g + e)      g = r(theta) / tan(theta/2)

`d` is a ray in the camera frame, of any length, at any angle from the axis but exactly 180
degrees. g is tabulated at 256 equal steps of |p| + t, from 0 to that of t_max, and interpolated
linearly: smooth at the axis for every lens, those with even powers of theta among them, and finer
towards the rim, where lenses bend most. A ray with t > t_max is not seen by the lens.

e is there only for lenses that are not round (tangential terms and the like): a small grid of
offsets over the square [-p_max, p_max]^2 of p, interpolated bilinearly. Most cameras have none.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .errors import ProfileError
from .lens import (
    BentLens,
    Floats,
    Lens,
    angle_at_radius,
    growth_limit,
    image_point,
    radius_slope,
)
from .rotations import RDF_FROM_FRD

TABLE_SIZE = 256
# tan^2(theta/2) grows without bound towards 180 degrees; beyond this the table gets coarse
# (0.15 px at 160 degrees and f = 300), so nothing is claimed there.
WIDEST_RAD = np.radians(140.0)
NARROWEST_RAD = np.radians(0.5)
GRID_SIZES = (17, 33, 65, 129)
GRID_TOLERANCE_PX = 0.004


@dataclass(frozen=True)
class RadialTable:
    """g, ready for a renderer: `g` float32 (256,), `t_max`, and what the table costs.

    `residual_px` is the largest distance between table and exact formula over the whole field,
    measured at the middle of every interval, where linear interpolation is worst.
    """

    g: NDArray[np.float32]
    t_max: float
    residual_px: float

    def __call__(self, t: Floats) -> Floats:
        """g at `t`, linear between entries; held constant beyond `t_max`."""
        last = np.sqrt(self.t_max) + self.t_max
        return np.interp(np.sqrt(t) + t, np.linspace(0.0, last, len(self.g)), self.g)


def make_table(lens: Lens, theta_max: float) -> RadialTable:
    """Tabulate a lens on [0, theta_max] (radians)."""
    t_max = np.tan(theta_max / 2) ** 2
    places = np.linspace(0.0, np.sqrt(t_max) + t_max, TABLE_SIZE)
    g = _exact_g(lens, _tangent(places), theta_max).astype(np.float32)
    between = _tangent((places[1:] + places[:-1]) / 2)
    table_g = (g[1:].astype(np.float64) + g[:-1]) / 2
    residual = np.abs(table_g - _exact_g(lens, between, theta_max)) * between
    return RadialTable(g, float(t_max), float(residual.max()))


def _tangent(place: Floats) -> Floats:
    """tan(theta/2) = |p| where |p| + |p|^2 = place."""
    return np.asarray((np.sqrt(1 + 4 * place) - 1) / 2)


def _exact_g(lens: Lens, tangent: Floats, theta_max: float) -> Floats:
    theta = np.minimum(2 * np.arctan(tangent), theta_max)
    on_axis = 2 * radius_slope(lens, np.zeros(1))[0]  # r / tan(theta/2) -> 2 r'(0)
    return np.divide(
        lens.radius(theta), tangent, out=np.full_like(tangent, on_axis), where=tangent > 1e-9
    )


@dataclass(frozen=True)
class OffsetGrid:
    """e for lenses that are not round: `offsets` float32 (n, n, 2), pixels before the stretch.

    Entry [j, i] belongs to p = (-p_max + i step, -p_max + j step), step = 2 p_max / (n - 1).
    `residual_px` is the largest distance between grid and formula over the picture, measured
    in the middle of every cell and of every edge: in the middle of a cell alone, two bends of
    opposite sense would cancel.
    """

    offsets: NDArray[np.float32]
    p_max: float
    residual_px: float

    def __call__(self, p: Floats) -> Floats:
        """e (..., 2) at `p` (..., 2), bilinear between entries; held constant outside."""
        last = len(self.offsets) - 1
        place = np.clip((p / self.p_max + 1) * (last / 2), 0, last)
        low = np.minimum(place.astype(int), last - 1)
        part = (place - low)[..., None]
        column, row = low[..., 0], low[..., 1]
        e = self.offsets.astype(np.float64)
        top = e[row, column] * (1 - part[..., 0, :]) + e[row, column + 1] * part[..., 0, :]
        below = (
            e[row + 1, column] * (1 - part[..., 0, :]) + e[row + 1, column + 1] * part[..., 0, :]
        )
        return np.asarray(top * (1 - part[..., 1, :]) + below * part[..., 1, :])


def make_grid(camera: Camera) -> OffsetGrid | None:
    """The smallest of a few grids that strays less than 0.004 px, or the largest of them.

    None for a round lens, and for one whose offsets are all 0.
    """
    if not isinstance(camera.lens, BentLens):
        return None
    for size in GRID_SIZES:
        grid = _grid(camera, camera.lens, size)
        if grid.residual_px < GRID_TOLERANCE_PX:
            break
    return grid if grid.offsets.any() else None


def _grid(camera: Camera, lens: BentLens, size: int) -> OffsetGrid:
    p_max = float(np.tan(camera.theta_max / 2))
    # the nodes just outside the field hold up the cells on its rim; those farther off hold nothing
    reach = min(p_max * (1 + 3 / (size - 1)), _reach(lens))
    offsets = _offset_at(lens, _square(p_max, size), reach).astype(np.float32)
    grid = OffsetGrid(offsets, p_max, 0.0)
    p = _square(p_max, 2 * size - 1)
    exact = _offset_at(lens, p, reach)
    strays = np.linalg.norm(grid(p) - exact, axis=-1)
    seen = np.linalg.norm(p, axis=-1) <= p_max
    point = p * camera.table((p * p).sum(axis=-1))[..., None] + exact
    pixel = np.asarray(camera.center) + point @ camera.stretch.T
    shown = seen & ((pixel > -2) & (pixel < np.array(camera.size) + 1)).all(axis=-1)
    return replace(grid, residual_px=float(strays[shown].max(initial=0.0)))


def _square(p_max: float, size: int) -> Floats:
    across = np.linspace(-p_max, p_max, size)
    return np.stack(np.meshgrid(across, across), axis=-1)


def _offset_at(lens: BentLens, p: Floats, reach: float) -> Floats:
    """Offsets at p (..., 2); from |p| = reach on they go straight on.

    Nobody sees those, but a kink would spoil the interpolation next to the rim.
    """
    phi, length = np.arctan2(p[..., 1], p[..., 0]), np.hypot(p[..., 0], p[..., 1])
    step = 1e-4 * reach
    inner, held = (
        lens.offset(2 * np.arctan(np.minimum(length, end)), phi) for end in (reach - step, reach)
    )
    beyond = np.maximum(length - reach, 0)[..., None]
    return np.asarray(held + (held - inner) * (beyond / step))


@dataclass(frozen=True)
class Camera:
    """A lens on a sensor on a vehicle.

    size            (width, height) of the picture in pixels
    lens            r(theta) in pixels
    center          (x, y) of the optical axis; (0, 0) is the middle of the top-left pixel
    stretch         2x2, from the lens's round image to the sensor: pixel aspect, sensor tilt
    theta_max       half of the field the lens is good for, radians
    camera_from_body  how the camera is mounted; default: looks straight forward
    """

    size: tuple[int, int]
    lens: Lens
    center: tuple[float, float]
    theta_max: float
    stretch: NDArray[np.float64] = field(default_factory=lambda: np.eye(2))
    camera_from_body: Rotation = RDF_FROM_FRD

    @cached_property
    def table(self) -> RadialTable:
        """What renderers know of the lens; with `grid`, if it is not round."""
        return make_table(self.lens, self.theta_max)

    @cached_property
    def grid(self) -> OffsetGrid | None:
        """What renderers know of a lens that is not round, beside the table; None if it is."""
        return make_grid(self)

    @property
    def residual_px(self) -> float:
        """How far table and grid stray from the exact formula at most, before the stretch."""
        return self.table.residual_px + (self.grid.residual_px if self.grid else 0.0)

    def project(self, ray_in_camera: Floats) -> Floats:
        """Rays (..., 3) of any length to pixels (..., 2), exactly; NaN where not seen.

        NaN too for the zero vector. This is the float64 reference; renderers use `table`.
        """
        xy, theta, sine = _polar(ray_in_camera)
        seen = theta <= self.theta_max
        radius = self.lens.radius(np.where(seen, theta, 0.0))
        scale = np.divide(radius, sine, out=np.zeros_like(sine), where=sine > 0)
        point = xy * scale[..., None]
        if isinstance(self.lens, BentLens):
            phi = np.arctan2(xy[..., 1], xy[..., 0])  # NaN for a zero ray
            point += self.lens.offset(np.where(seen, theta, 0.0), np.where(seen, phi, 0.0))
        pixel = np.asarray(self.center) + point @ self.stretch.T
        pixel[~seen] = np.nan
        return np.asarray(pixel)

    def ray(self, pixel: Floats) -> Floats:
        """Pixels (..., 2) to unit rays in the camera frame (..., 3); NaN outside the field."""
        point = (np.asarray(pixel, dtype=np.float64) - self.center) @ np.linalg.inv(self.stretch).T
        if isinstance(self.lens, BentLens):
            theta, phi = _angles_of(self.lens, point, self.theta_max)
            sine = np.sin(theta)
            return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)
        radius = np.hypot(point[..., 0], point[..., 1])
        theta = np.asarray(angle_at_radius(self.lens, radius, self.theta_max))
        scale = np.divide(np.sin(theta), radius, out=np.zeros_like(radius), where=radius > 0)
        return np.concatenate([point * scale[..., None], np.cos(theta)[..., None]], axis=-1)

    def resized(self, size: tuple[int, int]) -> Camera:
        """The same camera delivering its whole picture at another size."""
        scale = np.array(size) / np.array(self.size)
        center = (np.array(self.center) + 0.5) * scale - 0.5
        return Camera(
            size,
            self.lens,
            (float(center[0]), float(center[1])),
            self.theta_max,
            np.diag(scale) @ self.stretch,
            self.camera_from_body,
        )


def _angles_of(lens: BentLens, point: Floats, theta_max: float) -> tuple[Floats, Floats]:
    """(theta, phi) of image points (..., 2) of a lens that is not round; NaN outside the field.

    Newton's method in the plane of p, which has no pole inside any field, from the round lens's
    answer, and where that leads nowhere, from the axis. A point that does not close to 1e-6 px
    has none.
    """
    shape = point.shape[:-1]
    point = point.reshape(-1, 2)
    near = np.hypot(point[:, 0], point[:, 1]) < _farthest(lens, theta_max)  # and no NaN
    point = np.where(near[:, None], point, 0.0)
    theta = angle_at_radius(lens, np.hypot(point[:, 0], point[:, 1]), theta_max)
    theta = np.where(np.isnan(theta), theta_max, theta)
    phi = np.arctan2(point[:, 1], point[:, 0])
    p = np.tan(theta / 2)[:, None] * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    reach = min(1.001 * np.tan(theta_max / 2), _reach(lens))
    p = _newton(lens, point, p, reach)
    lost = _distance(lens, point, p, reach) > 1e-6
    if lost.any():
        p[lost] = _newton(lens, point[lost], np.zeros_like(p[lost]), reach)
    theta = 2 * np.arctan(np.hypot(p[:, 0], p[:, 1]))
    closed = near & (_distance(lens, point, p, reach) < 1e-6)
    theta[~closed | (theta > theta_max + 1e-12)] = np.nan
    return theta.reshape(shape), np.arctan2(p[:, 1], p[:, 0]).reshape(shape)


def _farthest(lens: BentLens, theta_max: float) -> float:
    """A distance from the axis beyond which there is no image, pixels: a little outside the rim."""
    phi = np.radians(np.arange(0, 360, 1.0))
    point = image_point(lens, np.full_like(phi, theta_max), phi)
    return float(1.01 * np.hypot(point[:, 0], point[:, 1]).max() + 1)


def _newton(lens: BentLens, point: Floats, p: Floats, reach: float) -> Floats:
    """p (n, 2), bettered until its image is `point`; steps that make it worse are shortened."""
    p = p.copy()
    open_ = np.arange(len(p))  # those that have not closed yet
    part = np.ones(len(p))
    with np.errstate(all="ignore"):  # a point with no answer may send its steps anywhere
        error = point - _point_at(lens, p, reach)
        for _ in range(40):
            left = (np.abs(error).max(axis=-1, initial=0) > 1e-10) & (part[open_] > 1e-3)
            open_, error = open_[left], error[left]
            if not len(open_):
                break
            step = _solve(_slopes(lens, p[open_], reach), error)
            tried = _within(p[open_] + part[open_, None] * step, reach)
            missed = point[open_] - _point_at(lens, tried, reach)
            better = np.hypot(missed[:, 0], missed[:, 1]) < np.hypot(error[:, 0], error[:, 1])
            p[open_] = np.where(better[:, None], tried, p[open_])
            error = np.where(better[:, None], missed, error)
            part[open_] = np.where(better, 1.0, part[open_] / 4)
    return p


def _distance(lens: BentLens, point: Floats, p: Floats, reach: float) -> Floats:
    with np.errstate(all="ignore"):
        apart = point - _point_at(lens, p, reach)
    return np.asarray(np.where(np.isfinite(apart).all(-1), np.abs(apart).max(-1), np.inf))


def _reach(lens: Lens) -> float:
    """|p| at the lens's hard limit."""
    return float(np.tan(np.nextafter(lens.hard_limit, 0) / 2))


def _within(p: Floats, reach: float) -> Floats:
    """p (n, 2), drawn in to the circle of radius `reach`."""
    length = np.maximum(np.hypot(p[:, 0], p[:, 1]), reach)[:, None]
    return np.asarray(p * (reach / length))


def _solve(matrices: Floats, values: Floats) -> Floats:
    """x of matrices @ x = values for many 2 x 2 matrices; no step at all where there is none."""
    (a, b), (c, d) = matrices[:, 0].T, matrices[:, 1].T
    determinant = a * d - b * c
    solved = np.stack(
        [d * values[:, 0] - b * values[:, 1], a * values[:, 1] - c * values[:, 0]], axis=-1
    )
    usable = (np.abs(determinant) > 1e-12)[:, None]
    return np.divide(solved, determinant[:, None], out=np.zeros_like(solved), where=usable)


def _point_at(lens: Lens, p: Floats, reach: float) -> Floats:
    length = np.minimum(np.hypot(p[..., 0], p[..., 1]), reach)
    return image_point(lens, 2 * np.arctan(length), np.arctan2(p[..., 1], p[..., 0]))


def _slopes(lens: Lens, p: Floats, reach: float) -> Floats:
    """d point / d p, (n, 2, 2), by central differences; on the rim of `reach`, just inside it."""
    step = 1e-6
    p = _within(p, reach - 1.5 * step)
    columns = [
        (_point_at(lens, p + h, reach) - _point_at(lens, p - h, reach)) / (2 * step)
        for h in step * np.eye(2)
    ]
    return np.stack(columns, axis=-1)


def _polar(ray: Floats) -> tuple[Floats, Floats, Floats]:
    """(xy of the unit ray, angle from the axis, sine of it); NaN angle for a zero ray."""
    ray = np.asarray(ray, dtype=np.float64)
    length = np.linalg.norm(ray, axis=-1, keepdims=True)
    unit = np.divide(ray, length, out=np.full_like(ray, np.nan), where=length > 0)
    sine = np.hypot(unit[..., 0], unit[..., 1])
    return unit[..., :2], np.arctan2(sine, unit[..., 2]), sine


def make_camera(
    size: tuple[int, int],
    lens: Lens,
    *,
    center: tuple[float, float] | None = None,
    field_deg: float | None = None,
    stretch: NDArray[np.float64] | None = None,
    camera_from_body: Rotation = RDF_FROM_FRD,
) -> Camera:
    """A camera with the usual defaults, checked.

    `center` defaults to the middle of the picture. `field_deg` is the full field of view the
    lens is claimed to be good for; when None it ends where the radius stops growing or at the
    farthest corner of the picture, whichever comes first. ProfileError says where a radius
    stops growing inside a claimed field.
    """
    width, height = size
    center = ((width - 1) / 2, (height - 1) / 2) if center is None else center
    stretch = np.eye(2) if stretch is None else np.asarray(stretch, dtype=np.float64)
    if width < 1 or height < 1:
        raise ProfileError(f"size must be at least 1 x 1 pixels, not {width} x {height}")
    if abs(np.linalg.det(stretch)) < 1e-6:
        raise ProfileError(f"stretch {stretch.tolist()} flattens the picture to a line")
    limit = growth_limit(lens)
    if limit <= 0:
        raise ProfileError(
            f"{_short(lens)}: the radius does not grow with the angle, not even on the axis"
        )
    theta_max = (
        _corner_angle(size, lens, center, stretch, limit)
        if field_deg is None
        else _claimed_angle(lens, field_deg, limit)
    )
    if isinstance(lens, BentLens):
        theta_max = _unfolded(lens, theta_max, field_deg)
    rim = float(lens.radius(np.array([theta_max]))[0])
    if rim < 1:
        raise ProfileError(
            f"{_short(lens)}: the whole image has a radius of {rim:.3g} pixels; "
            "parameters are in pixels"
        )
    return Camera(size, lens, center, theta_max, stretch, camera_from_body)


def _claimed_angle(lens: Lens, field_deg: float, limit: float) -> float:
    half = np.radians(field_deg) / 2
    if not NARROWEST_RAD <= half <= WIDEST_RAD:
        narrowest, widest = 2 * np.degrees(NARROWEST_RAD), 2 * np.degrees(WIDEST_RAD)
        raise ProfileError(f"field_deg must be {narrowest:.0f} to {widest:.0f}, not {field_deg}")
    if half > limit + 1e-9:
        raise ProfileError(
            f"the radius of this {type(lens).__name__} lens stops growing at "
            f"{np.degrees(limit):.2f} degrees from the axis, inside the claimed field of "
            f"{field_deg} degrees (half: {field_deg / 2}); claim at most "
            f"field_deg = {2 * np.degrees(limit):.1f}, or check the parameters"
        )
    return _below_pole(lens, min(half, limit))


def _unfolded(lens: BentLens, theta_max: float, field_deg: float | None) -> float:
    """The angle, at most theta_max, up to which no two rays land on one pixel."""
    limit = _fold(lens, theta_max)
    if limit < NARROWEST_RAD or (field_deg is not None and limit < theta_max - 1e-5):
        raise ProfileError(
            f"this {type(lens).__name__} lens folds at {np.degrees(limit):.2f} degrees from the "
            "axis: two rays land on one pixel; claim at most "
            f"field_deg = {2 * np.degrees(limit):.1f}, or check the parameters"
        )
    return limit


def _fold(lens: BentLens, theta_max: float) -> float:
    """Where the image first folds over in any of 72 directions, looked for in 180 steps."""
    theta = np.linspace(0, theta_max, 181)
    whole = _whole(lens, theta[1:])
    if whole.all():
        return theta_max
    first = int(np.argmin(whole))
    low, high = theta[first], theta[first + 1]
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (middle, high) if _whole(lens, np.array([middle]))[0] else (low, middle)
    return float(low)


def _whole(lens: BentLens, theta: Floats) -> NDArray[np.bool_]:
    """Whether the image keeps its sense on whole circles of these angles (n,)."""
    phi = np.radians(np.arange(0, 360, 5))
    p = np.tan(theta / 2)[:, None, None] * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    with np.errstate(all="ignore"):
        slopes = _slopes(lens, p.reshape(-1, 2), _reach(lens))
        return (np.linalg.det(slopes) > 0).reshape(len(theta), len(phi)).all(axis=-1)


def _below_pole(lens: Lens, theta: float) -> float:
    """Keep a hair away from an angle where the formula is infinite (tan at 90 degrees)."""
    last, hair = float(np.nextafter(lens.hard_limit, 0)), lens.hard_limit - 1e-3
    if theta <= hair:
        return theta
    with np.errstate(all="ignore"):
        near, at = lens.radius(np.array([hair, min(theta, last)]))
    return min(theta, last) if at < 1.1 * near else hair


def _short(lens: Lens) -> str:
    """A lens with its parameters, for a message; splines have hundreds."""
    text = str(lens)
    return text if len(text) <= 200 else f"{text[:200]}...)"


def _corner_angle(
    size: tuple[int, int],
    lens: Lens,
    center: tuple[float, float],
    stretch: NDArray[np.float64],
    limit: float,
) -> float:
    corners = np.array([[x, y] for x in (-0.5, size[0] - 0.5) for y in (-0.5, size[1] - 0.5)])
    point = (corners - center) @ np.linalg.inv(stretch).T
    limit = _below_pole(lens, min(limit, WIDEST_RAD))
    if isinstance(lens, BentLens):
        angles, _ = _angles_of(lens, point, limit)
    else:
        angles = angle_at_radius(lens, np.hypot(point[:, 0], point[:, 1]), limit)
    return limit if np.isnan(angles).any() else float(angles.max())
