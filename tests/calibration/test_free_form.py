"""A free-form lens: its slopes, what it follows, and what it leaves alone."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from boards import CENTER, SIZE, sigmas_off, some_pixels, truth, views_of

from freelook.bench.boards import Simulated, board, simulate
from freelook.bench.calibration_trials import apart
from freelook.calibration._surface import Surface, stereographic, stereographic_slopes
from freelook.calibration.bundle import BoardProblem, rms, solve
from freelook.calibration.calibrate import Calibration, calibrate
from freelook.calibration.candidates import AUTO
from freelook.calibration.equations import Pull, State
from freelook.calibration.free_form import (
    FREE_FORM,
    MOST,
    free_form,
    promised_gain,
    pulled_to,
    usual_control,
)
from freelook.calibration.left_out import cross_validate
from freelook.calibration.parameters import Freedom, Parameters
from freelook.calibration.slopes import project
from freelook.calibration.words import sentences
from freelook.camera import Camera, make_camera
from freelook.errors import CalibrationError
from freelook.fitting.splined import refit_splined
from freelook.lens import Equidistant, Floats, SplinedStereographic

FREE = Freedom()
RNG = np.random.default_rng(70)


def small_lens() -> SplinedStereographic:
    control = RNG.normal(0, 0.02, 2 * 9 * 7)
    return SplinedStereographic(300.0, 3, 9, 7, 190.0, tuple(map(float, control)))


def small_camera() -> Camera:
    stretch = np.array([[1.0, 0.02], [0.0, 1.01]])
    return Camera(SIZE, small_lens(), CENTER, np.radians(60), stretch)


def points_within(count: int, most_deg: float = 70.0) -> Floats:
    """Points at all depths, in directions up to an angle from the axis."""
    theta = np.radians(most_deg) * np.sqrt(RNG.random(count))
    phi = RNG.uniform(-np.pi, np.pi, count)
    ray = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    return np.asarray(ray * RNG.uniform(0.2, 3.0, (count, 1)))


# The surface


def test_the_surface_is_the_lens() -> None:
    """Weights of our own against the lens, which asks SciPy; both to rounding."""
    camera, points = small_camera(), points_within(500)
    ray = points / np.linalg.norm(points, axis=1, keepdims=True)
    plain = make_camera(SIZE, camera.lens, center=CENTER, field_deg=140, stretch=camera.stretch)
    assert project(camera, points) == pytest.approx(plain.project(ray), abs=1e-9)


def test_beyond_the_control_points_it_is_still_the_lens() -> None:
    """One point out there, and all go the long way."""
    camera = small_camera()
    points = np.vstack([points_within(5), [[0.0, 5.0, -1.5]]])
    assert not Surface.of(small_lens(), stereographic(points)).inside.all()
    inside = project(camera, points[:5])
    assert project(camera, points)[:5] == pytest.approx(inside, abs=1e-9)
    assert np.isfinite(project(camera, points)).all()


def test_the_weights_add_up_and_follow_their_slopes() -> None:
    lens = small_lens()
    u = stereographic(points_within(200))
    surface = Surface.of(lens, u)
    assert surface.weights.sum(axis=1) == pytest.approx(np.ones(200))
    assert surface.slopes.sum(axis=1) == pytest.approx(np.zeros((200, 2)), abs=1e-12)
    assert surface.spread(63).sum(axis=1) == pytest.approx(np.ones(200))
    control = np.reshape(lens.control, (-1, 2))
    h = 1e-6
    for axis in range(2):
        step = h * np.eye(2)[axis]
        ahead, behind = (Surface.of(lens, u + s).offset(control) for s in (step, -step))
        by_axis = surface.offset_slopes(control)[:, :, axis]
        assert by_axis == pytest.approx((ahead - behind) / (2 * h), abs=1e-8)


def test_stereographic_slopes() -> None:
    points, h = points_within(100, 120.0), 1e-6
    for axis, step in enumerate(h * np.eye(3)):
        difference = (stereographic(points + step) - stereographic(points - step)) / (2 * h)
        assert stereographic_slopes(points)[:, :, axis] == pytest.approx(difference, abs=1e-6)


def test_all_slopes_are_those_of_the_residuals() -> None:
    """d pixel by every control value and every pose against central differences, with skew."""
    camera, made = small_camera(), views_of(truth("stereographic", 100), 3, 71, noise_px=0.0)
    problem = BoardProblem(made.views, camera, FREE)
    state = State.of(problem.parameters.values, made.poses)
    by_values, by_pose = problem.slopes(state)
    k, h = by_values.shape[-1], 1e-6
    assert k == 2 * 9 * 7
    nothing = np.zeros((3, 6))
    for i in RNG.choice(k, 20, replace=False):
        step = h * np.eye(k)[i]
        ahead, behind = (problem.residuals(state.moved((s, nothing))) for s in (step, -step))
        assert by_values[:, :, i] == pytest.approx((behind - ahead) / (2 * h), abs=1e-5)
    for i in range(6):
        step = h * np.eye(6)[i] * np.ones((3, 1))
        ahead, behind = (problem.residuals(state.moved((np.zeros(k), s))) for s in (step, -step))
        # up to 1000 pixels a radian or metre; differences of 1e-6 are good to 1e-6 of that
        assert by_pose[:, :, i] == pytest.approx((behind - ahead) / (2 * h), rel=1e-5, abs=1e-3)


# The pull


def test_a_pull_costs_what_it_says() -> None:
    pull = Pull(np.array([1.0, 2.0]), np.diag([4.0, 0.5]))
    assert pull.cost(np.array([2.0, 0.0])) == pytest.approx(4.0 + 0.5 * 4)
    assert pull.right(np.array([2.0, 0.0])) == pytest.approx([-4.0, 1.0])


def test_it_starts_as_the_lens_it_is_pulled_to() -> None:
    """Where points were seen, to a tenth of what the pull lets it differ; and mrcal can read it."""
    camera = truth("kannala_brandt")
    made = views_of(camera, 10, 72)
    found = solve(camera, made.poses, made.views)
    start, pull = pulled_to(found, made.views, (16, 12))
    assert pull.cost(Parameters(start, FREE).values) == 0.0
    points = np.concatenate(
        [p.apply(v.points) for p, v in zip(made.poses, made.views, strict=True)]
    )
    assert rms(project(start, points) - project(found.camera, points)) < 0.1
    assert Parameters(start, FREE).names[0] == "control[0]"
    assert len(Parameters(start, FREE).names) == 2 * 16 * 12


def test_control_points_are_as_many_as_the_points_can_carry() -> None:
    camera = truth("equidistant")
    made = views_of(camera, 8, 73)
    found = solve(camera, made.poses, made.views, robust=False)
    across, down = usual_control(found, made.views)
    points = sum(len(view.pixels) for view in made.views)
    assert across * down == pytest.approx(points / 4, rel=0.2)
    assert across * down < np.prod(MOST)
    with pytest.raises(CalibrationError, match="2 x 12 control points: take 5 to 60"):
        calibrate(made.views, SIZE, FREE_FORM, control=(2, 12))


# What it follows


def dented() -> Camera:
    """An equidistant lens whose picture is pushed about by up to 3 pixels, smoothly, by no law."""
    base = make_camera(SIZE, Equidistant(300.0), center=CENTER, field_deg=220)
    splined = refit_splined(base, np.radians(110))
    lens = splined.lens
    assert isinstance(lens, SplinedStereographic)
    rows, columns = np.mgrid[: lens.ny, : lens.nx] / (lens.nx - 1)
    push = np.stack(
        [np.sin(9 * columns) * np.cos(7 * rows), np.cos(10 * rows) * np.sin(8 * columns + 1)], -1
    )
    control = np.ravel(lens.control) + 3.0 / lens.f * push.ravel()
    bent = SplinedStereographic(
        lens.f, 3, lens.nx, lens.ny, lens.fov_x_deg, tuple(map(float, control))
    )
    return make_camera(SIZE, bent, center=base.center, stretch=splined.stretch, field_deg=150)


@cache
def of_a_dented_lens() -> tuple[Camera, Simulated, Calibration]:
    camera = dented()
    made = simulate(camera, board(9, 6), 16, np.random.default_rng(74), noise_px=0.2)
    return camera, made, calibrate(made.views, SIZE, control=(11, 10))


def test_a_lens_that_is_like_no_other_gets_a_free_form() -> None:
    """By `auto`, at noise level, and predicted better than by any model of few parameters."""
    _, _, found = of_a_dented_lens()
    assert found.model == FREE_FORM
    assert found.rms_px < 0.3  # 0.283 of noise; the others are at 0.33 and more
    others = [c for c in found.candidates if c.model in AUTO]
    assert min(c.rms_px for c in others if c.solution) > 1.2 * found.rms_px
    predicted = [c.cross_validated_px for c in others]
    assert np.nanmin(predicted) > 1.1 * found.cross_validated_px
    assert any("predicts views left out better than" in line for line in sentences(found))


def test_it_is_nearer_to_the_truth_and_says_how_near() -> None:
    """Half as far off as the best other lens at most; within three of its own sigmas."""
    camera, made, found = of_a_dented_lens()
    others = [c for c in found.candidates if c.model in AUTO and c.solution]
    best = min(others, key=lambda c: c.cross_validated_px).solution
    assert best is not None
    pixels = some_pixels(found.views, found.solution)
    best_camera = make_camera(
        SIZE, best.camera.lens, center=best.camera.center, stretch=best.camera.stretch
    )
    assert rms(apart(camera, best_camera, pixels)) > 1.8 * rms(apart(camera, found.camera, pixels))
    assert sigmas_off(camera, found) < 3
    assert len(made.views) == len(found.views)


def test_round_lenses_are_left_alone() -> None:
    """Nothing is left to follow, and so nothing is tried."""
    made = views_of(truth("kannala_brandt"), 8, 75)
    found = calibrate(made.views, SIZE)
    assert found.model in AUTO
    assert FREE_FORM not in [c.model for c in found.candidates]
    assert promised_gain(found.solution, found.views) < 0.01


def test_asked_for_it_is_overfit_and_says_so() -> None:
    made = views_of(truth("equidistant"), 7, 76, noise_px=0.5)
    found = calibrate(made.views, SIZE, FREE_FORM, control=(12, 9))
    assert found.model == FREE_FORM
    assert found.control == (12, 9)
    by_name = {c.model: c for c in found.candidates}
    other = by_name[by_name[FREE_FORM].instead_of]
    assert found.rms_px < other.rms_px
    assert found.cross_validated_px > other.cross_validated_px
    assert any(line.startswith("overfit: splined_stereographic fits") for line in sentences(found))


def test_where_no_corner_was_seen_it_is_near_the_other_lens() -> None:
    """Views of the left half, noise of 0.2 px; 250 px beyond, without anything that holds it but
    the pull, it is less than a pixel away."""
    camera = truth("kannala_brandt")
    made = views_of(camera, 40, 77)
    left = [i for i, v in enumerate(made.views) if v.pixels[:, 0].max() < CENTER[0] - 20]
    assert len(left) > 4
    views, poses = [made.views[i] for i in left], [made.poses[i] for i in left]
    start = solve(camera, poses, views, robust=False)
    found = free_form(start, views, None, (12, 9))
    right = camera.ray(np.array([[CENTER[0] + 250.0, y] for y in (300.0, 430.0, 560.0)]))
    assert rms(project(found.camera, right) - project(start.camera, right)) < 1.0
    assert found.pull is not None


def test_left_out_one_by_one_it_is_solved_with_its_pull() -> None:
    camera = truth("equidistant", 160)
    made = views_of(camera, 6, 78, noise_px=0.2)
    start = solve(camera, made.poses, made.views, robust=False)
    found = free_form(start, made.views, None, (12, 9))
    assert cross_validate(found, made.views, FREE) == pytest.approx(0.29, abs=0.04)
