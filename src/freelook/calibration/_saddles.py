"""Corners where four squares meet: placed to a fraction of a pixel, and told from other things.

Both work in coordinates of the local grid (`LocalMaps`), in which squares are squares and edges
are straight wherever in a fisheye picture they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..lens import Floats
from ._lattice import Bools, LocalMaps

Gray = NDArray[np.uint8]
Pictures = NDArray[np.float32]

BLUR_PX = 0.7
FEWEST_PX = 3.0  # to each side, that a corner is placed by
STEPS = 8
LONGEST_STEP_PX = 2.0
ENOUGH_PX = 1e-3  # a step that is the last
FLAT = 1e-4  # ratio of slopes' products, below which there is one edge and no corner
# rings around a corner in squares, and how far from the edges (sine of twice the angle) they count
RINGS = (0.18, 0.26, 0.34)
CLEAR_OF_EDGES = 0.35
INSIDE = 0.6  # of the rings that must lie in the picture
AROUND = np.arange(24) * (2 * np.pi / 24) + np.pi / 24
LIKE = 0.75  # correlation with the ideal corner; a T of edges has 0.58, a straight edge 0


@dataclass(frozen=True)
class Window:
    """How far around a corner looks count: a share of a square, and at most so many pixels.

    In tiny squares a larger share, up to `most`: a corner takes a few pixels to be placed by.
    """

    share: float = 0.45
    widest_px: float = 12.0
    most: float = 0.75

    def shares(self, axes: Floats) -> Floats:
        """(n,) of the squares with these `axes` (n, 2, 2)."""
        length = np.linalg.norm(axes, axis=1)
        share = np.clip(FEWEST_PX / length.min(axis=1), self.share, self.most)
        return np.minimum(share, self.widest_px / length.max(axis=1))


@dataclass(frozen=True)
class Slopes:
    """A picture's brightness, a little smoothed, and its slopes along x and y."""

    level: Pictures
    x: Pictures
    y: Pictures

    @classmethod
    def of(cls, gray: Gray, blur_px: float = BLUR_PX) -> Slopes:
        level = cv2.GaussianBlur(gray.astype(np.float32), (0, 0), blur_px)
        x = cv2.Scharr(level, cv2.CV_32F, 1, 0, scale=1 / 32)
        y = cv2.Scharr(level, cv2.CV_32F, 0, 1, scale=1 / 32)
        return cls(level, x, y)


