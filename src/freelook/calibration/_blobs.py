"""Round blobs, and grids of them in bent pictures.

A circle's picture is an ellipse, and an ellipse says how the grid lies there: in coordinates in
which it is a circle again, the neighbours are all equally far and at right angles. So the first
neighbours are found without knowing the grid, and from then on it grows as a chessboard's does.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import cv2
import numpy as np
from scipy.spatial import cKDTree

from ..lens import Floats
from ._growing import largest_grid, mutual
from ._lattice import Bools, Cells, Lattice, LocalMaps, in_squares
from ._saddles import Gray

WINDOWS = (8, 16, 40)  # parts of the picture's shorter side that brightness is compared over
LEAST = 6  # grey levels beyond the usual of the surroundings
SMALLEST_PX2 = 20.0  # area of a blob; a smaller one looks round whatever it is
LARGEST_SHARE = 0.02  # of the picture
ROUND = 0.03  # how far an area may be from that of the ellipse of these moments; squares: 0.045
LONGEST = 6.0  # axis of an ellipse, in short ones
SAME_PX = 0.5  # of a blob's radius: nearer ones are the same blob
NEIGHBOURS = 14
ASIDE = np.radians(25)  # how far beside its direction a neighbour may be
FARTHER = 1.5  # than the nearest a neighbour may be
SEARCH = 0.33  # of a step
ALIKE = 2.5  # ratio of neighbours' areas


@dataclass(frozen=True)
class Blobs:
    """Middles (n, 2) and second moments (n, 2, 2) of ellipses, pixels."""

    pixels: Floats
    spread: Floats
    tree: cKDTree = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "tree", cKDTree(self.pixels))

    @property
    def area(self) -> Floats:
        return np.asarray(4 * np.pi * np.sqrt(np.linalg.det(self.spread)))


def find_blobs(gray: Gray, scale: float = 1.0) -> Blobs:
    """Dark ellipses on light ground, each once; in a picture enlarged `scale` times."""
    smallest, largest = SMALLEST_PX2 * scale**2, LARGEST_SHARE * gray.size
    pixels, spread = [], []
    for part in WINDOWS:
        window = max(7, min(gray.shape) // part) | 1
        dark = cv2.adaptiveThreshold(
            gray, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY_INV, window, LEAST
        )
        outlines, _ = cv2.findContours(dark, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        for outline in outlines:
            ellipse = _ellipse(outline, smallest, largest)
            if ellipse is not None:
                pixels.append(ellipse[0])
                spread.append(ellipse[1])
    return _each_once(np.array(pixels).reshape(-1, 2), np.array(spread).reshape(-1, 2, 2))


def _ellipse(outline: Cells, smallest: float, largest: float) -> tuple[Floats, Floats] | None:
    """Middle and second moments of what an outline encloses, if that is an ellipse."""
    if len(outline) < 8:
        return None
    m = cv2.moments(outline)
    # an outline runs through the middles of the outermost pixels: half a pixel is missing around it
    area = m["m00"] + len(outline) / 2
    if not smallest <= area <= largest or m["m00"] <= 0:
        return None
    xx, xy, yy = (m[name] / m["m00"] for name in ("mu20", "mu11", "mu02"))
    half, apart = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy)
    short, long = math.sqrt(max(half - apart, 0.0)), math.sqrt(half + apart)
    if short < 0.3 or long > LONGEST * short:
        return None
    if abs(m["m00"] / (4 * math.pi * short * long) - 1) > ROUND:
        return None
    middle = np.array([m["m10"], m["m01"]]) / m["m00"]
    return middle, np.array([[xx, xy], [xy, yy]]) * (area / m["m00"])


def _each_once(pixels: Floats, spread: Floats) -> Blobs:
    """Without those that another window found already; the largest outline of each counts."""
    order = np.argsort(-np.linalg.det(spread), kind="stable")
    pixels, spread = pixels[order], spread[order]
    area = Blobs(pixels, spread).area
    radius = np.sqrt(area / np.pi)
    kept = np.ones(len(pixels), bool)
    if len(pixels):
        tree = cKDTree(pixels)
        for i, near in enumerate(tree.query_ball_point(pixels, SAME_PX * radius)):
            if kept[i]:
                kept[[j for j in near if j > i and area[j] * ALIKE > area[i]]] = False
    return Blobs(pixels[kept], spread[kept])


def grid_of(blobs: Blobs) -> Lattice | None:
    """The largest grid of blobs; None if there is none of more than three."""
    if len(blobs.pixels) < 4:
        return None
    links = mutual(_links(blobs))

    def start(seed: int) -> Lattice:
        return _started(blobs, seed, links[seed])

    return largest_grid(links, blobs.area, start, lambda: _Growth(blobs))


def _whitening(spread: Floats) -> Floats:
    """(n, 2, 2): pixel offsets to those in which an ellipse is the unit circle (not mirrored)."""
    values, vectors = np.linalg.eigh(4 * spread)
    scale = 1 / np.sqrt(np.maximum(values, 1e-9))
    return np.asarray((vectors * scale[:, None, :]) @ vectors.swapaxes(1, 2))


def _links(blobs: Blobs) -> Cells:
    """(n, 4): the neighbours along an axis, forth and back, and along the other, or -1.

    The first axis leads to the nearest.
    """
    count = len(blobs.pixels)
    near = blobs.tree.query(blobs.pixels, k=min(NEIGHBOURS, count))[1][:, 1:]
    white = _whitening(blobs.spread)
    offset = np.einsum("nij,nkj->nki", white, blobs.pixels[near] - blobs.pixels[:, None])
    area = blobs.area
    ratio = area[near] / area[:, None]
    distance = np.hypot(offset[..., 0], offset[..., 1])
    distance = np.where((ratio < ALIKE) & (ratio > 1 / ALIKE), distance, np.inf)
    rows = np.arange(count)
    nearest = np.argmin(distance, axis=1)
    least = distance[rows, nearest]
    angle = np.arctan2(offset[..., 1], offset[..., 0])
    angle = angle - angle[rows, nearest][:, None]
    links = np.full((count, 4), -1)
    for k, way in enumerate((0.0, np.pi, np.pi / 2, -np.pi / 2)):
        aside = np.abs((angle - way + np.pi) % (2 * np.pi) - np.pi)
        fits = np.where((aside < ASIDE) & (distance <= FARTHER * least[:, None]), distance, np.inf)
        first = np.argmin(fits, axis=1)
        links[:, k] = np.where(np.isfinite(fits[rows, first]), near[rows, first], -1)
    return links


def _started(blobs: Blobs, seed: int, links: Cells) -> Lattice:
    """The seed and its neighbours; the second axis is clockwise (y down) of the first."""
    there = links >= 0
    lattice = Lattice()
    lattice.put(np.zeros((1, 2), np.int64), blobs.pixels[[seed]])
    steps = np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    lattice.put(steps[there], blobs.pixels[links[there]])
    return lattice


class _Growth:
    """Finds the next blobs of one grid."""

    def __init__(self, blobs: Blobs) -> None:
        self.blobs = blobs
        self.used = np.zeros(len(blobs.pixels), bool)

    def __call__(self, cells: Cells, maps: LocalMaps) -> Floats:
        places = np.full((len(cells), 2), np.nan)
        near = self.blobs.tree.query(maps.place)[1]
        off = in_squares(maps.axes, self.blobs.pixels[near] - maps.place)
        off[~self._alike(near, maps)] = np.inf
        for n in np.argsort(off):
            if off[n] < SEARCH and not self.used[near[n]]:
                self.used[near[n]] = True
                places[n] = self.blobs.pixels[near[n]]
        return places

    def _alike(self, near: Cells, maps: LocalMaps) -> Bools:
        """Whether blobs fill about as much of a step as a circle in a grid can."""
        square = np.abs(np.linalg.det(maps.axes))
        filled = self.blobs.area[near] / np.maximum(square, 1e-9)
        return (filled > 0.02) & (filled < 0.8)
