"""How sure a calibration is of where it projects to, all over the picture.

The covariance of the parameters says little by itself: a shift of the centre is much the same as a
turn of the camera, which the user of a camera does not see. So, as mrcal does (its tour of
projection uncertainty), for each pixel: take its ray, change the parameters by their covariance,
turn the camera by the small rotation that best undoes the change over the whole seen picture, and
look at what is left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..camera import Camera
from ..lens import Floats
from .bundle import Solution
from .parameters import Freedom, Parameters
from .slopes import cross_matrices, point_slopes, value_slopes

COLUMNS = 24  # of the pixels that decide the turn


@dataclass(frozen=True)
class Uncertainty:
    """Standard deviation of the projection at pixels (n, 2): `sigma_px` (n,), NaN where not seen.

    The worse of the two directions counts.
    """

    pixels: Floats
    sigma_px: Floats


def projection_uncertainty(
    camera: Camera, solution: Solution, freedom: Freedom, pixels: Floats
) -> Uncertainty:
    """The uncertainty at the given pixels; `camera` is the solution's, with its field."""
    covariance = projection_covariance(camera, solution, freedom, pixels)
    seen = np.isfinite(covariance[:, 0, 0])
    sigma = np.full(len(pixels), np.nan)
    if seen.any():
        sigma[seen] = np.sqrt(np.maximum(np.linalg.eigvalsh(covariance[seen])[:, -1], 0))
    return Uncertainty(pixels, sigma)


def projection_covariance(
    camera: Camera, solution: Solution, freedom: Freedom, pixels: Floats
) -> Floats:
    """The same as covariances (n, 2, 2), pixels squared."""
    rays = camera.ray(pixels)
    seen = np.isfinite(rays[:, 2])
    covariance = np.full((len(pixels), 2, 2), np.nan)
    if seen.any():
        left = _after_turning(camera, freedom, rays[seen])
        covariance[seen] = left @ solution.covariance @ left.transpose(0, 2, 1)
    return covariance


def grid_of(size: tuple[int, int], columns: int) -> Floats:
    """Pixels (n, 2) evenly over a picture, row by row, `columns` across."""
    rows = max(2, round(columns * size[1] / size[0]))
    x = (np.arange(columns) + 0.5) * size[0] / columns - 0.5
    y = (np.arange(rows) + 0.5) * size[1] / rows - 0.5
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _after_turning(camera: Camera, freedom: Freedom, rays: Floats) -> Floats:
    """d pixel / d values (n, 2, k) at rays, less the turn that best undoes it."""
    everywhere = camera.ray(grid_of(camera.size, COLUMNS))
    everywhere = everywhere[np.isfinite(everywhere[:, 2])]
    by_values, by_turn = _slopes(camera, freedom, everywhere)
    k = by_values.shape[-1]
    turn = np.linalg.lstsq(by_turn.reshape(-1, 3), by_values.reshape(-1, k), rcond=None)[0]
    here_values, here_turn = _slopes(camera, freedom, rays)
    return np.asarray(here_values - here_turn @ turn)


def _slopes(camera: Camera, freedom: Freedom, rays: Floats) -> tuple[Floats, Floats]:
    """d pixel / d values (n, 2, k) and d pixel / d small rotation (n, 2, 3)."""
    parameters = Parameters(camera, freedom)
    by_turn = -np.einsum("nij,njk->nik", point_slopes(camera, rays), cross_matrices(rays))
    return value_slopes(parameters, parameters.values, rays), by_turn
