"""Corners of boards with numbered markers: the markers say which corner is where.

    markers found and read by OpenCV -> where the board's corners should be -> corners placed to a
    fraction of a pixel, checked by their looks -> those beside them, until nothing is added

A marker too bent or too small to be read costs nothing as long as others are near.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..errors import CalibrationError
from ..lens import Floats
from ._lattice import SAME_PX, Bools, LocalMaps, in_squares, maps_at
from ._saddles import Gray, Slopes, Window, likeness, placed
from .views import FEWEST_POINTS

STRAY = 0.5  # of a square: how far a marker may be from where the others expect it
ENOUGH = 0.6  # of the markers: the corners between them are found without the others
DOUBLED = 2_000_000  # pixels: pictures up to that are looked at enlarged too, others made small
SMALLEST_PX = 36.0  # around a marker; a smaller one cannot be read
LIKE = 0.65  # correlation with the ideal corner; which corner it is, markers say
REACHES = 0.5, 1.1  # pitches from what is known, that corners are looked for at
RINGS_REACH = 0.34  # of what `likeness` looks at
WORSE, WORSE_TIMES = 0.08, 5.0  # how much less like a corner than the median one may be
CONFIRMED = 0.2  # of the markers among the corners found must be read and where they belong
OFF = 0.25  # of a square or tag: how far a marker may be from there


def _dictionaries() -> dict[str, int]:
    names = [name for name in dir(cv2.aruco) if name.startswith("DICT_")]
    known = {name.removeprefix("DICT_").lower(): int(getattr(cv2.aruco, name)) for name in names}
    return dict(sorted(known.items(), key=lambda item: item[1]))


DICTIONARIES = _dictionaries()


@dataclass(frozen=True)
class Plan:
    """What a board with markers consists of, in units of `pitch`, any flat coordinates.

    markers  (m, 4, 2) the corners of marker number i, in the order OpenCV gives them
    corners  (n, 2) where dark and light squares meet
    signs    (n,) 1 if the squares with u v > 0 are the light ones, else -1
    clear    radius around a corner in which there is nothing else
    search   how far from its expected place a corner may be
    """

    markers: Floats
    corners: Floats
    signs: Floats
    clear: float
    search: float

    @property
    def window(self) -> Window:
        """What a corner is placed by; where that is a few pixels only, a little more."""
        return Window(self.clear, most=1.4 * self.clear)


def dictionary(name: str) -> cv2.aruco.Dictionary:
    """OpenCV's dictionary of that name, such as 4x4_50; CalibrationError lists the known."""
    if name.lower() not in DICTIONARIES:
        known = ", ".join(DICTIONARIES)
        raise CalibrationError(f"unknown marker dictionary '{name}'; known: {known}")
    return cv2.aruco.getPredefinedDictionary(DICTIONARIES[name.lower()])


def marker_bits(name: str, number: int, border: int = 1) -> NDArray[np.bool_]:
    """A marker's squares, border and all, as OpenCV draws it: True is dark."""
    kind = dictionary(name)
    side = kind.markerSize + 2 * border
    return np.asarray(cv2.aruco.generateImageMarker(kind, number, side, borderBits=border)) == 0


def find_markers(
    gray: Gray, name: str, expected: int, border: int = 1
) -> tuple[NDArray[np.int64], Floats]:
    """Numbers (m,) and corners (m, 4, 2) of the first `expected` markers of a dictionary.

    When few of them are found, at another size of the picture too.
    """
    whole = dictionary(name)
    # reading a marker takes as long as there are numbers that it can be
    kind = cv2.aruco.Dictionary(
        whole.bytesList[: expected + 1], whole.markerSize, whole.maxCorrectionBits
    )
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = border
    parameters.adaptiveThreshWinSizeMax = 53
    parameters.polygonalApproxAccuracyRate = 0.05  # sides are bent
    parameters.perspectiveRemovePixelPerCell = 8
    parameters.errorCorrectionRate = 1.0  # what is misread is far from where others expect it
    seen: dict[int, Floats] = {}
    for scale in (1.0, 2.0 if gray.size <= DOUBLED else 0.5):
        if len(seen) > ENOUGH * expected:
            break
        how = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_AREA
        level = cv2.resize(gray, None, fx=scale, fy=scale, interpolation=how)
        parameters.minMarkerPerimeterRate = SMALLEST_PX * max(1.0, scale) / max(level.shape)
        detector = cv2.aruco.ArucoDetector(kind, parameters)
        corners, numbers, _ = detector.detectMarkers(level)
        for number, at in zip(() if numbers is None else numbers.ravel(), corners, strict=True):
            place = (at.reshape(4, 2).astype(np.float64) + 0.5) / scale - 0.5
            seen.setdefault(int(number), place)
    if not seen:
        return np.empty(0, np.int64), np.empty((0, 4, 2))
    return np.array(list(seen)), np.array(list(seen.values()))


def find_corners(
    gray: Gray, plan: Plan, numbers: NDArray[np.int64], seen: Floats
) -> tuple[NDArray[np.int64], Floats]:
    """Which of the plan's corners are in the picture, and where (n, 2), from markers seen."""
    known = numbers < len(plan.markers)
    markers, seen = plan.markers[numbers[known]], seen[known]
    good = _without_strays(markers.mean(axis=1), seen.mean(axis=1))
    points, pixels = markers[good].reshape(-1, 2), seen[good].reshape(-1, 2)
    search = _Search(Slopes.of(gray), plan)
    while search.round(points, pixels):
        found = np.flatnonzero(np.isfinite(search.at[:, 0]))
        points = np.concatenate([markers[good].reshape(-1, 2), plan.corners[found]])
        pixels = np.concatenate([seen[good].reshape(-1, 2), search.at[found]])
    found, at = _once_more(search.slopes, plan, _each_once(search.at))
    if not _confirmed(plan, found, at, markers.mean(axis=1), seen.mean(axis=1)):
        return found[:0], at[:0]
    return found, at


