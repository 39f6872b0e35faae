"""Corner candidates: saddles whose surroundings go dark, light, dark, light, and grids of them.

Nothing here expects straight lines or the whole board: a grid grows as long as the next corner is
where the last ones lead to, so a fisheye's bends and a board cut by the picture do no harm.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..lens import Floats
from ._growing import largest_grid, mutual
from ._lattice import Cells, Lattice, LocalMaps, in_squares
from ._saddles import Gray, Pictures, sampled

BLUR_PX = 1.2
RING_PX = 4.0  # radius of the ring around a corner that is looked at
RING = 32
LEAST_CONTRAST = 3.0  # grey levels, light to middle
NEIGHBOURS = 20  # among which the next corner along an edge is looked for
STRAIGHT = 0.94  # cosine of how far beside the edge it may be
SEARCH = 0.33  # of a square: how far from its expected place a corner may be
TURNED = 0.6  # radians: how far its edges may be turned from the grid's


@dataclass(frozen=True)
class Corners:
    """Candidates: places (n, 2), the directions of their two edges, contrast.

    `angles` (n, 2): an edge at angles[:, 0] has light on its clockwise (y down) side going outward
    from the corner, one at angles[:, 1] dark; both modulo pi, radians.
    """

    pixels: Floats
    angles: Floats
    contrast: Floats
    tree: cKDTree = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "tree", cKDTree(self.pixels))

    def along(self, which: Cells, odd: NDArray[np.bool_]) -> Floats:
        """Edge directions (..., 2) along the grid's two axes, whichever way the colours lie."""
        angles = self.angles[which]
        return np.where(odd[..., None], angles[..., ::-1], angles)


def find_corners(gray: Gray) -> Corners:
    """All candidates in a picture."""
    smooth = cv2.GaussianBlur(gray.astype(np.float32), (0, 0), BLUR_PX)
    xx = cv2.Sobel(smooth, cv2.CV_32F, 2, 0)
    yy = cv2.Sobel(smooth, cv2.CV_32F, 0, 2)
    xy = cv2.Sobel(smooth, cv2.CV_32F, 1, 1)
    saddle = np.maximum(xy * xy - xx * yy, 0)
    highest = cv2.dilate(saddle, np.ones((2 * round(RING_PX / 2) + 1,) * 2, np.uint8))
    peak = (saddle == highest) & (saddle > 1e-3 * np.percentile(saddle, 99.5))
    border = int(RING_PX) + 1
    peak[:border], peak[-border:], peak[:, :border], peak[:, -border:] = (False,) * 4
    y, x = np.nonzero(peak)
    return _alternating(smooth, np.stack([x, y], axis=-1).astype(np.float64))


def _alternating(smooth: Pictures, at: Floats) -> Corners:
    """Those whose ring goes dark, light, dark, light."""
    turn = np.arange(RING) * (2 * np.pi / RING)
    ring = RING_PX * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    values = sampled(smooth, at[:, None] + ring)
    values = values - values.mean(axis=1, keepdims=True)
    waves = np.fft.rfft(values, axis=1)
    energy = np.sum(np.abs(waves[:, 1:]) ** 2, axis=1)
    second = np.abs(waves[:, 2]) ** 2  # the first and third are what edges and noise have
    light = values > 0
    changes = np.sum(light != np.roll(light, 1, axis=1), axis=1)
    contrast = np.abs(waves[:, 2]) * 2 / RING
    good = (second > 0.6 * energy) & (changes == 4) & (contrast > LEAST_CONTRAST)
    return Corners(at[good], _edges(values[good]), contrast[good])


def _edges(values: Floats) -> Floats:
    """(n, 2) directions, modulo pi, of the edges where the ring turns light and where dark."""
    angles = np.empty((len(values), 2))
    step = 2 * np.pi / RING
    following = np.roll(values, -1, axis=1)
    for k, (low, high) in enumerate(((values, following), (following, values))):
        crossing = (low <= 0) & (high > 0)
        part = np.where(crossing, np.abs(values) / (np.abs(values) + np.abs(following) + 1e-9), 0)
        turn = (np.arange(RING) + part) * step
        # two crossings half a turn apart: their mean modulo pi, by doubling the angle
        doubled = np.sum(np.exp(2j * turn) * crossing, axis=1)
        angles[:, k] = np.angle(doubled) / 2 % np.pi
    return angles


