"""A lens from straight lines: what is straight in the world lies on a great circle of rays.

The points of one straight line and the camera span a plane, so their rays are on a great circle,
whatever the field of view. A lens is refined until all lines are on such circles (plumb lines;
D. C. Brown, "Close-range camera calibration", 1971; on the sphere: F. Devernay and O. Faugeras,
"Straight lines have to be straight", 2001).

Straightness leaves one number open. Any linear map of space keeps planes through the camera planes,
and those that are round about the axis are tan(theta) -> s tan(theta): every s makes a lens under
which the lines are as straight. 90 degrees stays where it is. So the scale comes from elsewhere:

- lines that are known to be parallel and at right angles in the world (a building's) settle it;
- the angle at one radius is kept, that of the image circle (the field of view that was told). Near
  90 degrees from the axis it hardly tells s apart, d theta = sin(2 theta)/2 ds/s, at 90 not at all;
- then only what lenses are like remains: the slope dr/dtheta is SLOPE_SIGMA from that of the start.

Also kept: the pixels' aspect, and the centre within CENTER_SIGMA of the circle's radius, because a
shift of the centre is nearly a turn of the camera, which lines do not notice either.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..errors import CalibrationError
from ..lens import Floats, KannalaBrandt, growth_limit, radius_slope, vector
from ._great_circles import Line, LinePoints, best_circles
from ._line_solver import (
    CENTER_SIGMA,
    MOST_TERMS,
    RADIUS_SIGMA,
    Found,
    LineProblem,
    as_kannala_brandt,
    powers,
)

FEWEST_LINES = 4
FEWEST_POINTS = 3  # on a line; two always have a straight line through them
TELLING_PX = 0.1  # a line whose bend changes by less when the lens does by BEND says nothing
BEND = 0.1
THROUGH_CENTER_DEG = 3.0
FIELD_ERROR_DEG = 1.0
RIM_WITHIN = 1.5  # of the field: farther out the rim is not looked for
WORST_LINE = 3.0  # times the median of all lines' RMS is no straight line
LEAST_WORST_PX = 0.5
STRAY, LEAST_STRAY_PX = 10.0, 3.0  # times the median of its line, and pixels: a wrong click
ROUNDS = 6

Bools = NDArray[np.bool_]

__all__ = [
    "Line",
    "LineFit",
    "as_kannala_brandt",
    "check_telling",
    "great_circles",
    "line_distances",
    "refine",
    "telling_px",
]


@dataclass(frozen=True)
class LineFit:
    """A camera under which lines are straight, and what is known about it. Less sure than a board.

    start, camera      before and after; the same size, field and aspect
    lines, kept        all lines, without points that are clearly wrong, and (n,) which of them
                       counted
    before, after      distances of each line's points from its great circle, pixels, signed
    covariance         (k, k) of f, k1 to k4, center x, y, with everything that was assumed but
                       the errors of what was told; terms that were not sought have zeros
    scale_sigma        standard deviation of ln s in tan(theta) -> s tan(theta)
    rim_deg, rim_sigma_deg  full field of view where the lines alone, without being told, put the
                       image circle; NaN where they put it nowhere
    noise_px           of a point, by its distance from its circle
    together           so many points of a line err as one: how much less they say
    """

    start: Camera
    camera: Camera
    lines: tuple[Line, ...]
    kept: Bools
    before: tuple[Floats, ...]
    after: tuple[Floats, ...]
    covariance: Floats
    scale_sigma: float
    rim_deg: float
    rim_sigma_deg: float
    noise_px: float
    together: float

    @property
    def rms_before_px(self) -> float:
        """Root mean square over the points of the lines that counted."""
        return self._rms(self.before)

    @property
    def rms_px(self) -> float:
        """The same, after."""
        return self._rms(self.after)

    def radius_sigma_px(self, theta: Floats) -> Floats:
        """Standard deviation of the lens's radius at angles (n,) from the axis, pixels."""
        lens = self.camera.lens
        assert isinstance(lens, KannalaBrandt)
        odd = powers(theta, MOST_TERMS)
        by_f = lens.radius(theta) / lens.f
        slopes = np.column_stack([by_f, lens.f * odd[:, 1:]])
        return np.sqrt(np.einsum("ni,ij,nj->n", slopes, self.covariance[:5, :5], slopes))

    def _rms(self, parts: Sequence[Floats]) -> float:
        counted = [part for part, kept in zip(parts, self.kept, strict=True) if kept]
        return float(np.sqrt(np.mean(np.concatenate(counted) ** 2)))


def line_distances(camera: Camera, lines: Sequence[Line]) -> tuple[Floats, ...]:
    """Signed distances in pixels of each line's points from the great circle nearest to them."""
    points = LinePoints.of(lines)
    found = best_circles(camera, points, LEAST_WORST_PX)[1]
    return tuple(np.split(found, points.first[1:]))


