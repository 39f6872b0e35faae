"""Two cameras on one rig: both lenses, and how the right one stands to the left, in one solve.

    each camera alone -> which corner is which in both -> one place of the right camera that all
    pairs agree on -> bundle adjustment of everything

A moment may have only one of its two pictures: it still says something about that lens. Everything
is in the unit of the target's sizes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..errors import CalibrationError
from ..lens import Floats
from ..rotations import RDF_FROM_FRD
from ._correspondence import Sight, matched
from .bundle import Adjusted, Problem, State, adjusted, rms
from .calibrate import Calibration, Progress, calibrate
from .field import with_field
from .parameters import Freedom, Parameters
from .slopes import cross_matrices, point_slopes, project, value_slopes
from .views import Pose, View

SIDES = ("left", "right")
ALONG_DEG = 5.0  # rays nearer to the baseline than this have no epipolar plane to speak of


@dataclass(frozen=True)
class Moment:
    """What both cameras saw at one time; either view may be missing."""

    name: str
    left: View | None
    right: View | None


@dataclass(frozen=True)
class StereoCalibration:
    """The result.

    left, right      cameras, each mounted so that both look the same way: the rig's mean direction
    right_from_left  x_right = right_from_left.apply(x_left) + translation, in camera frames
    translation      in the target's unit
    turn_sigma_deg   standard deviations of the rotation, about the right camera's x, y and z
    shift_sigma      (3,) of the translation
    baseline_sigma   of its length
    rms_px           of each camera (left, right): 2-D, per point, over the points that count
    epipolar_deg     (n,) angle of each point's right ray from its epipolar plane, without sign
    pairs, singles   how many moments with both views, and with one
    covariance       of the free values: left camera's, right camera's, rotation, translation
    dropped          (name, why) of views and of pairs that do not fit
    rejected         points that do not count
    alone            each camera calibrated alone, for comparison
    """

    left: Camera
    right: Camera
    right_from_left: Rotation
    translation: Floats
    turn_sigma_deg: Floats
    shift_sigma: Floats
    baseline_sigma: float
    rms_px: tuple[float, float]
    epipolar_deg: Floats
    pairs: int
    singles: int
    covariance: Floats
    names: tuple[str, ...]
    dropped: tuple[tuple[str, str], ...]
    rejected: int
    alone: tuple[Calibration, Calibration]

    @property
    def baseline(self) -> float:
        """The distance between the cameras, in the target's unit."""
        return float(np.linalg.norm(self.translation))

    @property
    def right_in_body(self) -> Floats:
        """Where the right camera is, seen from the left one: forward, right, down of the rig."""
        right_in_left = -self.right_from_left.inv().apply(self.translation)
        return np.asarray(self.left.camera_from_body.inv().apply(right_in_left))

    @property
    def swapped(self) -> bool:
        """Whether the right camera stands to the left of the left one."""
        return bool(self.right_in_body[1] < -0.5 * self.baseline)


def calibrate_stereo(
    moments: Sequence[Moment],
    sizes: tuple[tuple[int, int], tuple[int, int]],
    model: str = "auto",
    freedom: Freedom | None = None,
    *,
    ambiguous: bool = True,
    board: tuple[int, int] | None = None,
    progress: Progress = lambda _: None,
) -> StereoCalibration:
    """Calibrate both cameras and the rig.

    sizes      of the left and of the right picture
    ambiguous  the target's points are a grid without names (a chessboard), numbered anyhow
    board      its points across and down, for pairs that show only a part; None: as many as seen

    CalibrationError when one camera cannot be calibrated (which one is said), when no picture
    pair shows the target in both, or when the pairs do not agree on one rig.
    """
    freedom = freedom or Freedom()
    alone = _alone(moments, sizes, model, freedom, progress)
    progress("rig")
    kept, start = _start(moments, alone, ambiguous, board)
    problem = _RigProblem(kept.views, (alone[0].solution.camera, alone[1].solution.camera), freedom)
    state = State.of(problem.start(start), kept.poses)
    progress("both cameras and the rig")
    found = adjusted(problem, state)
    return _result(problem, found, kept, alone)


