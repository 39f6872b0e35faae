"""Stereo: simulated rigs with known truth, numbered anyhow, with views missing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from freelook.calibration._correspondence import Sight, matched, spacing
from freelook.calibration.bundle import State
from freelook.calibration.parameters import Freedom, Parameters
from freelook.calibration.stereo import (
    Moment,
    StereoCalibration,
    _Rig,
    _RigProblem,
    calibrate_stereo,
)
from freelook.calibration.views import Pose, View
from freelook.camera import Camera, make_camera
from freelook.errors import CalibrationError
from freelook.lens import KannalaBrandt
from freelook.rotations import angle_between_deg

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEFT = make_camera(
    (960, 720), KannalaBrandt(262.0, 0.01, -0.002), center=(487.3, 352.8), field_deg=190
)
RIGHT = make_camera(
    (848, 800), KannalaBrandt(285.0, -0.006, 0.001), center=(418.0, 405.0), field_deg=163
)
SIZES = (LEFT.size, RIGHT.size)
TURN = Rotation.from_euler("xyz", [2, -3, 1.5], degrees=True)
SHIFT = np.array([-0.12, 0.004, -0.006])  # the right camera is 12 cm to the right
BOARD, SQUARE = (8, 6), 0.03
CELLS = np.stack(np.meshgrid(np.arange(8), np.arange(6)), axis=-1).reshape(-1, 2)
QUARTERS = [np.array(m) for m in ([[1, 0], [0, 1]], [[0, -1], [1, 0]], [[-1, 0], [0, -1]])]


def board_at(rng: np.random.Generator) -> Pose:
    """Within 60 degrees of the axis, 25 to 50 cm away, tilted by up to 35 degrees."""
    look = Rotation.from_euler("YX", [rng.uniform(-60, 60), rng.uniform(-50, 50)], degrees=True)
    tilt = Rotation.from_euler("xyz", rng.uniform(-35, 35, 3) * [1, 1, 3], degrees=True)
    middle = np.array([3.5, 2.5, 0.0]) * SQUARE
    place = look.apply([0, 0, rng.uniform(0.25, 0.5)])
    return Pose(look * tilt, place - (look * tilt).apply(middle))


def in_right(pose: Pose) -> Pose:
    return Pose(TURN * pose.camera_from_target, TURN.apply(pose.translation) + SHIFT)


def flat(cells: Ints) -> Floats:
    return np.column_stack([cells * SQUARE, np.zeros(len(cells))])


def numbered_anyhow(cells: Ints, rng: np.random.Generator) -> Ints:
    """As a detector may number them: turned, mirrored, from another corner."""
    mirrored = np.diag([1, rng.choice([-1, 1])])
    turned = cells @ (QUARTERS[rng.integers(3)] @ mirrored).T
    return np.asarray(turned - turned.min(axis=0))


def cut(cells: Ints, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Two columns or a row less, at one side."""
    sides = (cells[:, 0] >= 2, cells[:, 0] < 6, cells[:, 1] >= 1, cells[:, 1] < 5)
    return np.asarray(sides[rng.integers(4)])


def moments(
    seed: int,
    count: int = 14,
    *,
    noise_px: float = 0.2,
    missing: float = 0.2,
    partial: float = 0.0,
    named: bool = False,
) -> list[Moment]:
    """A rig's views; `missing` and `partial` are shares of the views."""
    rng = np.random.default_rng(seed)
    made = []
    for i in range(count):
        pose = board_at(rng)
        views: list[View | None] = []
        for camera, own in ((LEFT, pose), (RIGHT, in_right(pose))):
            pixels = camera.project(own.apply(flat(CELLS)))
            seen = np.isfinite(pixels[:, 0])
            seen &= ((pixels > 2) & (pixels < np.array(camera.size) - 3)).all(axis=1)
            if rng.random() < partial:
                seen &= cut(CELLS, rng)
            if seen.sum() < 12 or rng.random() < missing:
                views.append(None)
                continue
            cells = CELLS[seen] if named else numbered_anyhow(CELLS[seen], rng)
            spread = rng.normal(0, noise_px, (len(cells), 2))
            views.append(View(f"{i:02d}", flat(cells), pixels[seen] + spread))
        made.append(Moment(f"{i:02d}", *views))
    return made


