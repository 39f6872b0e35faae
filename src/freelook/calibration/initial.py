"""A first guess of lens, centre and poses, from nothing but the views.

A flat target and the rays of its points obey ray x (H point) = 0 with H = [r1 r2 t], whatever the
angle from the axis; no division by z, so rays beyond 90 degrees are like any other. A lens that is
about right is one for which r1 and r2 come out orthonormal. So: try lenses of four shapes, many
fields and a few centres, solve H for every view by one eigenvector (all at once), make a rotation
of it, and keep what projects the points nearest to their pixels.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera, make_camera
from ..lens import (
    Equidistant,
    Equisolid,
    Floats,
    KannalaBrandt,
    Lens,
    Perspective,
    Stereographic,
)
from .views import Pose, View

SHAPES: tuple[type[Lens], ...] = (Perspective, Stereographic, Equidistant, Equisolid)
# angle from the axis of the outermost point seen
OUTERMOST_DEG = (20, 28, 36, 45, 54, 63, 72, 81, 90, 98, 106)
CENTERS = (-0.1, 0.0, 0.1)  # of the picture's size, from its middle
FEW_POINTS, FEW_VIEWS = 24, 12  # enough to tell good from bad
SMOOTH_SHARE = 0.03  # of the target's size in the picture: points so near a smooth map are good
KEPT = 3


@dataclass(frozen=True)
class Guess:
    """A camera, the target's pose in every view, and how far off that is (median, pixels)."""

    camera: Camera
    poses: tuple[Pose, ...]
    error_px: float


def first_guesses(views: Sequence[View], size: tuple[int, int]) -> list[Guess]:
    """The best few guesses, best first; what is best here may lose after refinement."""
    smooth = [smooth_part(view) for view in views]
    few = _Few(smooth)
    scored: list[_Scored] = []
    for center, lenses in _candidates(few.pixels, size):
        errors = few.errors_px(lenses, center)
        scored += [(float(e), lens, center) for e, lens in zip(errors, lenses, strict=True)]
    scored.sort(key=lambda entry: entry[0])
    return [_guess(lens, center, smooth, size, error) for error, lens, center in _varied(scored)]


def as_kannala_brandt(camera: Camera) -> Camera:
    """With the Kannala-Brandt lens nearest to its own, and a field that hinders no solver."""
    theta = np.linspace(0, camera.theta_max, 200)[1:]
    powers = theta[:, None] ** np.array([1, 3, 5, 7, 9])
    terms = np.linalg.lstsq(powers, camera.lens.radius(theta), rcond=None)[0]
    f = float(terms[0])
    lens = KannalaBrandt(f, *(float(k) / f for k in terms[1:]))
    return replace(camera, lens=lens, theta_max=np.pi)


def pose_of(camera: Camera, view: View) -> Pose | None:
    """Where the target is in one view of a known camera; None if its points are not seen.

    Points far off the others' plane hardly count.
    """
    rays = camera.ray(view.pixels)
    seen = np.isfinite(rays[:, 2])
    if seen.sum() < 4:
        return None
    points, rays = view.points[seen], rays[seen]
    pose = _pose(points, rays)
    for _ in range(5):
        at = pose.apply(points)
        ahead = at / np.maximum(np.linalg.norm(at, axis=1, keepdims=True), 1e-12)
        off = np.linalg.norm(rays - ahead, axis=1)
        scale = 3 * max(float(np.median(off)), 1e-9)
        pose = _pose(points, rays, (1 + (off / scale) ** 2) ** -2)
    return pose


def mirrored(pose: Pose, view: View) -> Pose:
    """The other pose from which a small flat target looks much the same: tilted the other way."""
    middle = view.points.mean(axis=0)
    _, axes, _ = _plane(view.points)
    at = pose.apply(middle[None])[0]
    away, normal = at / np.linalg.norm(at), axes[:, 2]
    turn = pose.camera_from_target.as_matrix()
    turn = (
        (np.eye(3) - 2 * np.outer(away, away)) @ turn @ (np.eye(3) - 2 * np.outer(normal, normal))
    )
    return Pose(Rotation.from_matrix(turn), at - turn @ middle)


