"""The view by definition: NumPy, float64, exact lens formula, one pixel after another.

Slow and plain on purpose; every other renderer is tested against it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..lens import Floats
from ..types import Picture, Plane
from ..viewport import Viewport
from .blank import Sampling, black_of, check_fits, plane_scales
from .window import window_coordinates


class ReferenceRenderer:
    """One sample at each exactly projected pixel; no feather at the rim."""

    def __init__(self, sampling: Sampling = "bilinear") -> None:
        self._sample = {"bilinear": sample, "bicubic": sample_bicubic}[sampling]

    def render(
        self, picture: Picture, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> Picture:
        check_fits(picture, camera)
        pixels = coordinates(camera, camera_from_view, viewport)
        planes = tuple(
            self._sample(plane, _at_scale(pixels, scale), black)
            for plane, scale, black in zip(
                picture.planes, plane_scales(picture), black_of(picture), strict=True
            )
        )
        return Picture(picture.layout, planes, picture.color)


def coordinates(camera: Camera, camera_from_view: Rotation, viewport: Viewport) -> Floats:
    """Where each view pixel looks in the picture: (height, width, 2); NaN where nothing is seen."""
    if viewport.kind.cut:
        return window_coordinates(camera, camera_from_view, viewport)
    rays = viewport.rays()
    return camera.project(camera_from_view.apply(rays.reshape(-1, 3)).reshape(rays.shape))


def sample(plane: Plane, pixels: Floats, black: float) -> Plane:
    """Bilinear values at `pixels` (..., 2); `black` counts as the value outside the plane."""
    rows, columns = plane.shape[:2]
    padded = np.pad(
        plane.astype(np.float64),
        [(1, 1), (1, 1)] + [(0, 0)] * (plane.ndim - 2),
        constant_values=black,
    )
    x = np.clip(np.nan_to_num(pixels[..., 0], nan=-1.0), -1, columns) + 1
    y = np.clip(np.nan_to_num(pixels[..., 1], nan=-1.0), -1, rows) + 1
    x0 = np.minimum(x.astype(int), columns)
    y0 = np.minimum(y.astype(int), rows)
    fx, fy = x - x0, y - y0
    if plane.ndim == 3:
        fx, fy = fx[..., None], fy[..., None]
    top = padded[y0, x0] * (1 - fx) + padded[y0, x0 + 1] * fx
    bottom = padded[y0 + 1, x0] * (1 - fx) + padded[y0 + 1, x0 + 1] * fx
    return np.rint(top * (1 - fy) + bottom * fy).astype(np.uint8)


def sample_bicubic(plane: Plane, pixels: Floats, black: float) -> Plane:
    """As `sample`, with Keys' cubic through four pixels each way (a = -0.75, as OpenCV):

    1.25 |x|^3 - 2.25 |x|^2 + 1 up to 1, -0.75 |x|^3 + 3.75 |x|^2 - 6 |x| + 3 up to 2, then 0
    """
    rows, columns = plane.shape[:2]
    padded = np.pad(
        plane.astype(np.float64),
        [(3, 3), (3, 3)] + [(0, 0)] * (plane.ndim - 2),
        constant_values=black,
    )
    x = np.clip(np.nan_to_num(pixels[..., 0], nan=-2.0), -2, columns + 1) + 3
    y = np.clip(np.nan_to_num(pixels[..., 1], nan=-2.0), -2, rows + 1) + 3
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    total = np.zeros((*x.shape, *plane.shape[2:]))
    for j in range(-1, 3):
        for i in range(-1, 3):
            weight = _cubic(x - (x0 + i)) * _cubic(y - (y0 + j))
            taken = padded[y0 + j, x0 + i]
            total += taken * (weight[..., None] if plane.ndim == 3 else weight)
    return np.clip(np.rint(total), 0, 255).astype(np.uint8)


def _cubic(x: Floats) -> Floats:
    x = np.abs(x)
    near = (1.25 * x - 2.25) * x * x + 1
    far = ((-0.75 * x + 3.75) * x - 6) * x + 3
    return np.where(x < 1, near, np.where(x < 2, far, 0.0))


def _at_scale(pixels: Floats, scale: int) -> Floats:
    """Luma coordinates to those of a plane `scale` times smaller, at its own view pixels.

    A small pixel sits in the middle of the `scale` x `scale` it stands for, here and there.
    """
    if scale == 1:
        return pixels
    height, width = pixels.shape[:2]
    even = pixels[: height - height % 2 or 1, : width - width % 2 or 1]
    middle = (even[::2, ::2] + even[1::2, ::2] + even[::2, 1::2] + even[1::2, 1::2]) / 4
    grown = np.pad(middle, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
    return (grown - (scale - 1) / 2) / scale
