"""Cameras whose calibration is known, and measures of how far a calibration is from them."""

from __future__ import annotations

import numpy as np

from freelook.bench.boards import Simulated, board, simulate
from freelook.bench.calibration_trials import apart
from freelook.calibration.bundle import Solution
from freelook.calibration.calibrate import Calibration
from freelook.calibration.field import seen_angle, with_field
from freelook.calibration.parameters import HELD, Freedom, Parameters
from freelook.calibration.uncertainty import projection_uncertainty
from freelook.calibration.views import View
from freelook.camera import Camera, make_camera
from freelook.fitting.refit import refit
from freelook.lens import (
    MODELS,
    Equisolid,
    Floats,
    KannalaBrandt,
    Lens,
    RadialSpline,
    growth_limit,
    parameters,
    vector,
    with_vector,
)

SIZE = (1280, 960)
CENTER = (700.0, 430.0)  # 60 and 50 pixels from the middle
STRETCH = np.diag([1.0, 1.004])
RIM_PX = 470.0
BOARD = board(9, 6)
# Full field to the shape of r(theta): TUM VI's lens, an ideal one, a bend of its own.
SHAPES: dict[int, Lens] = {
    188: KannalaBrandt(1.0, 0.00348, 0.000715, -0.002053, 0.000203),
    200: Equisolid(1.0),
    160: KannalaBrandt(1.0, -0.05, 0.01, -0.004, 0.0004),
    100: KannalaBrandt(1.0, 0.1, 0.02),
}
RECTILINEAR = ("perspective", "poly3", "poly5", "ptlens", "opencv_rational")
# How a lens that is not round is bent.
BENDS: dict[str, dict[str, float]] = {
    "mei": {"p1": 0.001, "p2": -0.0006},
    "thin_prism_fisheye": {"p1": 0.001, "p2": -0.0006, "sx1": 0.0008, "sy1": -0.0012},
    "rad_tan_thin_prism_fisheye": {"p0": 0.001, "p1": -0.0006, "s0": 0.0008, "s2": -0.0012},
    "opencv_rational": {"p1": 0.001, "p2": -0.0006},
}


def fields_of(model: str) -> tuple[int, ...]:
    """The full fields, in degrees, that a model is tested with."""
    if model in RECTILINEAR:
        return (100,)
    return (160,) if model == "orthographic" else (188, 200, 160)


def truth(model: str, field_deg: int = 188) -> Camera:
    """A camera with an off-centre lens of a model that is like the shape for that field."""
    shape = SHAPES[field_deg]
    rim = float(shape.radius(np.radians([field_deg / 2]))[0])
    f, *others = vector(shape)
    base = _camera(with_vector(shape, [f * RIM_PX / rim, *others]), field_deg)
    if model == "radial_spline":
        return _camera(_spline(base.lens, field_deg), field_deg)
    held = HELD.get(MODELS[model], ())
    lens = refit(base, model, stretch="none", held=held).camera.lens
    lens = MODELS[model](**{**parameters(lens), **BENDS.get(model, {})})
    return _camera(lens, min(field_deg, 2 * np.degrees(growth_limit(lens)) * 0.999))


def _camera(lens: Lens, field_deg: float) -> Camera:
    return make_camera(SIZE, lens, center=CENTER, field_deg=float(field_deg), stretch=STRETCH)


def _spline(lens: Lens, field_deg: int) -> RadialSpline:
    knots = np.linspace(0, field_deg / 2 + 2, 9)[1:]
    return RadialSpline(tuple(knots.tolist()), tuple(lens.radius(np.radians(knots)).tolist()))


def views_of(
    camera: Camera, count: int, seed: int, *, noise_px: float = 0.2, outliers: float = 0.0
) -> Simulated:
    rng = np.random.default_rng(seed)
    return simulate(camera, BOARD, count, rng, noise_px=noise_px, outliers=outliers)


def sigmas_off(camera: Camera, calibration: Calibration) -> float:
    """How far a calibration is from the truth, in its own stated standard deviations: root mean
    square over places where points were seen."""
    pixels = some_pixels(calibration.views, calibration.solution)
    found, free = calibration.camera, calibration.freedom
    stated = projection_uncertainty(found, calibration.solution, free, pixels).sigma_px
    seen = np.isfinite(stated)
    off = apart(camera, found, pixels[seen])
    # `stated` is that of the worse direction; a distance has two
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1)) / np.mean(2 * stated[seen] ** 2)))


def some_pixels(views: tuple[View, ...], solution: Solution, most: int = 200) -> Floats:
    """Pixels of points that count, evenly chosen."""
    pixels = np.concatenate([v.pixels[ok] for v, ok in zip(views, solution.inliers, strict=True)])
    chosen = np.linspace(0, len(pixels) - 1, min(len(pixels), most)).astype(int)
    return np.asarray(pixels[chosen])


def squared_sigmas(camera: Camera, solution: Solution, freedom: Freedom) -> tuple[float, int]:
    """Squared Mahalanobis distance of all parameters from the truth, and how many they are.

    By the covariance of the solution with independent errors: simulated errors are.
    """
    found = Parameters(solution.camera, freedom).values
    right = Parameters(camera, freedom).values
    if isinstance(camera.lens, RadialSpline):  # its knots may be elsewhere: compare the radii
        assert isinstance(solution.camera.lens, RadialSpline)
        knots = np.radians(solution.camera.lens.angles_deg)
        right = np.concatenate([camera.lens.radius(knots), right[-3:]])
    covariance = solution.covariance / solution.together**2
    scale = np.sqrt(np.diag(covariance))
    off = (found - right) / scale
    return float(off @ np.linalg.solve(covariance / np.outer(scale, scale), off)), len(found)


def field_camera(solution: Solution, views: tuple[View, ...]) -> Camera:
    return with_field(solution.camera, seen_angle(solution, views))
