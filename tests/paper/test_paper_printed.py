"""The paper's printed numbers: what they say, checked by hand and by other ways."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.paper import parts, printed, printed_curve, sensor
from freelook.paper.exhibit import Settings


def horner(theta: float) -> float:
    """Equation 7, typed in a second time and evaluated another way."""
    a = (469, 5.3175, 0.4329, 0.0085, 7e-5, 2e-7)
    return a[0] + theta * (-a[1] + theta * (a[2] + theta * (-a[3] + theta * (a[4] - theta * a[5]))))


@pytest.mark.parametrize("theta", [0.0, 7.5, 33.0, 60.0, 94.0])
def test_quintic_is_equation_7(theta: float) -> None:
    assert float(printed.quintic(np.array(theta))) == pytest.approx(horner(theta), abs=1e-9)


def test_quintic_falls_from_469_to_about_450_near_8_degrees() -> None:
    degrees, pixels = printed.lowest_point()
    fine = np.arange(0, 30, 0.001)
    values = np.array([horner(theta) for theta in fine])
    assert degrees == pytest.approx(fine[np.argmin(values)], abs=1e-3)
    assert pixels == pytest.approx(values.min(), abs=1e-6)
    assert (round(degrees, 1), round(pixels, 1)) == (7.8, 450.1)
    assert float(printed.quintic(np.array(0.0))) == 469


@pytest.mark.parametrize(
    ("theta", "difference"),
    # by a desk calculator; the signs are those of (6) minus (7)
    [(0, -56.87), (20, 7.302), (40, -4.446), (60, 8.686), (85, 33.398)],
)
def test_line_minus_quintic(theta: float, difference: float) -> None:
    table = printed_curve.stems()
    at = float(table["line_minus_quintic_px"][table["theta_deg"] == theta][0])
    assert at == pytest.approx(difference, abs=5e-4)


def test_p_cannot_be_a_distance_from_the_centre_of_the_picture() -> None:
    assert float(printed.line(np.array(0.0))) > printed.PICTURE_SIZE[0] / 2
    assert float(printed.line(np.array(90.0))) > printed.PICTURE_SIZE[0]


def test_half_units_are_those_of_the_last_printed_digits() -> None:
    for value, decimals, half in zip(
        printed.QUINTIC, printed.QUINTIC_DECIMALS, printed.QUINTIC_HALF_UNITS, strict=True
    ):
        assert round(value, decimals) == pytest.approx(value, abs=1e-12)
        assert half == pytest.approx(0.5 * 10**-decimals, rel=1e-12)
    # the fewest digits that still say what is printed
    assert round(7e-5, 4) != 7e-5
    assert round(2e-7, 6) != 2e-7


def test_prices_add_up() -> None:
    assert parts.total_dollars() == pytest.approx(724.94, abs=1e-9)
    assert int(parts.total_dollars()) == printed.TOTAL_DOLLARS
    assert parts.parts_table()["dollars"][-1] == pytest.approx(724.94, abs=1e-9)
    assert parts.window_share() == 1 / 16


def test_image_circles_of_the_two_focal_lengths() -> None:
    """Formulas typed in once more: 188 degrees through 1.2 and 2.1 mm."""
    half = np.radians(94)
    assert sensor.circle_mm("equidistant", 1.2) == pytest.approx(2 * 1.2 * half)
    assert sensor.circle_mm("equisolid", 1.2) == pytest.approx(4 * 1.2 * np.sin(half / 2))
    assert sensor.circle_mm("orthographic", 2.1) == pytest.approx(2 * 2.1)
    table = sensor.circles()
    at = dict(zip(table.words["model"], table["circle if f = 1.2 mm"], strict=True))
    assert at["equisolid"] < 3.6 < at["equidistant"] < at["stereographic"]
    assert (table["circle if f = 2.1 mm"] > 3.6).all()
    assert (table["circle of equation 7, rows"] > 576).all()


def test_the_section_says_that_it_does_not_hold() -> None:
    section = printed_curve.section(Settings())
    assert section.verdict == "does not hold"
    text = " ".join(section.ours)
    for number in ("469", "450.1", "7.8 degrees", "± 7 ", "± 115", "± 661", "-56.9", "+33.4"):
        assert number in text
