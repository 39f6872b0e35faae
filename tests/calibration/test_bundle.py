"""The solver: right answers, points that do not count, and what the slopes must be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boards import BOARD, field_camera, truth, views_of
from scipy.spatial.transform import Rotation

from freelook.calibration.bundle import Solution, fit, resect, resect_all, rms, solve
from freelook.calibration.minimise import FAR, NEAR
from freelook.calibration.parameters import (
    HELD,
    Freedom,
    Parameters,
    lens_names,
    lens_values,
    with_lens_values,
)
from freelook.calibration.slopes import (
    both_slopes,
    cross_matrices,
    point_slopes,
    project,
    turn_slopes,
    value_slopes,
)
from freelook.calibration.views import Pose, View
from freelook.errors import CalibrationError
from freelook.lens import Floats, KannalaBrandt, model_name, vector
from lens_examples import ALL, Example

KANNALA = truth("kannala_brandt")


def off(poses: tuple[Pose, ...], seed: int = 0) -> list[Pose]:
    """Poses about as wrong as a first guess's: five degrees, five percent."""
    rng = np.random.default_rng(seed)
    return [
        Pose(
            Rotation.from_rotvec(rng.normal(0, 0.05, 3)) * pose.camera_from_target,
            pose.translation * (1 + rng.normal(0, 0.05)),
        )
        for pose in poses
    ]


def test_without_noise_the_truth_comes_out() -> None:
    made = views_of(KANNALA, 8, 1, noise_px=0.0)
    wrong = replace(KANNALA, lens=KannalaBrandt(280.0), center=(640.0, 480.0), stretch=np.eye(2))
    found = solve(wrong, off(made.poses), made.views)
    assert found.rms_px < 1e-6
    assert vector(found.camera.lens) == pytest.approx(vector(KANNALA.lens), rel=1e-4)
    assert found.camera.center == pytest.approx(KANNALA.center, abs=1e-5)
    assert found.camera.stretch == pytest.approx(KANNALA.stretch, abs=1e-7)
    for pose, right in zip(found.poses, made.poses, strict=True):
        assert pose.translation == pytest.approx(right.translation, abs=1e-7)


@pytest.mark.parametrize("share", [0.1, 0.2, 0.3])
def test_wrong_points_are_told_from_good_ones(share: float) -> None:
    """No wrong point counts, and no more good ones are dropped than by chance: the limit of 4.5
    sigma drops 4 in 100,000, here 0.02 of them."""
    made = views_of(KANNALA, 10, 2, noise_px=0.2, outliers=share)
    found = solve(KANNALA, off(made.poses), made.views)
    for counts, good in zip(found.inliers, made.good, strict=True):
        assert not (counts & ~good).any()
    lost = sum(int((good & ~c).sum()) for c, good in zip(found.inliers, made.good, strict=True))
    assert lost <= 1
    assert found.noise_px == pytest.approx(0.2, rel=0.1)  # 1000 values: 2 % is one sigma


def test_a_view_that_is_all_wrong_stands_aside() -> None:
    """It keeps some pose, counts for nothing, and the others come out as without it."""
    made = views_of(KANNALA, 8, 3)
    rng = np.random.default_rng(4)
    noise = View("noise", BOARD, rng.uniform(100, 800, (54, 2)))
    found = solve(KANNALA, [*made.poses, made.poses[0]], [*made.views, noise])
    alone = solve(KANNALA, made.poses, made.views)
    assert not found.inliers[-1].any()
    assert found.camera.center == pytest.approx(alone.camera.center, abs=1e-4)
    assert np.isfinite(found.residuals[-1]).all()


def test_every_point_counts_when_asked() -> None:
    made = views_of(KANNALA, 8, 5, outliers=0.1)
    found = solve(KANNALA, made.poses, made.views, robust=False)
    assert all(ok.all() for ok in found.inliers)
    assert found.rms_px > 10
    right = solve(KANNALA, made.poses, made.views, robust=False, counted=made.good)
    assert right.rms_px == pytest.approx(0.2 * np.sqrt(2), rel=0.1)
    for ok, good in zip(right.inliers, made.good, strict=True):
        assert (ok == good).all()


def test_the_rms_is_that_of_distances() -> None:
    assert rms(np.array([[3.0, 4.0], [0.0, 0.0]])) == pytest.approx(np.sqrt(12.5))
    assert np.isnan(rms(np.zeros((0, 2))))


