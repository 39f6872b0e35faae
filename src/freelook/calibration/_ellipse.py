"""Circles through edge points, and axis-aligned ellipses: circles on pixels that are not square."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

ASPECTS = (0.7, 1.45)  # beyond what any video format makes of a circle
GROUP_DEG = 15.0  # edges closer together than this err together


@dataclass(frozen=True)
class Ellipse:
    """Centre (x, y) and radius along x, pixels; aspect is the radius along y, divided by it."""

    x: float
    y: float
    radius: float
    aspect: float = 1.0

    def distance(self, points: Floats) -> Floats:
        """How far points (n, 2) lie outside (inside: negative), in pixels along x."""
        return self.polar(points)[1] - self.radius

    def polar(self, points: Floats) -> tuple[Floats, Floats]:
        """Angle from x towards y, and radius, both in the plane where this is a circle."""
        dx, dy = points[..., 0] - self.x, (points[..., 1] - self.y) / self.aspect
        return np.arctan2(dy, dx), np.hypot(dx, dy)

    def points(self, angle: Floats, radius: Floats | float | None = None) -> Floats:
        """Pixels (..., 2) at these angles, on the ellipse or at another radius."""
        radius = self.radius if radius is None else radius
        x = self.x + radius * np.cos(angle)
        return np.stack([x, self.y + self.aspect * radius * np.sin(angle)], axis=-1)

    def as_row(self) -> Floats:
        return np.array([self.x, self.y, self.radius, self.aspect])


def through(points: Floats, *, circles: bool) -> Floats:
    """Ellipses (m, 4: x, y, radius, aspect) through sets of points (n, 3 or 4, 2), m <= n.

    Solves x^2 + q y^2 + d x + e y + g = 0, with q = 1 for circles through three points. Sets
    that lie nearly on a line, or on nothing with an aspect within ASPECTS, have no row.
    """
    middle = points.mean(axis=1, keepdims=True)
    scale = np.abs(points - middle).max(initial=1.0)
    x, y = np.moveaxis((points - middle) / scale, -1, 0)
    columns = [x, y, np.ones_like(x)] if circles else [x, y, np.ones_like(x), y * y]
    matrix = np.stack(columns, axis=-1)
    right = -(x * x + y * y) if circles else -x * x
    solvable = np.abs(np.linalg.det(matrix)) > 1e-4
    solved = np.linalg.solve(matrix[solvable], right[solvable][..., None])[..., 0]
    middle = middle[solvable, 0]
    q = np.ones(len(solved)) if circles else solved[:, 3]
    usable = (q > ASPECTS[1] ** -2) & (q < ASPECTS[0] ** -2)
    (d, e, g), q, middle = solved[usable, :3].T, q[usable], middle[usable]
    squared = d * d / 4 + e * e / (4 * q) - g
    real = squared > 0
    d, e, q, squared, middle = d[real], e[real], q[real], squared[real], middle[real]
    return np.stack(
        [
            middle[:, 0] - scale * d / 2,
            middle[:, 1] - scale * e / (2 * q),
            scale * np.sqrt(squared),
            q**-0.5,
        ],
        axis=-1,
    )


F = TypeVar("F", np.float64, np.float32)


def shares_outside(ellipses: NDArray[F], points: NDArray[F]) -> NDArray[F]:
    """(m, n): how far n points lie outside m ellipses, as a share of the radius."""
    x, y, radius, aspect = ellipses.T[..., None]
    dx, dy = (points[:, 0] - x) / radius, (points[:, 1] - y) / (radius * aspect)
    return np.asarray(np.sqrt(dx * dx + dy * dy) - 1)


def fitted(
    start: Ellipse, points: Floats, weights: Floats, reach_px: float, *, free_aspect: bool
) -> Ellipse:
    """The ellipse that the points within `reach_px` of it agree on best (Tukey's biweight).

    Gauss-Newton steps from `start`, for the distances along x. Without `free_aspect` the aspect
    stays what it is. Edges that lead far away are no answer: then it is `start`.
    """
    now = start
    for _ in range(30):
        angle, radius = now.polar(points)
        off = radius - now.radius
        near = np.abs(off) < reach_px
        angle, radius, off = angle[near], radius[near], off[near]
        weight = weights[near] * (1 - (off / reach_px) ** 2) ** 2
        sine, cosine = np.sin(angle), np.cos(angle)
        columns = [cosine, sine / now.aspect, np.ones_like(off)]
        columns += [radius * sine**2 / now.aspect] if free_aspect else []
        matrix = np.stack(columns, axis=-1)
        weighted = matrix.T * weight
        x, y, grown, *bent = np.linalg.lstsq(weighted @ matrix, weighted @ off, rcond=None)[
            0
        ].tolist()
        aspect = float(np.clip(now.aspect + sum(bent), *ASPECTS))
        now = Ellipse(now.x + x, now.y + y, now.radius + grown, aspect)
        if np.abs(now.as_row() - start.as_row())[:3].max() > 0.1 * start.radius:
            return start
        if max(abs(x), abs(y), abs(grown)) < 1e-4:
            break
    return now


def standard_errors(
    best: Ellipse, points: Floats, weights: Floats, reach_px: float, *, free_aspect: bool
) -> Ellipse:
    """Of x, y, radius and aspect, by leaving out one part of the rim after the other (jackknife).

    Neighbouring edges err together (one lamp, one shadow), so that parts of GROUP_DEG are left
    out, not points.
    """
    part = np.degrees(best.polar(points)[0]) // GROUP_DEG
    near = np.abs(best.distance(points)) < reach_px
    parts = np.unique(part[near])
    rows = []
    for one in parts:
        rest = near & (part != one)
        again = fitted(best, points[rest], weights[rest], reach_px, free_aspect=free_aspect)
        rows.append(again.as_row())
    if len(rows) < 3:
        return Ellipse(np.inf, np.inf, np.inf, np.inf)
    return Ellipse(*(np.sqrt(len(rows) - 1) * np.std(rows, axis=0)).tolist())


def rounded(ellipse: Ellipse) -> Ellipse:
    """The circle of the same area."""
    radius = ellipse.radius * float(np.sqrt(ellipse.aspect))
    return replace(ellipse, radius=radius, aspect=1.0)
