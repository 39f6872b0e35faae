"""Which corner of a board, as one camera numbered them, is which as the other did.

A grid of corners looks the same turned by quarter turns and shifted by whole squares. Each way of
laying the right grid on the left one gives another place of the right camera beside the left one;
only the true ways give the same place in every pair. So: the place that most pairs can agree on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from ..lens import Floats
from .views import Pose, View

Ints = NDArray[np.int64]

SPROUTS = 6  # pairs whose hypotheses are tried on all others
AGREE_DEG, AGREE_STEPS = 2.0, 0.3  # how near hypotheses count fully: turn, shift in squares
ACCEPT_DEG, ACCEPT_STEPS = 6.0, 0.6  # and at all
MOST_SHIFTS = 400  # of one pair


@dataclass(frozen=True)
class Sight:
    """One pair: the target in the left and right picture, with its pose in each camera."""

    left: View
    right: View
    left_pose: Pose
    right_pose: Pose


@dataclass(frozen=True)
class Relation:
    """right_from_left: x_right = turn @ x_left + shift; and target_left_from_target_right."""

    turn: Floats
    shift: Floats
    relabel: Floats  # (3, 4): points of the right view in the left view's numbering

    def relabelled(self, view: View) -> View:
        points = view.points @ self.relabel[:, :3].T + self.relabel[:, 3]
        return View(view.name, points, view.pixels)


def matched(
    sights: Sequence[Sight], *, ambiguous: bool, board: tuple[int, int] | None = None
) -> tuple[list[Relation | None], Floats, Floats]:
    """How the right view of each pair goes with the left one, and the rig: (turn, shift).

    `ambiguous`: the points are a grid whose numbering is arbitrary, of `board` points across and
    down (None: as many as were seen). None for pairs that agree with no other.
    """
    step = spacing([sight.left for sight in sights]) if ambiguous else _size(sights)
    board = board or _largest([view for s in sights for view in (s.left, s.right)], step)
    choices = [_ways(sight, step, board) if ambiguous else [_as_is(sight)] for sight in sights]
    turns = np.array([way.turn for ways in choices for way in ways])
    shifts = np.array([way.shift for ways in choices for way in ways])
    owner = np.repeat(np.arange(len(sights)), [len(ways) for ways in choices])
    few = np.argsort([len(ways) or MOST_SHIFTS + 1 for ways in choices], kind="stable")[:SPROUTS]
    tried = np.flatnonzero(np.isin(owner, few))
    votes = np.array([_votes(turns[i], shifts[i], turns, shifts, owner, step) for i in tried])
    # cameras of a rig look about the same way and are near each other: only where votes are equal
    angle = Rotation.from_matrix(turns[tried]).magnitude()
    length = np.linalg.norm(shifts[tried], axis=1)
    best = tried[np.argmax(votes - 1e-2 * angle - 1e-2 * length / (length + step))]
    turn, shift = turns[best], shifts[best]
    chosen = [_nearest(ways, turn, shift, step) for ways in choices]
    return chosen, turn, shift


def spacing(views: Sequence[View]) -> float:
    """The distance between neighbouring points of a grid."""
    steps = [cKDTree(view.points).query(view.points, k=2)[0][:, 1] for view in views]
    return float(np.median(np.concatenate(steps)))


def _size(sights: Sequence[Sight]) -> float:
    """Of a target whose points have names: a tenth of its extent."""
    return float(max(np.ptp(sight.left.points, axis=0).max() for sight in sights)) / 10


def _cells(view: View, step: float) -> Ints:
    return np.rint(view.points[:, :2] / step).astype(np.int64)


def _largest(views: Sequence[View], step: float) -> tuple[int, int]:
    extents = np.sort([np.ptp(_cells(view, step), axis=0) + 1 for view in views], axis=1)
    short, long = extents.max(axis=0).tolist()
    return int(long), int(short)


def _as_is(sight: Sight) -> Relation:
    return _relation(sight, np.eye(3), np.zeros(3))


def _relation(sight: Sight, turned: Floats, shifted: Floats) -> Relation:
    """From P_left = turned @ P_right + shifted, and both poses."""
    right = sight.right_pose.camera_from_target.as_matrix() @ turned.T
    turn = right @ sight.left_pose.camera_from_target.as_matrix().T
    shift = sight.right_pose.translation - right @ shifted - turn @ sight.left_pose.translation
    return Relation(turn, shift, np.column_stack([turned, shifted]))


QUARTERS = [np.array([[c, -s], [s, c]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
MIRROR = np.diag([1, -1])


def _ways(sight: Sight, step: float, board: tuple[int, int]) -> list[Relation]:
    """Every way of laying the right grid on the left one so that both are on one board."""
    left, right = _cells(sight.left, step), _cells(sight.right, step)
    same_side = _front(sight.left_pose, sight.left) * _front(sight.right_pose, sight.right) > 0
    found = []
    for quarter in QUARTERS:
        plane = quarter if same_side else quarter @ MIRROR
        for shift in _shifts(left, right @ plane.T, board):
            turned = np.eye(3)
            turned[:2, :2] = plane
            turned[2, 2] = np.linalg.det(plane)
            found.append(_relation(sight, turned, np.append(shift * step, 0.0)))
    return found[:MOST_SHIFTS]


def _front(pose: Pose, view: View) -> float:
    """Above 0 if the target's z points away from the camera."""
    middle = pose.apply(view.points.mean(axis=0, keepdims=True))[0]
    return float(pose.camera_from_target.as_matrix()[:, 2] @ middle)


