"""Whether a calibration can be that of a lens at all.

Collections of profiles hold fits that went wrong, and such numbers are still numbers. Each limit
here is far from what lenses do, so that whatever is refused is no lens; what is merely rough
passes, and its error is told.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..camera import Camera
from ..errors import ProfileError
from ..lens import BentLens, Floats, radius_slope
from ._matrix import Matrix

# Gyroflow's calibrator: "this value should be less than 5, ideally less than 1".
LARGEST_RMS_PX = 5.0
GOOD_RMS_PX = 1.0
# Anamorphic lenses squeeze two to one at most; a tenth more for what their fits miss.
LARGEST_ASPECT = 2.2
# Lenses sit within a few hundredths of the picture's side; a fit that goes this far is lost.
LARGEST_SHIFT = 0.25
# 1200 mm in front of a full-frame sensor sees 2.07 degrees across.
NARROWEST_DEG = 2.0
# The widest straight-line lenses, 135 degrees across, grow 1 / cos^2(67.5 deg) = 6.8 times.
STEEPEST = 8.0


def check_rms(rms_px: float) -> None:
    """ProfileError if a calibration did not even fit its own points."""
    if not 0 <= rms_px <= LARGEST_RMS_PX:
        raise ProfileError(
            f"RMS_error is {rms_px:.4g} px; a calibration that misses its own points by more than "
            f"{LARGEST_RMS_PX:g} px is none"
        )


def check_matrix(matrix: Matrix, size: tuple[int, int]) -> None:
    """ProfileError for pixels too far from square or an axis too far from the middle."""
    aspect = matrix.fy / matrix.fx
    if not 1 / LARGEST_ASPECT <= aspect <= LARGEST_ASPECT:
        raise ProfileError(
            f"fy is {aspect:.3g} times fx; even behind an anamorphic lens it is at most "
            f"{LARGEST_ASPECT:g} to one"
        )
    shift = (np.array(matrix.center) - middle(size)) / size
    if np.abs(shift).max() > LARGEST_SHIFT:
        raise ProfileError(
            f"the axis at ({matrix.cx:.1f}, {matrix.cy:.1f}) px is ({shift[0]:+.2f}, "
            f"{shift[1]:+.2f}) of the {size[0]} x {size[1]} picture away from its middle; no lens "
            f"sits more than {LARGEST_SHIFT:g} away"
        )


def check_curve(camera: Camera, *, whole_picture: bool, remedy: Callable[[float], str]) -> None:
    """ProfileError for a curve that no lens has, or that ends inside the picture.

    A radius may stop growing inside the picture only at 90 degrees from the axis or farther: such
    a lens is a fisheye whose image circle ends there, and what lies outside is black. Where it
    stops before, the polynomial has come to its end and the lens has not: the picture goes on.
    `whole_picture` is False for a profile that itself says where its field ends; `remedy` tells
    how to say so, given an angle in degrees that would do.
    """
    half_deg = float(np.degrees(camera.theta_max))
    if whole_picture and half_deg < 90 and not reaches_the_corners(camera):
        rim = float(camera.lens.radius(np.array([camera.theta_max]))[0])
        raise ProfileError(
            f"the radius stops growing at {half_deg:.2f} degrees from the axis, {rim:.0f} px from "
            f"it: inside the {camera.size[0]} x {camera.size[1]} picture, which goes on beyond; "
            f"{remedy(min(0.99 * half_deg, half_deg - 0.1))}"
        )
    if 2 * half_deg < NARROWEST_DEG:
        raise ProfileError(
            f"the whole picture is {2 * half_deg:.2g} degrees across; no lens is that long"
        )
    theta = np.linspace(0.0, camera.theta_max, 91)
    growth = radius_slope(camera.lens, theta)
    if growth.max() > STEEPEST * growth[0]:
        worst = int(np.argmax(growth))
        raise ProfileError(
            f"the radius grows {growth[worst] / growth[0]:.3g} times as fast at "
            f"{np.degrees(theta[worst]):.1f} degrees as on the axis; no lens does more than "
            f"{STEEPEST:g} times"
        )


def middle(size: tuple[int, int]) -> Floats:
    """The middle of a picture, (x, y)."""
    return (np.array(size) - 1) / 2


def reaches_the_corners(camera: Camera) -> bool:
    """Whether the field covers the picture; its corners a hair inside, as it often ends there."""
    half = np.array(camera.size) / 2 * (1 - 1e-6)
    corners = middle(camera.size) + half * [[-1, -1], [1, -1], [-1, 1], [1, 1]]
    if isinstance(camera.lens, BentLens):
        return not np.isnan(camera.ray(corners)).any()
    point = (corners - camera.center) @ np.linalg.inv(camera.stretch).T
    rim = camera.lens.radius(np.array([camera.theta_max]))[0]
    return bool(np.hypot(point[:, 0], point[:, 1]).max() <= rim)