def solved(made: list[Moment], **options: object) -> StereoCalibration:
    return calibrate_stereo(made, SIZES, "kannala_brandt", **options)  # type: ignore[arg-type]


def squared_distance(stereo: StereoCalibration) -> float:
    """Of rotation and translation from the truth, by their covariance (Mahalanobis)."""
    turn = (stereo.right_from_left * TURN.inv()).as_rotvec()
    off = np.concatenate([turn, stereo.translation - SHIFT])
    return float(off @ np.linalg.solve(stereo.covariance[-6:, -6:], off))


# what six normal values together exceed as rarely as one exceeds 3 sigma (0.27 %: chi squared)
THREE_SIGMA = 20.1


@cache
def plain() -> StereoCalibration:
    return solved(moments(2))


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("partial", [0.0, 0.5])
def test_the_rig_is_recovered_within_3_sigma(seed: int, partial: float) -> None:
    stereo = solved(moments(seed, partial=partial), board=BOARD)
    assert squared_distance(stereo) < THREE_SIGMA
    assert stereo.baseline == pytest.approx(np.linalg.norm(SHIFT), abs=3 * stereo.baseline_sigma)
    assert stereo.baseline_sigma < 0.001  # and known well: to 1 mm of 12 cm
    assert stereo.turn_sigma_deg.max() < 0.1
    assert not stereo.dropped
    # noise of 0.2 px in x and in y is 0.283 px a point, less a little that the fit takes up
    np.testing.assert_allclose(stereo.rms_px, 0.283, rtol=0.1)


def test_both_lenses_are_recovered_within_3_sigma() -> None:
    stereo = plain()
    sigma = dict(zip(stereo.names, np.sqrt(np.diag(stereo.covariance)), strict=True))
    for side, camera, truth in (("left", stereo.left, LEFT), ("right", stereo.right, RIGHT)):
        got, known = (Parameters(c, Freedom()) for c in (camera, truth))
        for name, value, real in zip(got.names, got.values, known.values, strict=True):
            assert abs(value - real) < 3.5 * sigma[f"{side}.{name}"], f"{side}.{name}"


def test_the_epipolar_error_is_that_of_the_noise() -> None:
    """0.2 px at 262 to 285 px per radian, in both pictures, across the plane: 0.059 degrees;
    the median of its size is 0.674 of that."""
    errors = plain().epipolar_deg
    assert len(errors) > 100
    assert np.median(errors) == pytest.approx(0.674 * 0.059, rel=0.25)


def test_both_cameras_are_mounted_to_look_the_mean_way() -> None:
    stereo = plain()
    left, right = stereo.left.camera_from_body, stereo.right.camera_from_body
    assert angle_between_deg(right * left.inv(), stereo.right_from_left) < 1e-6
    axes = left.inv().apply([0, 0, 1]) + right.inv().apply([0, 0, 1])
    np.testing.assert_allclose(axes / np.linalg.norm(axes), [1, 0, 0], atol=1e-3)


def test_the_right_camera_is_to_the_right_of_the_left() -> None:
    forward, right, down = plain().right_in_body
    assert right == pytest.approx(0.12, abs=0.002)
    assert abs(forward) < 0.02
    assert abs(down) < 0.02
    assert not plain().swapped


def test_swapped_cameras_are_told() -> None:
    turned = [Moment(m.name, m.right, m.left) for m in moments(2)]
    stereo = calibrate_stereo(turned, SIZES[::-1], "kannala_brandt")
    assert stereo.swapped
    assert stereo.baseline == pytest.approx(plain().baseline, rel=1e-4)


