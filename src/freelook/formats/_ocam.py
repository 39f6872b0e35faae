"""Scaramuzza's lens in both of its files: a direct polynomial, and an inverse one beside it.

The direct polynomial is the lens: with rho the distance from the centre in pixels, a ray there
points (x, y, f(rho)), f = a0 + a1 rho + a2 rho^2 + ..., a1 = 0 and a0 > 0 when z is forward. The
inverse polynomial, rho as a function of the angle, is an approximation that programs use because
it is fast.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..camera import Camera
from ..errors import ProfileError
from ..lens import OCamCalib, model_name

MOST_TERMS = 64  # as many as the toolbox's own C code holds
MOST_DIRECT_TERMS = 12  # the toolbox proposes 5
LARGEST_FOCAL_PX = 1e6
GOOD_PX = 0.01  # where the toolbox is content with an inverse polynomial
HIGHEST_DEGREE = 25
# Inverse polynomials of published files are within 0.01 px of the direct ones, or some pixels off
# where they were fitted to less than the picture; in wrong order or sign they are off everywhere.
OTHER_LENS = 0.05


@dataclass(frozen=True)
class Inverse:
    """rho = sum c_i (theta + shift)^i; `error_px` is its largest distance from the lens."""

    coefficients: tuple[float, ...]
    shift: float
    error_px: float
    error_deg: float

    @property
    def words(self) -> str:
        return f"{self.error_px:.2g} px off the direct one at most ({self.error_deg:.0f} degrees)"


def check_inverse(camera: Camera, coefficients: Sequence[float], shift: float) -> tuple[str, ...]:
    """What should be told of a file's inverse polynomial (ascending powers of theta + shift).

    ProfileError when it is another lens: more than 5 % of the image's radius off over half of
    the field.
    """
    theta = np.linspace(0.0, camera.theta_max, 1001)
    radius = camera.lens.radius(theta)
    off = np.abs(np.polynomial.polynomial.polyval(theta + shift, coefficients) - radius)
    if np.median(off) > OTHER_LENS * radius[-1]:
        raise ProfileError(
            f"its direct and inverse polynomials are different lenses: {np.median(off):.3g} px "
            f"apart over half of the field (the image's radius is {radius[-1]:.0f}); is the order "
            "of one reversed, or its sign? Compare them with the calibration"
        )
    worst = int(np.argmax(off))
    inverse = Inverse(tuple(coefficients), shift, off[worst], np.degrees(theta[worst]))
    return (f"the direct polynomial is used; the file's inverse one is {inverse.words}",)


def fit_inverse(camera: Camera, shift: float) -> Inverse:
    """The polynomial of the lowest degree that strays less than 0.01 px from the lens's radius.

    If none up to degree 25 does, the best of them; `error_px` says how good it is.
    """
    theta = camera.theta_max * (1 - np.cos(np.linspace(0, np.pi, 401))) / 2
    radius = camera.lens.radius(theta)
    best: Inverse | None = None
    for degree in range(2, HIGHEST_DEGREE + 1):
        with np.errstate(under="ignore"):  # high powers of places near the middle are 0
            fitted = np.polynomial.Polynomial.fit(theta + shift, radius, degree).convert().coef
        off = np.abs(np.polynomial.polynomial.polyval(theta + shift, fitted) - radius)
        worst = int(np.argmax(off))
        if best is None or off[worst] < best.error_px:
            terms = tuple(float(c) for c in fitted)
            best = Inverse(terms, shift, float(off[worst]), float(np.degrees(theta[worst])))
        if best.error_px < GOOD_PX:
            break
    assert best is not None
    return best


def lens_of(direct: Sequence[float]) -> OCamCalib:
    """The lens of a direct polynomial, ascending, of either sign; ProfileError if it is none."""
    if not 1 <= abs(direct[0]) <= LARGEST_FOCAL_PX:
        raise ProfileError(f"a0 = {direct[0]:g} is no focal length in pixels")
    if len(direct) > MOST_DIRECT_TERMS:
        raise ProfileError(
            f"a direct polynomial of {len(direct)} terms; {MOST_DIRECT_TERMS} can be read"
        )
    return OCamCalib.from_coefficients(direct)


def scaled(lens: OCamCalib, scale: float) -> OCamCalib:
    """The lens whose image is `scale` times as large."""
    return OCamCalib(lens.f * scale, lens.taylor)


def expect_ocam(camera: Camera, what: str) -> OCamCalib:
    """The camera's lens, or ProfileError if it is none that `what` can hold."""
    if not isinstance(camera.lens, OCamCalib):
        raise ProfileError(
            f"{what} holds Scaramuzza's polynomial only (model ocamcalib), "
            f"no {model_name(camera.lens)}"
        )
    return camera.lens
