"""How a camera is fixed to its vehicle, from things whose direction from the vehicle is known.

Points: rays of picture points against their directions from the vehicle (Wahba's problem, solved
by Kabsch's method). Horizon: in every frame the plane of the skyline against the vehicle's roll
and pitch; robustly, all frames together.

A level vehicle's horizon says nothing about yaw. Frames with the vehicle banked or pitched
differently do: a camera that looks to the right sees a bank partly as a change of pitch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..errors import CalibrationError
from ..lens import Floats
from ..rotations import body_from_view, head_angles_deg
from .horizon import HEIGHT_SIGMA_DEG, Horizon

CLICK_PX = 1.0  # how well a point is known at best
WRONG_DEG = 10.0  # points that are farther off contradict each other,
AGREE_DEG = 3.0  # and horizons
APART_DEG = 5.0  # points closer together say nothing about the turn around them
YAW_DEG = 2.0  # a yaw known less well than this is left as it was told
POINTS_PER_FRAME = 120
PARTS = 12  # of a skyline; within one its points err together, as on one hill
ATTITUDE_DEG = 0.1  # roll and pitch of a vehicle are known no better
DOWN = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Mounting:
    """The result.

    camera_from_body  as in a lens profile
    sigma_deg         standard deviations of yaw, pitch and roll; NaN for a yaw that was told
    errors_deg        what is left of every point or frame that counts, by name
    dropped           the others, with the reason
    height_deg        of the skylines above the horizon, their mean; None if points were used
    """

    camera_from_body: Rotation
    sigma_deg: tuple[float, float, float]
    errors_deg: tuple[tuple[str, float], ...]
    dropped: tuple[tuple[str, str], ...] = ()
    height_deg: float | None = None

    @property
    def angles_deg(self) -> tuple[float, float, float]:
        """(yaw, pitch, roll), as in `mount_deg`: right, up, right side down."""
        return head_angles_deg(self.camera_from_body.inv())

    @property
    def yaw_found(self) -> bool:
        """False where the yaw is as it was told."""
        return bool(np.isfinite(self.sigma_deg[0]))


@dataclass(frozen=True)
class KnownPoint:
    """A pixel (x, y), and where from the vehicle that is: yaw to the right, pitch up, degrees."""

    pixel: tuple[float, float]
    yaw_deg: float
    pitch_deg: float

    @property
    def name(self) -> str:
        return "{:g},{:g}".format(*self.pixel)

    @property
    def direction_in_body(self) -> Floats:
        return np.asarray(body_from_view(self.yaw_deg, self.pitch_deg).apply([0.0, 0.0, 1.0]))


@dataclass(frozen=True)
class LevelledFrame:
    """The skyline of one frame, and how the vehicle was turned: right side down, nose up."""

    name: str
    horizon: Horizon
    roll_deg: float
    pitch_deg: float

    @property
    def down_in_body(self) -> Floats:
        return down_in_body(self.roll_deg, self.pitch_deg)


def down_in_body(roll_deg: float, pitch_deg: float) -> Floats:
    """Where down is, in a vehicle at these angles (of an autopilot: yaw, then pitch, then roll)."""
    world_from_body = Rotation.from_euler("YX", [pitch_deg, roll_deg], degrees=True)
    return np.asarray(world_from_body.inv().apply(DOWN))


def mounting_from_points(camera: Camera, points: Sequence[KnownPoint]) -> Mounting:
    """The mounting from two or more points in one picture.

    CalibrationError names a point outside the lens's field, points that contradict each other,
    and points too close together.
    """
    if len(points) < 2:
        raise CalibrationError(
            f"{len(points)} point with a known direction; two are needed, better three, far apart"
        )
    pixels = np.array([point.pixel for point in points])
    rays = camera.ray(pixels)
    for point, ray in zip(points, rays, strict=True):
        if not np.isfinite(ray).all():
            raise CalibrationError(f"point {point.name} is outside the lens's field")
    known = np.array([point.direction_in_body for point in points])
    _check_apart(known, "known directions")
    _check_apart(rays, "points in the picture")
    camera_from_body, _ = Rotation.align_vectors(rays, known)
    left = _between_deg(rays, camera_from_body.apply(known))
    if left.max() > WRONG_DEG:
        worst = points[int(np.argmax(left))]
        raise CalibrationError(
            f"the points contradict each other by {left.max():.0f} degrees, most of all "
            f"{worst.name}; yaw is positive to the right, pitch upwards, pixels count from the "
            "top left corner"
        )
    sigma = max(_spread(left, 2 * len(points) - 3), np.radians(_pixel_deg(camera, pixels)))
    information = np.sum(np.eye(3) - known[:, :, None] * known[:, None, :], axis=0) / sigma**2
    return Mounting(
        camera_from_body,
        _angle_sigma(camera_from_body.inv(), np.linalg.inv(information)),
        tuple((point.name, float(off)) for point, off in zip(points, left, strict=True)),
    )


def mounting_from_horizon(
    frames: Sequence[LevelledFrame], told: Rotation, *, hold_yaw: bool = False
) -> Mounting:
    """The mounting from frames with known roll and pitch.

    `told` is the camera_from_body that is about right; its yaw stays where the frames' attitudes
    differ too little to find it (sigma above YAW_DEG), or with `hold_yaw`. Frames that fit nothing
    are dropped and named; CalibrationError when none is left.
    """
    if not frames:
        raise CalibrationError("no frame with a horizon in it: nothing to find the mounting from")
    kept, start, dropped = _agreeing(list(frames), told)
    if not hold_yaw:
        fit = _fit(kept, start, None)
        mounting = _mounting(kept, fit, dropped, held=False)
        if mounting.sigma_deg[0] < YAW_DEG:
            return mounting
    fit = _fit(kept, _with_yaw_of(start, told), _heading_axis(kept))
    return _mounting(kept, fit, dropped, held=True)


@dataclass(frozen=True)
class _Fit:
    camera_from_body: Rotation
    height_deg: float
    covariance: Floats  # (3, 3), of a small turn in the body frame, radians


def _agreeing(
    frames: list[LevelledFrame], told: Rotation
) -> tuple[list[LevelledFrame], Rotation, tuple[tuple[str, str], ...]]:
    """The frames without those that contradict the others, and a mounting near theirs."""
    seen = np.array([frame.horizon.down_in_camera for frame in frames])
    known = np.array([frame.down_in_body for frame in frames])
    best, best_cost = told, np.inf
    for a, b in zip(seen, known, strict=True):  # each frame alone, with the yaw as told
        turned = told.apply(b)
        start = _shortest(turned, a) * told
        cost = float(np.minimum(_between_deg(seen, start.apply(known)), WRONG_DEG).sum())
        if cost < best_cost:
            best, best_cost = start, cost

    def residuals(turn: Floats) -> Floats:
        return (seen - (Rotation.from_rotvec(turn) * best).apply(known)).ravel()

    # a weak pull to the start keeps what the frames say nothing about
    turn = least_squares(
        lambda v: np.concatenate([residuals(v), 1e-3 * v]),
        np.zeros(3),
        loss="soft_l1",
        f_scale=0.02,
    ).x
    start = Rotation.from_rotvec(turn) * best
    off = _between_deg(seen, start.apply(known))
    dropped = tuple(
        (frame.name, f"its horizon is {error:.1f} degrees from where the others put it")
        for frame, error in zip(frames, off, strict=True)
        if error > AGREE_DEG
    )
    kept = [frame for frame, error in zip(frames, off, strict=True) if error <= AGREE_DEG]
    if len(kept) <= len(frames) / 2:
        raise CalibrationError(
            "the frames contradict each other; are roll and pitch in degrees, right side down and "
            "nose up, and do they belong to these pictures?"
        )
    return kept, start, dropped


def _fit(frames: Sequence[LevelledFrame], start: Rotation, held: Floats | None) -> _Fit:
    """All edge points at once; without a turn about `held` (in the body frame), if given.

    Every frame's skyline has its own height: hills, haze and altitude differ.
    """
    rays, downs, frame_of = _edge_points(frames)
    basis = np.eye(3) if held is None else np.linalg.svd(held[None])[2][1:]
    k = len(basis)

    def off(values: Floats) -> Floats:
        camera_from_body = start * Rotation.from_rotvec(values[:k] @ basis)
        level = np.sum(rays * camera_from_body.apply(downs), axis=1)
        return np.asarray(np.arcsin(np.clip(-level, -1, 1)) - values[k:][frame_of])

    begin = np.zeros(k + len(frames))
    begin[k:] = [np.median(off(begin)[frame_of == f]) for f in range(len(frames))]
    noise = max(float(np.median(np.abs(off(begin)))), np.radians(0.02))
    # a turn that no frame says anything about is none; a height that none tells is small
    pull = np.append(np.full(k, 1e-3), np.full(len(frames), noise / np.radians(HEIGHT_SIGMA_DEG)))
    solved = least_squares(
        lambda values: np.concatenate([off(values), pull * values]),
        begin,
        loss="soft_l1",
        f_scale=2 * noise,
    )
    camera_from_body = start * Rotation.from_rotvec(solved.x[:k] @ basis)
    left = off(solved.x)
    points = _point_covariance(solved.jac, float(np.mean(np.minimum(np.abs(left), 3 * noise) ** 2)))
    whole = basis.T @ (points[:k, :k] * len(rays) / (PARTS * len(frames))) @ basis
    return _Fit(
        camera_from_body,
        float(np.degrees(solved.x[k:].mean())),
        whole + _frame_covariance(frames, camera_from_body, basis),
    )


def _edge_points(frames: Sequence[LevelledFrame]) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Rays (n, 3), down in the body for each, and the number of the frame."""
    rays, downs, frame_of = [], [], []
    for number, frame in enumerate(frames):
        found = frame.horizon.rays
        chosen = np.linspace(0, len(found) - 1, min(len(found), POINTS_PER_FRAME)).astype(int)
        rays.append(found[chosen])
        downs.append(np.tile(frame.down_in_body, (len(chosen), 1)))
        frame_of.append(np.full(len(chosen), number))
    return np.concatenate(rays), np.concatenate(downs), np.concatenate(frame_of)


