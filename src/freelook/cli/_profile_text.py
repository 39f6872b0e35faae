"""The lens profile a calibration ends with."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..calibration.calibrate import Calibration


def profile_text(name: str, calibration: Calibration) -> str:
    """The text of the profile file; `name` is for people."""
    from ..formats import Profile, format_module

    source = (
        f"calibrated from {len(calibration.views)} views, {calibration.rms_px:.3f} px RMS, "
        f"corners to {np.degrees(calibration.seen_rad):.0f} degrees from the axis"
    )
    return format_module("freelook").write(Profile(calibration.camera, name, source))
