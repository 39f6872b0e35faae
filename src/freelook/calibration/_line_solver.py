"""The lens under which lines are straightest, given what is assumed of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..lens import Floats, KannalaBrandt, radius_slope, vector
from ._great_circles import Line, LinePoints, best_circles

MOST_TERMS = 4
SLOPE_SIGMA = 0.3  # as a share; equidistant to stereographic is -0.24 on the axis, 0.6 at 94 deg
SLOPES_AT = 6  # angles at which that is said
CENTER_SIGMA = 0.01  # of the circle's radius
RADIUS_SIGMA = 0.001  # of the radius, where its error is not told
FIRST_NOISE_PX, LEAST_NOISE_PX = 2.0, 0.05
WEIGHINGS = 5
TRUSTING = 2  # so many times all points count, and each: a lens still far off bends whole lines
STRAY = 5.0  # times the noise: such a point does not count

Distances = Callable[[Floats], Floats]


def as_kannala_brandt(camera: Camera, terms: int = MOST_TERMS) -> Camera:
    """The round part of a camera's lens as the nearest Kannala-Brandt one over its field."""
    theta = np.linspace(0, camera.theta_max, 200)[1:]
    columns = powers(theta / camera.theta_max, terms)
    values = np.linalg.lstsq(columns, camera.lens.radius(theta), rcond=None)[0]
    return replace(camera, lens=_lens_of(np.asarray(values, np.float64), camera.theta_max))


def powers(u: Floats, terms: int) -> Floats:
    """u, u^3, u^5 ... (n, 1 + terms)."""
    return np.asarray(u[:, None] ** (2 * np.arange(1 + terms) + 1))


def _lens_of(values: Floats, half: float) -> KannalaBrandt:
    """From the coefficients, in pixels, of powers of theta / half."""
    raw = values / half ** (2 * np.arange(len(values)) + 1)
    return KannalaBrandt(float(raw[0]), *map(float, raw[1:] / raw[0]))


@dataclass(frozen=True)
class Found:
    """values as in `LineProblem`; spread is their covariance."""

    terms: int
    values: Floats
    camera: Camera
    spread: Floats
    covariance: Floats  # of f, k1 to k4 and the centre
    noise_px: float
    together: float


@dataclass(frozen=True)
class LineProblem:
    """What is sought, and what is assumed.

    Values, all in pixels: coefficients of odd powers of theta / half, the centre, and for each
    picture with known directions the turn of these directions, times the rim's radius.

    told, terms      the camera to start from, and how many of k1 to k4 are sought
    radius_error_px, center_error_px  standard deviations of the image circle's
    """

    told: Camera
    terms: int
    radius_error_px: float
    center_error_px: float

    def solved(self, lines: Sequence[Line], near: Camera | None = None) -> Found:
        """The best values; the noise, and how much points of a line err as one, as found.

        Both are needed to weigh lines against what is assumed, so it is done a few times. `near`
        is a Kannala-Brandt camera to begin at, of the same field; only to save time.
        """
        start = near or as_kannala_brandt(self.told, self.terms)
        points, triads = LinePoints.of(lines), Triads.of(start, lines)
        values = np.concatenate([self._values_of(start), np.zeros(3 * len(triads.first_guess))])
        noise, together, counts = FIRST_NOISE_PX, 1.0, np.ones(len(points.pixels))
        for number in range(WEIGHINGS):
            scale, straggling = noise * np.sqrt(together), 3 * noise

            def off(
                values: Floats, straggling: float = straggling, counts: Floats = counts
            ) -> Floats:
                along = triads.along(values[self.terms + 3 :] / self._rim_px)
                return counts * best_circles(self.camera(values), points, straggling, along)[1]

            def rows(values: Floats, scale: float = scale, off: Distances = off) -> Floats:
                return np.concatenate([_softened(off(values) / scale), self._assumed(values)])

            near_enough = 1e-6 if number == WEIGHINGS - 1 else 1e-4
            solution = least_squares(
                rows, values, x_scale="jac", xtol=near_enough, ftol=near_enough, max_nfev=40
            )
            values = np.asarray(solution.x)
            left = off(values, counts=np.ones(len(counts)))
            noise = _noise(left, len(left) - 2 * len(lines) - len(values))
            if number >= TRUSTING:
                counts = (np.abs(left) < STRAY * noise).astype(float)
                slopes = _differences(off, values)
                together = _together(slopes, counts * left, points, noise)
        spread = self._spread(values, slopes / (noise * np.sqrt(together)))
        by_values = _differences(self._parameters, values)
        covariance = np.asarray(by_values @ spread @ by_values.T)
        return Found(self.terms, values, self.camera(values), spread, covariance, noise, together)

    def camera(self, values: Floats) -> Camera:
        """The camera of these values, with the field that was told."""
        lens = _lens_of(values[: self.terms + 1], self._half)
        x, y = map(float, values[self.terms + 1 : self.terms + 3])
        return replace(self.told, lens=lens, center=(x, y))

    @property
    def _half(self) -> float:
        return self.told.theta_max

    @cached_property
    def _rim_px(self) -> float:
        return float(self.told.lens.radius(np.array([self._half]))[0])

    def _values_of(self, start: Camera) -> Floats:
        lens = start.lens
        assert isinstance(lens, KannalaBrandt)
        terms = np.array([1, lens.k1, lens.k2, lens.k3, lens.k4])[: 1 + self.terms]
        reach = self._half ** (2 * np.arange(1 + self.terms) + 1)
        return np.concatenate([lens.f * terms * reach, start.center])

    def _parameters(self, values: Floats) -> Floats:
        camera = self.camera(values)
        return np.concatenate([vector(camera.lens), camera.center])

    @cached_property
    def _told_slopes(self) -> Floats:
        return radius_slope(self.told.lens, self._slope_angles)

    @property
    def _slope_angles(self) -> Floats:
        return np.linspace(0, self._half * (1 - 1e-4), SLOPES_AT)

    @cached_property
    def _slope_rows(self) -> Floats:
        """d (dr/dtheta) / d coefficients."""
        u = self._slope_angles / self._half
        even = 2 * np.arange(1 + self.terms)
        return np.asarray((even + 1) * u[:, None] ** even / self._half)

    def _assumed(self, values: Floats) -> Floats:
        """What does not come from lines, each in its standard deviations."""
        coefficients = values[: self.terms + 1]
        center = values[self.terms + 1 : self.terms + 3]
        slopes = self._slope_rows @ coefficients / self._told_slopes - 1
        return np.concatenate(
            [
                slopes / SLOPE_SIGMA,
                [(coefficients.sum() - self._rim_px) / self.radius_error_px],
                (center - self.told.center) / self.center_error_px,
            ]
        )

    def _spread(self, values: Floats, weighed: Floats) -> Floats:
        assumed = _differences(self._assumed, values)
        information = weighed.T @ weighed + assumed.T @ assumed
        return np.asarray(np.linalg.pinv(information, hermitian=True))