def test_a_fit_is_a_solution_less_what_is_known_about_it() -> None:
    made = views_of(KANNALA, 6, 9, outliers=0.1)
    plain, known = fit(KANNALA, made.poses, made.views), solve(KANNALA, made.poses, made.views)
    assert plain.camera.lens == known.camera.lens
    assert plain.rms_px == known.rms_px
    assert plain.noise_px == pytest.approx(known.noise_px, rel=1e-12)
    few = [view.only(np.arange(len(view.pixels)) < 5) for view in made.views[:2]]
    with pytest.raises(CalibrationError, match="10 points are too few for 20 unknowns"):
        fit(KANNALA, made.poses[:2], few, robust=False)


def test_a_start_that_is_nowhere_is_no_fit() -> None:
    """Among others, one whose noise is no number would be neither better nor worse than any."""
    made = views_of(KANNALA, 3, 9)
    nowhere = replace(made.poses[0], translation=np.full(3, np.nan))
    for robust in (False, True):
        with pytest.raises(CalibrationError, match="do not determine"):
            fit(KANNALA, [nowhere, *made.poses[1:]], made.views, robust=robust)


@pytest.mark.parametrize("damping", [FAR, NEAR])
def test_how_the_first_step_is_damped_changes_the_way_only(damping: float) -> None:
    """From poses five degrees off and another focal length, too, where the whole step is wrong."""
    made = views_of(KANNALA, 8, 10)
    wrong = replace(KANNALA, lens=KannalaBrandt(270.0))
    found = solve(wrong, off(made.poses), made.views, damping=damping)
    right = solve(KANNALA, made.poses, made.views)
    assert found.rms_px == pytest.approx(right.rms_px, rel=1e-6)
    assert found.camera.center == pytest.approx(right.camera.center, abs=1e-3)


def test_what_is_not_free_stays() -> None:
    made = views_of(KANNALA, 6, 6)
    start = replace(KANNALA, center=(690.0, 435.0))
    found = solve(start, made.poses, made.views, Freedom(center=False, aspect=False))
    assert found.camera.center == (690.0, 435.0)
    assert found.camera.stretch.tolist() == KANNALA.stretch.tolist()
    assert found.names == ("f", "k1", "k2", "k3", "k4")


def test_skew_is_found_when_asked() -> None:
    skewed = replace(KANNALA, stretch=np.array([[1.0, 0.01], [0.0, 1.004]]))
    made = views_of(skewed, 8, 7, noise_px=0.1)
    found = solve(KANNALA, made.poses, made.views, Freedom(skew=True))
    sigma = np.sqrt(found.covariance[-1, -1])
    assert found.names[-1] == "skew"
    assert sigma < 1e-3
    assert abs(found.camera.stretch[0, 1] - 0.01) < 4 * sigma


def test_too_few_points_are_said() -> None:
    made = views_of(KANNALA, 2, 8)
    few = [view.only(np.arange(len(view.pixels)) < 5) for view in made.views]
    with pytest.raises(CalibrationError, match="10 points are too few for 20 unknowns"):
        solve(KANNALA, made.poses, few, robust=False)


def test_what_the_views_leave_open_is_said() -> None:
    """A lens of which nothing but the middle is seen, with nine terms."""
    camera = truth("kannala_brandt_9")
    rng = np.random.default_rng(9)
    poses = [Pose(Rotation.identity(), np.array([-0.12, -0.08, z])) for z in (4.0, 5.0, 6.0)]
    views = []
    for pose in poses:
        exact = camera.project(pose.apply(BOARD))
        views.append(View("", BOARD, exact + rng.normal(0, 0.1, exact.shape)))
    with pytest.raises(CalibrationError, match="do not determine all parameters"):
        solve(camera, poses, views)


def test_resection_finds_the_pose_and_nothing_else() -> None:
    made = views_of(KANNALA, 6, 10, outliers=0.2)
    poses = off(made.poses)
    together, residuals = resect_all(KANNALA, poses, made.views, made.good)
    for i, (view, good) in enumerate(zip(made.views, made.good, strict=True)):
        alone, own = resect(KANNALA, poses[i], view)
        assert rms(own[good]) == pytest.approx(rms(residuals[i][good]), rel=0.02)
        assert alone.translation == pytest.approx(together[i].translation, rel=0.02, abs=2e-3)


