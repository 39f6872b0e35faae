"""What the rounding of equation 7 allows, alone and together with equation 6."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.paper import agreement, printed
from freelook.paper.exhibit import Settings
from freelook.paper.rounding import Design, designs, half_width_px, within_rounding


@pytest.mark.parametrize(("theta", "pixels"), [(10, 0.61), (30, 7.16), (60, 115.16), (90, 660.65)])
def test_worst_case_of_the_rounding(theta: float, pixels: float) -> None:
    assert float(half_width_px(np.array(float(theta)))) == pytest.approx(pixels, abs=0.005)


def test_no_draw_leaves_the_worst_case_and_some_come_near(rng: np.random.Generator) -> None:
    angles = np.array([5.0, 30.0, 60.0, 90.0])
    curves = within_rounding(rng, 4000) @ printed.powers(angles).T
    strays = np.abs(curves - printed.quintic(angles)).max(axis=0)
    assert (strays <= half_width_px(angles)).all()
    # three terms count at most, so of 4000 draws some have all three near their ends
    assert (strays >= 0.8 * half_width_px(angles)).all()


def test_every_draw_falls_at_the_axis(rng: np.random.Generator) -> None:
    assert (within_rounding(rng, 1000)[:, 1] < -5.3).all()


@pytest.mark.parametrize("design", [Design(10, 90, 10), Design(0, 60, 5)])
def test_line_through_points_is_the_line_through_their_quintic(
    design: Design, rng: np.random.Generator
) -> None:
    """The fact all of it rests on: least squares onto quintics keeps the least squares line."""
    points = 400 + 3.5 * design.angles_deg + rng.normal(0, 20, len(design.angles_deg))
    fit, line = (
        np.asarray(np.polynomial.Polynomial.fit(design.angles_deg, points, n).convert().coef)
        for n in (5, 1)
    )
    # conditioning of the sixth power of 90 in 64-bit numbers
    np.testing.assert_allclose(design.line_of @ fit.astype(float), line.astype(float), rtol=1e-7)


def test_what_is_left_keeps_both_equations(rng: np.random.Generator) -> None:
    design = Design(10, 90, 10)
    found = design.coefficients(rng, 500)
    assert len(found) == 500
    assert (np.abs(found - printed.QUINTIC) <= printed.QUINTIC_HALF_UNITS).all()
    lines = found @ design.line_of.T
    # 1e-9: rounding in the solution of a 2 x 2 system with entries from 1e3 to 1e7
    off = np.abs(lines - printed.LINE)
    assert (off <= np.array(printed.LINE_HALF_UNITS) + 1e-9).all()


@pytest.mark.parametrize("theta", [30.0, 60.0, 90.0])
def test_linear_program_bounds_the_draws_tightly(theta: float, rng: np.random.Generator) -> None:
    """Two ways to the same range: draws never leave it, and fill most of it."""
    design = Design(10, 90, 10)
    ends = design.range_px(theta)
    assert ends is not None
    values = design.coefficients(rng, 20_000) @ printed.powers(np.array(theta))
    width = ends[1] - ends[0]
    assert ends[0] - 1e-6 <= values.min() <= ends[0] + 0.15 * width
    assert ends[1] - 0.15 * width <= values.max() <= ends[1] + 1e-6


def test_experiments_from_the_axis_on_contradict_the_print() -> None:
    left = agreement.possible(agreement.allowed_ranges())
    assert 0 < len(left) < len(designs())
    assert left["first_deg"].min() == 5
    for last in (60, 70, 80, 90):
        for step in (5, 10):
            assert Design(0, last, step).range_px(60.0) is None


def test_both_equations_narrow_the_curve_down() -> None:
    ends = Design(10, 90, 10).range_px(90.0)
    assert ends is not None
    low, high = ends
    assert high - low < 12 < float(half_width_px(np.array(90.0))) / 50
    assert low > float(printed.quintic(np.array(90.0))) + 30


def test_a_fall_as_printed_needs_a_late_first_angle() -> None:
    table = agreement.fall_shares(Settings(seed=1, draws=2000))
    first, noise, share = (table[name] for name in ("first angle", "noise px", "falls percent"))
    assert share[first == 0].max() == 0
    late = share[(first == 10) & (noise == 6)]
    assert 4 < late[0] < 14  # 7.9 with 20000 draws; 2000 of them have a sigma of 0.6


def test_fall_is_that_of_the_print() -> None:
    lowest = printed.lowest_point()[1]
    assert printed.QUINTIC[0] - lowest == pytest.approx(agreement.FALL_PX, abs=0.05)