def _shifts(left: Ints, right: Ints, board: tuple[int, int]) -> list[Ints]:
    """Shifts of `right` (in cells) with which both lie on one board, upright or on its side."""
    low, high = left.min(axis=0), left.max(axis=0)
    own_low, own_high = right.min(axis=0), right.max(axis=0)
    found = set()
    for size in {board, board[::-1]}:
        spans = [
            range(
                int(high[k] - (size[k] - 1) - own_low[k]),
                int(low[k] + (size[k] - 1) - own_high[k]) + 1,
            )
            for k in range(2)
        ]
        if all(high - low < size):
            found |= {(x, y) for x in spans[0] for y in spans[1]}
    return [np.array(shift) for shift in sorted(found)]


def _votes(
    turn: Floats, shift: Floats, turns: Floats, shifts: Floats, owner: Ints, step: float
) -> float:
    """How many pairs have a hypothesis like this one; near ones count in part."""
    off = _apart(turn, shift, turns, shifts, step)
    near = np.exp(-((off[0] / AGREE_DEG) ** 2) - (off[1] / AGREE_STEPS) ** 2)
    best = np.zeros(int(owner.max()) + 1)
    np.maximum.at(best, owner, near)
    return float(best.sum())


def _apart(
    turn: Floats, shift: Floats, turns: Floats, shifts: Floats, step: float
) -> tuple[Floats, Floats]:
    """Degrees, and squares, between one hypothesis and others."""
    cosine = (np.einsum("ij,nij->n", turn, turns) - 1) / 2
    degrees = np.minimum(np.degrees(np.arccos(np.clip(cosine, -1, 1))), 40.0)
    squares = np.minimum(np.linalg.norm(shifts - shift, axis=1) / step, 5.0)
    return degrees, squares


def _nearest(ways: Sequence[Relation], turn: Floats, shift: Floats, step: float) -> Relation | None:
    if not ways:
        return None
    turns, shifts = np.array([w.turn for w in ways]), np.array([w.shift for w in ways])
    degrees, squares = _apart(turn, shift, turns, shifts, step)
    best = int(np.argmin((degrees / AGREE_DEG) ** 2 + (squares / AGREE_STEPS) ** 2))
    fits = degrees[best] < ACCEPT_DEG and squares[best] < ACCEPT_STEPS
    return ways[best] if fits else None
