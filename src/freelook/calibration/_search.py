"""Where in a picture the image circle is: the three steps that `circle.py` describes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._ellipse import Ellipse, Floats, fitted, rounded, shares_outside, standard_errors, through
from ._rim import Edges, falling_edges, outermost, smoothed, unroll

Size = tuple[int, int]

SMALLEST = 0.25  # radius, as a share of the picture's shorter side
RIM_LEVELS = (
    0.03,
    0.05,
    0.08,
    0.12,
    0.18,
    0.27,
    0.4,
)  # shares of the brightness: the rim may be dim
LEAST_LEVEL = 2.0  # grey levels above black
FEWEST_POINTS = 20

# shares of the radius
ROUGH_REACH = 0.015  # points so near support a rough circle
CLEAR_REACH = 0.007  # edges so near lie on a circle
BLUR = 0.004  # edges are sought in rays blurred by this
FIT_REACHES = (0.02, 0.012, CLEAR_REACH)
SEARCHED = (0.86, 1.08)  # around the rough circle; the image ends inside a ring of stray light

HYPOTHESES = 500  # through three places each: enough if a fifth of them are right
EDGE_HYPOTHESES = 1500
REFINED = 20  # of these, the best that are fitted before one is chosen
RIVAL_SCORE = 0.85  # of the best circle's
RIVAL_APART = 0.01
PART_DEG = 4.0

BENT_SCORE = 0.85  # an ellipse bends to anything a little better than a circle
LEAST_BENT = 0.015  # pixels that are not square are so by 1.6 % at least
LEAST_BENT_ARC_DEG = 180.0


@dataclass(frozen=True)
class Found:
    """The likeliest circle or ellipse, all edges around it, and another that is nearly as likely.

    rival  None where the second best has much less of a rim, as it should have
    """

    circle: Ellipse
    edges: Edges
    rival: Ellipse | None


def best_circle(picture: Floats, dark: float, bright: float) -> Found | None:
    """The circle or ellipse with most of a rim; None without any.

    `dark` and `bright` are the levels of the picture's (rows, columns) dark and bright parts.
    """
    outer = _outer_places(picture, dark, bright)
    size = (picture.shape[1], picture.shape[0])
    roughs = (_rough(outer, size, circles=circles) for circles in (True, False))
    found = [_fine(picture, rough, dark) for rough in roughs if rough]
    return max(found, key=_final_score, default=None)


def used(circle: Ellipse, edges: Edges) -> NDArray[np.bool_]:
    """Which edges count as lying on a circle."""
    return np.asarray(np.abs(circle.distance(edges.points)) < _reach_px(circle))


def errors_of(circle: Ellipse, edges: Edges) -> Ellipse:
    """Standard errors of centre, radius and (of an ellipse) aspect."""
    bent = circle.aspect != 1
    reach_px = _reach_px(circle)
    return standard_errors(circle, edges.points, edges.weights, reach_px, free_aspect=bent)


def arcs_deg(ellipse: Ellipse, points: Floats, reach_px: float, size: Size) -> tuple[float, float]:
    """How many degrees of the rim are in the picture, and how many of these have points near."""
    angles = np.radians(np.arange(-180, 180, PART_DEG) + PART_DEG / 2)
    places = ellipse.points(angles)
    seen = ((places > 0) & (places < np.array(size) - 1)).all(axis=-1)
    near = points[np.abs(ellipse.distance(points)) < reach_px]
    parts = np.floor((np.degrees(ellipse.polar(near)[0]) + 180) / PART_DEG).astype(int)
    has = np.isin(np.arange(len(angles)), parts % len(angles))
    return PART_DEG * float(seen.sum()), PART_DEG * float((seen & has).sum())


def arcs_found_deg(circle: Ellipse, edges: Edges, size: Size) -> tuple[float, float]:
    """As `arcs_deg`, for the edges that lie on a circle."""
    return arcs_deg(circle, edges.points, _reach_px(circle), size)


def _outer_places(picture: Floats, dark: float, bright: float) -> list[Floats]:
    """For several levels: along rays from the middle, the outermost places that are brighter."""
    rows, columns = picture.shape
    corner = float(np.hypot(rows, columns)) / 2
    middle = Ellipse((columns - 1) / 2, (rows - 1) / 2, corner)
    first, step = 0.3 * SMALLEST * min(rows, columns), max(1.0, corner / 700)
    rays = smoothed(unroll(picture, middle, first, corner, step))
    levels = (dark + max(share * (bright - dark), LEAST_LEVEL) for share in RIM_LEVELS)
    return [outermost(rays, level) for level in levels]


def _rough(outer: list[Floats], size: Size, *, circles: bool) -> Ellipse | None:
    """Step 1: what most of the outermost places of one level support."""
    found = [_most_supported(points, size, circles=circles) for points in outer]
    return max(found, key=lambda one: one[1])[0]


def _most_supported(points: Floats, size: Size, *, circles: bool) -> tuple[Ellipse | None, float]:
    """The best of many through a few points each (RANSAC), and how much of a rim it has.

    The same pictures always give the same answer: the random numbers are.
    """
    if len(points) < FEWEST_POINTS:
        return None, 0.0
    random = np.random.default_rng(2011)
    picks = random.integers(len(points), size=(HYPOTHESES, 3 if circles else 4))
    found = through(points[picks], circles=circles)
    x, y, radius, _ = found.T
    fits = (radius > SMALLEST * min(size)) & (radius < np.hypot(*size))
    found = found[fits & (x > 0) & (x < size[0]) & (y > 0) & (y < size[1])]
    off = shares_outside(found, points[::2]) / ROUGH_REACH
    near = np.clip(1 - off**2, 0, None).sum(axis=1)
    best, most = None, 0.0
    for row in found[np.argsort(-near)[:10]].tolist():
        ellipse = Ellipse(*row)
        seen_deg, found_deg = arcs_deg(ellipse, points, ROUGH_REACH * ellipse.radius, size)
        support = found_deg**2 / max(seen_deg, 10 * PART_DEG)
        if support > most:
            best, most = ellipse, support
    return best, most


def _fine(picture: Floats, rough: Ellipse, dark: float) -> Found:
    """Steps 2 and 3 around a rough circle."""
    edges = _edges_around(rough, picture, dark)
    now, rival = _envelope(rough, edges)
    now = _refit(now, edges, FIT_REACHES[0], free_aspect=now.aspect != 1)
    edges = _edges_around(now, picture, dark)
    for reach in FIT_REACHES[1:]:
        now = _refit(now, edges, reach, free_aspect=now.aspect != 1)
    bent = now
    for reach in FIT_REACHES[1:]:
        bent = _refit(bent, edges, reach, free_aspect=True)
    if _clearly_bent(bent, edges, (picture.shape[1], picture.shape[0])):
        return Found(bent, edges, rival)
    now = _refit(rounded(now), edges, FIT_REACHES[-1], free_aspect=False)
    return Found(now, edges, rival)


def _edges_around(circle: Ellipse, picture: Floats, dark: float) -> Edges:
    blur_px = max(1.0, BLUR * circle.radius)
    first, last = (share * circle.radius for share in SEARCHED)
    rays = unroll(picture, circle, first, last, max(0.5, blur_px / 4))
    return falling_edges(rays, blur_px, dark)


def _envelope(about: Ellipse, edges: Edges) -> tuple[Ellipse, Ellipse | None]:
    """Step 2: the circle that many edges lie on and few clear ones outside of (RANSAC again).

    A dark thing at the rim puts a ray's last edge inside the image, but nothing puts a clear
    one outside: stray light fades. The aspect stays. The second is a rival of the first, if any.
    """
    if not edges.weights.any():
        return about, None
    flat = edges.points / (1, about.aspect)  # where the ellipse is a circle
    random = np.random.default_rng(2011)
    chance = edges.weights**2 / (edges.weights**2).sum()
    picks = random.choice(len(flat), size=(EDGE_HYPOTHESES, 3), p=chance)
    found = through(flat[picks], circles=True)
    moved = np.hypot(found[:, 0] - about.x, found[:, 1] - about.y / about.aspect) / about.radius
    grown = found[:, 2] / about.radius
    found = found[(moved < 0.06) & (grown > SEARCHED[0]) & (grown < 1.06)]
    if not len(found):
        return about, None
    rows = found[np.argsort(-_quick_scores(found, flat, edges))[: 5 * REFINED]]
    rows = rows[np.argsort(-_scores(rows, flat, edges))[:REFINED]]
    rows[:, 1] *= about.aspect
    rows[:, 3] = about.aspect
    offered = [
        _refit(Ellipse(*row), edges, CLEAR_REACH, free_aspect=False) for row in rows.tolist()
    ]
    rows = np.array([one.as_row() for one in offered])
    scores = _scores(rows, edges.points, edges)
    first = int(np.argmax(scores))
    away = np.abs(rows - rows[first])[:, :3].max(axis=1) > RIVAL_APART * rows[first, 2]
    second = int(np.argmax(np.where(away, scores, -np.inf)))
    rivals = away[second] and scores[second] > RIVAL_SCORE * scores[first]
    return offered[first], offered[second] if rivals else None


def _quick_scores(ellipses: Floats, points: Floats, edges: Edges) -> NDArray[np.float32]:
    """Nearly the `_scores` of many ellipses: by every other edge, not by ray."""
    off = shares_outside(ellipses.astype(np.float32), points[::2].astype(np.float32))
    off /= np.float32(CLEAR_REACH)
    weights = edges.weights[::2].astype(np.float32)
    on = np.maximum(1 - off * off, 0) @ weights**2
    return np.asarray(on - (off > 1.5) @ weights**4)


def _scores(ellipses: Floats, points: Floats, edges: Edges) -> Floats:
    """How many rays have an edge on each of m ellipses, less those with a clear one outside."""
    off = shares_outside(ellipses, points) / CLEAR_REACH
    on = np.clip(1 - off**2, 0, None) * edges.weights**2
    outside = (off > 1.5) * edges.weights**4
    starts = np.flatnonzero(np.diff(edges.ray, prepend=-1))
    best_of_rays = np.maximum.reduceat(np.stack([on, outside]), starts, axis=-1)
    count, misplaced = best_of_rays.sum(axis=-1)
    return np.asarray(count - misplaced)


def _final_score(found: Found) -> float:
    if not len(found.edges.points):
        return 0.0
    score = float(_scores(found.circle.as_row()[None], found.edges.points, found.edges)[0])
    return score if found.circle.aspect == 1 else BENT_SCORE * score


def _refit(start: Ellipse, edges: Edges, reach: float, *, free_aspect: bool) -> Ellipse:
    reach_px = _reach_px(start, reach)
    return fitted(start, edges.points, edges.weights, reach_px, free_aspect=free_aspect)


def _reach_px(ellipse: Ellipse, reach: float = CLEAR_REACH) -> float:
    return max(2.0, reach * ellipse.radius)


def _clearly_bent(ellipse: Ellipse, edges: Edges, size: Size) -> bool:
    """Whether the pixels are certainly not square; short arcs cannot tell."""
    off = abs(ellipse.aspect - 1)
    if off < LEAST_BENT or arcs_found_deg(ellipse, edges, size)[1] < LEAST_BENT_ARC_DEG:
        return False
    return off > 5 * errors_of(ellipse, edges).aspect
