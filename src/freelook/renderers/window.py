"""The crop: a window of the camera's picture as it is, in the plain manner of the first gimbals.

Its middle is where the view looks, or the nearest place on the rim of the field. Nothing of the
lens is taken out, and the head's roll turns nothing; only the pixels' own shape is made square. In
the middle of the picture it spans the field that the viewport says: one focal length of the view
is one of the lens.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..lens import Floats, radius_slope
from ..viewport import Viewport

INSIDE = 1 - 1e-9  # of theta_max: rounding puts nothing on it outside


@dataclass(frozen=True)
class Window:
    """middle (2,): the picture's pixel in the middle of the view; slopes (2, 2): picture pixels
    per view pixel; centre (2,): the view's own middle."""

    middle: Floats
    slopes: Floats
    centre: Floats

    def at(self, pixel: Floats) -> Floats:
        """Pixels of the view (..., 2) to those of the picture."""
        return np.asarray(self.middle + (np.asarray(pixel) - self.centre) @ self.slopes.T)


def window_of(camera: Camera, camera_from_view: Rotation, viewport: Viewport) -> Window:
    """Where a crop lies in the camera's picture."""
    per_px = float(radius_slope(camera.lens, np.zeros(1))[0]) / viewport.focal_px
    ahead = _held(camera_from_view.apply([0.0, 0.0, 1.0]), camera.theta_max * INSIDE)
    centre = (np.array(viewport.size) - 1) / 2
    return Window(camera.project(ahead), camera.stretch * per_px, centre)


def window_coordinates(camera: Camera, camera_from_view: Rotation, viewport: Viewport) -> Floats:
    """Where each pixel of a crop looks: (height, width, 2); NaN where the lens does not see."""
    width, height = viewport.size
    pixel = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float)
    there = window_of(camera, camera_from_view, viewport).at(pixel)
    there[np.isnan(camera.ray(there)[..., 0])] = np.nan
    return there


def rim_px(camera: Camera) -> float:
    """The radius of the round image at the end of the field."""
    return float(camera.lens.radius(np.array([camera.theta_max]))[0])


def _held(ray: Floats, theta_max: float) -> Floats:
    """A unit ray, drawn in to the rim; to the right of it where it looks straight behind."""
    x, y, z = ray
    away = np.hypot(x, y)
    if np.arctan2(away, z) <= theta_max:
        return ray
    side = np.array([x, y]) / away if away > 1e-12 else np.array([1.0, 0.0])
    return np.array([*(side * np.sin(theta_max)), np.cos(theta_max)])