def smooth_part(view: View) -> View:
    """The view without points that do not follow the others, as far as that shows without a lens.

    However a lens bends, target and picture are joined by a smooth map: a polynomial of second or
    third degree, fitted robustly. All points, if they are too few to tell.
    """
    count = len(view.pixels)
    if count < 15:
        return view
    flat, _, _ = _flattened(view.points)
    u, v = flat.T
    terms = [np.ones(count), u, v, u * u, u * v, v * v]
    if count >= 30:
        terms += [u**3, u * u * v, u * v * v, v**3]
    columns, weight = np.stack(terms, axis=-1), np.ones(count)
    off = np.zeros(count)
    for _ in range(10):
        root = np.sqrt(weight)[:, None]
        answer = np.linalg.lstsq(columns * root, view.pixels * root, rcond=None)[0]
        off = np.linalg.norm(view.pixels - columns @ answer, axis=1)
        weight = (1 + (off / (3 * max(float(np.median(off)), 1e-3))) ** 2) ** -2
    extent = float(np.median(np.ptp(view.pixels[off <= np.median(off)], axis=0)))
    good = off <= max(6 * float(np.median(off)), SMOOTH_SHARE * extent)
    return view.only(good)


_Scored = tuple[float, Lens, tuple[float, float]]


def _varied(scored: list[_Scored]) -> Iterator[_Scored]:
    """The best, then the best of the other shapes: what fits a few points well may not all."""
    shapes = set()
    for entry in scored:
        if type(entry[1]) not in shapes and np.isfinite(entry[0]):
            shapes.add(type(entry[1]))
            yield entry
        if len(shapes) == KEPT:
            return


def _candidates(
    pixels: Floats, size: tuple[int, int]
) -> Iterator[tuple[tuple[float, float], list[Lens]]]:
    """Centres, and for each the lenses that bring the outermost pixel to some angle."""
    middle = (np.array(size) - 1) / 2
    for dx, dy in product(CENTERS, CENTERS):
        center = middle + np.array([dx, dy]) * size
        farthest = float(np.hypot(*(pixels.reshape(-1, 2) - center).T).max())
        lenses = []
        for shape, degrees in product(SHAPES, OUTERMOST_DEG):
            if shape is Perspective and degrees > 80:
                continue
            unit = shape(1.0).radius(np.radians([degrees]))[0]  # type: ignore[call-arg]
            lenses.append(shape(farthest / unit))  # type: ignore[call-arg]
        yield (float(center[0]), float(center[1])), lenses


class _Few:
    """Some points of some views, the same number of each, to try thousands of lenses on."""

    def __init__(self, views: Sequence[View]) -> None:
        thinned = [_thinned(view) for view in _spread(views)]
        self.points = np.stack([view.points for view in thinned])  # (views, n, 3)
        self.pixels = np.stack([view.pixels for view in thinned])  # (views, n, 2)
        self.flat = np.stack([_flattened(points)[0] for points in self.points])

    def errors_px(self, lenses: Sequence[Lens], center: tuple[float, float]) -> Floats:
        """(lenses,) median over the views of their median pixel error, each with its best pose."""
        offset = self.pixels - center
        radius, phi = np.hypot(offset[..., 0], offset[..., 1]), _direction(offset)
        theta = np.stack([_angles(lens, radius) for lens in lenses])  # (lenses, views, n)
        rotation, translation = _flat_pose(self.flat, _rays(theta, phi))
        seen = self.flat @ rotation[..., :2].swapaxes(-1, -2) + translation[..., None, :]
        theta = np.arctan2(np.hypot(seen[..., 0], seen[..., 1]), seen[..., 2])
        r = np.stack(
            [
                lens.radius(np.minimum(t, 0.999 * lens.hard_limit))
                for lens, t in zip(lenses, theta, strict=True)
            ]
        )
        phi = _direction(seen)
        error = np.hypot(r * np.cos(phi) - offset[..., 0], r * np.sin(phi) - offset[..., 1])
        return np.asarray(np.median(np.median(error, axis=-1), axis=-1))


def _direction(xy: Floats) -> Floats:
    return np.arctan2(xy[..., 1], xy[..., 0])


def _angles(lens: Lens, radius: Floats) -> Floats:
    """The four shapes' own inverses."""
    f = getattr(lens, "f")  # noqa: B009 - all four have one
    x = radius / f
    if isinstance(lens, Perspective):
        return np.arctan(x)
    if isinstance(lens, Stereographic):
        return 2 * np.arctan(x / 2)
    if isinstance(lens, Equidistant):
        return np.asarray(x)
    return 2 * np.arcsin(np.minimum(x / 2, 1.0))


