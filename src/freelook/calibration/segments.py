"""Straight things in fisheye pictures: edges that follow a great circle.

1. Edges (Canny), with the direction of the gradient, to a fraction of a pixel.
2. Chains of neighbouring edge points with the same gradient; they end where edges meet.
3. A chain is cut where it leaves the great circle through its ends by more than a share of its
   length. Long pieces that keep to theirs are kept; what continues behind a gap is joined.

The share starts large, because the lens that decides what a great circle is is not known yet, and
becomes smaller while it gets known: see `refine_with_segments`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..errors import CalibrationError
from ..lens import Floats
from ..types import Plane
from ._great_circles import Line
from .lines import LineFit, as_kannala_brandt, line_distances, refine, telling_px

BLUR = 1.2  # sigma of the picture's smoothing, pixels
STRONG = 92.0  # percentile of the gradient inside the circle that begins an edge
WEAK_SHARE = 0.4  # of that continues one
LEAST_STRONG = 12.0  # grey levels per pixel, times the Sobel mask's 4
INSIDE = 0.96  # of the rim's radius: the rim itself is no straight line
TURN = np.cos(np.radians(50))  # neighbours' gradients differ by no more
STEP_PX = 10.0  # between the points of a line
SHORTEST = 0.14  # of the circle's radius
STRAYS = (0.02, 0.01, 0.006)  # of a piece's length, round after round
LEAST_STRAY_PX = 1.0
GAP = 0.15  # of the radius, between pieces that are joined
JOINED = 0.4  # of the share by which a piece may stray: joining must not bend
MOST_LINES = 80
FEWEST = 10  # pixels of a chain
NEIGHBOURS = tuple(
    (r, c, float(np.hypot(r, c)))
    for r, c in ((0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1))
)

Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Chain:
    """Points (n, 2) one after the other along an edge, pixels, in one picture."""

    picture: str
    pixels: Floats


def find_chains(gray: Plane, camera: Camera, picture: str) -> list[Chain]:
    """Edges of a picture (rows, columns) inside the camera's image; long ones."""
    shortest = SHORTEST * _rim_px(camera)
    smooth = cv2.GaussianBlur(gray, (0, 0), BLUR)
    dx, dy = (cv2.Sobel(smooth, cv2.CV_16S, *order) for order in ((1, 0), (0, 1)))
    inside = _inside(camera)
    strength = np.abs(dx).astype(np.float64) + np.abs(dy)
    strong = max(float(np.percentile(strength[inside], STRONG)), LEAST_STRONG)
    edges = (cv2.Canny(dx, dy, WEAK_SHARE * strong, strong) > 0) & inside
    gradient = np.stack([dx, dy], axis=-1).astype(np.float64)
    slope = np.hypot(gradient[..., 0], gradient[..., 1]).astype(np.float32)
    chains = _walked(edges, gradient)
    return [
        Chain(picture, _refined(chain, slope, gradient))
        for chain in chains
        if len(chain) > 0.7 * shortest
    ]


def straight_pieces(chains: Sequence[Chain], camera: Camera, stray: float) -> list[Line]:
    """Pieces of chains that keep to a great circle within `stray` times their length."""
    shortest = SHORTEST * _rim_px(camera)
    lines: list[Line] = []
    for picture in dict.fromkeys(chain.picture for chain in chains):
        pieces = [
            _thinned(piece)
            for chain in chains
            if chain.picture == picture
            for piece in _cut(chain.pixels, camera.ray(chain.pixels), camera, stray, shortest)
        ]
        for piece in _joined(pieces, camera, stray):
            lines.append(Line(f"{picture} {len(lines) + 1}".strip(), piece, picture))
    return lines


def _joined(pieces: list[Floats], camera: Camera, stray: float) -> list[Floats]:
    """With pieces (n, 2) made one that follow each other along a great circle."""
    left = sorted(pieces, key=len, reverse=True)
    found = []
    while left:
        now = left.pop(0)
        grown = True
        while grown:
            grown = False
            for k, other in enumerate(left):
                both = _continued(now, other, GAP * _rim_px(camera))
                if both is not None and _on_one_circle(both, camera, stray):
                    now, grown = both, True
                    left.pop(k)
                    break
        found.append(now)
    return found