def _point_covariance(slopes: Floats, variance: float) -> Floats:
    information = slopes.T @ slopes
    return np.asarray(variance * np.linalg.pinv(information, hermitian=True), np.float64)


def _frame_covariance(
    frames: Sequence[LevelledFrame], camera_from_body: Rotation, basis: Floats
) -> Floats:
    """Of a small body turn, if every frame's attitude errs by itself, in both tilts alike."""
    known = np.array([frame.down_in_body for frame in frames])
    surplus = 2 * len(frames) - len(basis)
    squares = float(np.sum(np.radians(_left_deg(frames, camera_from_body)) ** 2))
    variance = max(squares / max(surplus, 1), np.radians(ATTITUDE_DEG) ** 2)
    information = np.sum(np.eye(3) - known[:, :, None] * known[:, None, :], axis=0)
    inner = basis @ information @ basis.T + 1e-9 * np.eye(len(basis))
    return np.asarray(variance * basis.T @ np.linalg.inv(inner) @ basis)


def _left_deg(frames: Sequence[LevelledFrame], camera_from_body: Rotation) -> Floats:
    seen = np.array([frame.horizon.down_in_camera for frame in frames])
    known = np.array([frame.down_in_body for frame in frames])
    return _between_deg(seen, camera_from_body.apply(known))


