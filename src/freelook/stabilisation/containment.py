"""Whether a view sees only what the lens sees, and how far a path may go for that.

The test is exact for any lens: the view's border is projected, and must be on the picture.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d, uniform_filter1d
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..viewport import Viewport

Floats = NDArray[np.float64]
_PER_SIDE = 12
_HALVINGS = 10  # a fraction good to 0.001


class Containment:
    """Views of one size through one camera."""

    def __init__(self, camera: Camera, viewport: Viewport) -> None:
        self._camera = camera
        self._border = _border(viewport)

    def holds(self, body_from_view: Rotation) -> NDArray[np.bool_]:
        """Whether each of n views (stacked) is wholly on the picture."""
        camera_from_view = (self._camera.camera_from_body * body_from_view).as_matrix()
        rays = np.einsum("nij,mj->nmi", camera_from_view, self._border)
        pixels = self._camera.project(rays)
        with np.errstate(invalid="ignore"):  # NaN is outside
            inside = (pixels >= -0.5) & (pixels <= np.array(self._camera.size) - 0.5)
        return np.asarray(inside.all(axis=(1, 2)))

    def largest_fractions(self, raw: Rotation, wanted: Rotation) -> Floats:
        """How far of the way from each raw view to the wanted one (both n) all views are whole,
        (n,), 0 to 1; 1 wherever the wanted one is whole, 0 where neither is."""
        turn = (raw.inv() * wanted).as_rotvec()
        low, high = np.zeros(len(turn)), np.ones(len(turn))
        low[self.holds(wanted)] = 1.0
        for _ in range(_HALVINGS):
            open_ = np.flatnonzero(low < 1.0)
            if not len(open_):
                break
            middle = 0.5 * (low[open_] + high[open_])
            views = raw[open_] * Rotation.from_rotvec(middle[:, None] * turn[open_])
            fine = self.holds(views)
            low[open_[fine]], high[open_[~fine]] = middle[fine], middle[~fine]
        return low


def widest_hfov_deg(camera: Camera, viewport: Viewport, body_from_view: Rotation) -> float | None:
    """The largest field of view at which this view is whole; None when none is."""
    views = Rotation.concatenate([body_from_view])

    def whole(hfov_deg: float) -> bool:
        return bool(Containment(camera, replace(viewport, hfov_deg=hfov_deg)).holds(views)[0])

    kind = viewport.kind
    # a wider view of this size may be too high for its projection
    low, high = kind.narrowest_deg, viewport.hfov_deg if kind.tallest_deg else kind.widest_deg
    if not whole(low):
        return None
    while high - low > 0.5:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if whole(middle) else (low, middle)
    return low


def eased(allowed: Floats, half_window: int) -> Floats:
    """A smooth curve nowhere above `allowed` (n,): the least within `half_window` samples to both
    sides, then the mean over as many."""
    if half_window < 1:
        return allowed
    size = 2 * half_window + 1
    least = minimum_filter1d(allowed, size, mode="nearest")
    mean = uniform_filter1d(least, size, mode="nearest")
    return np.clip(np.minimum(mean, allowed), 0.0, 1.0)


def _border(viewport: Viewport) -> Floats:
    """Directions (m, 3) in the view frame round the outer edge of a view."""
    return viewport.border(_PER_SIDE)