def _continued(a: Floats, b: Floats, gap_px: float) -> Floats | None:
    """Both, one after the other, if `b` begins not far from an end of `a` and goes on its way."""
    for first in (a, a[::-1]):
        for then in (b, b[::-1]):
            gap, way = then[0] - first[-1], first[-1] - first[-min(5, len(first))]
            if np.hypot(*gap) < gap_px and gap @ way > 0.9 * np.hypot(*gap) * np.hypot(*way):
                return np.concatenate([first, then])
    return None


def _on_one_circle(pixels: Floats, camera: Camera, stray: float) -> bool:
    off = line_distances(camera, [Line("", pixels)])[0]
    length = float(np.hypot(*np.diff(pixels, axis=0).T).sum())
    return bool(np.abs(off).max() <= max(JOINED * stray * length, LEAST_STRAY_PX))


def refine_with_segments(
    camera: Camera,
    pictures: Iterable[tuple[str, Plane]],
    told: Sequence[Line] = (),
    *,
    terms: int = 4,
    field_error_deg: float = 1.0,
    radius_error_px: float | None = None,
    center_error_px: float = 0.0,
    progress: Callable[[], None] = lambda: None,
) -> LineFit:
    """`refine` with what is straight in pictures (name, (rows, columns)), and with lines told.

    CalibrationError where too little is found.
    """
    chains = []
    for name, gray in pictures:
        if (gray.shape[1], gray.shape[0]) != camera.size:
            raise CalibrationError(
                f"{name} is {gray.shape[1]} x {gray.shape[0]} pixels, the lens is for "
                f"{camera.size[0]} x {camera.size[1]}"
            )
        chains += find_chains(gray, camera, name)
        progress()
    current = camera
    for stray in STRAYS if chains else STRAYS[-1:]:
        lines = [*told, *_most_telling(straight_pieces(chains, current, stray), current)]
        fit = refine(
            camera,
            lines,
            terms=terms,
            field_error_deg=field_error_deg,
            radius_error_px=radius_error_px,
            center_error_px=center_error_px,
            ask_rim=stray == STRAYS[-1],
        )
        current = fit.camera
    return fit


def _most_telling(lines: list[Line], camera: Camera) -> list[Line]:
    if len(lines) <= MOST_LINES:
        return lines
    tells = telling_px(as_kannala_brandt(camera), lines)
    return [lines[k] for k in sorted(np.argsort(-tells)[:MOST_LINES].tolist())]


def _rim_px(camera: Camera) -> float:
    return float(camera.lens.radius(np.array([camera.theta_max * (1 - 1e-9)]))[0])


def _inside(camera: Camera) -> Bools:
    width, height = camera.size
    y, x = np.mgrid[0:height, 0:width]
    pixels = np.stack([x, y], axis=-1).astype(np.float64)
    point = (pixels - camera.center) @ np.linalg.inv(camera.stretch).T
    inside = np.hypot(point[..., 0], point[..., 1]) < INSIDE * _rim_px(camera)
    inside[:3] = inside[-3:] = False
    inside[:, :3] = inside[:, -3:] = False
    return np.asarray(inside)


Place = tuple[int, int]


def _walked(edges: Bools, gradient: Floats) -> list[NDArray[np.int64]]:
    """Chains (n, 2) of (row, column), each edge pixel in one of them."""
    places = np.argwhere(edges)
    ways = gradient[edges]
    ways /= np.maximum(np.hypot(ways[:, 0], ways[:, 1]), 1e-9)[:, None]
    free: dict[Place, tuple[float, float]] = {
        (r, c): (x, y) for (r, c), (x, y) in zip(places.tolist(), ways.tolist(), strict=True)
    }
    chains = []
    while free:
        seed, way = free.popitem()
        ahead = _followed(seed, way, free, (0.0, 0.0))
        start = (ahead[0][0] - seed[0], ahead[0][1] - seed[1]) if ahead else (0, 0)
        back = _followed(seed, way, free, (-float(start[0]), -float(start[1])))
        chain = [*reversed(back), seed, *ahead]
        if len(chain) > FEWEST:
            chains.append(np.array(chain))
    return chains


