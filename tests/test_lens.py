"""Every model in `freelook.lens.MODELS` keeps what the rest relies on; a new one is tested by
naming it in `lens_examples.EXAMPLES`."""

from __future__ import annotations

from dataclasses import MISSING, fields
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.errors import ProfileError
from freelook.lens import (
    MODELS,
    BentLens,
    DoubleSphere,
    Equidistant,
    Equisolid,
    ExtendedUnified,
    FieldOfView,
    KannalaBrandt,
    KannalaBrandt9,
    Lens,
    Mei,
    OCamCalib,
    OpenCVRational,
    Orthographic,
    Perspective,
    Poly3,
    Poly5,
    Polynomial,
    PTLens,
    RadialSpline,
    RadTanThinPrismFisheye,
    Sony,
    SplinedStereographic,
    Stereographic,
    ThinPrismFisheye,
    angle_at_radius,
    growth_limit,
    image_point,
    model_name,
    parameters,
    radius_slope,
    vector,
    with_vector,
)
from lens_examples import ALL, EXAMPLES, Example

BENT = [example for example in ALL if isinstance(example.lens, BentLens)]


def needed(name: str) -> int:
    """How many of a model's parameters have no default."""
    return sum(field.default is MISSING for field in fields(MODELS[name]))  # type: ignore[arg-type]


def domain(example: Example) -> np.ndarray:
    """Angles from the axis to the end of the example's field, or just before growth ends."""
    end = min(np.radians(example.field_deg / 2), growth_limit(example.lens) - np.radians(0.1))
    return np.linspace(0, end, 4001)


def test_every_model_has_a_real_example() -> None:
    assert set(EXAMPLES) == set(MODELS)
    for name, examples in EXAMPLES.items():
        assert all(model_name(example.lens) == name for example in examples)
        assert not examples[0].source.startswith("made up")
        assert all(len(example.source) > 20 for example in examples)


@pytest.mark.parametrize("example", ALL, ids=str)
class TestEveryModel:
    def test_radius_is_zero_on_the_axis(self, example: Example) -> None:
        assert example.lens.radius(np.zeros(3)).tolist() == [0, 0, 0]

    def test_radius_grows_all_over_the_domain(self, example: Example) -> None:
        assert (np.diff(example.lens.radius(domain(example))) > 0).all()

    def test_field_lies_inside_the_domain(self, example: Example) -> None:
        assert example.camera.theta_max == pytest.approx(np.radians(example.field_deg / 2))

    def test_radius_keeps_the_shape(self, example: Example) -> None:
        theta = np.full((2, 3, 4), 0.3)
        assert example.lens.radius(theta).shape == (2, 3, 4)
        assert example.lens.radius(np.array(0.3)).shape == ()

    def test_slope_matches_coarser_differences(self, example: Example) -> None:
        theta = domain(example)[10:-10]
        h = 1e-4  # five points: error h^4, far below the tolerance
        r = [example.lens.radius(theta + k * h) for k in (-2, -1, 1, 2)]
        slope = (r[0] - 8 * r[1] + 8 * r[2] - r[3]) / (12 * h)
        np.testing.assert_allclose(radius_slope(example.lens, theta), slope, rtol=1e-4, atol=1e-3)

    def test_inverse_closes_the_round_trip(self, example: Example) -> None:
        theta = domain(example)
        radius = example.lens.radius(theta)
        back = angle_at_radius(example.lens, radius, theta[-1])
        np.testing.assert_allclose(example.lens.radius(back), radius, atol=1e-8)

    def test_inverse_is_nan_beyond_the_field(self, example: Example) -> None:
        theta_max = domain(example)[-1]
        beyond = example.lens.radius(np.array([theta_max])) * [[1.001], [2.0]]
        assert np.isnan(angle_at_radius(example.lens, beyond, theta_max)).all()

    def test_parameters_come_in_the_order_of_the_fields(self, example: Example) -> None:
        names = [f.name for f in fields(example.lens)]  # type: ignore[arg-type]
        assert list(parameters(example.lens)) == names
        assert type(example.lens)(**parameters(example.lens)) == example.lens

    def test_a_fit_may_change_every_number_that_is_not_fixed(self, example: Example) -> None:
        values = vector(example.lens)
        assert with_vector(example.lens, values) == example.lens
        changed = with_vector(example.lens, values + 1)
        np.testing.assert_allclose(vector(changed), values + 1)
        for field in fields(example.lens):  # type: ignore[arg-type]
            same = getattr(changed, field.name) == getattr(example.lens, field.name)
            assert same == bool(field.metadata.get("fixed")), field.name


