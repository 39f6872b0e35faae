"""Does it ever fail? Calibrations of random lenses, each measured by its own stated uncertainty.

Every round lens model in turn, bent at random, over 160, 188 or 200 degrees (those that end before
go as far as they can), its centre up to 8 % of the picture off, 12 views of 54 corners with 0.1 to
0.5 px of noise and a fifth of the corners wrong. A trial fails if there is no result, if a view is
dropped, if a wrong corner counts that is plainly off, or if the projection is off by more than
three times what is stated. Of 200 good ones, chance lets none be.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ..calibration.calibrate import Calibration, calibrate
from ..calibration.minimise import REJECT
from ..calibration.parameters import HELD
from ..calibration.slopes import project
from ..calibration.uncertainty import grid_of, projection_covariance
from ..camera import Camera, make_camera
from ..errors import FreelookError
from ..fitting.refit import refit
from ..lens import (
    MODELS,
    Equidistant,
    Floats,
    KannalaBrandt,
    Lens,
    RadialSpline,
    growth_limit,
)
from .boards import Simulated, board, simulate

SIZE = (1280, 960)
RIM_PX = 470.0  # from the axis to the edge of the field
OFF_CENTER = 0.08  # of the picture's size
BENDS = (0.02, 0.006, 0.002, 0.0003)  # k1 to k4 of a bent lens, standard deviations
VIEWS = 12
OUTLIERS = 0.2
MOST_SIGMAS = 3.0
FIELDS_DEG = (188, 200, 160)
NARROW_DEG = 100  # of those that end at 90 degrees from the axis
PLACES = 200


@dataclass(frozen=True)
class Trial:
    """sigmas: how far the projection is from the truth where corners were seen, root mean square,
    in units of what is stated for it (1 is right on average). failed: why, if it did."""

    seed: int
    model: str
    field_deg: float
    noise_px: float
    sigmas: float = float("nan")
    failed: str = ""


@dataclass(frozen=True)
class Summary:
    """spread: of all trials' errors, in units of what is stated."""

    trials: int
    failed: int
    within: int
    worst: float
    spread: float

    @classmethod
    def of(cls, trials: Sequence[Trial]) -> Summary:
        sigmas = np.array([t.sigmas for t in trials if np.isfinite(t.sigmas)])
        return cls(
            len(trials),
            sum(bool(t.failed) for t in trials),
            int((sigmas <= MOST_SIGMAS).sum()),
            float(sigmas.max(initial=0)),
            float(np.sqrt(np.mean(sigmas**2))) if len(sigmas) else float("nan"),
        )


def round_models() -> list[str]:
    """All that can be calibrated and are round."""
    return [name for name, kind in MODELS.items() if not hasattr(kind, "offset")]


def run(
    count: int, model: str | None = None, *, progress: Callable[[], None] = lambda: None
) -> Iterator[Trial]:
    """`model` asked for; None: the one that the lens is of."""
    for seed in range(count):
        yield trial(seed, model)
        progress()


def trial(seed: int, model: str | None = None) -> Trial:
    models = round_models()
    name = models[seed % len(models)]
    rng = np.random.default_rng(seed)
    camera = _camera(name, rng)
    noise = float(rng.uniform(0.1, 0.5))
    about = (seed, name, float(np.degrees(2 * camera.theta_max)), noise)
    made = simulate(camera, board(9, 6), VIEWS, rng, noise_px=noise, outliers=OUTLIERS)
    try:
        found = calibrate(made.views, camera.size, model or name)
    except FreelookError as error:
        return Trial(*about, failed=str(error))
    sigmas = sigmas_off(camera, found)
    return Trial(*about, sigmas, _fault(found, made, noise, sigmas))


