"""Bundle adjustment: lens, centre, pixel aspect and every pose at once, by least squares in pixels.

Residuals are pixel distances, and the projection takes rays at any angle, so a point beyond 90
degrees weighs like any other. Levenberg-Marquardt on the normal equations; poses meet each other
only through the camera, so they are eliminated (Schur complement) and a step costs as much as the
points are many.

Outliers: first every point counts by the Geman-McClure weight at a scale taken from the residuals
themselves; then points farther off than `REJECT` times the noise are dropped, and what is left is
solved once more by plain least squares, so that the stated uncertainty means what it says.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..errors import CalibrationError
from ..lens import Floats, image_point
from .parameters import Freedom, Parameters, difference_step
from .views import Pose, View

STEPS = 60
ENOUGH = 1e-8  # relative gain of a step that is the last
REJECT = 4.5  # times the noise per coordinate: chance drops 4 in 100,000 good points


@dataclass(frozen=True)
class Solution:
    """A camera that fits the views, and what is known about it.

    camera      with `theta_max` as it was given; see `calibrate` for the field that was seen
    poses       the target's, one for each view
    residuals   (n, 2) for each view: seen minus projected, pixels
    inliers     (n,) for each view: the points that count
    covariance  (k, k) of the free values (see `parameters`); the noise taken from the residuals
    names       of those
    condition   of the scaled normal equations of the camera alone; above 1e14 they say nothing
    noise_px    standard deviation of a coordinate, from the points that count
    """

    camera: Camera
    poses: tuple[Pose, ...]
    residuals: tuple[Floats, ...]
    inliers: tuple[NDArray[np.bool_], ...]
    covariance: Floats
    names: tuple[str, ...]
    condition: float
    noise_px: float

    @property
    def rms_px(self) -> float:
        """Root of the mean squared 2-D distance per point, over the points that count."""
        return rms(
            np.concatenate([r[ok] for r, ok in zip(self.residuals, self.inliers, strict=True)])
        )


def rms(residuals: Floats) -> float:
    """Root of the mean squared length of (n, 2) residuals."""
    return float(np.sqrt(np.mean(np.sum(residuals**2, axis=-1))))


def solve(
    camera: Camera,
    poses: Sequence[Pose],
    views: Sequence[View],
    freedom: Freedom | None = None,
    *,
    robust: bool = True,
    steps: int = STEPS,
) -> Solution:
    """Adjust everything, starting from a camera and poses that are about right.

    `robust=False` counts every point fully. `steps` bounds each minimisation. CalibrationError when
    the views do not determine the camera.
    """
    problem = _Problem(views, camera, freedom or Freedom())
    state = _State(problem.parameters.values, tuple(poses))
    counted = np.ones(problem.count)
    if robust:
        state = _graduated(problem, state, steps)
        counted = _inliers(problem, state)
    state = _minimise(problem, state, lambda _: counted, steps)
    if robust:  # the last step may have brought some back, or pushed some out
        counted = _inliers(problem, state)
        state = _minimise(problem, state, lambda _: counted, steps)
    return _solution(problem, state, counted)


def resect(camera: Camera, pose: Pose, view: View) -> tuple[Pose, Floats]:
    """The best pose of one view in a known camera, robustly, and its residuals (n, 2)."""
    problem = _Problem([view], camera, Freedom(lens=False, center=False, aspect=False))
    state = _graduated(problem, _State(np.zeros(0), (pose,)))
    return state.poses[0], problem.residuals(state)


@dataclass(frozen=True)
class _State:
    values: Floats
    poses: tuple[Pose, ...]


class _Problem:
    """The views stacked, and what a row of values means."""

    def __init__(self, views: Sequence[View], camera: Camera, freedom: Freedom) -> None:
        self.views = views
        self.parameters = Parameters(camera, freedom)
        self.pixels = np.concatenate([view.pixels for view in views])
        self.count = len(self.pixels)
        ends = np.cumsum([0, *(len(view.pixels) for view in views)])
        self.parts = [slice(a, b) for a, b in pairwise(ends)]

    def in_camera(self, poses: Sequence[Pose]) -> Floats:
        seen = [pose.apply(v.points) for pose, v in zip(poses, self.views, strict=True)]
        return np.concatenate(seen)

    def residuals(self, state: _State) -> Floats:
        camera = self.parameters.camera_of(state.values)
        return self.pixels - project(camera, self.in_camera(state.poses))


def project(camera: Camera, points: Floats) -> Floats:
    """As `Camera.project`, but never NaN: beyond the formula's end a point stays at its end.

    What lies out there is wrong anyway; a solver has to find its way back from it.
    """
    across = np.hypot(points[:, 0], points[:, 1])
    theta = np.arctan2(across, points[:, 2])
    theta = np.minimum(theta, camera.lens.hard_limit * (1 - 1e-6))
    at = image_point(camera.lens, theta, np.arctan2(points[:, 1], points[:, 0]))
    return np.asarray(camera.center) + at @ camera.stretch.T


_Weights = Callable[[Floats], Floats]


def _graduated(problem: _Problem, state: _State, steps: int = STEPS) -> _State:
    """Robust steps: the scale follows the residuals down to their noise."""
    for _ in range(6):
        scale = 3 * max(_noise(problem.residuals(state)), 1e-6)
        before = scale
        state = _minimise(problem, state, _geman_mcclure(scale), steps)
        if _noise(problem.residuals(state)) * 3 > 0.95 * before:
            break
    return state


def _inliers(problem: _Problem, state: _State) -> Floats:
    residuals = problem.residuals(state)
    limit = REJECT * max(_noise(residuals), 1e-6)
    return (np.sqrt(_squares(residuals)) <= limit).astype(float)


def _noise(residuals: Floats) -> float:
    """Standard deviation per coordinate, from the median length (Rayleigh: 1.1774 sigma)."""
    return float(np.median(np.sqrt(_squares(residuals)))) / 1.1774


def _squares(residuals: Floats) -> Floats:
    return np.asarray(np.sum(residuals**2, axis=-1))


def _geman_mcclure(scale: float) -> _Weights:
    return lambda residuals: np.asarray((1 + _squares(residuals) / scale**2) ** -2)


def _minimise(problem: _Problem, state: _State, weights_of: _Weights, steps: int = STEPS) -> _State:
    """Levenberg-Marquardt with weights that follow the residuals."""
    damping = 1e-3
    residuals = problem.residuals(state)
    for _ in range(steps):
        weights = weights_of(residuals)
        cost = float(weights @ _squares(residuals))
        equations = _Equations.of(problem, state, residuals, weights)
        while True:
            step = equations.step(damping)
            moved = _moved(state, step, len(problem.parts)) if step is not None else None
            if moved is not None:
                new = _tried(problem, moved)
                if new is not None and float(weights @ _squares(new)) < cost:
                    break
            damping *= 8
            if damping > 1e10:
                return state
        gain = 1 - float(weights @ _squares(new)) / cost
        state, residuals, damping = moved, new, max(damping / 6, 1e-12)
        if gain < ENOUGH:
            return state
    return state


def _tried(problem: _Problem, state: _State) -> Floats | None:
    """The residuals at a new state; None where the lens is no lens any more."""
    try:
        with np.errstate(all="raise", under="ignore"):
            residuals = problem.residuals(state)
    except FloatingPointError:
        return None
    return residuals if np.isfinite(residuals).all() else None


def _moved(state: _State, step: tuple[Floats, Floats], count: int) -> _State:
    values, turns = step
    poses = tuple(
        Pose(
            Rotation.from_rotvec(turns[i, :3]) * state.poses[i].camera_from_target,
            state.poses[i].translation + turns[i, 3:],
        )
        for i in range(count)
    )
    return _State(state.values + values, poses)


@dataclass(frozen=True)
class _Equations:
    """The normal equations in blocks: camera, poses, and between them."""

    camera: Floats  # (k, k)
    between: Floats  # (views, k, 6)
    poses: Floats  # (views, 6, 6)
    camera_right: Floats  # (k,)
    poses_right: Floats  # (views, 6)

    @classmethod
    def of(cls, problem: _Problem, state: _State, residuals: Floats, weights: Floats) -> _Equations:
        by_camera, by_pose = slopes(problem, state)
        weighted = by_camera * weights[:, None, None]
        camera = np.einsum("nik,nil->kl", weighted, by_camera)
        right = np.einsum("nik,ni->k", weighted, residuals)
        between, poses, poses_right = [], [], []
        for part in problem.parts:
            own = by_pose[part]
            heavy = own * weights[part][:, None, None]
            between.append(np.einsum("nik,nil->kl", by_camera[part], heavy))
            poses.append(np.einsum("nik,nil->kl", heavy, own))
            poses_right.append(np.einsum("nik,ni->k", heavy, residuals[part]))
        return cls(camera, np.array(between), np.array(poses), right, np.array(poses_right))

    def step(self, damping: float) -> tuple[Floats, Floats] | None:
        """(camera values, pose changes (views, 6)), or None where the equations say nothing."""
        poses = self.poses + _diagonal(self.poses, damping)
        camera = self.camera + _diagonal(self.camera, damping)
        try:
            inverse = np.linalg.inv(poses)
            through = np.einsum("vkp,vpq->vkq", self.between, inverse)
            left = camera - np.einsum("vkq,vlq->kl", through, self.between)
            right = self.camera_right - np.einsum("vkq,vq->k", through, self.poses_right)
            values = _scaled_solve(left, right)
        except (np.linalg.LinAlgError, FloatingPointError):
            return None
        back = self.poses_right - np.einsum("vkp,k->vp", self.between, values)
        return values, np.einsum("vpq,vq->vp", inverse, back)

    def information(self) -> Floats:
        """(k, k) of the camera alone, the poses eliminated."""
        through = np.einsum("vkp,vpq->vkq", self.between, np.linalg.inv(self.poses))
        return np.asarray(self.camera - np.einsum("vkq,vlq->kl", through, self.between))


def _diagonal(blocks: Floats, damping: float) -> Floats:
    size = blocks.shape[-1]
    own = np.einsum("...ii->...i", blocks)
    return np.asarray(np.eye(size) * (damping * own + 1e-30)[..., None, :])


def _scaled_solve(left: Floats, right: Floats) -> Floats:
    """Pixels and k4 differ by ten orders of magnitude: solve with a unit diagonal."""
    if not len(left):
        return np.zeros(0)
    scale = 1 / np.sqrt(np.maximum(np.diag(left), 1e-300))
    return np.asarray(scale * np.linalg.solve(left * np.outer(scale, scale), right * scale))


def slopes(problem: _Problem, state: _State) -> tuple[Floats, Floats]:
    """d pixel / d values (n, 2, k) and d pixel / d (rotation vector, translation) (n, 2, 6)."""
    camera, points = problem.parameters.camera_of(state.values), problem.in_camera(state.poses)
    by_camera = value_slopes(problem.parameters, state.values, points)
    by_point = point_slopes(camera, points)
    by_pose = np.empty((problem.count, 2, 6))
    for part, pose in zip(problem.parts, state.poses, strict=True):
        turned = points[part] - pose.translation
        by_pose[part, :, :3] = -np.einsum("nij,njk->nik", by_point[part], cross_matrices(turned))
    by_pose[:, :, 3:] = by_point
    return by_camera, by_pose


def value_slopes(parameters: Parameters, values: Floats, points: Floats) -> Floats:
    """d pixel / d values (n, 2, k) of points in the camera frame, by central differences."""
    columns = np.empty((len(points), 2, len(values)))
    for i, value in enumerate(values):
        step = np.zeros(len(values))
        step[i] = difference_step(value)
        ahead = project(parameters.camera_of(values + step), points)
        behind = project(parameters.camera_of(values - step), points)
        columns[:, :, i] = (ahead - behind) / (2 * step[i])
    return columns


def point_slopes(camera: Camera, points: Floats) -> Floats:
    """d pixel / d point in the camera frame, (n, 2, 3), by central differences."""
    h = 1e-6 * np.linalg.norm(points, axis=1, keepdims=True)
    columns = [
        (project(camera, points + h * axis) - project(camera, points - h * axis)) / (2 * h)
        for axis in np.eye(3)
    ]
    return np.stack(columns, axis=-1)


def cross_matrices(v: Floats) -> Floats:
    """[v]x for many v: [v]x @ w = v x w."""
    zero = np.zeros(len(v))
    x, y, z = v.T
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)


def _solution(problem: _Problem, state: _State, counted: Floats) -> Solution:
    residuals = problem.residuals(state)
    information = _Equations.of(problem, state, residuals, counted).information()
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    unit = information * np.outer(scale, scale)
    condition = float(np.linalg.cond(unit)) if len(unit) else 1.0
    if not np.isfinite(condition) or condition > 1e14:
        raise CalibrationError(
            "these views do not determine the camera; add views with the target tilted, near the "
            "rim and at other distances"
        )
    unknowns = len(state.values) + 6 * len(problem.parts)
    surplus = 2 * int(counted.sum()) - unknowns
    if surplus < 1:
        raise CalibrationError(
            f"{int(counted.sum())} points are too few for {unknowns} unknowns; add views"
        )
    variance = float(counted @ _squares(residuals)) / surplus
    return Solution(
        problem.parameters.camera_of(state.values),
        state.poses,
        tuple(residuals[part] for part in problem.parts),
        tuple(counted[part] > 0 for part in problem.parts),
        variance * np.linalg.inv(unit) * np.outer(scale, scale),
        problem.parameters.names,
        condition,
        float(np.sqrt(variance)),
    )
