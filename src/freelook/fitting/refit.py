"""A camera of another lens model that projects as nearly the same as that model can.

Rays are taken evenly over the picture (so that every part of it counts by its area), some more
along its border and the rim of the field (for that is where lenses part). The parameters of the
new lens, its centre and the upper triangle of its stretch (fx, fy and skew of other programs) are
found by least squares. Where one model contains the other the result is the same lens to the last
digits; where not, the differences that remain are measured and told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..camera import Camera
from ..errors import FitError
from ..lens import MODELS, BentLens, Floats, Lens, image_point
from ..resolution import around_axis, inside_picture, places, ray_at, resolution_at, sample_places
from ._camera_problem import STRETCHES, CameraProblem
from ._cameras import fitted_camera
from ._curve_data import checked
from ._grown import HELD_SLOPES, grown
from ._minimum import ROUGH, Minimum
from ._models import known_model, let_free, model_end, round_parameters
from .curve import best_curve
from .splined import refit_splined

# The largest difference that counts as the same picture: half a pixel in 1000. Calibrations are
# seldom better than 0.3 pixels, and a straight edge bent by half a pixel still looks straight.
LIMIT_SHARE = 0.5e-3
COLUMNS_FIT, COLUMNS_CHECK = 36, 150
# of a radial spline; of a bent lens it can only follow the mean, and many would follow the rest
KNOTS, KNOTS_BENT = 32, 8
HOPELESS = 0.02  # of the picture


def limit_px(size: tuple[int, int]) -> float:
    """The largest difference, in pixels, that counts as the same picture of this size."""
    return LIMIT_SHARE * max(size)


@dataclass(frozen=True)
class Refit:
    """A camera and how far it is from the one it stands for.

    camera     the new one; its field may be smaller
    rms_px, max_px, rms_deg, max_deg   over the part of the picture that both see: where a ray
               lands, and which ray a pixel is taken for
    field_deg  full angle around the axis within which no pixel is off by more than `limit_px`
    seen       share of the old camera's image, as far as it is on the picture, that the new one
               sees too
    limit_px   the difference that counts as none
    """

    camera: Camera
    rms_px: float
    max_px: float
    rms_deg: float
    max_deg: float
    field_deg: float
    seen: float
    limit_px: float

    @property
    def holds(self) -> bool:
        """Whether it can stand for the old camera: sees all of it, nowhere off by more than the
        limit."""
        return self.seen >= 0.999 and self.max_px <= self.limit_px


def refit(
    camera: Camera,
    model: str,
    *,
    theta_max: float | None = None,
    stretch: str = "skew",
    held: Sequence[str] = (),
    limit: float | None = None,
) -> Refit:
    """The camera of a model that comes nearest to `camera`.

    theta_max  half of the field to keep, radians; None: all of it, or as far as the model goes
    stretch    what of the stretch is sought: "free", "skew" (upper triangle), "aspect" or "none"
    held       parameters of the model that stay at their defaults, for formats that lack them
    limit      the difference in pixels that counts as none; None: half a pixel in 1000

    FitError when no lens of the model comes near. A poor fit is no error: look at `holds`.
    """
    known_model(model)
    wanted = min(camera.theta_max, theta_max or np.inf)
    end = min(wanted, model_end(model))
    if stretch not in STRETCHES:
        raise FitError(f"unknown stretch '{stretch}'; known: {', '.join(STRETCHES)}")
    if model == "splined_stereographic":
        found = refit_splined(camera, end, stretch)
    else:
        rays = np.concatenate(field_rays(camera, end, COLUMNS_FIT))
        found = _fitted(camera, model, rays, end, stretch, held)
    limit = limit_px(camera.size) if limit is None else limit
    return measure(replace(camera, theta_max=wanted), found, limit)


def measure(old: Camera, new: Camera, limit: float) -> Refit:
    """How far `new` is from `old`, over the picture."""
    inner, edge = field_rays(old, old.theta_max, COLUMNS_CHECK)
    rays = np.concatenate([inner, edge])
    pixel, theta = old.project(rays), np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2])
    off_px = np.linalg.norm(new.project(rays) - pixel, axis=-1)
    seen = np.isfinite(off_px)
    if not seen.any():
        raise FitError("the new lens sees nothing of what the old one sees")
    even = np.arange(len(rays))[seen] < len(inner)  # of which the mean is taken
    off_deg = _off_deg(new, rays[seen], pixel[seen], off_px[seen])
    beyond = theta[~seen | (off_px > limit)]
    holds_to = min(float(beyond.min(initial=np.inf)), old.theta_max)
    return Refit(
        camera=new,
        rms_px=_rms(off_px[seen][even]),
        max_px=float(off_px[seen].max()),
        rms_deg=_rms(off_deg[even]),
        max_deg=float(off_deg.max()),
        field_deg=float(np.degrees(2 * holds_to)),
        seen=float(seen.mean()),
        limit_px=limit,
    )


def field_rays(camera: Camera, theta_max: float, columns: int) -> tuple[Floats, Floats]:
    """Unit rays even over the picture, and others along its border and the rim of the field.

    (n, 3) and (m, 3); none is farther from the axis than theta_max (radians).
    """
    inner = camera.ray(places(*sample_places(camera.size, columns)).reshape(-1, 2))
    rim = ray_at(np.array(theta_max * (1 - 1e-12)), around_axis(4 * columns))
    rim = rim[inside_picture(camera.project(rim), camera.size)]
    edge = np.concatenate([camera.ray(_border(camera.size, columns)), rim])
    inner, edge = _within(inner, theta_max), _within(edge, theta_max)
    if len(inner) < columns:
        raise FitError("next to nothing of this lens's field is on its picture")
    return inner, edge


def _within(rays: Floats, theta_max: float) -> Floats:
    rays = rays[np.isfinite(rays[:, 0])]
    return rays[np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2]) <= theta_max]


def _border(size: tuple[int, int], columns: int) -> Floats:
    """Places all around the outer edge of a picture, (n, 2)."""
    width, height = size
    along = np.linspace(0, 1, columns)
    x, y = along * width - 0.5, along * height - 0.5
    low, right, bottom = np.full(columns, -0.5), width - 0.5, height - 0.5
    sides = [(x, low), (x, low + bottom + 0.5), (low, y), (low + right + 0.5, y)]
    return np.concatenate([np.stack(side, axis=-1) for side in sides])


def _fitted(
    camera: Camera, model: str, rays: Floats, end: float, which: str, held: Sequence[str]
) -> Camera:
    pixel = camera.project(rays)
    same = type(camera.lens) is MODELS[model] and not held
    like = camera.lens if same else _start(camera, model, end, held)
    free = let_free(like, held)
    if not isinstance(camera.lens, BentLens):  # bent terms would only follow the picture's outline
        free &= round_parameters(like, np.linspace(0, end, 20))
    problem = CameraProblem(rays, pixel, like, free, camera.stretch, which)
    x = problem.start(np.asarray(camera.center))

    def fit(x: Floats, least_slope: float | None) -> Minimum:
        return problem.fit(x, end, loss="linear", least_slope=least_slope)

    if _is_hopeless(problem, x):
        found = problem.fit(x, end, loss="linear", least_slope=HELD_SLOPES[0], effort=ROUGH)
    else:
        found = grown(fit, problem.lens, x, end)
    lens = problem.lens(found.x)
    if lens is None:
        raise FitError(f"no {model} lens comes near this one")
    return fitted_camera(camera, lens, problem.center(found.x), problem.stretch_of(found.x), end)


def _is_hopeless(problem: CameraProblem, x: Floats) -> bool:
    """Whether even the nearest curve is so far off that the last digits do not matter."""
    return _rms(np.linalg.norm(problem.residuals_px(x), axis=1)) > HOPELESS * problem.size_px


def _start(camera: Camera, model: str, end: float, held: Sequence[str]) -> Lens:
    """The lens of the model whose radius is nearest, its centre and stretch left aside."""
    theta = np.linspace(0, end, 101)[1:]
    knots = KNOTS_BENT if isinstance(camera.lens, BentLens) else KNOTS
    data = checked(theta, _mean_radius(camera.lens, theta), None, False, "linear")
    problem, found = best_curve(model, data, fine_knots=knots, held=held)
    lens = problem.lens(found.x)
    assert lens is not None, "a fit ends where the parameters make sense"
    return lens


def _mean_radius(lens: Lens, theta: Floats) -> Floats:
    """Over all directions, of a lens that may be bent."""
    if not isinstance(lens, BentLens):
        return lens.radius(theta)
    phi = around_axis(72)[:, None]
    point = image_point(lens, *np.broadcast_arrays(theta, phi))
    away = np.stack(np.broadcast_arrays(np.cos(phi), np.sin(phi)), axis=-1)
    return np.asarray(np.sum(point * away, axis=-1).mean(axis=0))


def _off_deg(new: Camera, rays: Floats, pixel: Floats, off_px: Floats) -> Floats:
    """Angles between rays and what the new camera takes their old pixels for, degrees."""
    taken = np.linalg.norm(new.ray(pixel) - rays, axis=-1)
    angle = np.degrees(2 * np.arcsin(np.minimum(taken / 2, 1.0)))
    outside = np.isnan(angle)
    # just beyond the new rim no ray belongs to a pixel: the degrees that so many pixels are there
    least = resolution_at(new, rays[outside]).least
    angle[outside] = np.minimum(off_px[outside] / np.maximum(least, 1e-3), 180.0)
    return angle


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))
