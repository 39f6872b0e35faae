"""Sensible fields of view for a camera: not so narrow that there is nothing left to see, not so
wide that the lens has nothing more to show.

At the middle of a perspective view of `width` pixels there are
(width / 2) / tan(hfov / 2) pi / 180 view pixels to a degree, and as many with another projection
(`freelook.projections`) in place of the tangent; the camera has its own (`freelook.resolution`). A
view may enlarge the camera's pixels `MOST_ENLARGED` times; narrower fields would show the same
blur, larger.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..camera import Camera
from ..projections import projection_named
from ..resolution import resolution_at

MOST_ENLARGED = 10.0


@dataclass(frozen=True)
class ZoomLimits:
    """Degrees across the view."""

    narrowest_deg: float
    widest_deg: float

    def clamp(self, field_deg: float) -> float:
        return min(self.widest_deg, max(self.narrowest_deg, field_deg))


def zoom_limits(camera: Camera, width_px: float, projection: str = "perspective") -> ZoomLimits:
    """For views `width_px` across, by what the camera resolves on its axis.

    Always within the projection's own limits, 10 and 150 degrees for perspective, and never
    narrower than wide. RenderError for an unknown projection.
    """
    kind = projection_named(projection)
    field_deg = 2 * kind.angle_deg(width_px / 2 / most_focal_px(camera), 0.0)
    narrowest = max(kind.narrowest_deg, field_deg)
    widest = max(kind.narrowest_deg, min(kind.widest_deg, 2 * math.degrees(camera.theta_max)))
    return ZoomLimits(min(narrowest, widest), widest)


def most_focal_px(camera: Camera) -> float:
    """The focal length in view pixels at which a view enlarges the camera's as far as it may."""
    per_degree = float(resolution_at(camera, np.array([0.0, 0.0, 1.0])).mean)
    return MOST_ENLARGED * per_degree * math.degrees(1.0)
