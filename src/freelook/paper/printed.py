"""Every number this package takes from the 2011 paper, with its place there.

Angles in these formulas are degrees, as printed.
"""

from __future__ import annotations

import numpy as np

from ..lens import Floats

REFERENCE = (
    "O. Rawashdeh, B. Sababha, “An Image-Processing-Based Gimbal System Using Fisheye Video”, "
    "Computer Technology and Application 2 (2011) 85–93"
)

# Equation 6, section 3: p = slope theta + offset.
LINE = (412.13, 3.6771)
LINE_HALF_UNITS = (0.005, 0.00005)
LINE_GOOD_BELOW_DEG = 60.0
# Equation 7, section 3, with its signs: p = sum of coefficient[i] theta^i.
QUINTIC = (469.0, -5.3175, 0.4329, -0.0085, 7e-5, -2e-7)
QUINTIC_DECIMALS = (0, 4, 4, 4, 5, 7)
# What was cut off in print is at most half a unit of the last digit.
QUINTIC_HALF_UNITS = tuple(0.5 * 10.0**-decimals for decimals in QUINTIC_DECIMALS)

HALF_FIELD_DEG = 94.0  # section 3: 188 degrees in all
FOCAL_TEXT_MM = 1.2  # section 3
FOCAL_PARTS_MM = 2.1  # table 1
TARGET_DISTANCE_MM = 100.0  # section 3
GRID_MM = 6.0  # section 3
DISTANCES_MM = (40.0, 300.0)  # section 3, second experiment
PICTURE_SIZE = (720, 576)  # section 6
WINDOW_SIZE = (180, 144)  # section 6
TV_LINES = 420  # section 5
CAMERA_GRAMS = 22  # section 5

# Table 1: what, product, US dollars.
PARTS = (
    ("Video capture", "Pinnacle Dazzle DVD Recorder Plus", 49.99),
    ("Lens", "Range Video f2.10m Superwide", 10.00),
    ("Display headset", "Vuzix iWear VR920", 399.95),
    ("Camera", "Range Video KX191", 105.00),
    ("Wireless transmitter", "Range Video 1.3 GHz 300 mW", 75.00),
    ("Wireless receiver", "Range Video 1300 MHz dual output", 85.00),
)
TOTAL_DOLLARS = 724  # section 6
GOGGLES_DOLLARS = 400  # section 6: "about"


def line(theta_deg: Floats) -> Floats:
    """Equation 6: pixels at an angle in degrees, any shape."""
    return np.asarray(LINE[0] + LINE[1] * np.asarray(theta_deg, dtype=np.float64))


def quintic(theta_deg: Floats) -> Floats:
    """Equation 7 as printed: pixels at an angle in degrees, any shape."""
    return powers(theta_deg) @ np.array(QUINTIC)


def powers(theta_deg: Floats) -> Floats:
    """theta^0 to theta^5, (..., 6), so that `powers @ coefficients` is the quintic."""
    return np.asarray(np.asarray(theta_deg, dtype=np.float64)[..., None] ** np.arange(6))


def lowest_point() -> tuple[float, float]:
    """(degrees, pixels) where equation 7 as printed is lowest between 0 and 90 degrees."""
    slope = np.polynomial.polynomial.polyder(np.array(QUINTIC))
    roots = np.polynomial.polynomial.polyroots(slope)
    real = roots[np.abs(roots.imag) < 1e-9].real
    inside = real[(real > 0) & (real < 90)]
    lowest = inside[np.argmin(quintic(inside))]
    return float(lowest), float(quintic(np.array(lowest)))