@pytest.mark.parametrize("example", BENT, ids=str)
def test_offset_has_two_coordinates_and_one_value_on_the_axis(example: Example) -> None:
    assert isinstance(example.lens, BentLens)
    phi = np.linspace(-np.pi, np.pi, 7)
    assert example.lens.offset(np.full((2, 7), 0.3), np.tile(phi, (2, 1))).shape == (2, 7, 2)
    assert example.lens.offset(np.array(0.3), np.array(0.1)).shape == (2,)
    on_axis = example.lens.offset(np.zeros(7), phi)
    np.testing.assert_allclose(on_axis, on_axis[:1].repeat(7, axis=0), atol=1e-9)


@pytest.mark.parametrize("name", [name for name in MODELS if needed(name) == 1])
def test_the_scale_alone_makes_a_lens(name: str) -> None:
    """What a fit starts from: the radius grows to 60 degrees and is proportional to the scale."""
    small, large = (MODELS[name](scale) for scale in (100.0, 300.0))  # type: ignore[call-arg]
    assert growth_limit(small) > np.radians(60)
    theta = np.radians([10.0, 30.0, 60.0])
    np.testing.assert_allclose(large.radius(theta), 3 * small.radius(theta), rtol=1e-12)


def test_what_was_measured_has_no_defaults() -> None:
    assert [name for name in MODELS if needed(name) > 1] == [
        "radial_spline",
        "splined_stereographic",
    ]


# ---- formulas, written out once more by hand


@pytest.mark.parametrize(
    ("lens", "at_60", "at_80"),
    [  # by hand, for f = 100: tan 60 = sqrt 3, 2 tan 30 = 2/sqrt 3, pi/3, 2 sin 30 = 1, ...
        (Perspective(100), 173.20508, 567.12818),
        (Stereographic(100), 115.47005, 167.81993),
        (Equidistant(100), 104.71976, 139.62634),
        (Equisolid(100), 100.0, 128.55752),
        (Orthographic(100), 86.60254, 98.48078),
    ],
    ids=str,
)
def test_classical_models_against_closed_forms(lens: Lens, at_60: float, at_80: float) -> None:
    radius = lens.radius(np.radians([60.0, 80.0]))
    np.testing.assert_allclose(radius, [at_60, at_80], atol=1e-5)


T, U = 0.5, np.tan(0.5)
SINE, COSINE = np.sin(0.5), np.cos(0.5)


@pytest.mark.parametrize(
    ("lens", "radius"),
    [
        (Polynomial(1, 2, 3, 4, 5), T + 2 * T**2 + 3 * T**3 + 4 * T**4 + 5 * T**5),
        (
            KannalaBrandt(100, 0.1, 0.2, 0.3, 0.4),
            100 * (T + 0.1 * T**3 + 0.2 * T**5 + 0.3 * T**7 + 0.4 * T**9),
        ),
        (
            KannalaBrandt9(100, *range(1, 10)),
            100 * (T + sum(k * T ** (2 * k + 1) for k in range(1, 10))),
        ),
        (
            Sony(100, 1, 2, 3, 4, 5, 6),
            100 * (T + 2 * T**2 + 3 * T**3 + 4 * T**4 + 5 * T**5 + 6 * T**6),
        ),
        (Poly3(100, 2), 100 * (U + 2 * U**3)),
        (Poly5(100, 2, 3), 100 * (U + 2 * U**3 + 3 * U**5)),
        (PTLens(100, 4, 3, 2), 100 * (U + 2 * U**2 + 3 * U**3 + 4 * U**4)),
        (FieldOfView(100, 0.9), 100 * np.arctan(2 * U * np.tan(0.45)) / 0.9),
        (
            DoubleSphere(100, -0.2, 0.6),
            100 * SINE / (0.6 * np.hypot(SINE, COSINE - 0.2) + 0.4 * (COSINE - 0.2)),
        ),
        (
            ExtendedUnified(100, 0.6, 1.1),
            100 * SINE / (0.6 * np.sqrt(1.1 * SINE**2 + COSINE**2) + 0.4 * COSINE),
        ),
        (Mei(100, 2.0), 100 * SINE / (COSINE + 2)),
        (
            OpenCVRational(100, k1=1, k2=2, k3=3, k4=4, k5=5, k6=6),
            100 * U * (1 + U**2 + 2 * U**4 + 3 * U**6) / (1 + 4 * U**2 + 5 * U**4 + 6 * U**6),
        ),
        (
            ThinPrismFisheye(100, k1=1, k2=2, k3=3, k4=4),
            100 * (T + T**3 + 2 * T**5 + 3 * T**7 + 4 * T**9),
        ),
        (
            RadTanThinPrismFisheye(100, 1, 2, 3, 4, 5, 6),
            100 * (T + sum((k + 1) * T ** (2 * k + 3) for k in range(6))),
        ),
    ],
    ids=lambda value: type(value).__name__,
)
def test_radius_is_the_written_formula(lens: Lens, radius: float) -> None:
    assert lens.radius(np.array([T]))[0] == pytest.approx(radius, rel=1e-13)


