"""What a picture looks like along rays from a point, and where it ends there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from ._ellipse import Ellipse, Floats

RAYS = 720
ANGLES: Floats = np.asarray(np.arange(RAYS) * (2 * np.pi / RAYS), dtype=np.float64)
PER_RAY = 5  # edges kept of each ray

DIM = 8.0  # grey levels: steps in what is darker than this count little
WEAKEST = 0.04  # of a ray's brightness: falls weaker than this are no edges
CLEAR = 0.2  # falls stronger than this are as good as any
CLIPPED = 225.0  # grey levels: what is brighter spills over the rim
CLIPPED_TRUST = 0.5


@dataclass(frozen=True)
class Unrolled:
    """A picture along RAYS rays from an ellipse's centre.

    level  (RAYS, n) brightness at `radius` (n,), equal steps of `step` pixels
    there  (RAYS, n) whether that is inside the picture; every ray leaves it once
    """

    about: Ellipse
    radius: Floats
    level: Floats
    there: NDArray[np.bool_]

    @property
    def step(self) -> float:
        return float(self.radius[1] - self.radius[0])


@dataclass(frozen=True)
class Edges:
    """Places where brightness falls outwards.

    points   (n, 2) pixels
    ray      (n,) which ray they are on, in order
    weights  (n,) 0 to 1: how far to trust them
    """

    points: Floats
    ray: NDArray[np.int64]
    weights: Floats


def unroll(picture: Floats, about: Ellipse, first: float, last: float, step: float) -> Unrolled:
    """The picture (rows, columns) between two radii around a centre, bilinear."""
    radius = np.arange(first, last + step, step)
    points = about.points(ANGLES[:, None], radius)
    rows, columns = picture.shape
    there = np.asarray(((points >= 0) & (points <= (columns - 1, rows - 1))).all(axis=-1))
    level = map_coordinates(picture, [points[..., 1], points[..., 0]], order=1, mode="nearest")
    return Unrolled(about, radius, np.asarray(level, dtype=np.float64), there)


def smoothed(unrolled: Unrolled) -> Unrolled:
    """Less noise, at the cost of a few pixels' sharpness."""
    level = gaussian_filter(unrolled.level, (1, 2), mode=("wrap", "nearest"))
    return Unrolled(unrolled.about, unrolled.radius, level, unrolled.there)


def outermost(unrolled: Unrolled, level: float) -> Floats:
    """The outermost place of every ray that is brighter than `level`, pixels (n, 2).

    Rays that are so bright where they leave the picture, or nowhere, have none.
    """
    bright = (unrolled.level > level) & unrolled.there
    last = bright.shape[1] - 1 - np.argmax(bright[:, ::-1], axis=1)
    ends = bright.any(axis=1) & (last < unrolled.there.sum(axis=1) - 2)
    ray, last = np.flatnonzero(ends), last[ends]
    inner, outer = unrolled.level[ray, last], unrolled.level[ray, last + 1]
    radius = unrolled.radius[last] + unrolled.step * (inner - level) / (inner - outer)
    return unrolled.about.points(ANGLES[ray], radius)


def falling_edges(unrolled: Unrolled, blur_px: float, black: float) -> Edges:
    """Where brightness, blurred by `blur_px`, falls fastest outwards: the best few of each ray.

    How far an edge is trusted depends on its height as a share of the ray's brightness, so that
    lamps count no more than dim walls. Clipped white is trusted less: its edge lies farther out.
    """
    blur = blur_px / unrolled.step
    level = np.maximum(unrolled.level - black, 0)
    brightest = np.where(unrolled.there, level, 0).max(axis=1, keepdims=True)
    # a step of height 1, blurred, is at its steepest 0.4 / blur
    slope = gaussian_filter(level, (1, blur), order=(0, 1), mode=("wrap", "nearest"))
    fall = -2.5 * blur * slope / (brightest + DIM)
    middle, inside = fall[:, 1:-1], unrolled.there.sum(axis=1, keepdims=True) - 1.5 * blur
    peak = (middle > fall[:, :-2]) & (middle >= fall[:, 2:]) & (middle > WEAKEST)
    peak &= np.arange(1, fall.shape[1] - 1) < inside
    height = np.pad(np.where(peak, middle, 0), ((0, 0), (1, 1)))
    ray = np.repeat(np.arange(RAYS), PER_RAY)
    place = np.argsort(-height, axis=1)[:, :PER_RAY].ravel()
    kept = height[ray, place] > 0
    ray, place = ray[kept], place[kept]
    radius = unrolled.radius[place] + unrolled.step * _summit(fall, ray, place)
    before = unrolled.level[ray, np.maximum(place - round(2 * blur), 0)]
    trust = np.where(before > CLIPPED, CLIPPED_TRUST, 1.0)
    weights = trust * np.minimum(fall[ray, place] / CLEAR, 1)
    return Edges(unrolled.about.points(ANGLES[ray], radius), ray, weights)


def _summit(fall: Floats, ray: NDArray[np.int64], place: NDArray[np.int64]) -> Floats:
    """Of the parabola through each peak and its neighbours, in steps from the peak."""
    before, here, after = fall[ray, place - 1], fall[ray, place], fall[ray, place + 1]
    bend = np.minimum(before - 2 * here + after, -1e-12)
    return np.clip((before - after) / (2 * bend), -0.5, 0.5)
