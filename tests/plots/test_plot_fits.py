"""The figure of fits shows the points, the best curve's uncertainty, and every model."""

from __future__ import annotations

import numpy as np
import pytest
from drawn import panels
from matplotlib.collections import LineCollection

from freelook.camera import make_camera
from freelook.fitting import fit_curve, fit_points, rank
from freelook.lens import Equisolid
from freelook.plots.fits import fit_figure

DEGREES = np.arange(3.0, 88, 3)


def test_curves_residuals_and_ranking(rng: np.random.Generator) -> None:
    radius = Equisolid(300).radius(np.radians(DEGREES)) + rng.normal(0, 0.3, len(DEGREES))
    radius[7] += 30
    fits = rank(
        [fit_curve(name, np.radians(DEGREES), radius) for name in ("equidistant", "equisolid")]
    )
    curves, ranking, residuals = panels(fit_figure(fits, "lens"))
    best = fits[0]
    measured = next(line for line in curves.get_lines() if line.get_label() == "measured")
    np.testing.assert_allclose(
        np.sort(np.asarray(measured.get_xdata(), float)), np.delete(DEGREES, 7)
    )
    outliers = next(line for line in curves.get_lines() if line.get_label() == "outliers")
    np.testing.assert_allclose(np.asarray(outliers.get_xdata(), float), [DEGREES[7]])
    names = [label.get_text() for label in ranking.get_yticklabels()]
    assert names == ["equisolid (1)", "equidistant (1)"]
    stems = [each for each in residuals.get_children() if isinstance(each, LineCollection)]
    assert sum(len(each.get_segments()) for each in stems) == len(DEGREES)
    dots = next(line for line in residuals.get_lines() if line.get_label() == "points")
    np.testing.assert_allclose(np.asarray(dots.get_ydata(), float), np.delete(best.residuals_px, 7))
    labels = [text.get_text() for text in residuals.get_legend().get_texts()]  # type: ignore[union-attr]
    assert "1 standard deviation of the curve" in labels
    assert "equidistant minus equisolid" in labels


@pytest.mark.parametrize("count", [30, 500])
def test_points_of_a_camera(count: int, rng: np.random.Generator) -> None:
    camera = make_camera((800, 800), Equisolid(300), field_deg=160)
    theta, phi = rng.uniform(0.05, 1.35, count), rng.uniform(0, 6.28, count)
    sine = np.sin(theta)
    ray = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)
    pixel = camera.project(ray) + rng.normal(0, 0.3, (count, 2))
    figure = fit_figure([fit_points("equisolid", ray, pixel, camera.size)], "points")
    residuals = panels(figure)[2]
    dots = next(line for line in residuals.get_lines() if line.get_label() == "points")
    assert len(dots.get_xdata()) == count  # type: ignore[arg-type]
    stems = [each for each in residuals.get_children() if isinstance(each, LineCollection)]
    assert bool(stems) == (count == 30)  # too many would be one black mass
