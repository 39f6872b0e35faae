"""The normal equations of a bundle adjustment, in blocks, and what a state of it is.

Every part of the points (a view, a moment of a rig) has its own pose, and all share some values.
Poses meet each other only through these, so they are eliminated (Schur complement).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from ..lens import Floats
from .views import Pose

MANY = 64  # columns: from there on it is worth looking which are not 0


@dataclass(frozen=True)
class Pull:
    """What is expected of the values (k,), and how sure that is: information (k, k), in the
    pixels squared that a distance from it costs."""

    expected: Floats
    information: Floats

    def cost(self, values: Floats) -> float:
        off = values - self.expected
        return float(off @ self.information @ off)

    def right(self, values: Floats) -> Floats:
        return np.asarray(self.information @ (self.expected - values))

    @classmethod
    def none(cls, count: int) -> Pull:
        return cls(np.zeros(count), np.zeros((count, count)))


@dataclass(frozen=True)
class State:
    """Values (k,), and of every pose the rotation matrix (views, 3, 3) and shift (views, 3)."""

    values: Floats
    turns: Floats
    shifts: Floats

    @classmethod
    def of(cls, values: Floats, poses: Sequence[Pose]) -> State:
        turns = np.stack([pose.camera_from_target.as_matrix() for pose in poses])
        return cls(values, turns, np.stack([pose.translation for pose in poses]))

    @property
    def poses(self) -> tuple[Pose, ...]:
        rotations = Rotation.from_matrix(self.turns)
        return tuple(Pose(rotations[i], shift) for i, shift in enumerate(self.shifts))

    def moved(self, step: tuple[Floats, Floats]) -> State:
        """By (values, (views, 6): rotation vector, shift)."""
        values, moves = step
        turns = Rotation.from_rotvec(moves[:, :3]).as_matrix() @ self.turns
        return State(self.values + values, turns, self.shifts + moves[:, 3:])


class Problem(Protocol):
    """What is minimised: `count` points in `parts`, each of which has its own pose, and what the
    values are pulled to, if anything.

    How values and poses become pixels is the problem's own affair: one camera, or two on a rig.
    """

    count: int
    parts: list[slice]
    pull: Pull | None = None

    def residuals(self, state: State) -> Floats:
        """(count, 2): seen minus projected, pixels."""
        ...

    def slopes(self, state: State) -> tuple[Floats, Floats]:
        """d pixel / d values (n, 2, k) and d pixel / d (rotation vector, shift) (n, 2, 6)."""
        ...


@dataclass(frozen=True)
class Equations:
    """The normal equations in blocks: camera, poses, and between them; and the camera's pull."""

    camera: Floats  # (parts, k, k)
    between: Floats  # (parts, k, 6)
    poses: Floats  # (parts, 6, 6)
    camera_right: Floats  # (parts, k)
    poses_right: Floats  # (parts, 6)
    pull: Floats  # (k, k)
    pull_right: Floats  # (k,)

    @classmethod
    def of(cls, problem: Problem, state: State, residuals: Floats, weights: Floats) -> Equations:
        """`weights` (n,); the poses of views that count for nothing stay where they are."""
        by_camera, by_pose = problem.slopes(state)
        k = by_camera.shape[-1]
        root = np.sqrt(weights)
        rows = np.concatenate([by_camera, by_pose, residuals[:, :, None]], axis=-1)
        rows = (rows * root[:, None, None]).reshape(2 * problem.count, k + 7)
        products = np.stack([_square(rows[2 * p.start : 2 * p.stop]) for p in problem.parts])
        pull = problem.pull or Pull.none(k)
        poses = products[:, k:-1, k:-1]
        poses[~poses.any(axis=(1, 2))] = np.eye(6)
        return cls(
            products[:, :k, :k],
            products[:, :k, k:-1],
            poses,
            products[:, :k, -1],
            products[:, k:-1, -1],
            pull.information,
            pull.right(state.values),
        )

    def only(self, parts: list[int]) -> Equations:
        """Of some parts."""
        return Equations(
            self.camera[parts],
            self.between[parts],
            self.poses[parts],
            self.camera_right[parts],
            self.poses_right[parts],
            self.pull,
            self.pull_right,
        )

    @property
    def sound(self) -> bool:
        """Whether all of it are numbers: near the end of a formula some are not."""
        parts = (self.camera, self.between, self.poses, self.camera_right, self.poses_right)
        return all(bool(np.isfinite(part).all()) for part in parts)

    def step(self, damping: float) -> tuple[Floats, Floats] | None:
        """(changes of the values, of the poses (parts, 6)); None where the equations say
        nothing."""
        camera = self.camera.sum(0) + self.pull
        camera += _diagonal(camera, damping)
        try:
            inverse = np.linalg.inv(self.poses + _diagonal(self.poses, damping))
            through = self.between @ inverse
            left = camera - (through @ self.between.swapaxes(1, 2)).sum(0)
            values = _scaled_solve(left, self._right(through).sum(0) + self.pull_right)
        except np.linalg.LinAlgError:
            return None
        back = self.poses_right - values @ self.between
        return values, (inverse @ back[:, :, None])[:, :, 0]

    def eliminated(self) -> tuple[Floats, Floats]:
        """Of the values alone, for each part: information (parts, k, k), right side (parts, k);
        the pull not counted in.

        LinAlgError where a pose is open.
        """
        through = self.between @ np.linalg.inv(self.poses)
        return self.camera - through @ self.between.swapaxes(1, 2), self._right(through)

    def _right(self, through: Floats) -> Floats:
        return self.camera_right - (through @ self.poses_right[:, :, None])[:, :, 0]


def _square(rows: Floats) -> Floats:
    """rows.T @ rows; most columns of a splined lens are 0 in any one view."""
    columns = rows.shape[1]
    if columns < MANY:
        return np.asarray(rows.T @ rows)
    used = np.flatnonzero(rows.any(axis=0))
    square, some = np.zeros((columns, columns)), rows[:, used]
    square[np.ix_(used, used)] = some.T @ some
    return square


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
