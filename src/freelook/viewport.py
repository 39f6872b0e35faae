"""The virtual camera: a perspective view of any size and field of view.

The field of view runs from outer edge to outer edge of the outermost pixels:
f = (width/2) / tan(hfov/2), with the centre at ((width-1)/2, (height-1)/2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .errors import RenderError
from .lens import Floats

NARROWEST_DEG = 10.0
WIDEST_DEG = 150.0


@dataclass(frozen=True)
class Viewport:
    """A perspective view: `size` (width, height) in pixels, horizontal field in degrees.

    RenderError for a size below 2 x 2 or a field outside 10 to 150 degrees.
    """

    size: tuple[int, int]
    hfov_deg: float = 90.0

    def __post_init__(self) -> None:
        if min(self.size) < 2:
            raise RenderError(f"a view of {self.size[0]} x {self.size[1]} pixels is too small")
        if not NARROWEST_DEG <= self.hfov_deg <= WIDEST_DEG:
            raise RenderError(
                f"horizontal field of view must be {NARROWEST_DEG:.0f} to {WIDEST_DEG:.0f} "
                f"degrees, not {self.hfov_deg}"
            )

    @property
    def focal_px(self) -> float:
        return float(self.size[0] / 2 / np.tan(np.radians(self.hfov_deg) / 2))

    @property
    def vfov_deg(self) -> float:
        return float(2 * np.degrees(np.arctan(self.size[1] / 2 / self.focal_px)))

    def rays(self) -> Floats:
        """Rays in the view frame through all pixel centres, (height, width, 3), z = 1."""
        width, height = self.size
        x = (np.arange(width) - (width - 1) / 2) / self.focal_px
        y = (np.arange(height) - (height - 1) / 2) / self.focal_px
        rays = np.ones((height, width, 3))
        rays[..., 0] = x
        rays[..., 1] = y[:, None]
        return rays