def refine(
    camera: Camera,
    lines: Sequence[Line],
    *,
    terms: int = MOST_TERMS,
    field_error_deg: float = FIELD_ERROR_DEG,
    radius_error_px: float | None = None,
    center_error_px: float = 0.0,
    ask_rim: bool = True,
) -> LineFit:
    """The Kannala-Brandt camera near this one under which lines are straight.

    terms              how many of k1 to k4 are sought
    field_error_deg    standard deviation of the camera's field, from edge to edge
    radius_error_px, center_error_px  of the image circle's radius and centre
    ask_rim            find out too what the lines alone say of the field; else it is NaN

    The result's field ends at the same radius. CalibrationError where there are too few lines,
    lines of two points, or only lines that every lens shows straight.
    """
    if not 1 <= terms <= MOST_TERMS:
        raise CalibrationError(f"1 to {MOST_TERMS} terms can be sought, not {terms}")
    usable = _without_strays(camera, _checked(lines))
    check_telling(as_kannala_brandt(camera), usable)
    problem = _problem(camera, terms, field_error_deg, radius_error_px, center_error_px)
    found, kept = _solved(problem, usable)
    half, _ = _rim(camera, found)
    if np.isnan(half):
        half = growth_limit(found.camera.lens, camera.theta_max)
    rim = rim_sigma = float("nan")
    if ask_rim:
        counted = [line for line, k in zip(usable, kept, strict=True) if k]
        rim, rim_sigma = _rim(
            camera, replace(problem, radius_error_px=1e6).solved(counted, found.camera)
        )
    fitted = replace(found.camera, theta_max=half)
    return LineFit(
        camera,
        fitted,
        tuple(usable),
        kept,
        line_distances(camera, usable),
        line_distances(fitted, usable),
        found.covariance,
        float(np.sqrt(found.covariance[0, 0]) / vector(fitted.lens)[0]),
        float(np.degrees(2 * rim)),
        float(np.degrees(2 * rim_sigma)),
        found.noise_px,
        found.together,
    )


def _problem(
    camera: Camera,
    terms: int,
    field_error_deg: float,
    radius_error_px: float | None,
    center_error_px: float,
) -> LineProblem:
    at = np.array([camera.theta_max * (1 - 1e-4)])
    rim_px, slope = float(camera.lens.radius(at)[0]), float(radius_slope(camera.lens, at)[0])
    radius_error = RADIUS_SIGMA * rim_px if radius_error_px is None else radius_error_px
    return LineProblem(
        camera,
        terms,
        float(np.hypot(max(radius_error, 1e-3), slope * np.radians(field_error_deg) / 2)),
        float(np.hypot(CENTER_SIGMA * rim_px, center_error_px)),
    )


def _solved(problem: LineProblem, lines: Sequence[Line]) -> tuple[Found, Bools]:
    """With those lines that turn out straight, (n,)."""
    kept = np.ones(len(lines), dtype=bool)
    near = None
    for _ in range(ROUNDS):
        found = problem.solved([line for line, k in zip(lines, kept, strict=True) if k], near)
        near = found.camera
        good = _straight_enough(line_distances(found.camera, lines))
        if good.sum() < FEWEST_LINES:
            raise CalibrationError(
                f"only {good.sum()} of {len(lines)} lines are straight under one and the same "
                f"lens; at least {FEWEST_LINES} are needed: are they straight in the world?"
            )
        if (good == kept).all():
            break
        kept = good
    return found, kept


def _checked(lines: Sequence[Line]) -> list[Line]:
    if not lines:
        raise CalibrationError(
            "no lines: nothing straight was found or told; click points along straight things "
            "into a CSV (name,line,x,y), or take a picture with long straight edges off the middle"
        )
    for line in lines:
        if line.pixels.ndim != 2 or not np.isfinite(line.pixels).all():
            raise CalibrationError(f"line {line.name}: its points are no pixels (n, 2)")
        if len(line.pixels) < FEWEST_POINTS:
            raise CalibrationError(
                f"line {line.name} has {len(line.pixels)} points; two are always in a straight "
                f"line, so at least {FEWEST_POINTS} are needed, better 5 or more"
            )
    if len(lines) < FEWEST_LINES:
        raise CalibrationError(
            f"{len(lines)} lines are too few: at least {FEWEST_LINES}, better 20, in different "
            "directions and parts of the picture"
        )
    for picture in dict.fromkeys(line.picture for line in lines if line.along):
        _check_directions([line for line in lines if line.along and line.picture == picture])
    return list(lines)


def _without_strays(camera: Camera, lines: Sequence[Line]) -> list[Line]:
    """Without points that are far off where the rest of their line is nearly straight already."""
    usable = []
    for line, off in zip(lines, line_distances(camera, lines), strict=True):
        near = np.abs(off) < max(STRAY * float(np.median(np.abs(off))), LEAST_STRAY_PX)
        enough = near.sum() >= FEWEST_POINTS
        usable.append(replace(line, pixels=line.pixels[near]) if enough else line)
    return usable