def _mounting(
    frames: Sequence[LevelledFrame],
    fit: _Fit,
    dropped: tuple[tuple[str, str], ...],
    *,
    held: bool,
) -> Mounting:
    off = _left_deg(frames, fit.camera_from_body)
    yaw, pitch, roll = _angle_sigma(fit.camera_from_body.inv(), fit.covariance)
    return Mounting(
        fit.camera_from_body,
        (float("nan") if held else yaw, pitch, roll),
        tuple((frame.name, float(error)) for frame, error in zip(frames, off, strict=True)),
        dropped,
        fit.height_deg,
    )


def _heading_axis(frames: Sequence[LevelledFrame]) -> Floats:
    """The turn that level frames say nothing about: around the mean down, in the body frame."""
    mean = np.mean([frame.down_in_body for frame in frames], axis=0)
    return np.asarray(mean / np.linalg.norm(mean))


def _with_yaw_of(found: Rotation, told: Rotation) -> Rotation:
    """`found`, turned about the vehicle's vertical to the yaw of `told`.

    A camera that looks straight down has no yaw to speak of; it stays as near to `told` as can be.
    """
    yaw, pitch, _ = head_angles_deg(told.inv())
    found_yaw, found_pitch, _ = head_angles_deg(found.inv())
    if max(abs(pitch), abs(found_pitch)) < 80:
        turn = np.radians(yaw - found_yaw)
    else:
        matrix = (told.inv() * found).as_matrix()  # body turned to body
        turn = -np.arctan2(matrix[1, 0] - matrix[0, 1], matrix[0, 0] + matrix[1, 1])
    return found * Rotation.from_rotvec(-turn * DOWN)


