"""Which parts of the picture have been seen: a middle, a ring around it, and the rim.

    middle 1 sector, ring and rim 8 each; borders are shares of the way from the middle to the edge

The edge is where the picture ends or, with a lens whose image is a circle in the dark, where
nothing was ever bright. No lens has to be known for that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ..lens import Floats
from .targets import Gray
from .words import DIRECTIONS

RINGS = (0.0, 0.36, 0.7, 1.06)  # a little over the edge, which is known roughly
RING_AIMS = (0.0, 0.52, 0.77)  # where the middle of a board should be
EIGHTH = np.pi / 4
COUNT = 1 + 2 * 8
WAYS = 64  # directions in which the edge is looked for
THUMBNAIL = 192
LIT = 40  # of 255: video's black is 16, and noise comes on top
LEAST_REACH = 0.3  # of the way to the picture's border


class LitPicture:
    """Where the picture was ever bright, at a small size."""

    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self._scale = min(1.0, THUMBNAIL / max(size))
        self._most: NDArray[np.uint8] | None = None

    def add(self, gray: Gray) -> None:
        small = cv2.resize(
            gray, None, fx=self._scale, fy=self._scale, interpolation=cv2.INTER_AREA
        ).astype(np.uint8)
        self._most = small if self._most is None else np.maximum(self._most, small)

    def reach(self, center: tuple[float, float]) -> Floats:
        """Pixels (WAYS,) from the centre to the edge, clockwise from the right."""
        way = np.arange(WAYS) * (2 * np.pi / WAYS)
        ways = np.stack([np.cos(way), np.sin(way)], axis=-1)
        border = _to_border(self._size, np.array(center), ways)
        if self._most is None:
            return border
        shares = np.linspace(LEAST_REACH, 1, 120)
        at = np.array(center) + (border[:, None] * shares)[..., None] * ways[:, None]
        lit = self._is_lit(at)
        # the last lit one on each way, counted from outside
        last = lit.shape[1] - 1 - np.argmax(lit[:, ::-1], axis=1)
        share = np.where(lit.any(axis=1), shares[last], LEAST_REACH)
        if not lit.any():
            return border
        return np.minimum(_smooth(border * share), border)

    def _is_lit(self, pixels: Floats) -> NDArray[np.bool_]:
        assert self._most is not None
        rows, columns = self._most.shape
        place = ((pixels + 0.5) * self._scale).astype(int)
        x, y = place[..., 0].clip(0, columns - 1), place[..., 1].clip(0, rows - 1)
        return np.asarray(self._most[y, x] > LIT)


def _to_border(size: tuple[int, int], center: Floats, ways: Floats) -> Floats:
    """Pixels along each way (n, 2) until the picture ends."""
    far = np.where(ways > 0, np.array(size) - 1 - center, center)
    along = np.divide(far, np.abs(ways), out=np.full(ways.shape, np.inf), where=ways != 0)
    return np.maximum(along.min(axis=1), 1.0)


def _smooth(values: Floats) -> Floats:
    """The median of five neighbours around the circle (a dark spot at the rim is not its end), and
    of that the mean of three."""
    median = np.median([np.roll(values, k) for k in range(-2, 3)], axis=0)
    return np.asarray(np.mean([np.roll(median, k) for k in range(-1, 2)], axis=0))


@dataclass(frozen=True)
class Sectors:
    """The 17 parts of a picture. Number 0 is the middle, 1 to 8 the ring, 9 to 16 the rim, both
    clockwise from the right; `reach` as from `LitPicture.reach`."""

    center: tuple[float, float]
    reach: Floats

    def of(self, pixels: Floats) -> NDArray[np.int64]:
        """The sector of each pixel (n, 2); -1 outside."""
        offset = pixels - np.array(self.center)
        angle = np.arctan2(offset[:, 1], offset[:, 0])
        share = np.hypot(offset[:, 0], offset[:, 1]) / self.to_edge(angle)
        ring = np.searchsorted(RINGS, share, side="right") - 1
        eighth = np.round(angle / EIGHTH).astype(int) % 8
        number = np.where(ring == 0, 0, 1 + 8 * (ring - 1) + eighth)
        return np.asarray(np.where(ring < 3, number, -1))

    def to_edge(self, angle: Floats) -> Floats:
        """Pixels from the centre to the edge at angles from the right, clockwise."""
        place = angle / (2 * np.pi) * WAYS
        return np.interp(place, np.arange(WAYS), self.reach, period=WAYS)

    def at(self, share: float, angle: Floats) -> Floats:
        """Pixels (n, 2) at a share of the way to the edge."""
        away = share * self.to_edge(angle)
        return np.array(self.center) + away[:, None] * np.stack(
            [np.cos(angle), np.sin(angle)], axis=-1
        )

    def outline(self, number: int) -> Floats:
        """Pixels (n, 2) around a sector."""
        if number == 0:
            return self.at(RINGS[1], np.linspace(0, 2 * np.pi, 33)[:-1])
        inner, outer = RINGS[ring_of(number)], min(RINGS[ring_of(number) + 1], 1.0)
        across = ((number - 1) % 8 + np.linspace(-0.5, 0.5, 9)) * EIGHTH
        return np.concatenate([self.at(outer, across), self.at(inner, across[::-1])])

    def middle(self, number: int) -> Floats:
        """The pixel (2,) a board should be held at to fill a sector."""
        if number == 0:
            return np.array(self.center)
        share = RING_AIMS[ring_of(number)]
        return np.asarray(self.at(share, np.array([(number - 1) % 8 * EIGHTH]))[0])


def ring_of(number: int) -> int:
    """0 for the middle, 1 for the ring, 2 for the rim."""
    return 0 if number == 0 else 1 + (number - 1) // 8


def name_of(number: int) -> str:
    """Where a sector is, in words: "the lower right, near the edge"."""
    if number == 0:
        return "the middle"
    side = DIRECTIONS[(number - 1) % 8]
    return f"the {side}, near the edge" if ring_of(number) == 2 else f"the {side}, half way out"


def count_points(sectors: Sectors, views: Sequence[Floats]) -> NDArray[np.int64]:
    """Points (n, 2) of all views in each sector, (COUNT,)."""
    if not views:
        return np.zeros(COUNT, np.int64)
    number = sectors.of(np.concatenate(views))
    return np.bincount(number[number >= 0], minlength=COUNT)
