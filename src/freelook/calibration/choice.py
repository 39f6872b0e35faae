"""Which of many views to calibrate from: those that differ, and were held still."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from ..lens import Floats
from .views import View


def differing(views: Sequence[View], most: int, size: tuple[int, int]) -> list[View]:
    """At most `most` views, as different as can be, in their order.

    What counts is where in the picture the target is, how large, and how it is turned and tilted:
    the pixel positions say all that. Farthest-point sampling, from the view that reaches farthest
    out.
    """
    if len(views) <= most:
        return list(views)
    features = np.stack([_feature(view, size) for view in views])
    chosen = [int(np.argmax(np.abs(features[:, :2] - 0.5).max(axis=1)))]
    distance = np.linalg.norm(features - features[chosen[0]], axis=1)
    while len(chosen) < most:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(features - features[chosen[-1]], axis=1))
    return [views[i] for i in sorted(chosen)]


def moved_px(before: View, after: View) -> float:
    """How far the target moved from one picture to the next, if by less than half a square.

    Each point against the nearest one before: which is which may differ between the two.
    """
    distance, _ = cKDTree(before.pixels).query(after.pixels)
    return float(np.median(distance))


def _feature(view: View, size: tuple[int, int]) -> Floats:
    """Mean place, extent and shape in the picture, in shares of its size."""
    at = view.pixels / np.array(size)
    middle = at.mean(axis=0)
    flat = view.points[:, :2] - view.points[:, :2].mean(axis=0)
    # the best affine map from target to picture: size, turn and tilt
    affine = np.linalg.lstsq(flat, at - middle, rcond=None)[0] * np.abs(flat).max()
    return np.concatenate([middle, affine.ravel()])
