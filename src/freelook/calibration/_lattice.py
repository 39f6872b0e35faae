"""Grids of points in bent pictures: where the next point should be, and grids that grow by that.

Around every cell the grid is nearly a quadratic map from cells to pixels, however strongly a
fisheye bends the whole. That map is fitted to the neighbours that are known: it says where a
missing point should be, and how the squares lie there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..lens import Floats

Cells = NDArray[np.int64]
Bools = NDArray[np.bool_]

REACH = 3  # cells on each side that say how the grid runs
WIDE = 1.5  # cells: how fast they count for less with their distance
STIFF = 0.02  # how much the bend has to show before it is believed
SIDE = 256  # cells across, at most
MIDDLE = SIDE // 2
SAME_PX = 0.3  # a place expected this near to where nothing was found is not looked at again
FEWEST_AROUND = 3  # known points that a missing one is predicted from


ACROSS = np.arange(-REACH, REACH + 1)
OFFSETS = np.stack(np.meshgrid(ACROSS, ACROSS), axis=-1).reshape(-1, 2)
OWN = (OFFSETS == 0).all(axis=1)
WEIGHTS = np.exp(-(OFFSETS**2).sum(axis=1) / WIDE**2)
RIDGE = np.diag([1e-9, 1e-6, 1e-6, STIFF, STIFF, STIFF])


def _terms(offsets: Floats) -> Floats:
    """(..., 6): 1, u, v, u u, u v, v v of offsets (..., 2)."""
    u, v = offsets[..., 0], offsets[..., 1]
    return np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=-1)


TERMS = _terms(OFFSETS.astype(np.float64))


@dataclass(frozen=True)
class LocalMaps:
    """pixel(u, v) = place + axes @ (u, v) + bend @ (u u, u v, v v) around n cells.

    u and v are in cells. place (n, 2); axes (n, 2, 2): columns are one step along each direction
    of the grid; bend (n, 2, 3). `known` (n,): whether enough neighbours said so.
    """

    place: Floats
    axes: Floats
    bend: Floats
    known: Bools

    def pixels(self, u: Floats, v: Floats) -> Floats:
        """(n, k, 2) at (u, v) (n, k) or (k,)."""
        u, v = np.broadcast_arrays(u, v)
        u, v = np.atleast_2d(u), np.atleast_2d(v)
        terms = np.stack([u, v, u * u, u * v, v * v], axis=-1)
        factors = np.concatenate([self.axes, self.bend], axis=-1)
        terms = np.broadcast_to(terms, (len(self.place), *terms.shape[1:]))
        return np.asarray(self.place[:, None] + np.einsum("nij,nkj->nki", factors, terms))

    def shortest_step(self) -> Floats:
        """(n,) pixels: the width of the squares across their narrow side."""
        return np.asarray(np.linalg.svd(self.axes, compute_uv=False)[:, 1])

    def part(self, chosen: Bools | Cells) -> LocalMaps:
        return LocalMaps(
            self.place[chosen], self.axes[chosen], self.bend[chosen], self.known[chosen]
        )


# (cells, maps) -> places (n, 2), NaN where there is no point after all
Finder = Callable[[Cells, LocalMaps], Floats]


class Lattice:
    """Places (pixels) of a grid's points by cell (column, row); cells may be negative."""

    def __init__(self) -> None:
        self._at = np.full((SIDE, SIDE, 2), np.nan)

    @classmethod
    def of(cls, cells: Cells, pixels: Floats) -> Lattice:
        lattice = cls()
        lattice.put(cells, pixels)
        return lattice

    def put(self, cells: Cells, pixels: Floats) -> None:
        """Points that are known now; NaN forgets them."""
        self._at[cells[:, 0] + MIDDLE, cells[:, 1] + MIDDLE] = pixels

    def cells(self) -> Cells:
        """(n, 2), row by row."""
        rows_first = np.argwhere(np.isfinite(self._at[..., 0]).T)
        return rows_first[:, ::-1] - MIDDLE

    def pixels(self, cells: Cells) -> Floats:
        """(n, 2); NaN for those that are not known."""
        return np.asarray(self._at[cells[:, 0] + MIDDLE, cells[:, 1] + MIDDLE])

    def __len__(self) -> int:
        return int(np.isfinite(self._at[..., 0]).sum())

    def rim(self) -> Cells:
        """Unknown cells beside known ones."""
        known = np.isfinite(self._at[..., 0])
        beside = np.zeros_like(known)
        beside[1:] |= known[:-1]
        beside[:-1] |= known[1:]
        beside[:, 1:] |= known[:, :-1]
        beside[:, :-1] |= known[:, 1:]
        rim = np.argwhere(beside & ~known)
        inside = ((rim >= REACH) & (rim < SIDE - REACH)).all(axis=1)
        return np.asarray(rim[inside] - MIDDLE)

    def maps(self, cells: Cells, *, own: bool = False) -> LocalMaps:
        """How the grid runs around each cell; its own place counts only with `own`."""
        around = cells[:, None] + OFFSETS + MIDDLE
        near = self._at[np.clip(around[..., 0], 0, SIDE - 1), np.clip(around[..., 1], 0, SIDE - 1)]
        there = np.isfinite(near[..., 0]) & (own | ~OWN)
        weights = np.where(there, WEIGHTS, 0.0)
        near = np.where(there[..., None], near, 0.0)
        normal = np.einsum("nk,ki,kj->nij", weights, TERMS, TERMS)
        right = np.einsum("nk,ki,nkc->nic", weights, TERMS, near)
        return _solved(normal, right, there.sum(axis=1))

    def grow(self, find: Finder) -> None:
        """Add what `find` finds beside what is known, round by round, until nothing is added."""
        tried = np.full_like(self._at, np.inf)
        while True:
            rim = self.rim()
            maps = self.maps(rim)
            before = tried[rim[:, 0] + MIDDLE, rim[:, 1] + MIDDLE]
            worth = maps.known & (np.abs(maps.place - before).max(axis=1) > SAME_PX)
            rim, maps = rim[worth], maps.part(worth)
            tried[rim[:, 0] + MIDDLE, rim[:, 1] + MIDDLE] = maps.place
            places = find(rim, maps) if len(rim) else np.empty((0, 2))
            found = np.isfinite(places[:, 0])
            if not found.any():
                return
            self.put(rim[found], places[found])

    def drop_strays(self, most: float) -> None:
        """Forget points farther than `most` squares from where their neighbours expect them."""
        cells = self.cells()
        maps = self.maps(cells)
        off = self.pixels(cells) - maps.place
        strays = ~maps.known | (in_squares(maps.axes, off) > most)
        self.put(cells[strays], np.full((int(strays.sum()), 2), np.nan))

    def drop_thin_lines(self, fewest: int) -> None:
        """Forget rows and columns with fewer points than that, and what is thin without them."""
        while True:
            known = np.isfinite(self._at[..., 0])
            thin = np.zeros_like(known)
            thin[(known.sum(axis=1) < fewest), :] = True
            thin[:, (known.sum(axis=0) < fewest)] = True
            if not (thin & known).any():
                return
            self._at[thin] = np.nan