def placed(
    slopes: Slopes, start: Floats, maps: LocalMaps, window: Window, enough_px: float = ENOUGH_PX
) -> tuple[Floats, Bools]:
    """Corners (n, 2) near `start`, and which of them there are; to about `enough_px`.

    In grid coordinates an edge through the corner runs straight away from it, so that the slope at
    each pixel is at right angles to the way from the corner to the pixel: a linear least-squares
    problem over the pixels themselves (nothing is interpolated), weighted towards the corner.
    (Foerstner and Guelch 1987, with the squares' own coordinates instead of the picture's.)
    """
    at = start.copy()
    good = np.isfinite(at).all(axis=1) & (maps.shortest_step() > 1.0)
    moving = np.flatnonzero(good)
    for _ in range(STEPS):
        blocks = np.array_split(moving, 1 + len(moving) // _block(maps, window))
        steps = [_step(slopes, at[block], maps.part(block), window) for block in blocks]
        step, solvable = (np.concatenate(part) for part in zip(*steps, strict=True))
        length = np.hypot(step[:, 0], step[:, 1])
        at[moving] += step * np.minimum(1, LONGEST_STEP_PX / np.maximum(length, 1e-9))[:, None]
        good[moving[~solvable]] = False
        moving = moving[solvable & (length > enough_px)]
        if not len(moving):
            break
    return at, good


def _block(maps: LocalMaps, window: Window) -> int:
    """How many corners are worked on at once: memory for about a million pixels."""
    return int(max(1, 1e6 / (2 * _radii(maps, window).max(initial=1) + 3) ** 2))


def _radii(maps: LocalMaps, window: Window) -> Floats:
    """(n,) pixels that the windows reach to each side."""
    return np.asarray(window.shares(maps.axes) * np.linalg.norm(maps.axes, axis=1).max(axis=1))


def _step(slopes: Slopes, at: Floats, maps: LocalMaps, window: Window) -> tuple[Floats, Bools]:
    """How far (n, 2) the corners are from `at`, pixels, and where that can be told."""
    rows, columns = slopes.level.shape
    share = window.shares(maps.axes)
    reach = int(np.ceil(_radii(maps, window).max(initial=1)))
    across = np.arange(-reach, reach + 1)
    x = np.round(at[:, :1]).astype(int) + np.tile(across, len(across))
    y = np.round(at[:, 1:]).astype(int) + np.repeat(across, len(across))
    inside = (x >= 1) & (x < columns - 1) & (y >= 1) & (y < rows - 1)
    x, y = np.clip(x, 0, columns - 1), np.clip(y, 0, rows - 1)
    # float32 is exact to 1e-6 pixel here, and twice as fast
    maps = LocalMaps(at, maps.axes.astype(np.float32), maps.bend.astype(np.float32), maps.known)
    u, v = _grid_coordinates(_float32(x - at[:, :1]), _float32(y - at[:, 1:]), maps)
    by_u, by_v = _grid_slopes(slopes.x[y, x], slopes.y[y, x], u, v, maps)
    weight = np.maximum(1 - (u * u + v * v) / _float32(share * share)[:, None], 0) ** 2 * inside
    weight_u, weight_v, along = weight * by_u, weight * by_v, by_u * u + by_v * v
    pairs = (
        (weight_u, by_u),
        (weight_u, by_v),
        (weight_v, by_v),
        (weight_u, along),
        (weight_v, along),
    )
    a, b, c, p, q = (np.einsum("nk,nk->n", *pair).astype(np.float64) for pair in pairs)
    determinant = a * c - b * b
    solvable = determinant > FLAT * (a + c) ** 2
    determinant = np.where(solvable, determinant, np.inf)
    move = np.stack([c * p - b * q, a * q - b * p], axis=-1) / determinant[:, None]
    return (maps.axes @ move[..., None])[..., 0], solvable


def _float32(values: Floats) -> Pictures:
    return np.asarray(values, dtype=np.float32)


def _grid_coordinates(x: Pictures, y: Pictures, maps: LocalMaps) -> tuple[Pictures, Pictures]:
    """(u, v), each (n, k), of pixel offsets x and y (n, k): the local map undone, by two steps."""
    inverse, bend = np.linalg.inv(maps.axes)[..., None], maps.bend[..., None]

    def straight(x: Pictures, y: Pictures) -> tuple[Pictures, Pictures]:
        return (
            inverse[:, 0, 0] * x + inverse[:, 0, 1] * y,
            inverse[:, 1, 0] * x + inverse[:, 1, 1] * y,
        )

    u, v = straight(x, y)
    for _ in range(2):
        u, v = np.clip(u, -1, 1), np.clip(v, -1, 1)
        uu, uv, vv = u * u, u * v, v * v
        bent = [bend[:, i, 0] * uu + bend[:, i, 1] * uv + bend[:, i, 2] * vv for i in (0, 1)]
        u, v = straight(x - bent[0], y - bent[1])
    return u, v


def _grid_slopes(
    x: Pictures, y: Pictures, u: Pictures, v: Pictures, maps: LocalMaps
) -> tuple[Pictures, Pictures]:
    """Slopes along u and v, from those along x and y."""
    axes, bend = maps.axes[..., None], maps.bend[..., None]
    by_u = [axes[:, i, 0] + 2 * u * bend[:, i, 0] + v * bend[:, i, 1] for i in (0, 1)]
    by_v = [axes[:, i, 1] + u * bend[:, i, 1] + 2 * v * bend[:, i, 2] for i in (0, 1)]
    return _float32(x * by_u[0] + y * by_u[1]), _float32(x * by_v[0] + y * by_v[1])


def likeness(level: Pictures, maps: LocalMaps, size: float = 1.0) -> tuple[Floats, Floats]:
    """How much (n,) places look like an ideal corner, -1 to 1, and their contrast, grey levels.

    Positive where the squares with u v > 0 are the light ones. `size` shrinks the rings for
    patterns that have other things near their corners. 0 where most of the rings are outside.
    """
    rows, columns = level.shape
    ring = np.array(RINGS)[:, None] * size
    clear = np.abs(np.sin(2 * AROUND)) > CLEAR_OF_EDGES
    u, v = (ring * np.cos(AROUND[clear])).ravel(), (ring * np.sin(AROUND[clear])).ravel()
    at = maps.pixels(u, v)
    inside = np.asarray(((at >= 0) & (at <= (columns - 1, rows - 1))).all(axis=-1), dtype=bool)
    values = sampled(level, np.where(inside[..., None], at, 0.0))
    ideal = np.sign(u * v)
    count = np.maximum(inside.sum(axis=1), 1)
    values = np.where(inside, values - _mean(values, inside, count), 0.0)
    expected = np.where(inside, ideal - _mean(ideal, inside, count), 0.0)
    together = np.sum(values * expected, axis=1)
    spread = np.sqrt(np.sum(values**2, axis=1) * np.sum(expected**2, axis=1))
    enough = (count > INSIDE * len(u)) & (spread > 1e-3 * count)
    alike = np.divide(together, spread, out=np.zeros_like(together), where=enough)
    return alike, 2 * np.abs(together) / count


def edge_blur_px(slopes: Slopes, maps: LocalMaps) -> float:
    """Standard deviation of the blur across edges near corners, the picture's smoothing included.

    A step of height h blurred by s rises by h / (s sqrt(2 pi)) per pixel at its steepest.
    """
    ways = np.concatenate([np.linspace(-0.35, 0.35, 57)] * 2)
    along = np.repeat([0.25, -0.25], 57)
    steepest = np.zeros(len(maps.place))
    for u, v in ((ways, along), (along, ways)):  # across the edges of one kind, and of the other
        at = maps.pixels(u, v)
        steep = np.hypot(sampled(slopes.x, at), sampled(slopes.y, at))
        steepest = np.maximum(steepest, steep.max(axis=1))
    _, contrast = likeness(slopes.level, maps)
    blur = contrast / np.maximum(steepest, 1e-3) / np.sqrt(2 * np.pi)
    return float(np.median(blur))


def _mean(values: Floats, inside: Bools, count: NDArray[np.int64]) -> Floats:
    return np.asarray(np.sum(np.where(inside, values, 0.0), axis=1) / count)[:, None]


def sampled(picture: Pictures, at: Floats) -> Floats:
    """Bilinear values at `at` (..., 2), to 1/32 pixel; the border's beyond it."""
    shape = at.shape[:-1]
    flat = at.reshape(-1, 2).astype(np.float32)
    values = np.empty(len(flat), np.float32)
    for start in range(0, len(flat), 30000):  # OpenCV's pictures have less than 32768 columns
        part = flat[None, start : start + 30000]
        x, y = np.ascontiguousarray(part[..., 0]), np.ascontiguousarray(part[..., 1])
        values[start : start + 30000] = cv2.remap(
            picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )[0]
    return values.reshape(shape).astype(np.float64)