_Pair = tuple[View | None, View | None]


@dataclass(frozen=True)
class _Rig:
    turn: Floats  # (3, 3)
    shift: Floats  # (3,)


@dataclass(frozen=True)
class _Kept:
    """Moments that are used: views in one numbering, the target's pose in the left camera."""

    views: list[_Pair]
    poses: list[Pose]
    dropped: tuple[tuple[str, str], ...]


def _alone(
    moments: Sequence[Moment],
    sizes: tuple[tuple[int, int], tuple[int, int]],
    model: str,
    freedom: Freedom,
    progress: Progress,
) -> tuple[Calibration, Calibration]:
    found = []
    for side, size in zip(SIDES, sizes, strict=True):
        views = [view for m in moments if (view := getattr(m, side)) is not None]
        if not views:
            raise CalibrationError(f"the target was not found in any picture of the {side} camera")
        progress(f"{side} camera")
        try:
            found.append(calibrate(views, size, model, freedom))
        except CalibrationError as error:
            raise CalibrationError(f"{side} camera: {error}") from None
    return found[0], found[1]


def _start(
    moments: Sequence[Moment],
    alone: tuple[Calibration, Calibration],
    ambiguous: bool,
    board: tuple[int, int] | None,
) -> tuple[_Kept, _Rig]:
    """Moments as the solve takes them, and a rig to start from."""
    left, right = (
        {id(view): pose for view, pose in zip(c.views, c.solution.poses, strict=True)}
        for c in alone
    )
    both = [m for m in moments if id(m.left) in left and id(m.right) in right]
    if not both:
        raise CalibrationError(
            "no moment shows the target in both pictures; pictures that belong together need the "
            "same name or number, and the target has to be where both cameras see it"
        )
    sights = [_sight(m, left, right) for m in both]
    relations, turn, shift = matched(sights, ambiguous=ambiguous, board=board)
    agreeing = [m for m, relation in zip(both, relations, strict=True) if relation is not None]
    if len(both) > 2 and len(agreeing) <= len(both) / 3:
        raise CalibrationError(
            f"only {len(agreeing)} of {len(both)} pairs agree on how the cameras stand to each "
            "other; were both pictures of a pair taken at the same moment, is the rig rigid, and "
            "is --board right?"
        )
    rig = _Rig(turn, shift)
    views: list[_Pair] = []
    poses: list[Pose] = []
    dropped = [entry for c in alone for entry in c.dropped]
    relation_of = {id(m): r for m, r in zip(both, relations, strict=True)}
    for m in moments:
        relation = relation_of.get(id(m))
        if relation is not None and m.right is not None:
            views.append((m.left, relation.relabelled(m.right)))
            poses.append(left[id(m.left)])
            continue
        if id(m) in relation_of:
            dropped.append(
                (m.name, "left and right do not fit the rig: taken at different moments?")
            )
        if id(m.left) in left:
            views.append((m.left, None))
            poses.append(left[id(m.left)])
        if id(m.right) in right:
            views.append((None, m.right))
            poses.append(_in_left(rig, right[id(m.right)]))
    return _Kept(views, poses, tuple(dropped)), rig


def _sight(moment: Moment, left: dict[int, Pose], right: dict[int, Pose]) -> Sight:
    assert moment.left is not None
    assert moment.right is not None
    return Sight(moment.left, moment.right, left[id(moment.left)], right[id(moment.right)])


def _in_left(rig: _Rig, pose: Pose) -> Pose:
    """A pose in the right camera, as it is in the left one."""
    back = Rotation.from_matrix(rig.turn.T)
    return Pose(back * pose.camera_from_target, back.apply(pose.translation - rig.shift))


