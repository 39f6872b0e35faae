"""Chessboards in strongly bent pictures: corners first, then the grid that grows through them.

    saddle points of the blurred picture -> those whose surroundings alternate dark, light, dark,
    light -> a grid grown from corner to corner -> corners placed to a fraction of a pixel

Nothing here expects straight lines or the whole board: a grid grows as long as the next corner is
where the last ones lead to, so a fisheye's bends and a board cut by the picture do no harm. Which
corner of the board is which does not matter to a calibration, only that neighbours are neighbours.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..lens import Floats

Gray = NDArray[np.uint8]
Cell = tuple[int, int]

# blur of the corner search, pixels, and radius of the ring around a corner that is looked at
SCALES = ((1.2, 4.0), (2.4, 8.0))
RING = 32
SEARCH = 0.33  # of a square: how far from its place a corner may be
SEEDS = 60
FEWEST = 12  # corners; below that a grid is chance
# Half width of the patch a corner is placed by: of the local square, and at most so many pixels.
# Wider ones take in bent edges, narrower ones fewer pixels: both cost accuracy on real pictures.
WINDOW, WIDEST_PX = 0.33, 8.0
HALF = 8  # samples on each side of the middle of that patch
BLUR_PX = 0.7


@dataclass(frozen=True)
class Grid:
    """Corners of one board: `pixels` (n, 2) and `cells` (n, 2), column and row, from 0."""

    cells: NDArray[np.int64]
    pixels: Floats

    @property
    def size(self) -> tuple[int, int]:
        """Inner corners across and down."""
        columns, rows = self.cells.max(axis=0) + 1
        return int(columns), int(rows)


def find_chessboard(gray: Gray, inner: tuple[int, int] | None = None) -> Grid | None:
    """The largest chessboard in a picture (rows, columns) of uint8; None if there is none.

    `inner` is the number of inner corners, across and down in either order: a grid that is larger
    is cut to the part of that size that has most corners; a smaller one is taken as it is.
    """
    best: Grid | None = None
    for blur, ring in SCALES:
        corners = _corners(gray, blur, ring)
        cells = _largest_grid(corners)
        if cells is None:
            continue
        grid = _as_grid(_completed(gray, cells, ring), inner)
        if grid is not None and (best is None or len(grid.cells) > len(best.cells)):
            best = grid
    return None if best is None else _refined(gray, best)


@dataclass(frozen=True)
class _Corners:
    """Candidates: place, the directions of their two edges, strength.

    `angles` (n, 2): an edge at angles[:, 0] has light on its clockwise (y down) side going outward
    from the corner, one at angles[:, 1] dark; both modulo pi, radians.
    """

    pixels: Floats
    angles: Floats
    strength: Floats
    tree: cKDTree = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "tree", cKDTree(self.pixels))


def _corners(gray: Gray, blur: float, ring: float) -> _Corners:
    smooth = cv2.GaussianBlur(gray.astype(np.float32), (0, 0), blur)
    xx = cv2.Sobel(smooth, cv2.CV_32F, 2, 0)
    yy = cv2.Sobel(smooth, cv2.CV_32F, 0, 2)
    xy = cv2.Sobel(smooth, cv2.CV_32F, 1, 1)
    saddle = np.maximum(xy * xy - xx * yy, 0)
    around = np.ones((2 * round(ring / 2) + 1,) * 2, np.uint8)
    peak = (saddle == cv2.dilate(saddle, around)) & (saddle > 1e-3 * np.percentile(saddle, 99.5))
    border = int(ring) + 1
    peak[:border], peak[-border:], peak[:, :border], peak[:, -border:] = (False,) * 4
    y, x = np.nonzero(peak)
    return _alternating(smooth, np.stack([x, y], axis=-1).astype(np.float64), ring)


def _alternating(smooth: NDArray[np.float32], at: Floats, ring: float) -> _Corners:
    """Those whose ring goes dark, light, dark, light."""
    turn = np.arange(RING) * (2 * np.pi / RING)
    ring_xy = ring * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    values = _sampled(smooth, at[:, None] + ring_xy)
    values = values - values.mean(axis=1, keepdims=True)
    waves = np.fft.rfft(values, axis=1)
    energy = np.sum(np.abs(waves[:, 1:]) ** 2, axis=1)
    second = np.abs(waves[:, 2]) ** 2
    # four changes of sign; the third harmonic and the first are what edges and noise have
    light = values > 0
    changes = np.sum(light != np.roll(light, 1, axis=1), axis=1)
    contrast = np.abs(waves[:, 2]) * 2 / RING
    good = (second > 0.6 * energy) & (changes == 4) & (contrast > 6)
    return _Corners(at[good], _edges(values[good]), contrast[good])


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


def _sampled(picture: NDArray[np.float32], at: Floats) -> Floats:
    """Bilinear values at `at` (..., 2); the border's beyond it."""
    shape = at.shape[:-1]
    flat = at.reshape(-1, 2).astype(np.float32)
    values = np.empty(len(flat), np.float32)
    for start in range(0, len(flat), 30000):  # OpenCV's pictures have less than 32768 columns
        part = flat[None, start : start + 30000]
        values[start : start + 30000] = cv2.remap(
            picture,
            np.ascontiguousarray(part[..., 0]),
            np.ascontiguousarray(part[..., 1]),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )[0]
    return values.reshape(shape).astype(np.float64)