def test_related_models_meet() -> None:
    theta = np.linspace(0, np.radians(80), 50)
    same: list[tuple[Lens, Lens]] = [
        (FieldOfView(300, 1e-6), Perspective(300)),
        (ExtendedUnified(300, 0.5, 1), Stereographic(300)),
        (ExtendedUnified(300, 0, 1), Perspective(300)),
        (DoubleSphere(300, 0, 0.6), ExtendedUnified(300, 0.6, 1)),
        (DoubleSphere(300, 0.7, 0), Mei(300, 0.7)),
        (Mei(600, 1.0), Stereographic(300)),
        (OpenCVRational(300, 0.1, -0.02), Poly5(300, 0.1, -0.02)),
        (KannalaBrandt9(300, 0.1, 0.02, 0.003, 0.001), KannalaBrandt(300, 0.1, 0.02, 0.003, 0.001)),
        (OCamCalib(300, (-0.25,)), Stereographic(300)),  # z = 1 - q^2/4 is that paraboloid
        (OCamCalib(300, (0.0,)), Perspective(300)),
    ]
    for one, other in same:
        # the first differs from its limit by w^2 / 3 tan^2; the others by rounding
        np.testing.assert_allclose(
            one.radius(theta), other.radius(theta), rtol=2e-11, err_msg=f"{one} {other}"
        )


# ---- where models end


@pytest.mark.parametrize(
    ("lens", "limit_rad"),
    [
        (Perspective(1), np.pi / 2),
        (Orthographic(1), np.pi / 2),
        (Stereographic(1), np.pi),
        (Equidistant(1), np.pi),
        (Equisolid(1), np.pi),
        (Polynomial(1, 0, -1 / 3), 1.0),  # r' = 1 - theta^2
        (KannalaBrandt(1, -1 / 12), 2.0),  # r' = 1 - theta^2 / 4
        (Polynomial(-1), 0.0),
        (Polynomial(0, -1), 0.0),
        (Equidistant(-300), 0.0),
        (Equidistant(0), 0.0),
        (Equidistant(float("nan")), 0.0),
        (Equidistant(float("inf")), 0.0),
        (ExtendedUnified(1, 0.5), np.pi),
        (ExtendedUnified(1, 0.0), np.pi / 2),
        (ExtendedUnified(1, 1.0), np.pi / 2),  # sin(theta)
        (ExtendedUnified(1, 0.8), np.arccos(-0.25)),
        (ExtendedUnified(1, 0.5, 0.0), 0.0),
        (ExtendedUnified(1, 0.5, -1.0), 0.0),
        (Mei(1, 2.0), np.radians(120)),
        (Mei(1, 0.5), np.radians(120)),
        (Mei(1, -0.5), np.radians(60)),
        (Mei(1, -1.0), 0.0),
        (DoubleSphere(1, 0.0, 0.8), np.arccos(-0.25)),
        (DoubleSphere(1, 0.5, 0.0), np.radians(120)),  # Mei's
        (DoubleSphere(1, -1.0, 0.5), 0.0),
        (DoubleSphere(1, 1.1, 0.5), 0.0),
        (FieldOfView(1, 0.5), np.pi),
        (FieldOfView(1, 0.0), 0.0),
        (FieldOfView(1, -0.5), 0.0),
        (FieldOfView(1, 4.0), 0.0),
        (Poly3(1, -1 / 3), np.pi / 4),  # dr/dt = 1 - t^2
        (OpenCVRational(1, k4=-1.0), np.pi / 4),  # 1 - t^2 in the denominator
        (OpenCVRational(1, k4=1.0), np.pi / 4),  # t / (1 + t^2) turns at 1
        (OCamCalib(1, (0.25,)), np.arctan2(2.0, 2.0)),  # theta turns where 1 = q^2 / 4
        (RadialSpline((10.0, 20.0), (5.0, 10.0)), np.radians(20)),
        (RadialSpline((10.0, 20.0), (-5.0, 10.0)), 0.0),
    ],
    ids=str,
)
def test_growth_ends_where_the_slope_turns(lens: Lens, limit_rad: float) -> None:
    assert growth_limit(lens) == pytest.approx(limit_rad, abs=1e-6)


