"""The simulated counterpart of the paper's camera, and how badly it is read off.

The paper gives a 188 degree lens of 1.2 mm, a 1/3 inch sensor, a PAL picture of 720 x 576 and an
image circle inside the picture. On the 4.8 x 3.6 mm that "1/3 inch" means, an equisolid lens is
the one of the classical four whose 188 degree circle fits in nearly all of the height (the
`sensor` module compares them), and so it is the truth in every simulated experiment here: the
built-in profile `paper-2011` with its axis moved a little off the middle.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ..camera import Camera, make_camera
from ..lens import Equisolid, Floats
from . import printed

SENSOR_MM = (4.8, 3.6)  # what is called a 1/3 inch sensor
# ITU-T H.264 table E-1, aspect_ratio_idc 2: 12 wide to 11 high, for 720 x 576 shown as 4:3.
PIXEL_ASPECT = 12 / 11
ROWS_PER_MM = printed.PICTURE_SIZE[1] / SENSOR_MM[1]
COLUMNS_PER_MM = ROWS_PER_MM / PIXEL_ASPECT
FOCAL_PX = printed.FOCAL_TEXT_MM * ROWS_PER_MM  # in rows
CENTER = (366.3, 284.9)  # not quite the middle of the picture, as in any real camera
NOISE_PX = 1.0
NOISE_WORDS = f"reading error {NOISE_PX:g} px (1 sigma) in x and y, then rounded to whole pixels"


@cache
def camera() -> Camera:
    """720 x 576 PAL, equisolid, 188 degrees; the lens counts pixels in rows."""
    return make_camera(
        printed.PICTURE_SIZE,
        Equisolid(FOCAL_PX),
        center=CENTER,
        field_deg=2 * printed.HALF_FIELD_DEG,
        stretch=np.diag([1 / PIXEL_ASPECT, 1.0]),
    )


def read_off(pixel: Floats, rng: np.random.Generator, noise_px: float = NOISE_PX) -> Floats:
    """What somebody who clicks on a picture writes down: with an error, in whole pixels."""
    return np.asarray(np.rint(pixel + rng.normal(0.0, noise_px, np.shape(pixel))))


def read_sigma_px(noise_px: float = NOISE_PX) -> float:
    """Standard deviation of `read_off`: rounding adds 1/12 of a square pixel."""
    return float(np.hypot(noise_px, np.sqrt(1 / 12)))
