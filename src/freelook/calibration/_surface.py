"""The surface of a splined lens as a fit needs it: what each control point does, in closed form.

A ray lands at f (u + du(u)), with u = 2 (x, y) / (|p| + z) of its point p. At any u only 4 x 4
control points say something, by the weights of cubic B-splines on an even grid; beyond the covered
part the last polynomial goes on, as in the lens itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray

from ..lens import Floats, Lens, SplinedStereographic

ORDER = 3
# Each piece (4 of them, one for each control point) by powers of the place in the cell, 0 to 1.
PIECES = np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]]) / 6.0
LEAST = 1e-6  # of |p| + z: rays nearly straight backwards


@dataclass(frozen=True)
class Surface:
    """What control points say at places u (n, 2) of a lens.

    index    (n, 16) of control points, row after row
    weights  (n, 16)
    slopes   (n, 16, 2) of the weights, by u
    inside   (n,) whether u is where there are control points
    """

    index: NDArray[np.intp]
    weights: Floats
    slopes: Floats
    inside: NDArray[np.bool_]

    @classmethod
    def of(cls, lens: SplinedStereographic, u: Floats) -> Surface:
        """Beyond the control points, as at their edge."""
        edge = np.array([lens.nx - 1, lens.ny - 1]) / 2
        place = u / lens.spacing + edge
        inside = np.asarray(((place >= 0) & (place <= 2 * edge)).all(axis=1))
        place = np.clip(place, 0, 2 * edge)
        cell = np.clip(np.floor(place), 1, 2 * edge - 2).astype(np.intp)
        across, down = (_pieces(place[:, i] - cell[:, i]) for i in (0, 1))
        four = np.arange(-1, 3)
        columns, rows = cell[:, :1] + four, cell[:, 1:] + four
        by_x = down[0][:, :, None] * across[1][:, None, :] / lens.spacing
        by_y = down[1][:, :, None] * across[0][:, None, :] / lens.spacing
        return cls(
            (rows[:, :, None] * lens.nx + columns[:, None, :]).reshape(-1, 16),
            (down[0][:, :, None] * across[0][:, None, :]).reshape(-1, 16),
            np.stack([by_x, by_y], axis=-1).reshape(-1, 16, 2),
            inside,
        )

    def offset(self, control: Floats) -> Floats:
        """du (n, 2) for control points (n, 2)."""
        return np.einsum("nk,nki->ni", self.weights, control[self.index])

    def offset_slopes(self, control: Floats) -> Floats:
        """d du / d u, (n, 2, 2)."""
        return np.einsum("nki,nkj->nij", control[self.index], self.slopes)

    def spread(self, count: int) -> Floats:
        """The weights (n, count), with a column for each control point."""
        wide = np.zeros((len(self.index), count))
        np.put_along_axis(wide, self.index, self.weights, axis=1)
        return wide


def is_surface(lens: Lens) -> TypeGuard[SplinedStereographic]:
    """Whether this is a lens that all this is about."""
    return isinstance(lens, SplinedStereographic) and lens.order == ORDER


def control_of(lens: SplinedStereographic) -> Floats:
    """(nx * ny, 2)"""
    return np.reshape(lens.control, (-1, 2))


def stereographic(points: Floats) -> Floats:
    """u (n, 2) of points (n, 3)."""
    length = np.linalg.norm(points, axis=1)
    return 2 * points[:, :2] / _behind(points, length)[:, None]


def stereographic_slopes(points: Floats) -> Floats:
    """d u / d point (n, 2, 3)."""
    length = np.linalg.norm(points, axis=1)
    behind = _behind(points, length)
    by_behind = points / length[:, None] + [0.0, 0.0, 1.0]
    slopes = -2 * points[:, :2, None] * by_behind[:, None, :] / behind[:, None, None] ** 2
    slopes[:, [0, 1], [0, 1]] += 2 / behind[:, None]
    return slopes


def _behind(points: Floats, length: Floats) -> Floats:
    return np.maximum(length + points[:, 2], LEAST * length)


def _pieces(t: Floats) -> tuple[Floats, Floats]:
    """The four weights (n, 4) and their slopes by t (n,)."""
    powers = t[:, None] ** np.arange(4)
    by_power = powers[:, :3] * [1.0, 2.0, 3.0]
    return powers @ PIECES.T, by_power @ PIECES[:, 1:].T
