"""Whether a target is held still, and sharp, as far as its picture tells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..lens import Floats
from .choice import moved_px
from .targets import Gray
from .views import View

HOLD_NS = 500_000_000  # so long the target must not move
LONGEST_GAP_NS = 3_000_000_000  # between two looks; nobody knows what happened in a longer one
# How far it may drift meanwhile, as a share of the mean side of the picture: 1.2 px of 960. At that
# speed an exposure of 1/60 s smears it by 0.04 px.
DRIFT = 0.00125
MOST_POINTS = 60  # of a view that are looked at for sharpness
DIRECTIONS = np.linspace(0, np.pi, 8, endpoint=False)
WAYS = np.stack([np.cos(DIRECTIONS), np.sin(DIRECTIONS)])  # (2, 8)
# Corners are about 3 px wide in sharp pictures, and 4.5 px where these are blurred with a sigma of
# 1.2 px. A lens that never gets there is measured by its own best, once that is known.
SHARP_PX = 4.5
SHARP_OF_BEST = 1.3
SOFT_LOOKS = 30  # at a target that is held still


@dataclass
class Steadiness:
    """How long the target has been where it is; fed with one look after the other."""

    _anchor: View | None = None
    _since_ns: int = 0
    _last_ns: int = 0

    def look(self, view: View | None, size: tuple[int, int], now_ns: int) -> float:
        """The share of the time to hold still that has passed, 0 to 1; 0 without a target."""
        limit = DRIFT * (size[0] + size[1]) / 2
        anchor, gap_ns = self._anchor, now_ns - self._last_ns
        self._last_ns = now_ns
        moved = view is None or anchor is None or drift_px(anchor, view) > limit
        if moved or gap_ns > LONGEST_GAP_NS:
            self._anchor, self._since_ns = view, now_ns
            return 0.0
        return min((now_ns - self._since_ns) / HOLD_NS, 1.0)

    def forget(self) -> None:
        """Start over: what is seen next has not been held still yet."""
        self._anchor = None


def drift_px(before: View, after: View) -> float:
    """How far the target moved, also by a whole square, which nearest corners alone do not see."""
    if len(before.pixels) != len(after.pixels):
        return moved_px(before, after)
    whole = after.pixels.mean(axis=0) - before.pixels.mean(axis=0)
    return max(moved_px(before, after), float(np.hypot(*whole)))


@dataclass
class Sharpness:
    """Compares edges with what is sharp in general and, for a soft lens, with its best."""

    _best_px: float = float("inf")
    _looks: int = 0

    def look(self, width_px: float) -> bool:
        """Whether edges of this width are sharp; NaN is not."""
        if np.isnan(width_px):
            return False
        self._looks += 1
        self._best_px = min(self._best_px, width_px)
        soft = self._looks > SOFT_LOOKS and width_px <= SHARP_OF_BEST * self._best_px
        return width_px <= SHARP_PX or soft


def edge_width_px(gray: Gray, pixels: Floats) -> float:
    """How wide edges are at points of the target: contrast over slope, median over the points.

    Slopes count in the direction in which they are least, so that a picture smeared along one
    direction is not taken for sharp because of the edges along it: at the corner of a chessboard
    in the middle between its edges, where slopes are less by sqrt(2). An ideal corner is 2.8 px
    wide, one blurred with a sigma of 3 px 10.6 px. NaN if no point lies well inside the picture.
    """
    chosen = pixels[np.linspace(0, len(pixels) - 1, min(len(pixels), MOST_POINTS)).astype(int)]
    spacing = cKDTree(pixels).query(chosen, k=2)[0][:, 1]
    reach = np.clip(0.4 * spacing, 3, 10).astype(int)
    widths = [_width(gray, at, r) for at, r in zip(np.rint(chosen).astype(int), reach, strict=True)]
    known = [width for width in widths if np.isfinite(width)]
    return float(np.median(known)) if known else float("nan")


def _width(gray: Gray, at: NDArray[np.int64], reach: int) -> float:
    x, y = at
    rows, columns = gray.shape
    if not (reach <= x < columns - reach and reach <= y < rows - reach):
        return float("nan")
    patch = gray[y - reach : y + reach + 1, x - reach : x + reach + 1].astype(np.float64)
    down, across = np.gradient(patch)
    slope = np.abs(np.stack([across.ravel(), down.ravel()], axis=-1) @ WAYS).max(axis=0).min()
    low, high = np.percentile(patch, [5, 95])
    return float((high - low) / slope) if slope > 0 else float("nan")
