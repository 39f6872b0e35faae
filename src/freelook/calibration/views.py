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


def checked(
    views: Sequence[View], size: tuple[int, int]
) -> tuple[list[View], tuple[tuple[str, str], ...]]:
    """The views that can be used, and (name, why) of those that cannot.

    CalibrationError where none can, and where points lie outside the picture: then something is
    wrong with all of them.
    """
    if not views:
        raise CalibrationError("no view of the target: nothing to calibrate from")
    faults = [_fault(view, size) for view in views]
    used = [view for view, fault in zip(views, faults, strict=True) if not fault]
    if not used:
        raise CalibrationError(f"{views[0].name}: {faults[0]}")
    dropped = [(v.name, fault) for v, fault in zip(views, faults, strict=True) if fault]
    different: list[View] = []
    for view in used:
        twin = next((v for v in different if _same(v, view)), None)
        if twin is None:
            different.append(view)
        else:
            dropped.append((view.name, f"the same picture as {twin.name}"))
    return different, tuple(dropped)


def _fault(view: View, size: tuple[int, int]) -> str:
    """Why a view cannot be used; "" if it can."""
    if view.points.shape != (len(view.pixels), 3) or view.pixels.shape[1:] != (2,):
        raise CalibrationError(
            f"{view.name}: {view.points.shape} points do not go with {view.pixels.shape} pixels"
        )
    if not (np.isfinite(view.points).all() and np.isfinite(view.pixels).all()):
        return "some of its points are not numbers"
    outside = ((view.pixels < -1) | (view.pixels > np.array(size))).any(axis=1)
    if outside.any():
        raise CalibrationError(
            f"{view.name}: {outside.sum()} points lie outside the picture of {size[0]} x {size[1]} "
            "pixels; are all pictures of one size?"
        )
    count = len(view.pixels)
    if count < FEWEST_POINTS:
        return f"{count} points; a view needs at least {FEWEST_POINTS}"
    for what, rows in (("points of the target", view.points), ("pixels", view.pixels)):
        if twice := count - len(np.unique(rows, axis=0)):
            return f"{twice} of its {what} are listed more than once"
    spread = np.linalg.svd(view.points - view.points.mean(0), compute_uv=False)
    if spread[1] < 1e-6 * spread[0]:
        return "its points lie on one line"
    if spread[2] > 1e-3 * spread[0]:
        return "its points are not in one plane; use a flat target"
    return ""


def _same(a: View, b: View) -> bool:
    return a.pixels.shape == b.pixels.shape and bool((a.pixels == b.pixels).all())