def _largest_grid(corners: _Corners) -> dict[Cell, Floats] | None:
    """Grids grown from the strongest corners in turn; the largest."""
    taken = np.zeros(len(corners.pixels), bool)
    best: dict[Cell, int] = {}
    for seed in np.argsort(-corners.strength)[:SEEDS]:
        if taken[seed]:
            continue
        grown = _grown(corners, int(seed))
        taken[list(grown.values())] = True
        if len(grown) > len(best):
            best = grown
    if len(best) < FEWEST:
        return None
    return {cell: corners.pixels[i] for cell, i in best.items()}


STEPS: tuple[Cell, ...] = ((1, 0), (-1, 0), (0, 1), (0, -1))


def _grown(corners: _Corners, seed: int) -> dict[Cell, int]:
    """Corner numbers by cell, from one corner outward, nearest first."""
    start = _first_square(corners, seed)
    if start is None:
        return {}
    cells, owner = dict(start), {i: cell for cell, i in start.items()}
    places = {cell: corners.pixels[i] for cell, i in cells.items()}
    waiting = deque(cells)
    while waiting:
        cell = waiting.popleft()
        for step in STEPS:
            target = (cell[0] + step[0], cell[1] + step[1])
            if target in cells:
                continue
            expected = _expected(places, cell, step)
            if expected is None:
                continue
            found = _corner_near(corners, *expected, target, _along(corners, cells[cell], cell))
            if found is None or found in owner:
                continue
            places[target] = corners.pixels[found]
            cells[target], owner[found] = found, target
            waiting.append(target)
            waiting.append(cell)
    return cells


def _along(corners: _Corners, i: int, cell: Cell) -> Floats:
    """Edge directions along the grid's two axes, whichever way this corner's colours lie."""
    angles = corners.angles[i]
    return angles if sum(cell) % 2 == 0 else angles[::-1]


def _first_square(corners: _Corners, seed: int) -> dict[Cell, int] | None:
    """The seed and one neighbour along each of its edges."""
    here, angles = corners.pixels[seed], corners.angles[seed]
    near = [i for i in corners.tree.query(here, k=min(13, len(corners.pixels)))[1] if i != seed]
    cells: dict[Cell, int] = {(0, 0): seed}
    for axis in range(2):
        along = np.array([np.cos(angles[axis]), np.sin(angles[axis])])
        for i in near:
            offset = corners.pixels[i] - here
            distance = float(np.hypot(*offset))
            straight = abs(float(offset @ along)) > 0.94 * distance
            # a neighbour's colours lie the other way round
            swapped = _turn_between(corners.angles[i][::-1], angles).max() < 0.5
            if straight and swapped:
                sign = 1 if offset @ along > 0 else -1
                cells[(sign, 0) if axis == 0 else (0, sign)] = i
                break
    return cells if len(cells) == 3 else None