class _RigProblem(Problem):
    """Values: of the left camera, of the right one, the rig's rotation vector and translation.

    The rotation vector is a turn of the right camera away from the rig that was started from.
    """

    def __init__(
        self, views: Sequence[_Pair], cameras: tuple[Camera, Camera], freedom: Freedom
    ) -> None:
        self.parameters = [Parameters(camera, freedom) for camera in cameras]
        each = [(i, side, v) for i, pair in enumerate(views) for side, v in enumerate(pair) if v]
        self.points = np.concatenate([v.points for _, _, v in each])
        self.pixels = np.concatenate([v.pixels for _, _, v in each])
        self.count = len(self.pixels)
        counts = [len(v.pixels) for _, _, v in each]
        self.view_of = np.repeat([i for i, _, _ in each], counts)
        self.side = np.repeat([side for _, side, _ in each], counts)
        ends = np.searchsorted(self.view_of, np.arange(len(views) + 1))
        self.parts = [slice(int(a), int(b)) for a, b in pairwise(ends)]
        self._turn = np.eye(3)

    def start(self, rig: _Rig) -> Floats:
        """The values of the cameras as they are, on this rig."""
        self._turn = rig.turn
        cameras = [p.values for p in self.parameters]
        return np.concatenate([*cameras, np.zeros(3), rig.shift])

    @property
    def names(self) -> tuple[str, ...]:
        cameras = [
            f"{side}.{name}"
            for side, p in zip(SIDES, self.parameters, strict=True)
            for name in p.names
        ]
        return (*cameras, "turn_x", "turn_y", "turn_z", "shift_x", "shift_y", "shift_z")

    def split(self, values: Floats) -> tuple[Floats, Floats]:
        """The values of each camera."""
        count = len(self.parameters[0].values)
        return values[:count], values[count:-6]

    def cameras(self, values: Floats) -> tuple[Camera, Camera]:
        left, right = (
            p.camera_of(v) for p, v in zip(self.parameters, self.split(values), strict=True)
        )
        return left, right

    def rig(self, values: Floats) -> _Rig:
        return _Rig(Rotation.from_rotvec(values[-6:-3]).as_matrix() @ self._turn, values[-3:])

    def in_cameras(self, state: State) -> tuple[Floats, Floats, Floats]:
        """Points turned by their pose, in the left camera, and each in its own camera (n, 3)."""
        turned = (state.turns[self.view_of] @ self.points[:, :, None])[:, :, 0]
        left = turned + state.shifts[self.view_of]
        rig = self.rig(state.values)
        own = np.where(self.side[:, None] == 1, left @ rig.turn.T + rig.shift, left)
        return turned, left, own

    def residuals(self, state: State) -> Floats:
        own = self.in_cameras(state)[2]
        at = np.empty((self.count, 2))
        for side, camera in enumerate(self.cameras(state.values)):
            at[self.side == side] = project(camera, own[self.side == side])
        return self.pixels - at

    def slopes(self, state: State) -> tuple[Floats, Floats]:
        turned, _, own = self.in_cameras(state)
        rig = self.rig(state.values)
        by_values = np.zeros((self.count, 2, len(state.values)))
        by_left = np.empty((self.count, 2, 3))  # d pixel / d point in the left camera
        first = 0
        cameras, split = self.cameras(state.values), self.split(state.values)
        for side, (camera, values) in enumerate(zip(cameras, split, strict=True)):
            own_side = self.side == side
            at = own[own_side]
            columns = slice(first, first + len(values))
            by_values[own_side, :, columns] = value_slopes(self.parameters[side], values, at)
            by_point = point_slopes(camera, at)
            by_left[own_side] = by_point @ rig.turn if side else by_point
            if side:
                crossed = cross_matrices(at - rig.shift) @ _left_jacobian(state.values[-6:-3])
                by_values[own_side, :, -6:-3] = -by_point @ crossed
                by_values[own_side, :, -3:] = by_point
            first += len(values)
        by_turn = -by_left @ cross_matrices(turned)
        return by_values, np.concatenate([by_turn, by_left], axis=-1)


