"""What is stated about uncertainty is what happens: 200 calibrations of the same views."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from boards import field_camera, some_pixels, squared_sigmas, truth, views_of

from freelook.bench.boards import noisy_again
from freelook.bench.calibration_trials import apart
from freelook.calibration.bundle import Solution, solve
from freelook.calibration.doubts import typical_uncertainty
from freelook.calibration.parameters import Freedom, Parameters
from freelook.calibration.uncertainty import grid_of, projection_uncertainty
from freelook.calibration.views import View
from freelook.lens import Floats

FREE = Freedom()
NOISE_PX = 0.3
TRIALS = 200  # the standard deviation of 200 values is itself known to 5 %


@dataclass(frozen=True)
class Trials:
    """values (trials, k) found; sigma (trials, k) stated; off (trials, n, 2) of the projection at
    places (n, 2), each after the turn that suits it best; stated (trials, n) there."""

    values: Floats
    sigma: Floats
    off: Floats
    stated: Floats
    together: Floats


@cache
def trials(model: str) -> Trials:
    camera = truth(model)
    made = views_of(camera, 8, 21, noise_px=0.0)
    rng = np.random.default_rng(22)
    exact = solve(camera, made.poses, made.views, robust=False)
    places = some_pixels(made.views, exact, 40)
    values, sigma, off, stated, together = [], [], [], [], []
    for _ in range(TRIALS):
        views = tuple(noisy_again(made, rng, NOISE_PX))
        found = solve(camera, made.poses, views, robust=False)
        values.append(Parameters(found.camera, FREE).values)
        sigma.append(np.sqrt(np.diag(found.covariance)))
        with_field = field_camera(found, views)
        off.append(apart(camera, with_field, places))
        stated.append(projection_uncertainty(with_field, found, FREE, places).sigma_px)
        together.append(found.together)
    return Trials(*map(np.array, (values, sigma, off, stated, together)))


MODELS = ["kannala_brandt", "eucm"]


@pytest.mark.parametrize("model", MODELS)
def test_parameters_spread_as_stated(model: str) -> None:
    """Within 20 %: four times what chance does to the spread of 200 values."""
    run = trials(model)
    stated = np.sqrt(np.mean(run.sigma**2, axis=0))
    assert run.values.std(axis=0) / stated == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("model", MODELS)
def test_parameters_are_right_on_average(model: str) -> None:
    """The mean of 200 is off by less than four of its own standard deviations."""
    run, camera = trials(model), truth(model)
    right = Parameters(camera, FREE).values
    error = run.values.std(axis=0) / np.sqrt(TRIALS)
    # what bends with the noise adds to that; for 0.3 pixels it is a tenth of a sigma
    bent = 0.15 * run.values.std(axis=0)
    assert (np.abs(run.values.mean(axis=0) - right) < 4 * error + bent).all()


@pytest.mark.parametrize("model", MODELS)
def test_the_projection_spreads_as_stated(model: str) -> None:
    """At forty places all over the picture, after taking out the turn nobody sees."""
    run = trials(model)
    covariances = np.einsum("tni,tnj->nij", run.off, run.off) / TRIALS
    spread = np.sqrt(np.linalg.eigvalsh(covariances)[:, -1])
    stated = np.sqrt(np.mean(run.stated**2, axis=0))
    assert np.isfinite(stated).all()
    assert spread / stated == pytest.approx(1.0, abs=0.2)


@pytest.mark.parametrize("model", MODELS)
def test_independent_errors_are_seen_to_be_independent(model: str) -> None:
    run = trials(model)
    assert run.together.min() >= 1.0
    assert run.together.mean() < 1.1


def test_errors_that_go_together_are_stated_as_such() -> None:
    """All corners of a picture shifted by a warp of their own: the parameters spread far more than
    single errors of that size would make them, and that is what is stated."""
    camera = truth("kannala_brandt")
    made = views_of(camera, 16, 23, noise_px=0.0)
    rng = np.random.default_rng(24)
    values, sigma, naive = [], [], []
    for _ in range(60):
        views = [_warped(view, rng) for view in made.views]
        found = solve(camera, made.poses, views, robust=False)
        values.append(Parameters(found.camera, FREE).values)
        sigma.append(np.sqrt(np.diag(found.covariance)))
        naive.append(sigma[-1] / found.together)
    spread = np.array(values).std(axis=0)
    stated, single = (np.sqrt(np.mean(np.square(s), axis=0)) for s in (sigma, naive))
    # one number for all parameters, and 60 trials: within a third
    assert np.median(spread / stated) == pytest.approx(1.0, abs=0.33)
    assert np.median(spread / single) > 2.0


def _warped(view: View, rng: np.random.Generator) -> View:
    """Pixels moved by a random quadratic map of the board, 0.3 pixels typically."""
    x, y, _ = (view.points / np.abs(view.points).max(axis=0).max()).T
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    return View(view.name, view.points, view.pixels + terms @ rng.normal(0, 0.2, (6, 2)))


def test_all_simulated_parameters_are_within_their_sigmas() -> None:
    """Eight models, three noises, a fifth of the points wrong. The squared Mahalanobis distances
    of right solutions sum to a chi-square variable: within four of its standard deviations."""
    total = degrees = 0.0
    models = ("equidistant", "equisolid", "stereographic", "polynomial", "kannala_brandt")
    for seed, model in enumerate((*models, "sony", "eucm", "radial_spline")):
        for field, noise in ((188, 0.1), (200, 0.3), (160, 0.5)):
            camera = truth(model, field)
            made = views_of(camera, 10, 100 + seed, noise_px=noise, outliers=0.2)
            found = solve(camera, made.poses, made.views)
            squared, count = squared_sigmas(camera, found, FREE)
            assert squared < count + 6 * np.sqrt(2 * count), (model, field)
            total, degrees = total + squared, degrees + count
    assert abs(total - degrees) < 4 * np.sqrt(2 * degrees)


def solved(count: int = 8, noise_px: float = NOISE_PX) -> tuple[Solution, tuple[View, ...]]:
    camera = truth("kannala_brandt")
    made = views_of(camera, count, 25, noise_px=noise_px)
    return solve(camera, made.poses, made.views), made.views


def test_more_views_make_it_surer() -> None:
    """Four times the views: about half the uncertainty."""
    few, many = (typical_uncertainty(*solved(count), FREE) for count in (8, 32))
    assert 0.3 < many / few < 0.75


def test_views_on_one_side_leave_it_less_sure_than_views_all_around() -> None:
    """As many views, of the left half only: a round lens is then less sure of all of the picture,
    not only of the right half."""
    camera = truth("kannala_brandt")
    made = views_of(camera, 30, 26, noise_px=NOISE_PX)
    left = [i for i, v in enumerate(made.views) if v.pixels[:, 0].max() < camera.center[0]]
    assert len(left) > 4
    unsure = []
    for chosen in (left, range(len(left))):
        views = tuple(made.views[i] for i in chosen)
        found = solve(camera, [made.poses[i] for i in chosen], views)
        unsure.append(typical_uncertainty(found, views, FREE))
    assert unsure[0] > 1.5 * unsure[1]


def test_outside_the_field_nothing_is_known() -> None:
    found, views = solved()
    camera, corner = field_camera(found, views), np.array([[0.0, 0.0]])
    assert np.isnan(projection_uncertainty(camera, found, FREE, corner).sigma_px).all()


def test_a_grid_covers_the_picture_evenly() -> None:
    grid = grid_of((100, 50), 10)
    assert grid.shape == (50, 2)
    assert grid.mean(axis=0) == pytest.approx([49.5, 24.5])
    assert grid.min(axis=0) == pytest.approx([4.5, 4.5])
