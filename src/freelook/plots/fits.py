"""Lenses fitted to measured points: the curves, what they miss each point by, and the ranking."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..fitting import CurveFit, PointFit
from ._style import BLUE, COLORS, FAINT, GREEN, INK, ORANGE, new_figure, panel, style

MOST_CURVES = 5
MOST_RANKED = 16
STEMS = 400  # with more points than this only dots are drawn

Fit = CurveFit | PointFit


@style()
def fit_figure(fits: Sequence[Fit], title: str) -> Figure:
    """The first of `fits` in full, some of the others beside it; best first, at least one."""
    figure = new_figure(12, 9.6)
    figure.suptitle(title, x=0.01, ha="left")
    grid = figure.add_gridspec(2, 2)
    draw_curves(figure.add_subplot(grid[0, 0]), fits)
    draw_ranking(figure.add_subplot(grid[0, 1]), fits)
    draw_residuals(figure.add_subplot(grid[1, :]), fits)
    return figure


def draw_curves(axes: Axes, fits: Sequence[Fit]) -> None:
    """The measured points and the best few curves through them."""
    best = fits[0]
    theta, position = best.measured
    panel(axes, "Measured, and fitted", "angle from the axis, degrees", "position, pixels")
    along = _along(theta)
    for fit, color in reversed(list(zip(fits[:MOST_CURVES], COLORS, strict=False))):
        width = 2.6 if fit is best else 1.2
        axes.plot(np.degrees(along), _curve(fit, along), color=color, lw=width, label=_name(fit))
    out = best.outliers
    axes.plot(np.degrees(theta[~out]), position[~out], ".", color=INK, ms=5, label="measured")
    if out.any():
        axes.plot(np.degrees(theta[out]), position[out], "x", color=ORANGE, label="outliers")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[::-1], labels[::-1], loc="upper left")


def draw_residuals(axes: Axes, fits: Sequence[Fit]) -> None:
    """What the best curve misses each point by, away from the axis, and how sure the curve is.

    The next best are there as thin lines: how far they are from the best.
    """
    best = fits[0]
    theta, _ = best.measured
    residual, out = best.radial_residuals_px, best.outliers
    panel(
        axes,
        f"{_name(best)}: measured minus fitted",
        "angle from the axis, degrees",
        "pixels away from the axis",
    )
    along = _along(theta)
    band = best.band(along)
    for times, alpha in ((2, 0.15), (1, 0.25)):
        label = f"{times} standard deviation{'s' if times > 1 else ''} of the curve"
        axes.fill_between(
            np.degrees(along), -times * band, times * band, color=BLUE, alpha=alpha, label=label
        )
    axes.axhline(0, color=INK, lw=0.8)
    top = 1.25 * max(float(np.abs(residual[~out]).max()), 2 * float(np.nanmax(band)), 1e-9)
    if len(theta) <= STEMS:
        axes.vlines(np.degrees(theta), 0, np.clip(residual, -top, top), color=FAINT, lw=1)
    axes.plot(np.degrees(theta[~out]), residual[~out], "o", color=INK, ms=3.5, label="points")
    if out.any():
        shown = np.clip(residual[out], -0.97 * top, 0.97 * top)
        label = f"{out.sum()} outlier{'s' if out.sum() > 1 else ''}, perhaps beyond the edge"
        axes.plot(np.degrees(theta[out]), shown, "x", color=ORANGE, label=label)
    for fit, color in zip(fits[1:MOST_CURVES], COLORS[1:], strict=False):
        apart = _curve(fit, along) - _curve(best, along)
        label = f"{_name(fit)} minus {_name(best)}"
        axes.plot(np.degrees(along), apart, color=color, lw=1.2, label=label)
    axes.set_ylim(-top, top)
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5))


def draw_ranking(axes: Axes, fits: Sequence[Fit]) -> None:
    """How well each model fits the points it has seen, and predicts those it has not."""
    shown = fits[:MOST_RANKED]
    panel(axes, "Models, best first", "rms distance from the points, pixels", "")
    place = np.arange(len(shown))
    fitted, predicted = (
        [_kept_rms(fit, residuals) for fit, residuals in pairs]
        for pairs in (
            [(fit, fit.residuals_px) for fit in shown],
            [(fit, fit.cv_residuals_px) for fit in shown],
        )
    )
    axes.hlines(place, fitted, predicted, color=FAINT, lw=2)
    axes.plot(fitted, place, "o", color=BLUE, label="seen")
    axes.plot(predicted, place, "D", color=GREEN, ms=5, label="left out, predicted")
    axes.set_yticks(place, [f"{_name(fit)} ({len(fit.names)})" for fit in shown])
    axes.set_ylim(len(shown) - 0.5, -0.5)
    if min(*fitted, *predicted) > 0 and max(predicted) > 20 * min(fitted):
        axes.set_xscale("log")
    else:
        axes.set_xlim(left=0)
    axes.grid(axis="y", visible=False)
    axes.legend(title="points", loc="best")


def _along(theta: np.ndarray) -> np.ndarray:
    low = min(0.0, float(theta.min()))
    return np.linspace(low, float(theta.max()), 400)


def _curve(fit: Fit, theta: np.ndarray) -> np.ndarray:
    return fit(np.abs(theta)) * np.sign(theta) if isinstance(fit, PointFit) else fit(theta)


def _kept_rms(fit: Fit, residuals: np.ndarray) -> float:
    kept = residuals[~fit.outliers].reshape(int((~fit.outliers).sum()), -1)
    return float(np.sqrt(np.mean(np.sum(kept**2, axis=1))))


def _name(fit: Fit) -> str:
    return fit.model.replace("_", " ")
