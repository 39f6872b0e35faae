"""How far from the axis a calibrated lens is good for: as far as points were seen, and a little."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..camera import Camera, make_camera
from ..errors import CalibrationError, ProfileError
from ..lens import Floats, growth_limit
from .bundle import Fit
from .views import Pose, View

MARGIN = np.radians(5.0)  # beyond the outermost point seen


def seen_angle(solution: Fit, views: Sequence[View]) -> float:
    """The largest angle from the axis of a point that counts, radians."""
    seen = [
        angles(pose, view)[ok]
        for pose, view, ok in zip(solution.poses, views, solution.inliers, strict=True)
    ]
    return float(np.concatenate(seen).max(initial=0.0))


def angles(pose: Pose, view: View) -> Floats:
    """(n,) of a view's points from the axis, radians."""
    at = pose.apply(view.points)
    return np.arctan2(np.hypot(at[:, 0], at[:, 1]), at[:, 2])


def with_field(camera: Camera, seen: float) -> Camera:
    """The camera with the field it is good for; `seen` is the outermost angle seen, radians."""
    half = min(seen + MARGIN, growth_limit(camera.lens))
    try:
        return make_camera(
            camera.size,
            camera.lens,
            center=camera.center,
            stretch=camera.stretch,
            field_deg=float(np.degrees(2 * half)),
        )
    except ProfileError as error:
        raise CalibrationError(f"the result is no lens: {error}") from None