def _followed(
    at: Place,
    way: tuple[float, float],
    free: dict[Place, tuple[float, float]],
    heading: tuple[float, float],
) -> list[Place]:
    """On from a pixel, to the neighbour that is most ahead, as long as the gradient stays."""
    found: list[Place] = []
    while True:
        best, most = None, -1e-9
        for dr, dc, size in NEIGHBOURS:
            other = (at[0] + dr, at[1] + dc)
            its = free.get(other)
            if its is None or its[0] * way[0] + its[1] * way[1] < TURN:
                continue
            ahead = (dr * heading[0] + dc * heading[1]) / size
            if ahead > most:
                best, most = other, ahead
        if best is None:
            return found
        heading = (
            0.8 * heading[0] + best[0] - at[0],
            0.8 * heading[1] + best[1] - at[1],
        )
        way, at = free.pop(best), best
        found.append(best)


def _refined(chain: NDArray[np.int64], strength: NDArray[np.float32], gradient: Floats) -> Floats:
    """Pixels (n, 2) as (x, y), moved along the gradient to the top of a parabola through it."""
    row, column = chain.T
    way = gradient[row, column] / np.maximum(strength[row, column], 1e-9)[:, None]
    samples = []
    for step in (-1.0, 0.0, 1.0):
        x = (column + step * way[:, 0]).astype(np.float32)
        y = (row + step * way[:, 1]).astype(np.float32)
        samples.append(cv2.remap(strength, x, y, cv2.INTER_LINEAR)[:, 0].astype(np.float64))
    behind, here, ahead = samples
    bend = behind - 2 * here + ahead
    top = np.divide(behind - ahead, 2 * bend, out=np.zeros_like(bend), where=bend < -1e-6)
    return np.asarray(np.stack([column, row], axis=-1) + np.clip(top, -1, 1)[:, None] * way)


def _cut(
    pixels: Floats, rays: Floats, camera: Camera, stray: float, shortest: float
) -> list[Floats]:
    """The longest pieces that keep to the great circle through their ends."""
    whole = np.isfinite(rays[:, 0])
    pixels, rays = pixels[whole], rays[whole]
    if len(pixels) < 8:
        return []
    reach = float(np.hypot(*(pixels[-1] - pixels[0])))
    length = max(reach, float(np.hypot(*np.diff(pixels[::8], axis=0).T).sum()))
    if length < shortest:
        return []
    normal = np.cross(rays[0], rays[-1])
    size = float(np.linalg.norm(normal))
    if size > 1e-3:
        off = np.abs(rays @ (normal / size)) * _px_per_rad(camera)
        worst = int(np.argmax(off))
        if off[worst] <= max(stray * length, LEAST_STRAY_PX):
            return [pixels] if reach > 0.6 * shortest else []
    else:
        worst = len(pixels) // 2
    worst = int(np.clip(worst, 4, len(pixels) - 4))
    parts = (slice(None, worst + 1), slice(worst, None))
    return [p for part in parts for p in _cut(pixels[part], rays[part], camera, stray, shortest)]


def _px_per_rad(camera: Camera) -> float:
    return _rim_px(camera) / camera.theta_max


def _thinned(pixels: Floats) -> Floats:
    """Means of neighbours, STEP_PX apart; the ends, where edges bend off, are left away."""
    count = max(len(pixels) // int(STEP_PX), 5)
    parts = np.array_split(pixels, count)
    if len(parts) > 8:
        parts = parts[1:-1]
    return np.array([part.mean(axis=0) for part in parts])