def _fault(found: Calibration, made: Simulated, noise_px: float, sigmas: float) -> str:
    if found.dropped:
        return f"{found.dropped[0][0]} dropped: {found.dropped[0][1]}"
    limit = 2 * REJECT * noise_px
    for residuals, counts, good in zip(
        found.solution.residuals, found.solution.inliers, made.good, strict=True
    ):
        if (np.linalg.norm(residuals, axis=1)[counts & ~good] > limit).any():
            return "a wrong corner counts"
    return f"off by {sigmas:.1f} of its standard deviations" if sigmas > MOST_SIGMAS else ""


def sigmas_off(camera: Camera, found: Calibration) -> float:
    """How far a calibration projects from where the true camera does, in what it states itself."""
    counted = zip(found.views, found.solution.inliers, strict=True)
    pixels = np.concatenate([view.pixels[ok] for view, ok in counted])
    pixels = pixels[np.linspace(0, len(pixels) - 1, min(len(pixels), PLACES)).astype(int)]
    stated = projection_covariance(found.camera, found.solution, found.freedom, pixels)
    seen = np.isfinite(stated[:, 0, 0])
    off = apart(camera, found.camera, pixels[seen])
    variance = np.trace(stated[seen], axis1=1, axis2=2)
    return float(np.sqrt(np.sum(off**2) / np.sum(variance)))


def apart(camera: Camera, found: Camera, pixels: Floats) -> Floats:
    """(n, 2) how far `camera` projects from where `found` does, for the rays of `pixels` in the
    latter, once it is turned so that both agree best over the whole field of the latter."""
    everywhere = found.ray(grid_of(found.size, 24))
    everywhere = everywhere[np.isfinite(everywhere[:, 2])]

    def off(turn: Floats, rays: Floats) -> Floats:
        turned: Floats = Rotation.from_rotvec(turn).apply(rays)
        return np.asarray(project(camera, turned) - project(found, rays))

    turn: Floats = least_squares(lambda t: off(t, everywhere).ravel(), np.zeros(3)).x
    return off(turn, found.ray(pixels))


def _camera(name: str, rng: np.random.Generator) -> Camera:
    """A random camera of a model; half of the field at most where its radius still grows."""
    unit: Lens = MODELS[name](1.0) if name != "radial_spline" else Equidistant(1.0)  # type: ignore[call-arg]
    wide = unit.hard_limit > np.pi / 2
    field = float(rng.choice(FIELDS_DEG)) if wide else float(NARROW_DEG)
    if name == "orthographic":
        field = 160.0
    shift = rng.uniform(-OFF_CENTER, OFF_CENTER, 2) * SIZE
    center = (float(SIZE[0] / 2 + shift[0]), float(SIZE[1] / 2 + shift[1]))
    stretch = np.diag([1.0, rng.uniform(0.99, 1.01)])
    base = make_camera(SIZE, _bent(field, rng), center=center, field_deg=field, stretch=stretch)
    lens = _of_model(name, base, unit)
    end = min(field, 2 * float(np.degrees(growth_limit(lens))) * 0.999)
    return make_camera(SIZE, lens, center=center, field_deg=end, stretch=stretch)


def _bent(field_deg: float, rng: np.random.Generator) -> Lens:
    """A lens near the equidistant one that grows up to the edge of the field and 2 degrees more."""
    half = np.radians(field_deg / 2)
    while True:
        terms = (rng.normal(0, 1, 4) * BENDS).tolist()
        unit = KannalaBrandt(1.0, *terms)
        if growth_limit(unit) > half + np.radians(2):
            return KannalaBrandt(RIM_PX / float(unit.radius(np.array([half]))[0]), *terms)


def _of_model(name: str, base: Camera, unit: Lens) -> Lens:
    """The model's lens that is nearest to the base's, where it has anything but a focal length."""
    half = base.theta_max
    if name == "radial_spline":
        knots = np.linspace(0, np.degrees(half) + 1, 9)[1:]
        radii = base.lens.radius(np.radians(knots))
        return RadialSpline(tuple(knots.tolist()), tuple(radii.tolist()))
    if name == "kannala_brandt":
        return base.lens
    return refit(base, name, stretch="none", held=HELD.get(MODELS[name], ())).camera.lens
