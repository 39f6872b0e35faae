"""The camera matrix of computer vision, K = [[fx, skew, cx], [0, fy, cy], [0, 0, 1]], and ours.

A lens here has one focal length f in pixels; what makes fx and fy differ is the camera's stretch.
With f = fx the stretch is [[1, skew / fx], [0, fy / fx]]. Pixel (0, 0) is the middle of the
top-left pixel on both sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..camera import Camera
from ..errors import ProfileError
from ..lens import Floats


@dataclass(frozen=True)
class Matrix:
    """The five numbers of K, pixels."""

    fx: float
    fy: float
    cx: float
    cy: float
    skew: float = 0.0

    def __post_init__(self) -> None:
        if self.fx <= 0 or self.fy <= 0:
            raise ProfileError(f"focal lengths must be positive, not {self.fx} and {self.fy}")

    @property
    def center(self) -> tuple[float, float]:
        return self.cx, self.cy

    @property
    def stretch(self) -> Floats:
        return np.array([[1.0, self.skew / self.fx], [0.0, self.fy / self.fx]])


def matrix_of(camera: Camera, f: float, what: str) -> Matrix:
    """K of a camera whose lens has the focal length f; `what` names the format, for errors.

    ProfileError if the stretch turns the picture, or has a skew where `what` cannot hold one.
    """
    (xx, xy), (yx, yy) = camera.stretch.tolist()
    if abs(yx) > 1e-9 * abs(yy) or xx <= 0 or yy <= 0:
        raise ProfileError(
            f"{what} can say pixel aspect and skew only, no stretch like {camera.stretch.tolist()}"
        )
    return Matrix(f * xx, f * yy, *camera.center, f * xy)