def test_views_without_a_partner_say_something_about_their_lens() -> None:
    made = moments(3, missing=0.0, count=16)
    # every second moment has lost its right view, so that the left lens has twice the views
    halved = [replace(m, right=None) if i % 2 else m for i, m in enumerate(made)]
    paired = [m for i, m in enumerate(made) if not i % 2]
    more, less = solved(halved), solved(paired)
    sigma_of = [s.covariance[0, 0] ** 0.5 for s in (more, less)]
    assert (more.pairs, more.singles) == (less.pairs, less.singles + 8)
    assert sigma_of[0] < 0.95 * sigma_of[1]


def test_one_solve_knows_more_than_two_cameras_alone() -> None:
    """The same board seen by both ties them together: no standard deviation grows."""
    stereo = plain()
    alone = np.concatenate([np.diag(c.solution.covariance) for c in stereo.alone])
    together = np.diag(stereo.covariance)[:-6]
    assert (together < 1.15 * alone).all()
    assert (together < 0.95 * alone).any()


def test_points_with_names_need_no_guessing() -> None:
    stereo = solved(moments(1, named=True, partial=0.5), ambiguous=False)
    assert squared_distance(stereo) < THREE_SIGMA


def test_a_pair_of_two_moments_is_dropped_and_named() -> None:
    made = moments(4, missing=0.0)
    made[3], made[4] = replace(made[3], right=made[4].right), replace(made[4], right=None)
    stereo = solved(made, board=BOARD)
    assert [name for name, why in stereo.dropped if "different moments" in why] == ["03"]
    assert squared_distance(stereo) < THREE_SIGMA


def test_bad_corners_are_dropped() -> None:
    rng = np.random.default_rng(9)
    made = moments(1, missing=0.0)
    for m in made:
        assert m.left is not None
        wrong = rng.random(len(m.left.pixels)) < 0.1
        m.left.pixels[wrong] += rng.uniform(-15, 15, (int(wrong.sum()), 2))
    stereo = solved(made, board=BOARD)
    assert squared_distance(stereo) < THREE_SIGMA
    assert stereo.rejected > 40  # of about 65 wrong ones; some are hardly wrong


def shuffled(made: list[Moment]) -> list[Moment]:
    rights = [m.right for m in made]
    return [replace(m, right=rights[(i + 5) % len(made)]) for i, m in enumerate(made)]


def with_few_points(made: list[Moment]) -> list[Moment]:
    right = made[3].right
    assert right is not None
    few = View(right.name, right.points[:5], right.pixels[:5])
    return [*made[:3], replace(made[3], right=few), *made[4:]]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda made: [replace(m, right=None) for m in made], "any picture of the right camera"),
        (lambda made: [replace(m, left=None) for m in made], "any picture of the left camera"),
        (
            lambda made: [
                replace(m, right=None) if i % 2 else replace(m, left=None)
                for i, m in enumerate(made)
            ],
            "no moment shows the target in both",
        ),
        (shuffled, "pairs agree on how the cameras stand"),
    ],
)
def test_what_cannot_be_calibrated_is_said(
    change: Callable[[list[Moment]], list[Moment]], said: str
) -> None:
    with pytest.raises(CalibrationError, match=said):
        solved(change(moments(5, missing=0.0)))


def test_a_view_with_too_few_points_is_left_out_and_said() -> None:
    stereo = solved(with_few_points(moments(5, missing=0.0)))
    assert stereo.dropped == (("03", "5 points; a view needs at least 6"),)
    assert stereo.pairs + stereo.singles == len(moments(5, missing=0.0))
    assert stereo.singles == 1