def _turn_between(a: Floats, b: Floats) -> Floats:
    """Between directions modulo pi, in [0, pi/2]."""
    turn = np.abs(a - b) % np.pi
    return np.minimum(turn, np.pi - turn)


def _expected(places: Mapping[Cell, Floats], cell: Cell, step: Cell) -> tuple[Floats, float] | None:
    """Where the corner beyond `cell` should be, and the length of the step there."""
    here, back = places[cell], places.get((cell[0] - step[0], cell[1] - step[1]))
    steps = []
    for side in ((step[1], step[0]), (-step[1], -step[0])):  # the same step in the next rows
        start = places.get((cell[0] + side[0], cell[1] + side[1]))
        end = places.get((cell[0] + side[0] + step[0], cell[1] + side[1] + step[1]))
        if start is not None and end is not None:
            steps.append(end - start)
    if back is not None:
        last = here - back
        before = places.get((cell[0] - 2 * step[0], cell[1] - 2 * step[1]))
        # three in a row tell how the steps shrink
        steps.append(last if before is None else last + 0.7 * (last - (back - before)))
    if not steps:
        return None
    mean = np.mean(steps, axis=0)
    return here + mean, float(np.hypot(*mean))


def _corner_near(
    corners: _Corners, place: Floats, step: float, cell: Cell, along: Floats
) -> int | None:
    """The corner at a place, if its edges run along the grid and its colours lie rightly."""
    distance, i = corners.tree.query(place, distance_upper_bound=max(SEARCH * step, 1.5))
    if not np.isfinite(distance):
        return None
    return int(i) if _turn_between(_along(corners, int(i), cell), along).max() < 0.6 else None


def _completed(gray: Gray, cells: dict[Cell, Floats], ring: float) -> dict[Cell, Floats]:
    """With corners that were too faint to be found alone, where the grid expects them."""
    smooth = cv2.GaussianBlur(gray.astype(np.float32), (0, 0), 1.0)
    cells = dict(cells)
    for _ in range(4):
        added = {}
        for cell in list(cells):
            for step in STEPS:
                target = (cell[0] + step[0], cell[1] + step[1])
                if target in cells or target in added:
                    continue
                expected = _expected(cells, cell, step)
                if expected is not None and (at := _faint(gray, smooth, *expected)) is not None:
                    added[target] = at
        if not added:
            break
        cells.update(added)
    return cells


def _faint(gray: Gray, smooth: NDArray[np.float32], place: Floats, step: float) -> Floats | None:
    rows, columns = gray.shape
    reach = max(2, round(0.3 * step))
    margin = reach + 4
    if not (margin < place[0] < columns - margin and margin < place[1] < rows - margin):
        return None
    at = cv2.cornerSubPix(
        gray,
        place.astype(np.float32).reshape(1, 1, 2),
        (reach, reach),
        (-1, -1),
        (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 20, 0.01),
    ).reshape(2)
    if np.hypot(*(at - place)) > SEARCH * step:
        return None
    found = _alternating(smooth, at[None].astype(np.float64), float(np.clip(0.35 * step, 2.0, 8.0)))
    return at.astype(np.float64) if len(found.pixels) else None


def _as_grid(cells: dict[Cell, Floats], inner: tuple[int, int] | None) -> Grid | None:
    index = np.array(list(cells))
    pixels = np.array(list(cells.values()))
    # a line of the grid with a single corner is more likely chance than board
    while len(index):
        keep = np.ones(len(index), bool)
        for axis in range(2):
            values, counts = np.unique(index[:, axis], return_counts=True)
            keep &= ~np.isin(index[:, axis], values[counts < 2])
        if keep.all():
            break
        index, pixels = index[keep], pixels[keep]
    if len(index) < FEWEST:
        return None
    index = index - index.min(axis=0)
    if inner is not None:
        kept = _cut(index, inner)
        index, pixels = index[kept], pixels[kept]
        index = index - index.min(axis=0)
    return Grid(index, pixels)


