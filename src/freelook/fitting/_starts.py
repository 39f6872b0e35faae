"""Where a fit begins: lenses of a model that are roughly right for measured radii."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..errors import FitError
from ..lens import Lens, RadialSpline, vector
from ._curve_data import CurveData
from ._models import default_lens, fine_lens, lens_with, let_free, radius_of, scaled

FEW = 3


def starting_curves(
    model: str,
    data: CurveData,
    fine_knots: int | None = None,
    held: Sequence[str] = (),
) -> list[tuple[Lens, float]]:
    """A few simple lenses of a model, with offsets in pixels.

    They have the scale that suits the measured radii; all other parameters of the first are at
    their defaults; the others, the best of many, have one of them changed: some models have more
    than one valley to end in.
    """
    found = [
        start
        for shape in _shapes(model, data, fine_knots, held)
        if (start := _scaled(shape, data)) is not None
    ]
    if not found:
        raise FitError(f"no {model} lens comes near these radii; do they grow with the angle?")
    plain = found[0]  # all at their defaults
    # found out by trying: models of many parameters reach their deepest valley from anywhere
    most = 3 if len(vector(plain[1])) <= FEW else 1
    found.sort(key=lambda start: start[0])
    kept = [plain, *(start for start in found[:most] if start is not plain)]
    return [(lens, offset) for _, lens, offset in kept]


def _shapes(model: str, data: CurveData, fine_knots: int | None, held: Sequence[str]) -> list[Lens]:
    """Lenses of a model with scale 1: all defaults, then one parameter changed at a time."""
    plain = (
        fine_lens(model, data.theta_max, fine_knots)
        if fine_knots
        else default_lens(model, data.theta_max, knots_for(len(data.theta)))
    )
    x = vector(plain)
    shapes: list[Lens | None] = [plain]
    if not isinstance(plain, RadialSpline):  # there every parameter is a radius
        changes = np.diag(np.full(len(x), 0.3))
        changes[0] = 0  # the scale
        for change in changes[let_free(plain, held) & changes.any(axis=1)]:
            shapes += [lens_with(plain, x + change), lens_with(plain, x - change)]
    return [shape for shape in shapes if shape is not None]


def knots_for(points: int) -> int:
    """How many knots a radial spline gets: at least three points for each."""
    return int(np.clip(points // 3, 2, 8))


def _scaled(shape: Lens, data: CurveData) -> tuple[float, Lens, float] | None:
    """How far the shape misses most of the points at the scale that suits them, and the rest."""
    with np.errstate(all="ignore"):
        one = radius_of(shape, np.abs(data.theta)) * np.sign(data.theta)
    if not np.isfinite(one).all():
        return None
    columns = np.stack([one, np.ones_like(one)][: 2 if data.free_offset else 1], axis=-1)
    weight = 1 / data.sigma_px
    for _ in range(10):  # towards least absolute deviations: outliers do not pull
        answer = np.linalg.lstsq(columns * weight[:, None], data.position_px * weight)[0]
        miss = np.abs(data.position_px - columns @ answer) / data.sigma_px
        weight = 1 / np.sqrt(np.maximum(miss, 1e-3 * miss.max() + 1e-12)) / data.sigma_px
    lens = scaled(shape, float(answer[0]))
    if answer[0] <= 0 or lens is None:
        return None
    return float(miss.mean()), lens, float(answer[-1]) if data.free_offset else 0.0
