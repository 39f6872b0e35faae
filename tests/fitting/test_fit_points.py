"""`fit_points`: whole cameras come back from points and pixels."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.camera import Camera, make_camera
from freelook.errors import FitError
from freelook.fitting import fit_points, rank
from freelook.lens import Equidistant, Floats, KannalaBrandt, Mei

KB = KannalaBrandt(278.667, -0.0137, 0.0207, -0.01279, 0.00252)
CAMERA = make_camera(
    (1000, 980), KB, center=(503.2, 481.7), field_deg=186, stretch=np.diag([1, 0.9972])
)
TRUTH = {
    **{"f": 278.667, "k1": -0.0137, "k2": 0.0207, "k3": -0.01279, "k4": 0.00252},
    **{"center_x": 503.2, "center_y": 481.7, "stretch_yy": 0.9972},
}


def points_for(rng: np.random.Generator, count: int = 300, reach_deg: float = 92) -> Floats:
    """(n, 3), evenly over the sphere out to an angle, one to three units away."""
    cosine = 1 - rng.random(count) * (1 - np.cos(np.radians(reach_deg)))
    phi, sine = rng.uniform(0, 2 * np.pi, count), np.sqrt(1 - cosine**2)
    ray = np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine], axis=-1)
    return ray * rng.uniform(1, 3, (count, 1))


def apart_px(a: Camera, b: Camera) -> float:
    rays = points_for(np.random.default_rng(1), 500, 90)
    return float(np.nanmax(np.linalg.norm(a.project(rays) - b.project(rays), axis=-1)))


def test_exact_points_give_the_camera_back(rng: np.random.Generator) -> None:
    points = points_for(rng)
    fit = fit_points("kannala_brandt", points, CAMERA.project(points), CAMERA.size, loss="linear")
    assert apart_px(fit.camera, CAMERA) < 1e-6
    assert fit.exact
    # nothing is claimed beyond the outermost point
    outermost = np.arctan2(np.hypot(points[:, 0], points[:, 1]), points[:, 2]).max()
    assert fit.camera.theta_max == pytest.approx(outermost)


def test_errors_are_as_large_as_claimed(rng: np.random.Generator) -> None:
    """Mean square of error / sigma over 12 experiments, for 8 parameters, from one fixed seed.

    Each of them alone would be chi-square with 12 degrees of freedom over 12: 99.9 % within
    0.18 and 2.9.
    """
    squares = []
    for _ in range(12):
        points = points_for(rng)
        pixel = CAMERA.project(points) + rng.normal(0, 0.3, (len(points), 2))
        fit = fit_points("kannala_brandt", points, pixel, CAMERA.size, loss="linear")
        squares.append([((fit.values[n] - TRUTH[n]) / fit.sigma[n]) ** 2 for n in TRUTH])
        # per coordinate; of 600 its own error is 3 %
        assert fit.noise_px == pytest.approx(0.3, rel=0.15)
        assert fit.rms_px == pytest.approx(0.3 * np.sqrt(2), rel=0.15)
    means = np.mean(squares, axis=0)
    assert (means > 0.18).all()
    assert (means < 2.9).all()


def test_outliers_hardly_pull(rng: np.random.Generator) -> None:
    points = points_for(rng)
    pixel = CAMERA.project(points) + rng.normal(0, 0.3, (len(points), 2))
    wrong = rng.permutation(len(points))[:30]
    pixel[wrong] += [35, 20]
    robust = fit_points("kannala_brandt", points, pixel, CAMERA.size)
    plain = fit_points("kannala_brandt", points, pixel, CAMERA.size, loss="linear")
    assert apart_px(robust.camera, CAMERA) < 0.5
    assert apart_px(plain.camera, CAMERA) > 2
    assert set(np.flatnonzero(robust.outliers)) == set(wrong)


def test_the_pose_is_found_too(rng: np.random.Generator) -> None:
    points = points_for(rng)
    turn, move = Rotation.from_rotvec([0.1, -0.2, 0.3]), np.array([0.1, 0.2, 0.3])
    given = turn.inv().apply(points - move)
    nearly = (Rotation.from_rotvec([0.05, -0.15, 0.3]), np.zeros(3))
    fit = fit_points(
        "kannala_brandt", given, CAMERA.project(points), CAMERA.size, pose=nearly, loss="linear"
    )
    found_turn, found_move = fit.camera_from_points
    assert found_turn.approx_equal(turn, atol=1e-8)
    np.testing.assert_allclose(found_move, move, atol=1e-8)
    assert apart_px(fit.camera, CAMERA) < 1e-6


def test_bends_are_found_where_they_are(rng: np.random.Generator) -> None:
    bent = make_camera((1280, 966), Mei(900, 1.1, -0.1, 0.02, 0, 1e-3, -5e-4), field_deg=160)
    points = points_for(rng, reach_deg=79)
    pixel = bent.project(points) + rng.normal(0, 0.1, (len(points), 2))
    fits = [
        fit_points(name, points, pixel, bent.size)
        for name in ("kannala_brandt", "thin_prism_fisheye", "rad_tan_thin_prism_fisheye")
    ]
    best, second, third = rank(fits)
    assert best.model == "rad_tan_thin_prism_fisheye"
    assert third.model == "kannala_brandt"
    assert best.rms_px < second.rms_px < third.rms_px / 2
    assert apart_px(best.camera, bent) < 0.2


def test_points_left_out_are_predicted_a_little_worse(rng: np.random.Generator) -> None:
    points = points_for(rng, 60)
    pixel = CAMERA.project(points) + rng.normal(0, 0.3, (60, 2))
    fit = fit_points("kannala_brandt", points, pixel, CAMERA.size, loss="linear")
    # 8 parameters from 120 numbers: (1 + 8/120) / (1 - 8/120) in the mean square, about
    assert 1.02 < fit.cv_ratio < 1.3
    assert not fit.overfit
    few = fit_points("kannala_brandt", points[:7], pixel[:7], CAMERA.size, loss="linear")
    assert few.overfit


def test_measured_radii_lie_on_the_curve(rng: np.random.Generator) -> None:
    points = points_for(rng)
    pixel = CAMERA.project(points) + rng.normal(0, 0.3, (len(points), 2))
    fit = fit_points("kannala_brandt", points, pixel, CAMERA.size)
    theta, radius = fit.measured
    # beside the axis a residual is not along the radius
    far = theta > 0.1
    np.testing.assert_allclose((radius - fit(theta))[far], fit.radial_residuals_px[far], atol=0.02)
    at = np.radians([10.0, 45, 85])
    band = fit.band(at)
    assert (np.abs(fit(at) - KB.radius(at)) < 4 * band).all()
    assert (band < 0.3).all()


@pytest.mark.parametrize(
    ("which", "names"),
    [
        ("none", ()),
        ("aspect", ("stretch_yy",)),
        ("skew", ("stretch_xy", "stretch_yy")),
        ("free", ("stretch_xy", "stretch_yx", "stretch_yy")),
    ],
)
def test_the_stretch_that_is_asked_for_is_sought(
    which: str, names: tuple[str, ...], rng: np.random.Generator
) -> None:
    points = points_for(rng, 40)
    fit = fit_points("equidistant", points, CAMERA.project(points), CAMERA.size, stretch=which)
    assert fit.names == ("f", "center_x", "center_y", *names)


GOOD = points_for(np.random.default_rng(3), 30)
PIXEL = CAMERA.project(GOOD)


@pytest.mark.parametrize(
    ("model", "points", "pixel", "options", "message"),
    [
        ("fisheye", GOOD, PIXEL, {}, "unknown lens model"),
        ("splined_stereographic", GOOD, PIXEL, {}, "cannot be fitted to points"),
        ("equidistant", GOOD[:3], PIXEL[:3], {}, "3 points are too few"),
        ("kannala_brandt", GOOD[:4], PIXEL[:4], {}, "needs"),
        ("equidistant", GOOD, PIXEL[:-1], {}, "not of shapes"),
        ("equidistant", GOOD * np.nan, PIXEL, {}, "finite"),
        ("equidistant", GOOD * 0, PIXEL, {}, "in the camera itself"),
        ("equidistant", GOOD * [1, -1, 1], PIXEL, {}, "y down and z forward"),
        ("perspective", GOOD, PIXEL, {}, "perspective lenses end at 90 degrees"),
        ("equidistant", GOOD, PIXEL, {"stretch": "round"}, "unknown stretch 'round'"),
        ("equidistant", GOOD, PIXEL, {"loss": "cubic"}, "unknown loss 'cubic'"),
    ],
)
def test_impossible_points_are_refused(
    model: str, points: Floats, pixel: Floats, options: dict[str, str], message: str
) -> None:
    with pytest.raises(FitError, match=message):
        fit_points(model, points, pixel, CAMERA.size, **options)  # type: ignore[arg-type]


def test_pixels_of_a_smaller_picture_give_the_same_lens_smaller(rng: np.random.Generator) -> None:
    points = points_for(rng, 60)
    camera = make_camera((600, 600), Equidistant(150), field_deg=186)
    small = camera.resized((300, 300))
    fit = fit_points("equidistant", points, small.project(points), (300, 300), loss="linear")
    assert fit.values["f"] == pytest.approx(75)
    assert fit.camera.center == pytest.approx((149.5, 149.5))