def _cut(index: NDArray[np.int64], inner: tuple[int, int]) -> NDArray[np.bool_]:
    """Which cells lie in the part of the board's size that has most of them."""
    best = np.zeros(len(index), bool)
    for columns, rows in {inner, inner[::-1]}:
        for i in range(max(1, int(index[:, 0].max()) - columns + 2)):
            for j in range(max(1, int(index[:, 1].max()) - rows + 2)):
                x, y = index[:, 0] - i, index[:, 1] - j
                inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
                if inside.sum() > best.sum():
                    best = inside
    return best


def _refined(gray: Gray, grid: Grid) -> Grid:
    """Every corner where the gradients of its surroundings are at right angles to the way to it.

    The surroundings are a patch that follows the local grid: squashed and turned as the squares
    are, so that near the rim it neither reaches into the next square nor wastes the own.
    """
    smooth = cv2.GaussianBlur(gray.astype(np.float32), (0, 0), BLUR_PX)
    local = _local_steps(grid)
    length = np.linalg.norm(local, axis=1, keepdims=True)
    local *= np.minimum(WIDEST_PX / (WINDOW * np.maximum(length, 1e-9)), 1)
    side = np.linspace(-1, 1, 2 * HALF + 1)
    u, v = np.tile(side, len(side)), np.repeat(side, len(side))
    weight = np.exp(-2 * (u * u + v * v))
    pixels = grid.pixels.copy()
    good = np.ones(len(pixels), bool)
    for _ in range(12):
        offsets = WINDOW * np.einsum("nij,kj->nki", local, np.stack([u, v], axis=-1))
        patch = _sampled(smooth, pixels[:, None] + offsets).reshape(-1, len(side), len(side))
        slopes = np.gradient(patch, side, side, axis=(1, 2))
        gv, gu = (np.asarray(slope).reshape(len(pixels), -1) for slope in slopes)
        a = np.sum(weight * gu * gu, axis=1)
        b = np.sum(weight * gu * gv, axis=1)
        c = np.sum(weight * gv * gv, axis=1)
        p = np.sum(weight * (gu * gu * u + gu * gv * v), axis=1)
        q = np.sum(weight * (gu * gv * u + gv * gv * v), axis=1)
        determinant = a * c - b * b
        good &= determinant > 1e-9 * np.maximum(a * c, 1e-9)
        determinant = np.where(good, determinant, 1.0)
        move = np.stack([(c * p - b * q) / determinant, (a * q - b * p) / determinant], axis=-1)
        move = WINDOW * np.einsum("nij,nj->ni", local, move)
        move[~good] = 0
        pixels += move
        if np.abs(move).max() < 1e-3:
            break
    strayed = np.linalg.norm(pixels - grid.pixels, axis=1)
    good &= strayed < 0.4 * np.linalg.norm(local, axis=1).min(axis=1)
    return Grid(grid.cells[good], pixels[good])


def _local_steps(grid: Grid) -> Floats:
    """(n, 2, 2): columns are the steps to the next corner along the grid's two axes, pixels."""
    place = {(int(i), int(j)): at for (i, j), at in zip(grid.cells, grid.pixels, strict=True)}
    usual = float(np.mean(np.ptp(grid.pixels, axis=0) / (np.ptp(grid.cells, axis=0) + 1)))
    steps = np.empty((len(grid.cells), 2, 2))
    for n, ((i, j), here) in enumerate(place.items()):
        for axis, (di, dj) in enumerate(((1, 0), (0, 1))):
            before, after = place.get((i - di, j - dj)), place.get((i + di, j + dj))
            known = [] if before is None else [here - before]
            known += [] if after is None else [after - here]
            steps[n, :, axis] = np.mean(known, axis=0) if known else usual * np.eye(2)[axis]
    return steps
