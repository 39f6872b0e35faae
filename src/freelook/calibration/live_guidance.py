"""What is missing in the views taken so far, and where to hold the board next."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..lens import Floats
from .live_coverage import COUNT, LitPicture, Sectors, count_points, name_of, ring_of
from .live_placing import edge_angle, frame_along, newness, placing, rough_camera, wide
from .targets import Gray
from .views import View

ENOUGH_POINTS = 6  # in a sector
NEW_ENOUGH = 0.3  # how new a view must be that fills a sector
# Half of the board's diagonal, as a share of the angle from the axis to the edge, and at most. The
# larger the better: in simulations twice as large meant two to three times as certain.
GHOST, LARGEST_GHOST = 0.45, np.radians(32.0)
CERTAIN = 0.0004  # of the picture's mean side (0.4 px of 1000); less certain: all tilts are wanted
GHOST_TILT = np.radians(38.0)
PATIENCE = 4  # views taken elsewhere until another place is asked for
NEARER = {"left": (0, -1), "right": (0, 1), "top": (1, 0), "bottom": (-1, 0)}  # axes (x, y)
TILTS = (("left", "right"), ("top", "bottom"))
SIDE_STEPS = 12
USUAL_ASPECT = 0.7  # height by width of a board nobody has seen yet
LIGHT_EVERY = 8  # pictures until one is looked at for where the picture ends


@dataclass(frozen=True)
class Hold:
    """Where to hold the board: a sentence, its outline in the picture (n, 2), NaN where it is not
    seen, and what it is about: the number of the sector to fill, or the side to be nearer."""

    sentence: str
    outline: Floats
    about: int | str


def next_sector(filled: NDArray[np.bool_], last: int, asked: Mapping[int | str, int]) -> int | None:
    """The empty sector to fill next: the rim first, round from the last one; None: all are full.

    `asked` counts the views taken while each was asked for: after some, another has its turn.
    """

    def order(number: int) -> tuple[int, int, int]:
        turn = _eighths(number, last) if number > 0 and last > 0 else 0
        return asked.get(number, 0) // PATIENCE, -ring_of(number), turn

    return min(map(int, np.flatnonzero(~filled)), key=order, default=None)


def _eighths(a: int, b: int) -> int:
    apart = abs((a - 1) % 8 - (b - 1) % 8)
    return min(apart, 8 - apart)


class Guide:
    """Knows what was seen where, in pictures of one size.

    sectors  parts of the picture
    counts   points of the views in each
    hold     where to hold the board next; None when nothing is missing
    """

    def __init__(self, size: tuple[int, int]) -> None:
        self.size = size
        self.counts = np.zeros(COUNT, np.int64)
        self._lit, self._looks = LitPicture(size), 0
        self._asked: Counter[int | str] = Counter()
        self._most_points, self._aspect = 0, USUAL_ASPECT
        self.update((), None, float("nan"))

    @property
    def filled(self) -> NDArray[np.bool_]:
        return np.asarray(self.counts >= ENOUGH_POINTS)

    def look(self, gray: Gray, found: View | None) -> None:
        """Learn from a picture how far the image reaches, and from the target its shape."""
        if self._looks % LIGHT_EVERY == 0:
            self._lit.add(gray)
            self.update(self._views, self._known, self._uncertainty_px)
        self._looks += 1
        if found is not None and len(found.pixels) > self._most_points:
            self._most_points = len(found.pixels)
            sides = np.ptp(found.points[:, :2], axis=0)
            self._aspect = float(np.clip(sides.min() / max(sides.max(), 1e-12), 0.2, 1.0))

    def update(self, views: Sequence[View], known: Camera | None, uncertainty_px: float) -> None:
        """These views are there now, and this is the camera as far as it is known."""
        self._views, self._known, self._uncertainty_px = tuple(views), known, uncertainty_px
        width, height = self.size
        center = known.center if known else ((width - 1) / 2, (height - 1) / 2)
        self.sectors = Sectors(center, self._lit.reach(center))
        self._rough = rough_camera(self.size, self.sectors, known)
        self._wide = wide(known) if known else None
        placings = [placing(view, self._rough, self._wide) for view in views]
        self._placings = [p for p in placings if p is not None]
        self.counts = count_points(self.sectors, [view.pixels for view in views])
        self.hold = self._next()

    def taking(self) -> None:
        """A view is being taken while `hold` was asked for."""
        if self.hold is not None:
            self._asked[self.hold.about] += 1

    def is_new(self, view: View) -> bool:
        """Whether the board is held elsewhere, tilted otherwise or at another distance than in all
        views so far; less of it is enough where the picture is still empty."""
        here = placing(view, self._rough, self._wide)
        if here is None:
            return False
        how_new = newness(here, self._placings, edge_angle(self._rough, self.sectors))
        more = self.counts + count_points(self.sectors, [view.pixels])
        fills = bool(((more >= ENOUGH_POINTS) & ~self.filled).any())
        return how_new >= (NEW_ENOUGH if fills else 1.0)

    def _next(self) -> Hold | None:
        """The middle; tilted about both axes, without which nothing can be solved; all parts of
        the picture; then, where the lens is still uncertain, the other tilts."""
        if not self._views:
            return Hold("Hold the board in the middle, about so large", self._ghost(0), 0)
        seen = {placing.nearer_side() for placing in self._placings}
        first = [pair[0] for pair in TILTS if not seen & set(pair)]
        if tilt := self._patiently(first):
            return self._tilted(tilt)
        sector = next_sector(self.filled, self._last_sector(), self._asked)
        if sector is not None:
            return Hold(f"Hold the board at {name_of(sector)}", self._ghost(sector), sector)
        uncertain = self._uncertainty_px > CERTAIN * sum(self.size) / 2
        others = [side for side in NEARER if side not in seen] if uncertain else []
        return self._tilted(tilt) if (tilt := self._patiently(others)) else None

    def _patiently(self, sides: Sequence[str]) -> str | None:
        """The first that was not asked for in vain too often."""
        return next((side for side in sides if self._asked[side] < PATIENCE), None)

    def _tilted(self, side: str) -> Hold:
        words = f"Tilt the board: its {side} side nearer to the camera"
        return Hold(words, self._ghost(0, side), side)

    def _last_sector(self) -> int:
        return int(self.sectors.of(self._views[-1].pixels.mean(axis=0, keepdims=True))[0])

    def _ghost(self, sector: int, nearer: str | None = None) -> Floats:
        """The outline of a board held at a sector, facing the camera or with one side nearer."""
        half = np.array([1.0, self._aspect]) / np.hypot(1.0, self._aspect)
        half *= np.tan(min(GHOST * edge_angle(self._rough, self.sectors), LARGEST_GHOST))
        flat = np.column_stack([_square() * half, np.zeros(4 * SIDE_STEPS)])
        if nearer:
            flat = flat @ _turn(NEARER[nearer]).T
        ray = self._rough.ray(self.sectors.middle(sector)[None])[0]
        return self._rough.project(flat @ frame_along(ray).T + ray)


def _square() -> Floats:
    """Points around the square of side 2, (4 SIDE_STEPS, 2)."""
    along = np.linspace(-1, 1, SIDE_STEPS, endpoint=False)
    ones = np.ones(SIDE_STEPS)
    sides = ((along, -ones), (ones, along), (-along, ones), (-ones, -along))
    return np.concatenate([np.stack(side, axis=-1) for side in sides])


def _turn(axis: tuple[int, int]) -> Floats:
    """Rotation (3, 3) by GHOST_TILT about an axis of the picture."""
    return np.asarray(Rotation.from_rotvec(GHOST_TILT * np.array([*axis, 0.0])).as_matrix())
