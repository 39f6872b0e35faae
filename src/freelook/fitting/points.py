"""A whole camera from 3-D points and the pixels where they are seen."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera, make_camera
from ..errors import FitError, ProfileError
from ..lens import MODELS, Floats, Lens, vector
from ..rotations import RDF_FROM_FRD
from ._camera_problem import STRETCHES, CameraProblem
from ._curve_data import checked
from ._grown import HELD_SLOPES, grown
from ._minimum import FAIR, LOSSES, Minimum
from ._models import check_end, check_growth, known_model, radius_of
from ._scores import Scored, log_likelihood
from .curve import best_curve

NOT_POINTS = {"splined_stereographic": "its surface has far more parameters than points"}
GROUPS = 10


def point_models() -> list[str]:
    """Names of the models that can be fitted to points."""
    return [name for name in MODELS if name not in NOT_POINTS]


@dataclass(frozen=True)
class PointFit(Scored):
    """A camera fitted to points seen at pixels.

    model         the lens's name in `MODELS`
    camera        its field ends at the outermost point: nothing is known beyond
    names         the fitted parameters: the lens's, center_x, center_y, those of the stretch, and
                  of the pose, if sought, six small changes: turn_x_rad ... move_z
    residuals_px  (n, 2) measured minus projected
    camera_from_points   rotation and translation; none (identity, 0) unless sought
    """

    model: str
    camera: Camera
    names: tuple[str, ...]
    residuals_px: Floats
    camera_from_points: tuple[Rotation, Floats]
    _problem: CameraProblem = field(repr=False)
    _minimum: Minimum = field(repr=False)

    @cached_property
    def cv_residuals_px(self) -> Floats:
        """(n, 2) how far each point is from a fit that has not seen it: ten groups in turn."""
        problem, n = self._problem, len(self.residuals_px)
        theta, _ = problem.angles(self._minimum.x)
        order = np.argsort(theta, kind="stable")
        residuals = np.empty((n, 2))
        for group in range(min(GROUPS, n)):
            out = np.zeros(n, bool)
            out[order[group :: min(GROUPS, n)]] = True
            seen, unseen = (
                replace(problem, points=problem.points[part], pixel=problem.pixel[part])
                for part in (~out, out)
            )
            found = seen.fit(
                self._minimum.x,
                self.camera.theta_max,
                loss=self._minimum.loss,
                scale=self._minimum.scale,
                least_slope=HELD_SLOPES[-2] if self.forced else None,
                effort=FAIR,
            )
            residuals[out] = unseen.residuals_px(found.x)
        return residuals

    @property
    def measured(self) -> tuple[Floats, Floats]:
        """(theta in radians, radius in pixels) of the points, before centre and stretch."""
        theta, _ = self._problem.angles(self._minimum.x)
        return theta, np.linalg.norm(self._image_points, axis=1)

    def __call__(self, theta: Floats) -> Floats:
        """The lens's radius at angles in radians, pixels."""
        return radius_of(self.camera.lens, np.asarray(theta, dtype=float))

    def band(self, theta: Floats) -> Floats:
        """Standard deviation of that radius, from the covariance; centre and stretch left aside."""
        theta = np.asarray(theta, dtype=float)
        x, count = self._minimum.x, int(self._problem.free.sum())
        slopes = []
        for step in np.diag(self._minimum.step)[:count]:
            ahead, behind = self._problem.lens(x + step), self._problem.lens(x - step)
            if ahead is None or behind is None:
                return np.full(theta.shape, np.nan)
            slopes.append((radius_of(ahead, theta) - radius_of(behind, theta)) / (2 * step.max()))
        part = self.covariance[:count, :count]
        variance = np.einsum("i...,ij,j...->...", np.stack(slopes), part, np.stack(slopes))
        return np.asarray(np.sqrt(np.maximum(variance, 0)))

    @property
    def radial_residuals_px(self) -> Floats:
        """(n,) the part of the residuals that points away from the axis."""
        point = self._image_points
        away = point / np.maximum(np.linalg.norm(point, axis=1), 1e-12)[:, None]
        return np.asarray(np.sum(self.residuals_px * away, axis=1))

    @property
    def _image_points(self) -> Floats:
        camera = self.camera
        return (self._problem.pixel - camera.center) @ np.linalg.inv(camera.stretch).T

    @property
    def _size_px(self) -> float:
        return self._problem.size_px

    @cached_property
    def _log_likelihood(self) -> float:
        floor = 1e-9 * self._problem.size_px
        return log_likelihood(self._minimum.values, self._minimum.loss, floor)


