"""Views that cannot be right, or do not say enough: refused, or told as a doubt.

What decides is how sure the projection is where points were seen (see `uncertainty`): that is what
a user of the camera gets. Whether views say enough is judged with a Kannala-Brandt lens, whatever
model is taken: a model of one parameter is sure of itself even where the views say next to nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import CalibrationError
from ..lens import Floats
from .bundle import Solution
from .field import seen_angle, with_field
from .parameters import Freedom
from .uncertainty import projection_uncertainty
from .views import View

# In shares of the picture's longer side.
TOO_UNSURE, UNSURE = 0.01, 0.0025
NO_FIT, POOR_FIT = 0.004, 0.001
ALIKE_DEG, ALIKE_SHARE = 5.0, 0.1
SMALL_SHARE = 0.1
MANY_DROPPED = 0.1


def check_fit(solution: Solution) -> None:
    """CalibrationError where no lens comes near the points."""
    if solution.noise_px > NO_FIT * max(solution.camera.size):
        raise CalibrationError(
            f"no lens fits these views: the best is {solution.noise_px:.1f} px off. Is it one "
            "camera at one zoom, one flat board, and are the board's rows, columns and sizes right?"
        )


def check_enough(solution: Solution, views: Sequence[View], freedom: Freedom) -> None:
    """CalibrationError where the views leave the camera open, with the likely reason."""
    if len(views) == 1:
        raise CalibrationError(
            "one view is not enough: nothing tells a lens from a board that is not flat. Take at "
            "least 5, of the board in different places, near the rim too, and tilted"
        )
    if alike(solution, views):
        raise CalibrationError(
            f"all {len(views)} views show the board in the same place and tilt; move it between "
            "pictures: to the middle and all around the rim, near and far, straight and tilted"
        )
    # with independent errors: views that contradict each other are another matter
    unsure = typical_uncertainty(solution, views, freedom) / solution.together
    if unsure <= TOO_UNSURE * max(solution.camera.size):
        return
    tilted = tilts_deg(solution, views).max()
    why = (
        f"the board is never tilted by more than {tilted:.0f} degrees, so that a near board and a "
        "long lens look alike; tilt it by 20 to 50 degrees in some pictures"
        if tilted < 15
        else f"all corners lie within {percent(covered_share(views, solution))} of the picture; "
        "hold the board nearer and all around the rim"
        if covered_share(views, solution) < SMALL_SHARE
        else "take more views, with the board tilted, near the rim and at other distances"
    )
    raise CalibrationError(
        f"these views do not determine the camera: its projection is only known to "
        f"{unsure:.0f} px. {why[0].upper()}{why[1:]}"
    )


def doubts(solution: Solution, views: Sequence[View], unsure_px: float) -> tuple[str, ...]:
    """What is weak about a result, in sentences for people."""
    found, side = [], max(solution.camera.size)
    if solution.noise_px > POOR_FIT * side:
        found.append(
            f"corners are off by {solution.noise_px:.1f} px, which is much: is the board flat, the "
            "picture sharp, and is it always the same board?"
        )
    every = np.concatenate(solution.inliers)
    if (share := 1 - float(every.mean())) > MANY_DROPPED:
        found.append(
            f"{percent(share)} of the corners fit nothing: are all pictures by one camera at one "
            "zoom, and of one board?"
        )
    if unsure_px > UNSURE * side:
        found.append(
            f"the projection is only known to {unsure_px:.1f} px where corners were seen: add "
            "views, tilted and near the rim"
        )
    if (share := covered_share(views, solution)) < SMALL_SHARE:
        found.append(
            f"all corners lie within {percent(share)} of the picture: nothing is known of the rest"
        )
    if len(views) < 3:
        found.append("two views only: nothing is left to test the result on; take at least 5")
    return tuple(found)


def percent(share: float) -> str:
    return f"{max(share, 0.01):.0%}"


def typical_uncertainty(solution: Solution, views: Sequence[View], freedom: Freedom) -> float:
    """Root mean square of the stated standard deviation of the projection, pixels, where points
    that count were seen."""
    pixels = np.concatenate([v.pixels[ok] for v, ok in zip(views, solution.inliers, strict=True)])
    chosen = np.linspace(0, len(pixels) - 1, min(len(pixels), 300)).astype(int)
    camera = with_field(solution.camera, seen_angle(solution, views))
    sigma = projection_uncertainty(camera, solution, freedom, pixels[chosen]).sigma_px
    sigma = sigma[np.isfinite(sigma)]
    return float(np.sqrt(np.mean(sigma**2))) if len(sigma) else float("inf")


def tilts_deg(solution: Solution, views: Sequence[View]) -> Floats:
    """(views,) angle between the target's normal and the ray to its middle, degrees, 0 to 90."""
    normals, middles = _placed(solution, views)
    rays = middles / np.linalg.norm(middles, axis=1, keepdims=True)
    return np.degrees(np.arccos(np.abs(np.sum(normals * rays, axis=1)).clip(0, 1)))


def alike(solution: Solution, views: Sequence[View]) -> bool:
    """Whether all views show the target in one place, at one distance and at one tilt."""
    normals, middles = _placed(solution, views)
    distance = np.linalg.norm(middles, axis=1)
    rays = middles / distance[:, None]
    near = np.cos(np.radians(ALIKE_DEG))
    return bool(
        np.abs(normals @ normals[0]).min() > near
        and (rays @ rays[0]).min() > near
        and np.ptp(distance) < ALIKE_SHARE * distance.mean()
    )


def covered_share(views: Sequence[View], solution: Solution) -> float:
    """The share of the picture within the convex hull of all points that count."""
    from scipy.spatial import ConvexHull, QhullError

    pixels = np.concatenate([v.pixels[ok] for v, ok in zip(views, solution.inliers, strict=True)])
    try:
        area = float(ConvexHull(pixels).volume)
    except QhullError:
        return 0.0
    return area / float(np.prod(solution.camera.size))


def _placed(solution: Solution, views: Sequence[View]) -> tuple[Floats, Floats]:
    """Normals (views, 3) and middles (views, 3) of the target in the camera frame."""
    normals, middles = [], []
    for pose, view in zip(solution.poses, views, strict=True):
        across = np.linalg.svd(view.points - view.points.mean(0))[2][2]
        normals.append(pose.camera_from_target.apply(across))
        middles.append(pose.apply(view.points.mean(0, keepdims=True))[0])
    return np.array(normals), np.array(middles)
