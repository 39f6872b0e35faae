"""The largest grid among candidates that know their neighbours."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from ..lens import Floats
from ._lattice import Bools, Cells, Lattice, LocalMaps

SEEDS = 5


class Growth(Protocol):
    """Finds the next points of one grid; `used` (n,) says which candidates it has taken."""

    used: Bools

    def __call__(self, cells: Cells, maps: LocalMaps) -> Floats: ...


def largest_grid(
    links: Cells, quality: Floats, start: Callable[[int], Lattice], growth: Callable[[], Growth]
) -> Lattice | None:
    """Grids grown from the best linked candidates; the largest, or None.

    links (n, 4): each one's neighbours along one axis, forth and back, and along the other, or -1.
    """
    best: Lattice | None = None
    taken = np.zeros(len(links), bool)
    for seed in _seeds(links, quality):
        there = links[seed] >= 0
        if taken[seed] or not (there[:2].any() and there[2:].any()):
            continue
        lattice, grown = start(seed), growth()
        lattice.grow(grown)
        taken |= grown.used
        if best is None or len(lattice) > len(best):
            best = lattice
    return best


def mutual(links: Cells) -> Cells:
    """The links of pairs that name each other; -1 for the others."""
    back = (links[links] == np.arange(len(links))[:, None, None]).any(axis=-1)
    return np.where((links >= 0) & back, links, -1)


def _seeds(links: Cells, quality: Floats) -> list[int]:
    """The best linked candidate of each of the largest groups, the larger the earlier."""
    row, column = np.nonzero(links >= 0)
    pairs = coo_array((np.ones(len(row)), (row, links[row, column])), shape=(len(links),) * 2)
    _, group = connected_components(pairs, directed=False)
    members = np.bincount(group)[group]
    order = np.lexsort([-quality, -(links >= 0).sum(axis=1), -members])
    _, first = np.unique(group[order], return_index=True)
    best = order[np.sort(first)][:SEEDS]
    return [int(i) for i in best if members[i] > 3]