def _rays(theta: Floats, phi: Floats) -> Floats:
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)


def _pose(points: Floats, rays: Floats, weights: Floats | None = None) -> Pose:
    """The pose of a flat target whose points (n, 3) are seen along unit rays (n, 3), linearly."""
    flat, axes, (origin, scale) = _flattened(points)
    each = None if weights is None else weights[None]
    rotation, translation = _flat_pose(flat[None], rays[None], each)
    camera_from_target = rotation[0] @ axes.T
    shift = translation[0] * scale - camera_from_target @ origin
    return Pose(Rotation.from_matrix(camera_from_target), shift)


def _flat_pose(flat: Floats, rays: Floats, weights: Floats | None = None) -> tuple[Floats, Floats]:
    """Rotations (..., 3, 3) and translations (..., 3) from points (views, n, 2) and rays.

    rays (..., views, n, 3): any number of tries; weights (views, n) of the points.
    """
    x = np.concatenate([flat, np.ones((*flat.shape[:-1], 1))], axis=-1)
    pairs = (x[..., :, None] * x[..., None, :]).reshape(*x.shape[:-1], 9)
    # |ray x (H x)|^2 = (H x)^T (I - ray ray^T) (H x), a quadratic form in the nine of H
    across = np.eye(3) - rays[..., :, None] * rays[..., None, :]
    if weights is not None:
        across = across * weights[..., None, None]
    form = across.reshape(*rays.shape[:-1], 9).swapaxes(-1, -2) @ pairs  # [ij, kl]
    form = form.reshape(*rays.shape[:-2], 3, 3, 3, 3).swapaxes(-2, -3)
    form = form.reshape(*rays.shape[:-2], 9, 9)  # [ik, jl]
    h = np.linalg.eigh(form)[1][..., 0].reshape(*rays.shape[:-2], 3, 3)
    ahead = np.sum(rays * (x @ h.swapaxes(-1, -2)), axis=(-2, -1))
    h = h * np.where(ahead < 0, -1.0, 1.0)[..., None, None]
    length = np.linalg.norm(h[..., :2], axis=-2).mean(axis=-1)
    h = h / np.maximum(length, 1e-12)[..., None, None]
    u, _, vt = np.linalg.svd(h[..., :2], full_matrices=False)
    r = u @ vt  # the two columns nearest to these that are orthonormal
    third = np.cross(r[..., 0], r[..., 1])
    return np.concatenate([r, third[..., None]], axis=-1), h[..., 2]


def _flattened(points: Floats) -> tuple[Floats, Floats, tuple[Floats, float]]:
    """Points (n, 3) as (n, 2) in their own plane, of size 1; its axes; (origin, size)."""
    origin, axes, scale = _plane(points)
    return (points - origin) @ axes[:, :2] / scale, axes, (origin, scale)


def _plane(points: Floats) -> tuple[Floats, Floats, float]:
    """Origin, right-handed axes (columns; the third is the normal) and size of flat points."""
    origin = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - origin, full_matrices=False)
    axes = axes.T * np.array([1.0, 1.0, np.sign(np.linalg.det(axes)) or 1.0])
    return origin, axes, float(spread[0] / np.sqrt(len(points)))


def _guess(
    lens: Lens,
    center: tuple[float, float],
    views: Sequence[View],
    size: tuple[int, int],
    error_px: float,
) -> Guess:
    poses = []
    for view in views:
        offset = view.pixels - center
        theta = _angles(lens, np.hypot(offset[:, 0], offset[:, 1]))
        poses.append(_pose(view.points, _rays(theta, np.arctan2(offset[:, 1], offset[:, 0]))))
    return Guess(make_camera(size, lens, center=center), tuple(poses), error_px)


def _spread(views: Sequence[View]) -> list[View]:
    """At most FEW_VIEWS of them, evenly; more say nothing new about a first guess."""
    chosen = np.unique(np.linspace(0, len(views) - 1, FEW_VIEWS).astype(int))
    return [views[i] for i in chosen]


def _thinned(view: View) -> View:
    """FEW_POINTS points of a view, the outermost of them for sure; some twice if it has fewer."""
    far = np.argsort(-np.linalg.norm(view.pixels - view.pixels.mean(0), axis=1))
    even = far[np.linspace(0, len(far) - 1, FEW_POINTS).astype(int)]
    return View(view.name, view.points[even], view.pixels[even])