def _check_directions(lines: Sequence[Line]) -> None:
    """Of one picture: at most three, at least two, one of them told by two lines."""
    names = [line.along for line in lines]
    known = ", ".join(dict.fromkeys(names))
    where = f" in {lines[0].picture}" if lines[0].picture else ""
    if len(set(names)) > 3:
        raise CalibrationError(
            f"lines along {known}{where}: there are no more than three directions at right angles"
        )
    if len(set(names)) < 2 or max(map(names.count, names)) < 2:
        raise CalibrationError(
            f"lines along {known}{where}: at least two directions at right angles are needed, and "
            "two lines along one of them; or leave the column 'along' empty"
        )


def check_telling(camera: Camera, lines: Sequence[Line]) -> None:
    """CalibrationError unless FEWEST_LINES of these lines would bend under another lens."""
    points = LinePoints.of(lines)
    normal = best_circles(camera, points, LEAST_WORST_PX)[0]
    aside = np.abs(normal[:, 2]) > np.sin(np.radians(THROUGH_CENTER_DEG))
    telling = aside & (telling_px(camera, lines) > TELLING_PX)
    if telling.sum() >= FEWEST_LINES:
        return
    if aside.sum() < FEWEST_LINES:
        raise CalibrationError(
            "the lines go through the middle of the picture, where they are straight under every "
            f"round lens: at least {FEWEST_LINES} long ones off the middle are needed, better near "
            "the rim"
        )
    raise CalibrationError(
        f"only {telling.sum()} of {len(lines)} lines are long enough to say anything about the "
        f"lens; at least {FEWEST_LINES} are needed: longer ones, off the middle of the picture"
    )


def telling_px(camera: Camera, lines: Sequence[Line]) -> Floats:
    """How much each line (n,) bends, pixels, when a lens does by a tenth, as a whole or inside."""
    half, lens = camera.theta_max, camera.lens
    assert isinstance(lens, KannalaBrandt)
    k1 = BEND / half**2
    others = (
        replace(lens, f=lens.f * (1 + BEND)),
        replace(lens, f=lens.f / (1 + BEND), k1=lens.k1 + k1, k2=lens.k2 + lens.k1 * k1),
    )
    now = line_distances(camera, lines)
    most = np.zeros(len(lines))
    for other in others:
        bent = line_distances(replace(camera, lens=other), lines)
        moved = [np.sqrt(np.mean((b - a) ** 2)) for a, b in zip(now, bent, strict=True)]
        most = np.maximum(most, moved)
    return most


def _straight_enough(parts: Sequence[Floats]) -> Bools:
    each = np.array([np.sqrt(np.mean(part**2)) for part in parts])
    return np.asarray(each <= max(WORST_LINE * float(np.median(each)), LEAST_WORST_PX))


def _rim(told: Camera, found: Found) -> tuple[float, float]:
    """The angle, and its sigma, where the told rim's radius is under the found lens; radians.

    NaN where that lens has no such radius.
    """
    half, lens = told.theta_max, found.camera.lens
    rim_px = float(told.lens.radius(np.array([half]))[0])
    theta = np.linspace(0, growth_limit(lens, min(np.pi, RIM_WITHIN * half)), 8001)
    radius = lens.radius(theta)
    if rim_px >= radius[-1]:  # it stops growing before
        return float("nan"), float("nan")
    at = float(np.interp(rim_px, radius, theta))
    count = 1 + found.terms
    by_values = powers(np.array([at / half]), found.terms)[0]
    slope = float(radius_slope(lens, np.array([at]))[0])
    variance = float(by_values @ found.spread[:count, :count] @ by_values)
    return at, float(np.sqrt(variance)) / max(slope, 1e-6)


def great_circles(camera: Camera, lines: Sequence[Line]) -> Iterator[Floats]:
    """For each line the pixels (n, 2) of its great circle where it is seen, between its ends."""
    points = LinePoints.of(lines)
    for line, normal in zip(lines, best_circles(camera, points, LEAST_WORST_PX)[0], strict=True):
        rays = camera.ray(line.pixels)
        rays = rays[np.isfinite(rays[:, 2])]
        if not len(rays):
            yield np.zeros((0, 2))
            continue
        middle = rays.mean(axis=0)
        along = np.cross(normal, middle)
        along /= np.linalg.norm(along)
        ahead = np.cross(along, normal)
        angles = np.arctan2(rays @ along, rays @ ahead)
        turn = np.linspace(angles.min(), angles.max(), 100)[:, None]
        pixels = camera.project(np.cos(turn) * ahead + np.sin(turn) * along)
        yield pixels[np.isfinite(pixels[:, 0])]