def fit_points(
    model: str,
    points: Floats,
    pixel: Floats,
    size: tuple[int, int],
    *,
    stretch: str = "aspect",
    pose: tuple[Rotation, Floats] | None = None,
    loss: str = "soft_l1",
) -> PointFit:
    """The camera of a model that sees 3-D points nearest to where they were seen.

    points   (n, 3) in the camera frame (x right, y down, z forward), of any unit and, unless the
             pose is sought, of any distance
    pixel    (n, 2) where they were seen; (0, 0) is the middle of the top left pixel
    size     (width, height) of the picture
    stretch  what of it is sought: "free", "skew", "aspect" (fx and fy differ) or "none"
    pose     seek camera_from_points too, from this rotation and translation on; `points` may
             then be in any frame
    loss     "soft_l1" or "cauchy" against outliers, per coordinate; "linear"

    FitError for too few or impossible points, for points that run against the pixels, and where
    no lens of the model that grows all the way comes near.
    """
    points, pixel = _checked(model, points, pixel, stretch, loss)
    problem, start = _started(model, points, pixel, stretch, pose, loss)
    if 2 * len(points) <= len(start):
        raise FitError(
            f"{model} has {len(start)} parameters here; it needs {len(start) // 2 + 1} points, "
            f"not {len(points)}"
        )
    theta_max = float(problem.angles(start)[0].max())

    def fit(x: Floats, least_slope: float | None) -> Minimum:
        return problem.fit(x, theta_max, loss=loss, least_slope=least_slope)

    found = grown(fit, problem.lens, start, theta_max)
    theta_max = float(problem.angles(found.x)[0].max())
    return PointFit(
        model=model,
        camera=_camera(model, problem, found, size, theta_max),
        names=problem.names,
        residuals_px=problem.residuals_px(found.x),
        camera_from_points=problem.pose_of(found.x),
        _problem=problem,
        _minimum=found,
    )


def _checked(
    model: str, points: Floats, pixel: Floats, stretch: str, loss: str
) -> tuple[Floats, Floats]:
    known_model(model)
    if model in NOT_POINTS:
        raise FitError(f"{model} cannot be fitted to points; {NOT_POINTS[model]}")
    for name, value, known in (("stretch", stretch, STRETCHES), ("loss", loss, LOSSES)):
        if value not in known:
            raise FitError(f"unknown {name} '{value}'; known: {', '.join(known)}")
    points, pixel = np.asarray(points, dtype=float), np.asarray(pixel, dtype=float)
    if points.shape != (len(points), 3) or pixel.shape != (len(points), 2):
        raise FitError(
            f"points must be n rows of x, y, z and pixels n rows of u, v, not of shapes "
            f"{points.shape} and {pixel.shape}"
        )
    if not (np.isfinite(points).all() and np.isfinite(pixel).all()):
        raise FitError("points and pixels must be finite numbers")
    if len(points) < 4:
        raise FitError(f"{len(points)} points are too few for any lens")
    if not (np.linalg.norm(points, axis=1) > 0).all():
        raise FitError("a point lies in the camera itself, at 0, 0, 0")
    return points, pixel


def _started(
    model: str,
    points: Floats,
    pixel: Floats,
    which: str,
    pose: tuple[Rotation, Floats] | None,
    loss: str,
) -> tuple[CameraProblem, Floats]:
    """From an equidistant lens, which is linear in all it has, to one of the model."""
    turn, move = pose or (Rotation.identity(), np.zeros(3))
    x, y, z = (turn.apply(points) + move).T
    theta, phi = np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
    check_end(model, float(theta.max()))
    center, matrix = _equidistant(theta, phi, pixel)
    stretch = matrix / matrix[0, 0]
    allowed = np.eye(2, dtype=bool)
    for entry in STRETCHES[which]:
        allowed[entry] = True
    stretch = np.where(allowed, stretch, 0.0)
    if which == "none":
        stretch = np.eye(2)
    radius = np.linalg.norm((pixel - center) @ np.linalg.inv(stretch).T, axis=1)
    curve, found = best_curve(model, checked(theta, radius, None, False, loss))
    lens = curve.lens(found.x)
    if lens is None:
        raise FitError(f"no {model} lens comes near these points")
    free = np.ones(len(vector(lens)), bool)
    problem = CameraProblem(points, pixel, lens, free, stretch, which, pose)
    return problem, problem.start(center)


def _equidistant(theta: Floats, phi: Floats, pixel: Floats) -> tuple[Floats, Floats]:
    """(center, f * stretch) of the equidistant lens that suits most points."""
    columns = np.stack([np.ones_like(theta), theta * np.cos(phi), theta * np.sin(phi)], axis=-1)
    weight = np.ones(len(theta))
    for _ in range(20):  # towards least absolute deviations: outliers do not pull
        answer = np.linalg.lstsq(columns * weight[:, None], pixel * weight[:, None])[0]
        miss = np.linalg.norm(pixel - columns @ answer, axis=1)
        weight = 1 / np.sqrt(np.maximum(miss, 1e-3 * miss.max() + 1e-12))
    matrix = answer[1:].T
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0 or np.linalg.det(matrix) <= 0:
        raise FitError(
            "the pixels run against the points: x must be right, y down and z forward in the "
            "camera, u right and v down in the picture"
        )
    return np.asarray(answer[0]), np.asarray(matrix)


def _camera(
    model: str, problem: CameraProblem, found: Minimum, size: tuple[int, int], theta_max: float
) -> Camera:
    lens: Lens | None = problem.lens(found.x)
    if lens is None:
        raise FitError(f"no {model} lens comes near these points")
    check_growth(lens, theta_max, model)
    try:
        return make_camera(
            size,
            lens,
            center=problem.center(found.x),
            field_deg=float(np.degrees(2 * theta_max)) * (1 - 1e-9),
            stretch=problem.stretch_of(found.x),
            camera_from_body=RDF_FROM_FRD,
        )
    except ProfileError as error:
        raise FitError(f"{model}: {error}") from None
