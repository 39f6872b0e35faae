"""Every model in `freelook.lens.MODELS` keeps what the rest relies on; a new one is tested by
naming it in `EXAMPLES`."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from freelook.lens import (
    MODELS,
    Equidistant,
    Equisolid,
    KannalaBrandt,
    Lens,
    Orthographic,
    Perspective,
    Polynomial,
    Stereographic,
    angle_at_radius,
    growth_limit,
    model_name,
    parameters,
    radius_slope,
)

EXAMPLES: dict[str, list[Lens]] = {
    "perspective": [Perspective(300)],
    "stereographic": [Stereographic(300)],
    "equidistant": [Equidistant(300), Equidistant(1500)],
    "equisolid": [Equisolid(300)],
    "orthographic": [Orthographic(300)],
    "polynomial": [Polynomial(300), Polynomial(300, -5, 10, -8, 1)],
    "kannala_brandt": [KannalaBrandt(685.5, -0.1586, 0.01716, -0.01452, 0.00759)],
}
ALL = [lens for lenses in EXAMPLES.values() for lens in lenses]


def domain(lens: Lens) -> np.ndarray:
    """Angles from the axis to 0.1 degrees before the radius stops growing (or 140 degrees)."""
    return np.linspace(0, min(growth_limit(lens), np.radians(140)) - np.radians(0.1), 4001)


def test_every_model_has_an_example() -> None:
    assert set(EXAMPLES) == set(MODELS)
    for name, lenses in EXAMPLES.items():
        assert all(model_name(lens) == name for lens in lenses)


@pytest.mark.parametrize("lens", ALL, ids=str)
class TestEveryModel:
    def test_radius_is_zero_on_the_axis(self, lens: Lens) -> None:
        assert lens.radius(np.zeros(3)).tolist() == [0, 0, 0]

    def test_radius_grows_all_over_the_domain(self, lens: Lens) -> None:
        assert (np.diff(lens.radius(domain(lens))) > 0).all()

    def test_radius_keeps_the_shape(self, lens: Lens) -> None:
        theta = np.full((2, 3, 4), 0.3)
        assert lens.radius(theta).shape == (2, 3, 4)

    def test_slope_matches_coarser_differences(self, lens: Lens) -> None:
        theta = domain(lens)[10:-10]
        h = 1e-4  # five points: error h^4, far below the tolerance
        r = [lens.radius(theta + k * h) for k in (-2, -1, 1, 2)]
        slope = (r[0] - 8 * r[1] + 8 * r[2] - r[3]) / (12 * h)
        np.testing.assert_allclose(radius_slope(lens, theta), slope, rtol=1e-4, atol=1e-3)

    def test_inverse_closes_the_round_trip(self, lens: Lens) -> None:
        theta = domain(lens)
        radius = lens.radius(theta)
        radius = radius[radius < 15_000]  # a sensor's worth: tan(theta) goes on for ever
        back = angle_at_radius(lens, radius, theta[-1])
        np.testing.assert_allclose(lens.radius(back), radius, atol=1e-8)

    def test_inverse_is_nan_beyond_the_field(self, lens: Lens) -> None:
        theta_max = domain(lens)[-1]
        beyond = lens.radius(np.array([theta_max])) * [[1.001], [2.0]]
        assert np.isnan(angle_at_radius(lens, beyond, theta_max)).all()

    def test_parameters_come_in_the_order_of_the_fields(self, lens: Lens) -> None:
        names = [f.name for f in fields(lens)]  # type: ignore[arg-type]
        assert list(parameters(lens)) == names
        assert type(lens)(**parameters(lens)) == lens


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


def test_polynomial_is_the_written_sum() -> None:
    theta = np.array([0.5])
    expected = 1 * 0.5 + 2 * 0.25 + 3 * 0.125 + 4 * 0.0625 + 5 * 0.03125
    assert Polynomial(1, 2, 3, 4, 5).radius(theta)[0] == pytest.approx(expected)


def test_kannala_brandt_is_the_written_sum() -> None:
    t = 0.5
    expected = 100 * (t + 0.1 * t**3 + 0.2 * t**5 + 0.3 * t**7 + 0.4 * t**9)
    lens = KannalaBrandt(100, 0.1, 0.2, 0.3, 0.4)
    assert lens.radius(np.array([t]))[0] == pytest.approx(expected)


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
    ],
    ids=str,
)
def test_growth_ends_where_the_slope_turns(lens: Lens, limit_rad: float) -> None:
    assert growth_limit(lens) == pytest.approx(limit_rad, abs=1e-6)


def test_growth_is_only_sought_up_to_where_asked() -> None:
    assert growth_limit(Equidistant(1), up_to=0.7) == pytest.approx(0.7)


def test_the_papers_printed_polynomial_falls_first() -> None:
    """Equation (7) as printed: rounded coefficients, degrees to pixels; it is not monotonic."""
    p = np.polynomial.Polynomial([469, -5.3175, 0.4329, -0.0085, 7e-5, -2e-7])
    degrees = np.arange(0.0, 20.0, 0.1)
    lowest = degrees[np.argmin(p(degrees))]
    assert 6 < lowest < 9
    assert p(lowest) == pytest.approx(451, abs=1)
    per_radian = [c * np.degrees(1) ** k for k, c in enumerate(p.coef)]
    assert growth_limit(Polynomial(*map(float, per_radian[1:]))) == 0.0