def _left_jacobian(v: Floats) -> Floats:
    """d (rotation of v + dv) ~ rotation of (J dv) after that of v; v is a rotation vector (3,)."""
    angle = float(np.linalg.norm(v))
    cross = cross_matrices(v[None])[0]
    if angle < 1e-6:
        return np.eye(3) + cross / 2
    a, b = (1 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + a * cross + b * cross @ cross)


def _result(
    problem: _RigProblem, found: Adjusted, kept: _Kept, alone: tuple[Calibration, Calibration]
) -> StereoCalibration:
    values, covariance = found.state.values, found.covariance
    rig = problem.rig(values)
    turn = Rotation.from_matrix(rig.turn)
    mounts = _mounts(turn)
    own = problem.in_cameras(found.state)[2]
    cameras, errors = [], []
    for side, camera in enumerate(problem.cameras(values)):
        counted = found.counted & (problem.side == side)
        seen = _off_axis(own[counted]).max(initial=0.0)
        cameras.append(replace(with_field(camera, seen), camera_from_body=mounts[side]))
        errors.append(rms(found.residuals[counted]))
    jacobian = _left_jacobian(values[-6:-3])
    turned = jacobian @ covariance[-6:-3, -6:-3] @ jacobian.T
    moved = covariance[-3:, -3:]
    length = float(np.linalg.norm(rig.shift))
    along = rig.shift / length
    return StereoCalibration(
        cameras[0],
        cameras[1],
        turn,
        rig.shift,
        np.degrees(np.sqrt(np.diag(turned))),
        np.sqrt(np.diag(moved)),
        float(np.sqrt(along @ moved @ along)),
        (errors[0], errors[1]),
        _epipolar_deg(problem, found, rig, (cameras[0], cameras[1])),
        sum(left is not None and right is not None for left, right in kept.views),
        sum(left is None or right is None for left, right in kept.views),
        covariance,
        problem.names,
        kept.dropped,
        int((~found.counted).sum()),
        alone,
    )


def _mounts(turn: Rotation) -> tuple[Rotation, Rotation]:
    """camera_from_body of both, for a body that looks the mean way of the two."""
    half = Rotation.from_rotvec(turn.as_rotvec() / 2)
    return half.inv() * RDF_FROM_FRD, half * RDF_FROM_FRD


def _off_axis(points: Floats) -> Floats:
    return np.asarray(np.arctan2(np.hypot(points[:, 0], points[:, 1]), points[:, 2]))


def _epipolar_deg(
    problem: _RigProblem, found: Adjusted, rig: _Rig, cameras: tuple[Camera, Camera]
) -> Floats:
    """Of points that count in both pictures: the right ray's angle from the epipolar plane (n,).

    The plane holds the left ray and the baseline; rays nearer than ALONG_DEG to it are left out.
    """
    seen: list[dict[tuple[int, ...], Floats]] = []
    unit = float(np.ptp(problem.points, axis=0).max()) * 1e-6
    for side, camera in enumerate(cameras):
        chosen = np.flatnonzero(found.counted & (problem.side == side))
        rays = camera.ray(problem.pixels[chosen])
        named = np.rint(problem.points[chosen] / unit).astype(np.int64)
        keys = (
            (int(part), *map(int, name))
            for part, name in zip(problem.view_of[chosen], named, strict=True)
        )
        seen.append(dict(zip(keys, rays, strict=True)))
    shared = [key for key in seen[0] if key in seen[1]]
    if not shared:
        return np.zeros(0)
    left = np.array([seen[0][key] for key in shared]) @ rig.turn.T
    right = np.array([seen[1][key] for key in shared])
    normal = np.cross(rig.shift / np.linalg.norm(rig.shift), left)
    sine = np.linalg.norm(normal, axis=1)
    plane = sine > np.sin(np.radians(ALONG_DEG))
    away = np.sum(normal[plane] * right[plane], axis=1) / sine[plane]
    return np.degrees(np.abs(np.arcsin(np.clip(away, -1, 1))))