def maps_at(where: Floats, points: Floats, pixels: Floats, *, own: bool = False) -> LocalMaps:
    """As `Lattice.maps`, from points anywhere: at `where` (n, 2), both in units of a square.

    A point that is exactly there counts only with `own`.
    """
    offsets = points - where[:, None]
    distance = np.abs(offsets).max(axis=-1)
    near = (distance <= REACH) & (own | (distance > 1e-9))
    weights = np.exp(-np.minimum((offsets**2).sum(axis=-1) / WIDE**2, 50.0)) * near
    terms = _terms(np.where(near[..., None], offsets, 0.0))
    normal: Floats = np.einsum("nk,nki,nkj->nij", weights, terms, terms)
    right: Floats = np.einsum("nk,nki,kc->nic", weights, terms, pixels)
    return _solved(normal, right, near.sum(axis=1))


def _solved(normal: Floats, right: Floats, around: Cells) -> LocalMaps:
    known = (around >= FEWEST_AROUND) & (np.linalg.det(normal[:, :3, :3]) > 1e-3)
    solved = np.asarray(np.linalg.solve(normal + RIDGE, right).transpose(0, 2, 1), np.float64)
    return LocalMaps(solved[..., 0], solved[..., 1:3], solved[..., 3:], known)


def in_squares(axes: Floats, offsets: Floats) -> Floats:
    """Lengths (n,) of pixel offsets (n, 2) in squares that `axes` (n, 2, 2) span; inf if flat."""
    determinant = axes[:, 0, 0] * axes[:, 1, 1] - axes[:, 0, 1] * axes[:, 1, 0]
    x = axes[:, 1, 1] * offsets[:, 0] - axes[:, 0, 1] * offsets[:, 1]
    y = axes[:, 0, 0] * offsets[:, 1] - axes[:, 1, 0] * offsets[:, 0]
    length, area = np.hypot(x, y), np.abs(determinant)
    return np.divide(length, area, out=np.full_like(length, np.inf), where=area > 1e-9)
