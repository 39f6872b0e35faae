"""What a fit has to know about lens models: which can be started from what, and where they end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, fields

import numpy as np
from numpy.typing import NDArray

from ..errors import FitError, ProfileError
from ..lens import MODELS, Floats, Lens, OCamCalib, RadialSpline, growth_limit, vector, with_vector

PLACES = 91
RECTILINEAR = ("perspective", "poly3", "poly5", "ptlens", "opencv_rational")

Bools = NDArray[np.bool_]


def known_model(name: str) -> type[Lens]:
    """The class of a model; FitError that lists those there are."""
    if name not in MODELS:
        raise FitError(f"unknown lens model '{name}'; known: {', '.join(MODELS)}")
    return MODELS[name]


def default_lens(name: str, theta_max: float, knots: int) -> Lens:
    """A lens of a model with scale 1 and everything else at its default.

    A radial spline gets so many knots at equal steps to theta_max (radians). FitError for a model
    that has neither.
    """
    model = known_model(name)
    if model is RadialSpline:
        angles = np.linspace(0, theta_max * (1 + 1e-9), knots + 1)[1:]
        return RadialSpline(tuple(map(float, np.degrees(angles))), tuple(map(float, angles)))
    if sum(f.default is MISSING for f in fields(model)) > 1:  # type: ignore[arg-type]
        raise FitError(f"{name} has no lens to start a fit from")
    return model(1.0)  # type: ignore[call-arg]


def fine_lens(name: str, theta_max: float, knots: int) -> Lens:
    """As `default_lens`, with as many knots or terms as help where there is no noise."""
    if name == "ocamcalib":
        return OCamCalib(1.0, (*OCamCalib.taylor, 0.0, 0.0, 0.0))
    return default_lens(name, theta_max, knots)


def scaled(lens: Lens, factor: float) -> Lens | None:
    """The lens with all radii so many times as large."""
    x = vector(lens)
    x[slice(None) if isinstance(lens, RadialSpline) else slice(1)] *= factor
    return lens_with(lens, x)


def radius_of(lens: Lens, theta: Floats) -> Floats:
    """`lens.radius`, going on evenly beyond the angle where the formula ends.

    So a fit whose parameters pass through lenses that end early finds its way back.
    """
    end = min(lens.hard_limit, np.pi) * (1 - 1e-9)
    inside = np.minimum(theta, end)
    return np.asarray(lens.radius(inside) * (1 + theta - inside))


def lens_with(lens: Lens, x: Floats) -> Lens | None:
    """The lens with another vector, or None where there is no such lens."""
    try:
        changed = with_vector(lens, x)
        return changed if changed.hard_limit > 0 else None
    except (ProfileError, ValueError, ArithmeticError):
        return None


def slope_slack(lens: Lens, theta_max: float, least: float | None) -> Floats:
    """How much faster than `least` the radius grows, in shares of the mean slope, at 91 angles.

    From 0 to theta_max (radians); nothing, (0,), without a bound.
    """
    if least is None:
        return no_slack(least)
    theta = np.linspace(0, theta_max, PLACES)
    low, high = np.maximum(theta - 1e-4, 0), np.minimum(theta + 1e-4, theta_max)
    ends = radius_of(lens, np.concatenate([low, high, theta[-1:]]))
    slope = (ends[PLACES:-1] - ends[:PLACES]) / (high - low)
    mean = (abs(ends[-1]) + 1e-9 * np.abs(ends).max() + 1e-300) / theta_max
    return np.asarray(slope / mean - least)


def no_slack(least: float | None) -> Floats:
    """As many zeros as `slope_slack` has values."""
    return np.zeros(0 if least is None else PLACES)


def model_end(model: str) -> float:
    """The angle in radians that no lens of a model goes beyond.

    Models that become infinite at 90 degrees end at 85 here: five degrees more would be nine
    tenths of all pixels.
    """
    if model == "orthographic":
        return np.pi / 2 - 1e-3
    return np.radians(85.0) if model in RECTILINEAR else np.pi


def grows(lens: Lens, theta_max: float) -> bool:
    """Whether the lens is good for all angles up to theta_max (radians)."""
    return growth_end(lens, theta_max) >= theta_max * (1 - 1e-6)


def growth_end(lens: Lens, theta_max: float) -> float:
    """`growth_limit` up to theta_max, for any lens that a fit may come up with; 0 for nonsense."""
    if lens.hard_limit <= 0:
        return 0.0
    with np.errstate(all="ignore"):
        limit = growth_limit(lens, theta_max)
        ends = lens.radius(np.array([0.0, limit]))
    return limit if np.isfinite(ends).all() else 0.0


def check_end(model: str, theta_max: float) -> None:
    """FitError if no lens of a model goes as far as the data do."""
    ends = np.pi / 2 if model in (*RECTILINEAR, "orthographic") else np.pi
    if theta_max > ends - (1e-6 if model in RECTILINEAR else -1e-6):
        raise FitError(
            f"{model} lenses end at {np.degrees(ends):.0f} degrees from the axis; the data go to "
            f"{np.degrees(theta_max):.2f}"
        )


def check_growth(lens: Lens, theta_max: float, model: str) -> None:
    """FitError if a fitted lens ends, or stops growing, before theta_max (radians)."""
    if not grows(lens, theta_max):
        raise FitError(
            f"the {model} lens that comes nearest ends or stops growing at "
            f"{np.degrees(growth_end(lens, theta_max)):.2f} degrees from the axis; the data go to "
            f"{np.degrees(theta_max):.2f}"
        )


def let_free(lens: Lens, held: Sequence[str]) -> Bools:
    """(p,) bool: which entries of `vector(lens)` are not held; FitError for a name there is not."""
    names = free_names(lens)
    for name in held:
        if name not in names:
            raise FitError(f"this lens has no parameter '{name}' to hold; it has {names}")
    return np.array([name not in held for name in names])


def round_parameters(lens: Lens, theta: Floats) -> Bools:
    """(p,) bool: which entries of `vector(lens)` the radius depends on."""
    x = vector(lens)
    with np.errstate(all="ignore"):
        here = radius_of(lens, theta)
        moved = []
        for step in np.diag(1e-3 + 1e-3 * np.abs(x)):
            other = lens_with(lens, x + step)
            moved.append(other is None or not np.array_equal(radius_of(other, theta), here))
    return np.array(moved)


def free_names(lens: Lens) -> list[str]:
    """A name for every entry of `vector(lens)`; those of lists are numbered: `knots_px[0]`."""
    names: list[str] = []
    for item in fields(lens):  # type: ignore[arg-type]
        value = getattr(lens, item.name)
        if item.metadata.get("fixed"):
            continue
        many = isinstance(value, tuple)
        names += [f"{item.name}[{i}]" for i in range(len(value))] if many else [item.name]
    return names