def rays_in(example: Example, count: int = 60) -> Floats:
    """Points in front of a camera, the axis among them."""
    rng = np.random.default_rng(11)
    theta = rng.uniform(0, 0.98 * example.camera.theta_max, count)
    theta[0] = 0.0
    phi = rng.uniform(-np.pi, np.pi, count)
    rays = [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    return np.stack(rays, axis=-1) * rng.uniform(0.2, 5.0, (count, 1))


@pytest.mark.parametrize("first", [0, 1], ids=["on the axis too", "off the axis"])
@pytest.mark.parametrize("example", ALL, ids=str)
def test_slopes_by_the_point_are_those_of_the_projection(example: Example, first: int) -> None:
    """Against differences of the projection itself; even powers of theta have a kink on the axis,
    where a difference sees half of it: 2e-6."""
    camera, points = example.camera, rays_in(example)[first:]
    for axis in np.eye(3):
        h = 1e-6 * np.linalg.norm(points, axis=1, keepdims=True)
        change = project(camera, points + h * axis) - project(camera, points - h * axis)
        slope = point_slopes(camera, points) @ axis
        largest = np.abs(point_slopes(camera, points)).max()
        assert slope == pytest.approx(change / (2 * h), abs=3e-6 * largest)


@pytest.mark.parametrize(
    "example", [e for e in ALL if model_name(e.lens) != "splined_stereographic"], ids=str
)
def test_slopes_by_the_values_are_those_of_the_projection(example: Example) -> None:
    """A small step of all values at once moves the points as the slopes say, to second order."""
    camera, points = example.camera, rays_in(example)
    parameters = Parameters(camera, Freedom(skew=True))
    values = parameters.values
    step = 1e-6 * np.maximum(np.abs(values), 0.1) * np.cos(np.arange(len(values)))
    ahead = project(parameters.camera_of(values + step), points)
    behind = project(parameters.camera_of(values - step), points)
    by_values = value_slopes(parameters, values, points)
    assert by_values.shape == (len(points), 2, len(parameters.names))
    moved = (ahead - behind) / 2
    assert by_values @ step == pytest.approx(moved, abs=1e-4 * np.abs(moved).max() + 1e-9)


def test_a_turn_moves_points_as_the_cross_matrix_says() -> None:
    rng = np.random.default_rng(12)
    v, w = rng.normal(size=(2, 20, 3))
    assert (cross_matrices(v) @ w[:, :, None])[:, :, 0] == pytest.approx(np.cross(v, w))
    by_point = rng.normal(size=(20, 2, 3))
    assert turn_slopes(by_point, v) == pytest.approx(-by_point @ cross_matrices(v))


def test_both_slopes_are_those_that_each_gives() -> None:
    for example in ALL:
        points, parameters = rays_in(example), Parameters(example.camera, Freedom(skew=True))
        by_values, by_point = both_slopes(parameters, parameters.values, points)
        assert (by_values == value_slopes(parameters, parameters.values, points)).all()
        assert (by_point == point_slopes(example.camera, points)).all()


@pytest.mark.parametrize("example", ALL, ids=str)
def test_values_and_names_go_there_and_back(example: Example) -> None:
    parameters = Parameters(example.camera, Freedom(skew=True))
    values = parameters.values + 0.25
    assert len(parameters.names) == len(values)
    assert Parameters(parameters.camera_of(values), Freedom(skew=True)).values.tolist() == (
        values.tolist()
    )


def test_what_is_held_is_no_parameter_and_stays() -> None:
    for example in ALL:
        held = HELD.get(type(example.lens), ())
        assert not set(held) & set(lens_names(example.lens))
        changed = with_lens_values(example.lens, lens_values(example.lens) * 1.01)
        for name in held:
            assert getattr(changed, name) == getattr(example.lens, name)


def test_the_projection_never_fails_beyond_the_lens() -> None:
    """A solver must find its way back from there: the point stays at the end of the formula."""
    camera = truth("perspective", 100)
    behind = np.array([[0.3, 0.1, -1.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0]])
    assert np.isfinite(project(camera, behind)).all()
    assert np.isfinite(point_slopes(camera, behind[:1])).all()


def field_of(solution: Solution, views: tuple[View, ...]) -> float:
    return float(np.degrees(field_camera(solution, views).theta_max))


def test_the_field_ends_five_degrees_beyond_the_outermost_point() -> None:
    made = views_of(KANNALA, 10, 13, noise_px=0.0)
    found = solve(KANNALA, made.poses, made.views)
    rays = np.concatenate([p.apply(v.points) for p, v in zip(made.poses, made.views, strict=True)])
    outermost = np.degrees(np.arctan2(np.hypot(*rays[:, :2].T), rays[:, 2]).max())
    assert field_of(found, made.views) == pytest.approx(outermost + 5, abs=0.01)
