"""What a calibration starts from: where the points of a target appear in pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..errors import CalibrationError
from ..lens import Floats

FEWEST_POINTS = 6


@dataclass(frozen=True)
class View:
    """One picture of the target.

    name    of the picture, for people
    points  (n, 3) in the target's frame, in the unit the target was measured in
    pixels  (n, 2) where they appear; (0, 0) is the middle of the top-left pixel
    """

    name: str
    points: Floats
    pixels: Floats

    def only(self, chosen: NDArray[np.bool_]) -> View:
        return View(self.name, self.points[chosen], self.pixels[chosen])


@dataclass(frozen=True)
class Pose:
    """Where the target is: ray_in_camera ~ camera_from_target.apply(point) + translation."""

    camera_from_target: Rotation
    translation: Floats

    def apply(self, points: Floats) -> Floats:
        """Points of the target (n, 3) in the camera frame, in the target's unit."""
        return np.asarray(self.camera_from_target.apply(points) + self.translation)


def checked(views: Sequence[View], size: tuple[int, int]) -> list[View]:
    """The views, or CalibrationError that says which of them cannot be used and why."""
    if not views:
        raise CalibrationError("no view of the target: nothing to calibrate from")
    for view in views:
        if view.points.shape != (len(view.pixels), 3) or view.pixels.shape[1:] != (2,):
            raise CalibrationError(
                f"{view.name}: {view.points.shape} points do not go with {view.pixels.shape} pixels"
            )
        if not (np.isfinite(view.points).all() and np.isfinite(view.pixels).all()):
            raise CalibrationError(f"{view.name}: some points are not numbers")
        if len(view.pixels) < FEWEST_POINTS:
            raise CalibrationError(
                f"{view.name}: {len(view.pixels)} points; a view needs at least {FEWEST_POINTS}"
            )
        outside = ((view.pixels < -1) | (view.pixels > np.array(size))).any(axis=1)
        if outside.any():
            raise CalibrationError(
                f"{view.name}: {outside.sum()} points lie outside the picture of "
                f"{size[0]} x {size[1]} pixels; are all pictures of one size?"
            )
        spread = np.linalg.svd(view.points - view.points.mean(0), compute_uv=False)
        if spread[1] < 1e-6 * max(spread[0], 1e-300):
            raise CalibrationError(f"{view.name}: its points lie on one line")
        if spread[2] > 1e-3 * spread[0]:
            raise CalibrationError(
                f"{view.name}: its points are not in one plane; use a flat target"
            )
    return list(views)
