"""Mistakes people make with pictures of a target, told from what was found in them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np

from ..camera import Camera
from ..errors import CalibrationError
from . import aprilgrid
from ._markers import find_markers
from .aprilgrid import AprilGrid
from .bundle import resect
from .calibrate import Calibration
from .charuco import Charuco
from .initial import pose_of
from .targets import Chessboard, Circles, Gray, Target
from .views import FEWEST_POINTS, View, checked

LONGEST_PX = 1280  # side of a picture that is judged; larger ones are made smaller
FINE_PX, COARSE_PX = 1.0, 4.0
BLURRED = 1.5  # a step blurred by s is sqrt((4^2 + s^2) / (1^2 + s^2)) as steep at the fine scale
FAINT = 1.0  # grey levels per pixel
TRIED = 3  # pictures in which a larger board is looked for
FEW_MARKERS = 4  # so few may be misread
FITS, MISFITS = 3.0, 5.0  # times the usual distance


def is_blurred(gray: Gray) -> bool:
    """Whether even the steepest edges of a picture are blurred, by some 3 pixels of 1280."""
    scale = min(1.0, LONGEST_PX / max(gray.shape))
    if scale < 1:
        gray = np.asarray(cv2.resize(gray, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA))
    fine, coarse = (_steepest(gray, width) for width in (FINE_PX, COARSE_PX))
    return bool(coarse > FAINT and fine < BLURRED * coarse)


def _steepest(gray: Gray, width_px: float) -> float:
    """Grey levels per pixel that one pixel in 500 exceeds, smoothed by `width_px`."""
    smooth = cv2.GaussianBlur(gray.astype(np.float32), (0, 0), width_px)
    down, across = smooth[2:, 1:-1] - smooth[:-2, 1:-1], smooth[1:-1, 2:] - smooth[1:-1, :-2]
    steep = cv2.magnitude(across, down).ravel() / 2
    rank = int(0.998 * steep.size)
    return float(np.partition(steep, rank)[rank])


def check_different(views: Sequence[View], size: tuple[int, int]) -> None:
    """CalibrationError where of several views only one is left, with the reason."""
    used, dropped = checked(views, size)
    if len(views) > 1 and len(used) == 1:
        name, why = dropped[0]
        raise CalibrationError(
            f"one view is left of {len(views)}, which is not enough ({name}: {why}); take at least "
            "5, of the board in different places, near the rim too, and tilted"
        )


def other_size(target: Target, views: Sequence[View], pictures: Mapping[str, Gray]) -> str:
    """A sentence if the board has other numbers of points than it is said to have; "" if not.

    For chessboards and grids of circles; `pictures` are those of views, by name, a few of which are
    looked at again.
    """
    free: Target
    if isinstance(target, Chessboard) and target.inner:
        size, step, free = target.inner, target.square, replace(target, inner=None)
    elif isinstance(target, Circles) and target.count and not target.asymmetric:
        size, step, free = target.count, target.spacing, replace(target, count=None)
    else:
        return ""
    said = _sides(size)
    extents = Counter(_extent(view, step) for view in views)
    if not extents[said]:
        seen, count = extents.most_common(1)[0]
        enough = count >= max(2, len(views) / 2)
        return _told(size, f"{count} of {len(views)} pictures show one of", seen) if enough else ""
    names = [v.name for v in views if _extent(v, step) == said and v.name in pictures][:TRIED]
    again = [free.find(pictures[name], name) for name in names]
    larger = Counter(_extent(view, step) for view in again if view is not None)
    seen, count = next(iter(larger.most_common(1)), (said, 0))
    if np.prod(seen) <= np.prod(said) or count < 2:
        return ""
    return _told(size, f"{count} of {len(names)} pictures looked at again show", seen)


def why_not_by_markers(target: Target, pictures: Mapping[str, Gray]) -> str:
    """A sentence about pictures in which a target with markers was not found; "" for others."""
    if isinstance(target, Charuco):
        kind, border, most = target.dictionary, 1, int(np.prod(target.squares)) // 2
    elif isinstance(target, AprilGrid):
        kind, border, most = aprilgrid.FAMILY, aprilgrid.BORDERS[0], int(np.prod(target.tags))
    else:
        return ""
    seen = {name: len(find_markers(g, kind, most, border)[0]) for name, g in pictures.items()}
    name = max(seen, key=lambda name: seen[name], default="")
    if not name or seen[name] < FEW_MARKERS:
        return f"hardly a marker of {kind} was read in them: is that what is printed?"
    return (
        f"{seen[name]} markers of {kind} were read in {name}, but not enough where this target has "
        "them: are its numbers across and down right?"
    )


def _told(size: tuple[int, int], what: str, seen: tuple[int, int]) -> str:
    return (
        f"the board is said to be {size[0]} x {size[1]}, but {what} {seen[0]} x {seen[1]}; give "
        f"--board {seen[0]}x{seen[1]} if that is right, or leave it out"
    )


def _sides(size: tuple[int, int]) -> tuple[int, int]:
    return max(size), min(size)


def _extent(view: View, step: float) -> tuple[int, int]:
    """Points along the longer and the shorter side, from the first to the last that was found."""
    across, down = (int(n) for n in np.rint(np.ptp(view.points[:, :2], axis=0) / step) + 1)
    return _sides((across, down))


def with_turned_told(calibration: Calibration, views: Sequence[View]) -> Calibration:
    """The same, with the reason for views dropped that fit once turned by 180 degrees."""
    by_name = {view.name: view for view in views}
    dropped = tuple(
        (name, _why(calibration, by_name[name], why) if name in by_name else why)
        for name, why in calibration.dropped
    )
    return replace(calibration, dropped=dropped)


def _why(calibration: Calibration, view: View, why: str) -> str:
    camera, usual = calibration.camera, max(calibration.rms_px, 0.1)
    turned = View(view.name, view.points, np.array(camera.size) - 1 - view.pixels)
    if _off_px(camera, view) > MISFITS * usual and _off_px(camera, turned) < FITS * usual:
        return (
            "it fits once turned by 180 degrees; was the camera, or the file, upside down? Turn it "
            "back"
        )
    return why


def _off_px(camera: Camera, view: View) -> float:
    """Median distance of a view's points from where the camera would see them, at best."""
    pose = pose_of(camera, view) if len(view.pixels) >= FEWEST_POINTS else None
    if pose is None:
        return float("inf")
    _, residuals = resect(camera, pose, view)
    return float(np.median(np.hypot(residuals[:, 0], residuals[:, 1])))