def sight(pose: Pose, rng: np.random.Generator, keep: slice = slice(None)) -> Sight:
    """One pair, noiseless; the right view has only some of the corners."""
    right = CELLS[keep]
    cells = numbered_anyhow(CELLS, rng), numbered_anyhow(right, rng)
    views = [View("", flat(c), np.zeros((len(c), 2))) for c in cells]
    poses = [
        _posed(flat(a), own.apply(flat(b)))
        for a, b, own in zip(cells, (CELLS, right), (pose, in_right(pose)), strict=True)
    ]
    return Sight(views[0], views[1], poses[0], poses[1])


def _posed(numbered: Floats, seen: Floats) -> Pose:
    """The pose that leads points as they were numbered to where they are."""
    turn, _ = Rotation.align_vectors(seen - seen.mean(0), numbered - numbered.mean(0))
    return Pose(turn, seen.mean(0) - turn.apply(numbered.mean(0)))


def test_corners_are_matched_however_they_are_numbered() -> None:
    rng = np.random.default_rng(0)
    sights = [sight(board_at(rng), rng) for _ in range(6)]
    relations, turn, shift = matched(sights, ambiguous=True)
    np.testing.assert_allclose(turn, TURN.as_matrix(), atol=1e-6)
    np.testing.assert_allclose(shift, SHIFT, atol=1e-6)
    for one, relation in zip(sights, relations, strict=True):
        assert relation is not None
        there = one.left_pose.apply(relation.relabelled(one.right).points)
        own = one.right_pose.apply(one.right.points)
        np.testing.assert_allclose(TURN.apply(there) + SHIFT, own, atol=1e-6)


def test_half_a_board_is_matched_by_what_all_pairs_agree_on() -> None:
    rng = np.random.default_rng(3)
    sights = [sight(board_at(rng), rng, slice(0, 24)) for _ in range(6)]
    _, turn, shift = matched(sights, ambiguous=True, board=BOARD)
    np.testing.assert_allclose(turn, TURN.as_matrix(), atol=1e-6)
    np.testing.assert_allclose(shift, SHIFT, atol=1e-6)


def test_one_pair_is_taken_as_two_cameras_that_look_the_same_way() -> None:
    rng = np.random.default_rng(1)
    _, turn, _ = matched([sight(board_at(rng), rng)], ambiguous=True)
    np.testing.assert_allclose(turn, TURN.as_matrix(), atol=1e-6)


def test_the_spacing_is_that_of_neighbours() -> None:
    assert spacing([View("", flat(CELLS), np.zeros((48, 2)))]) == pytest.approx(SQUARE)


def test_slopes_are_those_of_the_residuals() -> None:
    """Against central differences, away from where the rig was started from."""
    made = [m for m in moments(6, 4, missing=0.0, named=True) if m.left and m.right]
    cameras: tuple[Camera, Camera] = (LEFT, RIGHT)
    problem = _RigProblem([(m.left, m.right) for m in made], cameras, Freedom())
    rng = np.random.default_rng(0)
    poses = [board_at(rng) for _ in made]
    values = problem.start(_Rig(TURN.as_matrix(), SHIFT))
    values[-6:-3] = [0.1, -0.2, 0.15]
    state = State.of(values, poses)
    by_values, by_poses = problem.slopes(state)
    k, still = len(values), np.zeros((len(made), 6))
    for i in range(k):
        step = np.zeros(k)
        step[i] = 1e-6 * max(abs(values[i]), 1.0)
        ahead, behind = (problem.residuals(state.moved((s, still))) for s in (step, -step))
        measured = -(ahead - behind) / (2 * step[i])
        scale = np.abs(by_values[:, :, i]).max()
        np.testing.assert_allclose(by_values[:, :, i], measured, atol=1e-4 * scale)
    for i in range(6):
        move = np.zeros((len(made), 6))
        move[:, i] = 1e-6
        ahead, behind = (problem.residuals(state.moved((np.zeros(k), m))) for m in (move, -move))
        measured = -(ahead - behind) / 2e-6
        scale = np.abs(by_poses[:, :, i]).max()
        np.testing.assert_allclose(by_poses[:, :, i], measured, atol=1e-4 * scale)