def grid_of(corners: Corners) -> Lattice | None:
    """The largest grid that grows from the best linked corners; None if nothing grows."""
    if len(corners.pixels) < 4:
        return None
    links = mutual(_links(corners))

    def start(seed: int) -> Lattice:
        return _started(corners, seed, links[seed])

    return largest_grid(links, corners.contrast, start, lambda: _Growth(corners))


def _links(corners: Corners) -> Cells:
    """(n, 4): the next corners along one edge, forth and back, and along the other; or -1."""
    count = len(corners.pixels)
    distance, near = corners.tree.query(corners.pixels, k=min(NEIGHBOURS, count))
    offset = corners.pixels[near] - corners.pixels[:, None]
    # a neighbour's colours lie the other way round
    alike = _turn_between(corners.angles[near][..., ::-1], corners.angles[:, None])
    swapped = (alike.max(axis=-1) < 0.5) & (distance > 0)
    links = np.full((count, 4), -1)
    for k in range(4):
        angle = corners.angles[:, k // 2]
        way = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * (1 if k % 2 == 0 else -1)
        fits = swapped & (np.einsum("nkc,nc->nk", offset, way) > STRAIGHT * distance)
        first = np.argmax(fits, axis=1)
        links[:, k] = np.where(fits.any(axis=1), near[np.arange(count), first], -1)
    return links


def _started(corners: Corners, seed: int, links: Cells) -> Lattice:
    """The seed and its neighbours, the second axis clockwise (y down) of the first."""
    first, second = (np.array([np.cos(a), np.sin(a)]) for a in corners.angles[seed])
    flip = 1 if first[0] * second[1] - first[1] * second[0] > 0 else -1
    steps = np.array([[1, 0], [-1, 0], [0, flip], [0, -flip]])
    there = links >= 0
    lattice = Lattice()
    lattice.put(np.zeros((1, 2), np.int64), corners.pixels[[seed]])
    lattice.put(steps[there], corners.pixels[links[there]])
    return lattice


class _Growth:
    """Finds the next corners of one grid among the candidates."""

    def __init__(self, corners: Corners) -> None:
        self.corners = corners
        self.used = np.zeros(len(corners.pixels), bool)

    def __call__(self, cells: Cells, maps: LocalMaps) -> Floats:
        places = np.full((len(cells), 2), np.nan)
        reach = SEARCH * np.linalg.norm(maps.axes, axis=1).max()
        count = len(self.corners.pixels)
        distance, near = self.corners.tree.query(
            maps.place, k=min(3, count), distance_upper_bound=max(float(reach), 1.5)
        )
        distance, near = distance.reshape(len(cells), -1), near.reshape(len(cells), -1)
        off = np.stack([self._off(maps, distance[:, k], near[:, k]) for k in range(near.shape[1])])
        near = np.minimum(near, count - 1)
        off[self._unlike(cells, maps, near).T] = np.inf
        choice = np.argmin(off, axis=0)
        off, chosen = off.min(axis=0), near[np.arange(len(cells)), choice]
        for n in np.argsort(off):  # a corner goes to the cell that it fits best
            if np.isfinite(off[n]) and not self.used[chosen[n]]:
                self.used[chosen[n]] = True
                places[n] = self.corners.pixels[chosen[n]]
        return places

    def _off(self, maps: LocalMaps, distance: Floats, near: Cells) -> Floats:
        """How far candidates are from their place, squares; inf if too far."""
        there = np.isfinite(distance)
        offset = self.corners.pixels[np.where(there, near, 0)] - maps.place
        off = in_squares(maps.axes, offset)
        return np.where(there & ((off < SEARCH) | (distance < 1.5)), off, np.inf)

    def _unlike(self, cells: Cells, maps: LocalMaps, near: Cells) -> NDArray[np.bool_]:
        """(n, k): where a candidate's edges run across the grid, or its colours lie wrong."""
        odd = np.broadcast_to((cells.sum(axis=1) % 2 == 1)[:, None], near.shape)
        grid = np.arctan2(maps.axes[:, 1], maps.axes[:, 0])
        turned = _turn_between(self.corners.along(near, odd), grid[:, None]).max(axis=-1)
        return (turned > TURNED) | self.used[near]


def _turn_between(a: Floats, b: Floats) -> Floats:
    """Between directions modulo pi, in [0, pi/2]."""
    turn = np.abs(a - b) % np.pi
    return np.minimum(turn, np.pi - turn)