def _confirmed(
    plan: Plan, found: NDArray[np.int64], at: Floats, markers: Floats, seen: Floats
) -> bool:
    """Whether the markers' middles say that the corners are those of the plan.

    Of another board, some markers are misread as this one's.
    """
    if len(found) < FEWEST_POINTS or not len(markers):
        return False
    maps = maps_at(markers, plan.corners[found], at)
    right = maps.known & (in_squares(maps.axes, seen - maps.place) < OFF)
    expected = len(plan.markers) / len(plan.corners) * len(found)
    return bool(right.sum() > max(1, CONFIRMED * expected, (maps.known & ~right).sum()))


class _Search:
    """Looks for a plan's corners round by round: `at` (n, 2), NaN until they are found."""

    def __init__(self, slopes: Slopes, plan: Plan) -> None:
        self.slopes, self.plan = slopes, plan
        self.at = np.full((len(plan.corners), 2), np.nan)
        self._tried = np.full_like(self.at, np.inf)

    def round(self, points: Floats, pixels: Floats) -> bool:
        """Look beside what is known, the nearest first; whether anything was found."""
        missing = np.flatnonzero(np.isnan(self.at[:, 0]))
        if not len(points) or not len(missing):
            return False
        distance, _ = cKDTree(points).query(self.plan.corners[missing])
        return any(self._look(missing[distance < reach], points, pixels) for reach in REACHES)

    def _look(self, which: NDArray[np.int64], points: Floats, pixels: Floats) -> bool:
        maps = maps_at(self.plan.corners[which], points, pixels)
        moved = np.abs(maps.place - self._tried[which]).max(axis=1, initial=0.0) > SAME_PX
        worth = maps.known & moved
        which, maps = which[worth], maps.part(worth)
        self._tried[which] = maps.place
        self.at[which] = _placed(self.slopes, self.plan, which, maps)
        return bool(np.isfinite(self.at[which]).any())


def _each_once(at: Floats) -> Floats:
    """Without those that were found at one place: one of them is not there, and which, is open."""
    found = np.flatnonzero(np.isfinite(at[:, 0]))
    pairs = cKDTree(at[found]).query_pairs(1.0, output_type="ndarray") if len(found) else []
    at = at.copy()
    at[found[np.unique(pairs).astype(int)]] = np.nan
    return at


def _placed(slopes: Slopes, plan: Plan, which: NDArray[np.int64], maps: LocalMaps) -> Floats:
    """Places (n, 2) of corners near where they are expected; NaN where they are not."""
    at, good = placed(slopes, maps.place, maps, plan.window)
    good &= in_squares(maps.axes, at - maps.place) < plan.search
    here = LocalMaps(np.where(good[:, None], at, maps.place), maps.axes, maps.bend, maps.known)
    good &= _alike(slopes, plan, which, here) > LIKE
    return np.where(good[:, None], at, np.nan)


def _alike(slopes: Slopes, plan: Plan, which: NDArray[np.int64], maps: LocalMaps) -> Floats:
    alike, _ = likeness(slopes.level, maps, 0.9 * plan.clear / RINGS_REACH)
    return np.asarray(plan.signs[which] * alike)


def _once_more(slopes: Slopes, plan: Plan, at: Floats) -> tuple[NDArray[np.int64], Floats]:
    """Placed again by windows that follow the corners themselves, not the markers' rough ones.

    Without those that look worse than the others: the rim of the lens's picture is near, a finger.
    """
    found = np.flatnonzero(np.isfinite(at[:, 0]))
    if not len(found):
        return found, np.empty((0, 2))
    maps = maps_at(plan.corners[found], plan.corners[found], at[found])
    found = found[maps.known & (in_squares(maps.axes, at[found] - maps.place) < plan.search)]
    found, maps = _known(plan, found, at)
    at = at.copy()
    at[found] = _placed(slopes, plan, found, maps)
    found, maps = _known(plan, found[np.isfinite(at[found, 0])], at)
    unlike = 1 - _alike(slopes, plan, found, maps)
    good = unlike < WORSE + WORSE_TIMES * np.median(unlike) if len(found) else np.zeros(0, bool)
    return found[good], at[found[good]]


def _known(plan: Plan, found: NDArray[np.int64], at: Floats) -> tuple[NDArray[np.int64], LocalMaps]:
    """The corners around which there are enough others, and the maps there."""
    maps = maps_at(plan.corners[found], plan.corners[found], at[found], own=True)
    maps = LocalMaps(at[found], maps.axes, maps.bend, maps.known)
    return found[maps.known], maps.part(maps.known)


def _without_strays(points: Floats, pixels: Floats) -> Bools:
    """Which of the markers (their middles) are about where the others expect them."""
    good = np.ones(len(points), bool)
    for _ in range(3):
        maps = maps_at(points, points[good], pixels[good])
        stray = maps.known & (in_squares(maps.axes, pixels - maps.place) > STRAY)
        if not (stray & good).any():
            break
        good &= ~stray
    return good