@dataclass(frozen=True)
class Triads:
    """Directions at right angles that lines are known to run along, one triad for each picture.

    first_guess  one turn for each picture with such lines, its columns are the directions
    triad_of, axis_of  (lines,): which triad and which of its columns; -1 where nothing is known
    """

    first_guess: tuple[Rotation, ...]
    triad_of: NDArray[np.int64]
    axis_of: NDArray[np.int64]

    @classmethod
    def of(cls, camera: Camera, lines: Sequence[Line]) -> Triads:
        """Guessed with the camera's normals of the lines."""
        triad_of = np.full(len(lines), -1)
        axis_of = triad_of.copy()
        guesses: list[Rotation] = []
        normal = best_circles(camera, LinePoints.of(lines), FIRST_NOISE_PX)[0]
        for picture in dict.fromkeys(line.picture for line in lines if line.along):
            mine = [k for k, line in enumerate(lines) if line.along and line.picture == picture]
            names = list(dict.fromkeys(lines[k].along for k in mine))
            axis_of[mine] = [names.index(lines[k].along) for k in mine]
            triad_of[mine] = len(guesses)
            here = triad_of == len(guesses)
            guesses.append(_triad([normal[here & (axis_of == a)] for a in range(3)]))
        return cls(tuple(guesses), triad_of, axis_of)

    def along(self, turns: Floats) -> Floats | None:
        """Each line's direction (lines, 3) after small turns of the triads; zeros: not known."""
        if not self.first_guess:
            return None
        pairs = zip(self.first_guess, turns.reshape(-1, 3), strict=True)
        matrices = np.array([(Rotation.from_rotvec(t) * g).as_matrix() for g, t in pairs])
        known = self.triad_of >= 0
        found = np.zeros((len(known), 3))
        found[known] = matrices[self.triad_of[known], :, self.axis_of[known]]
        return found


def _triad(normal: Sequence[Floats]) -> Rotation:
    """The turn whose columns are nearest to right angles with three groups of normals (n, 3)."""
    order = sorted(range(3), key=lambda a: -len(normal[a]))
    first, second, third = order
    columns = np.zeros((3, 3))
    columns[:, first] = np.linalg.svd(normal[first])[2][2]
    aside = np.linalg.svd(columns[:, [first]].T)[2][1:]
    within = normal[second] @ aside.T
    columns[:, second] = np.linalg.svd(within)[2][-1] @ aside
    columns[:, third] = np.cross(columns[:, first], columns[:, second])
    columns[:, third] *= np.sign(np.linalg.det(columns))
    return Rotation.from_matrix(columns)


def _softened(off: Floats) -> Floats:
    """The soft L1 loss, for lines only: what was told is not to be shrugged off."""
    grown = np.sqrt(1 + off**2) + 1
    return np.asarray(off * np.sqrt(2 / grown))


def _differences(function: Callable[[Floats], Floats], values: Floats) -> Floats:
    """Central differences by each value, in pixels all of them."""
    step = 1e-3
    columns = [
        (function(values + step * axis) - function(values - step * axis)) / (2 * step)
        for axis in np.eye(len(values))
    ]
    return np.stack(columns, axis=-1)


def _noise(off: Floats, surplus: int) -> float:
    """Standard deviation by the median, so that a few wrong points do not count."""
    found = 1.4826 * float(np.median(np.abs(off)))
    return max(LEAST_NOISE_PX, found * float(np.sqrt(len(off) / max(surplus, 1))))


def _together(slopes: Floats, off: Floats, points: LinePoints, noise: float) -> float:
    """How many points of a line err as one: the variance of the lines' pulls on the values, over
    that of as many independent points."""
    whitener = np.linalg.pinv(slopes.T @ slopes, hermitian=True)
    pulls = slopes * np.clip(off, -3 * noise, 3 * noise)[:, None]
    lines = np.add.reduceat(pulls, points.first, axis=0)
    single = noise**2 * float(np.trace(whitener @ slopes.T @ slopes))
    whole = float(np.einsum("li,ij,lj->", lines, whitener, lines))
    most = len(off) / len(points.first)
    return float(np.clip(whole / max(single, 1e-12), 1.0, most))
