"""Cameras of fitted lenses, with as much of the field as the lens is good for."""

from __future__ import annotations

import numpy as np

from ..camera import Camera, make_camera
from ..errors import FitError, ProfileError
from ..lens import Floats, Lens
from ._models import growth_end

LEAST_FIELD = np.radians(1.0)
# Tried in turn: a rim where the radius hardly grows any more folds within rounding, and some
# lenses fold farther in.
SHARES = (1.0, 0.9995, 0.998, 0.995, 0.99, 0.98, 0.95, 0.9, 0.8, 0.7, 0.5, 0.3)


def fitted_camera(
    like: Camera, lens: Lens, center: tuple[float, float], stretch: Floats, end: float
) -> Camera:
    """A camera like another with a lens that was fitted up to `end` (radians).

    Its field ends there, or where the lens stops growing, or before it folds. FitError if next to
    nothing is left.
    """
    end = min(end, growth_end(lens, end))
    for share in SHARES:
        if share * end < LEAST_FIELD:
            break
        try:
            return make_camera(
                like.size,
                lens,
                center=center,
                field_deg=float(np.degrees(2 * share * end)),
                stretch=stretch,
                camera_from_body=like.camera_from_body,
            )
        except ProfileError:
            continue
    raise FitError(f"no {type(lens).__name__} lens comes near")
