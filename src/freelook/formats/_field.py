"""What should be told of a field that ends inside the picture."""

from __future__ import annotations

import numpy as np

from ..camera import Camera
from ._trust import reaches_the_corners


def field_notes(camera: Camera) -> tuple[str, ...]:
    """A note if the formula ends before the picture does, and below 90 degrees from the axis.

    From 90 degrees on that is the image circle of a fisheye, and nothing to speak of.
    """
    end_deg = float(np.degrees(camera.theta_max))
    if end_deg >= 90 or reaches_the_corners(camera):
        return ()
    return (
        f"the field ends at {end_deg:.1f} degrees from the axis, inside the picture: farther out "
        "these numbers give no image (the radius stops growing, or it folds)",
    )