def test_growth_is_only_sought_up_to_where_asked() -> None:
    assert growth_limit(Equidistant(1), up_to=0.7) == pytest.approx(0.7)


def rounded(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers as in files: none of them 1e-300."""
    return st.floats(low, high).map(lambda value: round(value, 6))


@given(alpha=rounded(-3, 3), xi=rounded(-0.99, 1.0), beta=rounded(0.01, 10))
def test_sphere_models_grow_to_their_limit_and_no_farther(
    alpha: float, xi: float, beta: float
) -> None:
    for lens in (DoubleSphere(1.0, xi, alpha), ExtendedUnified(1.0, alpha, beta), Mei(1.0, xi + 1)):
        limit = lens.hard_limit
        assert growth_limit(lens) == pytest.approx(limit, abs=2e-4), lens
        if 0.01 < limit < np.pi - 0.01:
            before, after = lens.radius(np.array([limit - 1e-4, limit + 1e-4]))
            infinite = before > 50 or after < 0 or after > 50
            assert infinite or abs(after - before) < 1e-5 + 1e-3 * before, lens


# ---- models that are more than a formula


def test_ocamcalib_inverts_its_polynomial() -> None:
    lens = EXAMPLES["ocamcalib"][0].lens
    assert isinstance(lens, OCamCalib)
    a0, a1, a2, a3, a4 = lens.coefficients
    assert (a0, a1) == (551.7655, 0.0)
    rho = np.linspace(0.0, 1200.0, 5000)  # twice the picture, past 130 degrees
    theta = np.arctan2(rho, a0 + a2 * rho**2 + a3 * rho**3 + a4 * rho**4)
    assert theta[-1] > np.radians(130)
    np.testing.assert_allclose(lens.radius(theta), rho, rtol=1e-12)


def test_ocamcalib_agrees_with_the_toolbox_and_its_own_inverse() -> None:
    """The same file's inverse polynomial, fitted there to 0.01 px over the picture's 75 degrees."""
    inverse = [730.949123, 315.876984, -177.960849, -352.468231]
    inverse += [-678.144608, -615.917273, -262.086205, -42.961956]
    lens = EXAMPLES["ocamcalib"][0].lens
    theta = np.radians(np.linspace(5, 75, 50))
    rho = np.polynomial.Polynomial(inverse)(theta - np.pi / 2)  # theirs counts from the plane down
    np.testing.assert_allclose(lens.radius(theta), rho, atol=0.01)


def test_ocamcalib_takes_both_signs() -> None:
    ours = OCamCalib.from_coefficients((500.0, 0.0, -8e-4, 6e-7))
    theirs = OCamCalib.from_coefficients((-500.0, 0.0, 8e-4, -6e-7))
    assert ours == theirs
    assert ours.f == 500
    np.testing.assert_allclose(ours.taylor, (-8e-4 * 500, 6e-7 * 500**2))
    np.testing.assert_allclose(ours.coefficients, (500.0, 0.0, -8e-4, 6e-7))


@given(st.lists(rounded(-1, 1), min_size=1, max_size=9), st.floats(0.01, 0.999))
def test_any_taylor_lens_is_inverted_as_far_as_it_grows(taylor: list[float], part: float) -> None:
    lens = OCamCalib(1.0, tuple(taylor))
    theta = np.array([lens.hard_limit * part])
    q = lens.radius(theta)[0]
    z = 1 + sum(t * q ** (k + 2) for k, t in enumerate(taylor))
    # rounding of z, seen as an angle
    assert np.arctan2(q, z) == pytest.approx(theta[0], rel=1e-9, abs=1e-12)


def test_radial_spline_goes_through_its_points_smoothly() -> None:
    lens = EXAMPLES["radial_spline"][0].lens
    assert isinstance(lens, RadialSpline)
    np.testing.assert_allclose(lens.radius(np.radians(lens.angles_deg)), lens.radii_px, atol=1e-9)
    curve = EXAMPLES["kannala_brandt"][1].lens
    theta = np.radians(np.linspace(0, 93, 500))
    # cubic pieces of 10 degrees on a curve this bent
    np.testing.assert_allclose(lens.radius(theta), curve.radius(theta), atol=0.05)
    h = 1e-3
    for knot in np.radians((10.0, 50.0, 80.0)):  # the second derivative has no jump
        r = lens.radius(knot + h * np.arange(-4, 5))
        left, right = r[0] - 2 * r[2] + r[4], r[4] - 2 * r[6] + r[8]
        # pixels per square radian; the third derivative, some 1000, is what is left over 4 h
        assert right / (2 * h) ** 2 == pytest.approx(left / (2 * h) ** 2, abs=4 * h * 2000)
    assert RadialSpline((0.0, 10.0, 20.0), (0.0, 5.0, 9.0)).radius(np.array([0.1])) == RadialSpline(
        (10.0, 20.0), (5.0, 9.0)
    ).radius(np.array([0.1]))


def test_splined_lens_of_zeros_is_stereographic() -> None:
    for order in (2, 3):
        lens = SplinedStereographic(300.0, order, 7, 5, 120.0, (0.0,) * 70)
        theta, phi = np.radians([0.0, 30.0, 70.0]), np.array([0.0, 1.0, -2.0])
        stereographic = image_point(Stereographic(300.0), theta, phi)
        np.testing.assert_allclose(image_point(lens, theta, phi), stereographic, atol=1e-10)


def test_splined_lens_has_control_points_where_mrcal_has_its_knots() -> None:
    """mrcal.knots_for_splined_models('LENSMODEL_SPLINED_STEREOGRAPHIC_order=2_Nx=4_Ny=3_
    fov_x_deg=200'), from its documentation: x from -3.57526078, y from -2.38350719."""
    lens = SplinedStereographic(1.0, 2, 4, 3, 200.0, (0.0,) * 24)
    assert 3 * lens.spacing / 2 == pytest.approx(3.57526078, abs=1e-8)
    assert lens.hard_limit == pytest.approx(2 * np.arctan(np.hypot(3.57526078, 2.38350719) / 2))


def test_splined_lens_reads_whole_numbers_from_json() -> None:
    lens = SplinedStereographic(300.0, 3.0, 7.0, 5.0, 120.0, (0.0,) * 70)  # type: ignore[arg-type]
    assert parameters(lens)["order"] == 3
    assert isinstance(lens.nx, int)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (
            lambda: RadialSpline((1.0, 2.0), (1.0,)),
            "as many angles as radii, at least 2, not 2 and",
        ),
        (lambda: RadialSpline((1.0,), (1.0,)), "at least 2"),
        (lambda: RadialSpline((2.0, 1.0), (1.0, 2.0)), "must grow from 0 to at most 180"),
        (lambda: RadialSpline((-2.0, 1.0), (1.0, 2.0)), "must grow from 0"),
        (lambda: RadialSpline((1.0, 190.0), (1.0, 2.0)), "at most 180"),
        (lambda: RadialSpline((0.0, 1.0), (1.0, 2.0)), "is 0 at 0 degrees, not 1.0 px"),
        (lambda: RadialSpline(1.0, 2.0), "must be lists"),  # type: ignore[arg-type]
        (lambda: OCamCalib(300, ()), "a list of 1 to 16 numbers"),
        (lambda: OCamCalib(300, (0.0,) * 17), "a list of 1 to 16 numbers"),
        (lambda: OCamCalib(300, 0.5), "must be a list"),  # type: ignore[arg-type]
        (lambda: OCamCalib.from_coefficients((0.0, 0.0, 1.0)), "a0, a1 = 0, a2"),
        (lambda: OCamCalib.from_coefficients((1.0, 0.1, 1.0)), "a0, a1 = 0, a2"),
        (lambda: OCamCalib.from_coefficients((1e200, 0.0, 1.0, 1.0, 1.0)), "no lens has"),
        (lambda: splined(order=4), "order of a splined lens must be 2 or 3, not 4"),
        (lambda: splined(order=2.5), "order of a splined lens must be a whole number, not 2.5"),
        (lambda: splined(nx=3), "at least 4, not 3 and 5"),
        (lambda: splined(fov_x_deg=400.0), "fov_x_deg must be 1 to 355"),
        (lambda: splined(control=(0.0,)), "a list of 70 numbers"),
    ],
)
def test_what_cannot_be_a_lens_is_refused_at_once(make: Any, words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        make()


def splined(**changes: Any) -> SplinedStereographic:
    usual: dict[str, Any] = {
        "f": 300.0,
        "order": 3,
        "nx": 7,
        "ny": 5,
        "fov_x_deg": 120.0,
        "control": (0.0,) * 70,
    }
    return SplinedStereographic(**(usual | changes))
