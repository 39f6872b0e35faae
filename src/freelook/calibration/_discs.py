"""Where the centres of circles are seen, to a fraction of a pixel."""

from __future__ import annotations

import numpy as np

from ..lens import Floats
from ._blobs import LEAST, Blobs
from ._lattice import Bools, Cells, Lattice
from ._saddles import Gray

CROWDED = 0.02  # of what is around a blob may be dark
HALO = 1.7  # radii around a blob that its middle is weighed from
REACH = 3  # cells on each side that say how the grid bends
WIDE = 1.2  # cells: how fast they count for less with their distance
RIDGE = np.diag([1e-9, 1e-6, 1e-6, *[1e-3] * 7])  # how much a bend has to show


def weighed(gray: Gray, blobs: Blobs) -> Blobs:
    """The blobs with middle and area weighed by how much darker they are than what is around.

    Blur moves no darkness sideways and loses none, so that both stay what they are. Without those
    that have other dark things near them.
    """
    parts = [_weighed(gray, *one) for one in zip(blobs.pixels, blobs.spread, strict=True)]
    good = np.array([part is not None for part in parts], dtype=bool)
    pixels = np.array([part[0] for part in parts if part is not None]).reshape(-1, 2)
    area = np.array([part[1] for part in parts if part is not None])
    spread = blobs.spread[good] * (area / blobs.area[good])[:, None, None]
    return Blobs(pixels, spread)


def _weighed(gray: Gray, at: Floats, spread: Floats) -> tuple[Floats, float] | None:
    reach = HALO * 2 * np.sqrt(np.diag(spread)) + 1.5
    left, top = np.floor(at - reach).astype(int)
    right, bottom = np.ceil(at + reach).astype(int) + 1
    if left < 0 or top < 0 or right > gray.shape[1] or bottom > gray.shape[0]:
        return None
    patch = gray[top:bottom, left:right].astype(np.float64)
    y, x = np.mgrid[top:bottom, left:right]
    offset = np.stack([x - at[0], y - at[1]], axis=-1)
    inverse = np.linalg.inv(4 * spread + 0.1 * np.eye(2))
    far = np.sqrt(np.einsum("...i,ij,...j", offset, inverse, offset))
    inner, outer = far < 0.7, (far > 1.35) & (far < HALO)
    if inner.sum() < 1 or outer.sum() < 4:
        return None
    light, dark = float(np.median(patch[outer])), float(np.median(patch[inner]))
    if light - dark < LEAST:
        return None
    around = outer & (patch > (light + dark) / 2)
    if around.sum() < (1 - CROWDED) * outer.sum():
        return None
    paper = _plane(offset, patch, around)  # lenses and lamps light no paper evenly
    darkness = (paper - patch) / np.maximum(paper * (1 - dark / light), 1e-9)
    weight = np.clip(darkness, 0, 1) * (far < HALO)
    area = float(weight.sum())
    return np.array([np.sum(weight * x), np.sum(weight * y)]) / area, area


def _plane(offset: Floats, patch: Floats, chosen: Bools) -> Floats:
    """The plane through the chosen pixels' values, at all pixels."""
    terms = np.concatenate([np.ones_like(offset[..., :1]), offset], axis=-1)
    normal = terms[chosen].T @ terms[chosen] + np.diag([0, 1e-6, 1e-6])
    return np.asarray(terms @ np.linalg.solve(normal, terms[chosen].T @ patch[chosen]))


def centres(blobs: Blobs, lattice: Lattice) -> Floats:
    """(n, 2) for the lattice's cells: where the centres are seen, beside the middles of the blobs.

    Within a circle the local map is quadratic: a point u of its disc, of radius q squares, is seen
    at p + A u + B(u, u), and weighs by the area that is seen of it, det A (1 + g u). The mean of
    u u' over a disc is q q / 4, so that the middle of the blob lies (q q / 4) (B(e1, e1) +
    B(e2, e2) + A g) beside p. Repeated, as A and B are told by the centres, not the middles.
    """
    cells = lattice.cells()
    middles = found = lattice.pixels(cells)
    area = blobs.area[blobs.tree.query(middles)[1]]
    for _ in range(2):
        axes, bend = _local(cells, found)
        uu, uv, vv = (bend[..., k] for k in range(3))
        inverse = np.linalg.inv(axes)
        by_u, by_v = np.stack([2 * uu, uv], axis=-1), np.stack([uv, 2 * vv], axis=-1)
        growth = np.stack(
            [np.einsum("nij,nji->n", inverse, by_u), np.einsum("nij,nji->n", inverse, by_v)],
            axis=-1,
        )
        squared = area / (np.pi * np.abs(np.linalg.det(axes)))
        beside = uu + vv + np.einsum("nij,nj->ni", axes, growth)
        found = middles - squared[:, None] / 4 * beside
    return found


def _local(cells: Cells, pixels: Floats) -> tuple[Floats, Floats]:
    """Axes (n, 2, 2) and bend (n, 2, 3) of the grid around each cell, as in `LocalMaps`.

    From a fit of the third degree: at the grid's edge, where all neighbours lie on one side, one of
    the second takes what is beyond for bend, and leaves 0.3 pixel of the offset of large circles.
    """
    u, v = np.moveaxis((cells - cells[:, None]).astype(np.float64), -1, 0)
    near = np.maximum(np.abs(u), np.abs(v)) <= REACH
    weights = np.exp(-np.where(near, u * u + v * v, 0.0) / WIDE**2) * near
    u, v = u * near, v * near
    terms = np.stack([u**i * v ** (d - i) for d in range(4) for i in range(d, -1, -1)], axis=-1)
    normal = np.einsum("nk,nki,nkj->nij", weights, terms, terms) + RIDGE
    right = np.einsum("nk,nki,kc->nic", weights, terms, pixels)
    solved = np.asarray(np.linalg.solve(normal, right).transpose(0, 2, 1), np.float64)
    return solved[..., 1:3], solved[..., 3:6]
