"""`fit_curve`: known lenses come back, with uncertainties that are right, outliers or not."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.errors import FitError
from freelook.fitting import CurveFit, curve_models, fit_curve, rank
from freelook.lens import (
    MODELS,
    Equidistant,
    Equisolid,
    ExtendedUnified,
    Floats,
    KannalaBrandt,
    Lens,
    Orthographic,
    Polynomial,
    growth_limit,
    vector,
)
from lens_examples import EXAMPLES

THETA = np.radians(np.arange(3.0, 94, 3))
KB = KannalaBrandt(278.667, -0.0137, 0.0207, -0.01279, 0.00252)
# the four are slower than the others together: their exactness is looked at with fewer points
SLOW = {"ocamcalib", "opencv_rational", "kannala_brandt_9", "rad_tan_thin_prism_fisheye"}


def noisy(lens: Lens, rng: np.random.Generator, sigma_px: float, theta: Floats = THETA) -> Floats:
    return lens.radius(theta) + rng.normal(0, sigma_px, len(theta))


@pytest.mark.parametrize("name", sorted(set(curve_models()) - {"radial_spline", "mei"}))
def test_every_model_comes_back_from_exact_radii(name: str) -> None:
    """To rounding, from starts that know nothing of the lens: the valleys are found."""
    example = EXAMPLES[name][0]
    theta = np.radians(np.linspace(2, example.field_deg / 2 - 0.5, 16 if name in SLOW else 40))
    fit = fit_curve(name, theta, example.lens.radius(theta), loss="linear")
    assert fit.rms_px < 1e-9
    assert fit.exact
    assert not fit.forced
    assert not fit.overfit
    along = np.linspace(0, theta[-1], 200)
    # between the points too, if there are more points than parameters
    np.testing.assert_allclose(fit(along), example.lens.radius(along), atol=1e-6)


def test_mei_comes_within_a_hundredth_of_a_pixel() -> None:
    """xi and the radial terms say nearly the same, so that there is more than one valley."""
    example = EXAMPLES["mei"][0]
    theta = np.radians(np.linspace(2, example.field_deg / 2 - 0.5, 40))
    assert fit_curve("mei", theta, example.lens.radius(theta), loss="linear").rms_px < 0.01


def test_a_spline_follows_any_smooth_curve() -> None:
    fit = fit_curve("radial_spline", THETA, KB.radius(THETA))
    along = np.linspace(0, THETA[-1], 300)
    # eight knots, so steps of 12 degrees
    np.testing.assert_allclose(fit(along), KB.radius(along), atol=0.2)


def test_a_lens_that_cannot_be_fitted_to_a_curve_says_what_can() -> None:
    with pytest.raises(FitError, match=r"take radial_spline"):
        fit_curve("splined_stereographic", THETA, KB.radius(THETA))
    assert set(curve_models()) < set(MODELS)


def normalised(fit: CurveFit, truth: Floats, lens: Lens, offset_px: float) -> tuple[Floats, Floats]:
    """(parameters, curve) minus truth, in the standard deviations that the fit claims."""
    values, sigma = (np.array(list(each.values())) for each in (fit.values, fit.sigma))
    at = np.radians([10.0, 45.0, 85.0])
    return (values - truth) / sigma, (fit(at) - lens.radius(at) - offset_px) / fit.band(at)


@pytest.mark.parametrize(
    ("lens", "name", "offset_px", "loss", "rounds"),
    [
        (Equisolid(300), "equisolid", 400.0, "soft_l1", 60),
        (Equisolid(300), "equisolid", 400.0, "linear", 60),
        (ExtendedUnified(280, 0.6, 1.1), "eucm", None, "linear", 20),
        (KB, "kannala_brandt", None, "linear", 20),
    ],
)
def test_errors_are_as_large_as_claimed(
    lens: Lens,
    name: str,
    offset_px: float | None,
    loss: str,
    rounds: int,
    rng: np.random.Generator,
) -> None:
    """Over many noisy experiments (one fixed seed) the mean square of error / sigma is 1.

    It has a chi-square distribution with `rounds` degrees of freedom over `rounds`: 99.9 % of it
    lie in 1 +- 0.65 for 60, and in 0.29 to 2.3 for 20.
    """
    truth = np.append(vector(lens), [] if offset_px is None else [offset_px])
    offset = offset_px or 0.0
    both = [
        normalised(
            fit_curve(
                name,
                THETA,
                noisy(lens, rng, 0.4) + offset,
                free_offset=offset_px is not None,
                loss=loss,
            ),
            truth,
            lens,
            offset,
        )
        for _ in range(rounds)
    ]
    for errors in (np.array([pair[0] for pair in both]), np.array([pair[1] for pair in both])):
        squares = np.mean(errors**2, axis=0)
        low, high = (0.35, 1.65) if rounds == 60 else (0.29, 2.3)
        assert (squares > low).all()
        assert (squares < high).all()


def test_ten_percent_of_outliers_hardly_pull(rng: np.random.Generator) -> None:
    theta = np.radians(np.linspace(2, 92, 60))
    radius = noisy(KB, rng, 0.3, theta)
    clean = fit_curve("kannala_brandt", theta, radius)
    wrong = rng.permutation(60)[:6]
    radius[wrong] += rng.uniform(5, 40, 6)  # all to one side: nothing cancels
    robust = fit_curve("kannala_brandt", theta, radius)
    plain = fit_curve("kannala_brandt", theta, radius, loss="linear")
    along = np.linspace(0, theta[-1], 200)
    off = [float(np.abs(fit(along) - KB.radius(along)).max()) for fit in (clean, robust, plain)]
    # one-sided outliers move a robust curve by some standard deviations of the clean one at most
    assert off[1] < 3 * float(clean.band(along).max())
    assert off[2] > 5 * off[1]
    assert set(np.flatnonzero(robust.outliers)) == set(wrong)
    assert robust.noise_px == pytest.approx(clean.noise_px, rel=0.3)


def test_cauchy_is_pulled_even_less(rng: np.random.Generator) -> None:
    theta = np.radians(np.linspace(2, 92, 60))
    radius = Equidistant(300).radius(theta) + rng.normal(0, 0.3, 60)
    radius[::6] += 30
    off = {
        loss: abs(fit_curve("equidistant", theta, radius, loss=loss).values["f"] - 300)
        for loss in ("linear", "soft_l1", "cauchy")
    }
    assert off["cauchy"] < off["soft_l1"] < off["linear"] / 5


def test_covariance_is_that_of_linear_least_squares(rng: np.random.Generator) -> None:
    """The polynomial is linear in all it has, so there is a closed form."""
    radius = noisy(Polynomial(300, -5, 10, -8, 1), rng, 0.5)
    fit = fit_curve("polynomial", THETA, radius, loss="linear")
    columns = THETA[:, None] ** np.arange(1, 6)
    answer, (squares,), *_ = np.linalg.lstsq(columns, radius)
    covariance = np.linalg.inv(columns.T @ columns) * squares / (len(THETA) - 5)
    np.testing.assert_allclose(list(fit.values.values()), answer, rtol=1e-6)
    np.testing.assert_allclose(fit.covariance, covariance, rtol=1e-4)
    band = np.sqrt(np.einsum("ni,ij,nj->n", columns, covariance, columns))
    np.testing.assert_allclose(fit.band(THETA), band, rtol=1e-4)


def test_cross_validation_is_leaving_one_out(rng: np.random.Generator) -> None:
    """For a linear model there is a closed form: r / (1 - h), h the leverage."""
    radius = noisy(Equidistant(300), rng, 0.5)
    fit = fit_curve("equidistant", THETA, radius, loss="linear")
    leverage = THETA**2 / np.sum(THETA**2)
    np.testing.assert_allclose(fit.cv_residuals_px, fit.residuals_px / (1 - leverage), atol=1e-6)
    assert fit.cv_rms_px > fit.rms_px


def test_many_points_are_left_out_in_ten_groups(rng: np.random.Generator) -> None:
    theta = np.radians(np.linspace(1, 90, 100))
    fit = fit_curve("equidistant", theta, noisy(Equidistant(300), rng, 0.5, theta), loss="linear")
    out = np.arange(100) % 10 == 3
    kept = fit_curve("equidistant", theta[~out], fit.measured[1][~out], loss="linear")
    expected = fit.measured[1][out] - kept(theta[out])
    np.testing.assert_allclose(fit.cv_residuals_px[out], expected, atol=1e-6)


def test_criteria_are_those_of_the_books(rng: np.random.Generator) -> None:
    """Normal noise: -2 ln L = n ln(2 pi RSS / n) + n; k = 2, the focal length and the noise."""
    fit = fit_curve("equidistant", THETA, noisy(Equidistant(300), rng, 0.5), loss="linear")
    n, k = len(THETA), 2
    minus_2_log_l = n * np.log(2 * np.pi * np.mean(fit.residuals_px**2)) + n
    assert fit.aic == pytest.approx(minus_2_log_l + 2 * k)
    assert fit.bic == pytest.approx(minus_2_log_l + k * np.log(n))
    assert fit.aicc == pytest.approx(fit.aic + 2 * k * (k + 1) / (n - k - 1))


def test_the_right_one_of_the_classical_models_wins(rng: np.random.Generator) -> None:
    names = ["stereographic", "equidistant", "equisolid", "kannala_brandt"]
    radius = noisy(Equisolid(300), rng, 0.5)
    ranked = rank([fit_curve(name, THETA, radius) for name in names])
    assert [fit.model for fit in ranked][:2] == ["equisolid", "kannala_brandt"]
    # four parameters more than needed: no better, and AICc charges about 2 for each
    assert 2 < ranked[1].aicc - ranked[0].aicc < 15


def test_ranking_needs_the_same_points(rng: np.random.Generator) -> None:
    radius = noisy(KB, rng, 0.3)
    fits = [fit_curve("equidistant", THETA[:n], radius[:n]) for n in (20, 25)]
    with pytest.raises(FitError, match="same points"):
        rank(fits)


def test_too_many_parameters_for_few_points_are_called_so(rng: np.random.Generator) -> None:
    few = THETA[::3]
    radius = noisy(Equidistant(300), rng, 0.5, few)
    assert fit_curve("kannala_brandt", few, radius, loss="linear").overfit
    assert not fit_curve("equidistant", few, radius, loss="linear").overfit


def test_weights_count(rng: np.random.Generator) -> None:
    radius = noisy(Equidistant(300), rng, 0.1)
    radius[-1] += 50
    sigma = np.full(len(THETA), 0.1)
    sigma[-1] = 100
    fit = fit_curve("equidistant", THETA, radius, sigma_px=sigma, loss="linear")
    assert fit.values["f"] == pytest.approx(300, abs=0.1)
    # only their ratio counts: the size of the noise is taken from the residuals
    twice = fit_curve("equidistant", THETA, radius, sigma_px=2 * sigma, loss="linear")
    assert twice.sigma["f"] == pytest.approx(fit.sigma["f"])
    assert twice.aicc == pytest.approx(fit.aicc)


def test_both_sides_of_the_axis_and_a_free_offset(rng: np.random.Generator) -> None:
    theta = np.radians(np.arange(-80.0, 81, 5))
    position = 412.3 + np.sign(theta) * KB.radius(np.abs(theta)) + rng.normal(0, 0.2, len(theta))
    fit = fit_curve("kannala_brandt", theta, position, free_offset=True)
    assert fit.names[-1] == "offset_px"
    assert fit.offset_px == pytest.approx(412.3, abs=4 * fit.sigma["offset_px"])
    assert fit.sigma["offset_px"] < 0.1
    np.testing.assert_allclose(fit(theta) + fit.residuals_px, position)


def test_what_the_points_do_not_determine_is_named() -> None:
    """Four angles, measured over and over: a polynomial of five terms is not determined."""
    theta = np.radians(np.repeat([20.0, 40, 60, 80], 5))
    fit = fit_curve("polynomial", theta, Equidistant(300).radius(theta))
    assert set(fit.undetermined) == set("abcde")
    assert set(fit.sigma.values()) == {np.inf}


# The paper's equation 7, printed coefficients: it falls up to about 7 degrees.
PRINTED = np.polynomial.Polynomial([0, -5.3175, 0.4329, -0.0085, 7e-5, -2e-7])


def test_a_radius_that_falls_is_not_returned() -> None:
    degrees = np.arange(1.0, 81)
    fit = fit_curve("polynomial", np.radians(degrees), PRINTED(degrees), loss="linear")
    assert fit.forced
    # the nearest that does not fall: 7.85 px if it may still fall between every 0.9 degrees
    assert fit.rms_px < 8.1
    assert growth_limit(fit.lens, np.radians(80)) == pytest.approx(np.radians(80))
    free = np.linalg.lstsq(degrees[:, None] ** np.arange(1, 6), PRINTED(degrees))[0]
    assert growth_limit(Polynomial(*(c * 57.29578**k for k, c in enumerate(free, 1)))) < 0.1


def test_radii_that_fall_with_the_angle_are_refused() -> None:
    with pytest.raises(FitError, match="grow with the angle"):
        fit_curve("equidistant", THETA, 500 - KB.radius(THETA), free_offset=True)


@pytest.mark.parametrize("name", ["perspective", "orthographic", "poly3", "opencv_rational"])
def test_models_that_end_before_the_data_say_so(name: str) -> None:
    with pytest.raises(FitError, match=f"{name} lenses end at 90 degrees.*go to 93"):
        fit_curve(name, THETA, KB.radius(THETA))


def test_a_rim_where_the_radius_stops_growing_is_no_trouble(rng: np.random.Generator) -> None:
    theta = np.radians(np.arange(2.0, 90.5, 2))
    radius = noisy(Orthographic(300), rng, 0.3, theta)
    for name in ("orthographic", "kannala_brandt"):
        fit = fit_curve(name, theta, radius)
        assert growth_limit(fit.lens, theta[-1]) >= theta[-1] * (1 - 1e-6)
        assert fit.noise_px < 0.6


@pytest.mark.parametrize(
    ("theta", "radius", "options", "message"),
    [
        (THETA, KB.radius(THETA)[:-1], {}, "one length"),
        (THETA[:3], KB.radius(THETA[:3]), {}, "needs at least 6|it needs 6 points, not 3"),
        (THETA, np.full(len(THETA), np.nan), {}, "finite"),
        (np.degrees(THETA), KB.radius(THETA), {}, "radians"),
        (THETA, KB.radius(THETA), {"sigma_px": 0.0}, "above 0"),
        (THETA, np.full(len(THETA), 7.0), {"free_offset": True}, "all radii are the same"),
        (THETA, KB.radius(THETA), {"loss": "cubic"}, "known: linear, soft_l1, cauchy"),
    ],
)
def test_impossible_points_are_refused(
    theta: Floats, radius: Floats, options: dict[str, object], message: str
) -> None:
    with pytest.raises(FitError, match=message):
        fit_curve("kannala_brandt", theta, radius, **options)  # type: ignore[arg-type]


def test_an_unknown_model_lists_the_known_ones() -> None:
    with pytest.raises(FitError, match=r"unknown lens model 'fisheye'; known: perspective, "):
        fit_curve("fisheye", THETA, KB.radius(THETA))
