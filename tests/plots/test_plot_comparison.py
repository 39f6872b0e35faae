"""The figure of a comparison shows its numbers."""

from __future__ import annotations

import numpy as np
import pytest
from drawn import image_of, panels
from matplotlib.quiver import Quiver

from freelook.camera import make_camera
from freelook.comparison import compare
from freelook.lens import Equidistant
from freelook.plots.comparison import comparison_figure

A = make_camera((960, 720), Equidistant(280.0), field_deg=188)
B = make_camera((960, 720), Equidistant(282.8), field_deg=180, center=(483.5, 362.5))


def test_maps_arrows_and_curves_are_the_numbers() -> None:
    found = compare(A, B, columns=60)
    figure = comparison_figure(A, B, found, "A and B")
    as_is, turned, pixels, degrees = panels(figure)
    shown, _ = image_of(as_is)
    np.testing.assert_allclose(shown, np.where(found.as_is.common, found.as_is.distance_px, np.nan))
    assert np.isnan(shown[0, 0])
    (arrows,) = [one for one in as_is.get_children() if isinstance(one, Quiver)]
    assert np.mean(np.asarray(arrows.U)) > 0  # to the right, as B's picture is moved
    assert np.mean(np.asarray(arrows.V)) > 0  # and down
    turn_deg = np.degrees(found.a_from_b.magnitude())
    assert turned.get_title(loc="left") == f"After a turn of {turn_deg:.3g}°"
    for axes, unit in ((pixels, "pixels"), (degrees, "degrees")):
        assert axes.get_ylabel() == unit
        assert len(axes.get_lines()) == 2
    rms = np.asarray(pixels.get_lines()[0].get_ydata(), dtype=float)
    assert rms[0] == pytest.approx(5)
    assert np.isnan(rms[-1])  # B ends before A's rim


def test_two_that_are_the_same_are_drawn_too() -> None:
    comparison_figure(A, A, compare(A, A, columns=40), "A and A").draw_without_rendering()