def _shortest(a: Floats, b: Floats) -> Rotation:
    """The smallest turn that leads unit vector `a` to `b`."""
    axis = np.cross(a, b)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return Rotation.identity()
    return Rotation.from_rotvec(axis / sine * np.arctan2(sine, float(a @ b)))


def _angle_sigma(body_from_camera: Rotation, covariance: Floats) -> tuple[float, float, float]:
    """Standard deviations of yaw, pitch and roll in degrees, from that of a small body turn."""
    step = 1e-5
    columns = []
    for axis in np.eye(3):
        ahead, behind = (
            np.array(head_angles_deg(Rotation.from_rotvec(s * axis) * body_from_camera))
            for s in (step, -step)
        )
        columns.append(((ahead - behind + 180) % 360 - 180) / (2 * step))
    slopes = np.stack(columns, axis=-1)
    yaw, pitch, roll = np.sqrt(np.diag(slopes @ covariance @ slopes.T)).tolist()
    return yaw, pitch, roll


def _check_apart(directions: Floats, what: str) -> None:
    cosine = np.abs(directions @ directions.T)
    if cosine.min() > np.cos(np.radians(APART_DEG)):
        raise CalibrationError(
            f"the {what} are less than {APART_DEG:g} degrees apart, or opposite each other: they "
            "leave the turn around them open; add one to the side"
        )


def _between_deg(a: Floats, b: Floats) -> Floats:
    """Angles between unit vectors (n, 3)."""
    across = np.linalg.norm(np.cross(a, b), axis=1)
    return np.degrees(np.arctan2(across, np.sum(a * b, axis=1)))


def _spread(left_deg: Floats, surplus: int) -> float:
    """Standard deviation per direction, radians."""
    return float(np.radians(np.sqrt(np.sum(left_deg**2) / surplus)))


def _pixel_deg(camera: Camera, pixels: Floats) -> float:
    """How many degrees CLICK_PX is at these pixels, at most."""
    inward = np.where(pixels > np.asarray(camera.center), -1.0, 1.0)
    turns = [
        _between_deg(camera.ray(pixels), camera.ray(pixels + axis * inward))
        for axis in CLICK_PX * np.eye(2)
    ]
    return float(np.nanmax(turns))
