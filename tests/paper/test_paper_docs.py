"""docs/paper.md says what the code finds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from freelook.paper import parts, printed, views
from freelook.paper.exhibit import Settings
from freelook.paper.printed_models import NEAR, WHOLE, fits
from freelook.paper.projections import FISHEYES
from freelook.paper.rounding import Design, half_width_px

TEXT = (Path(__file__).parents[2] / "docs" / "paper.md").read_text("utf-8")


def test_numbers_of_equation_7() -> None:
    degrees, pixels = printed.lowest_point()
    assert (
        f"from {printed.QUINTIC[0]:.0f} pixels at 0 degrees to {pixels:.1f} at {degrees:.1f}"
        in TEXT
    )
    off = [float(half_width_px(np.array(theta))) for theta in (30.0, 60.0, 90.0)]
    assert "±{:.0f} pixels at 30 degrees, ±{:.0f} at 60, ±{:.0f} at 90".format(*off) in TEXT
    assert f"it is {printed.LINE[0]:.0f} pixels where the target is in the centre" in TEXT


def test_numbers_of_the_models() -> None:
    whole, near = ({fit.model: fit.rms_px for fit in fits(d, FISHEYES)} for d in (WHOLE, NEAR))
    order = ("equisolid", "equidistant", "orthographic")
    words = "by equisolid by {:.1f} pixels RMS, equidistant {:.1f}, orthographic {:.1f}"
    assert words.format(*(whole[model] for model in order)) in TEXT
    assert "below 60 degrees {:.1f}, {:.1f}, {:.1f}".format(*(near[m] for m in order)) in TEXT


def test_other_statements() -> None:
    assert Design(0, 90, 10).range_px(90.0) is None
    assert Design(10, 90, 10).range_px(90.0) is not None
    squeezed = float(views.costs()[0]["crop squeezes to"][-1])
    assert squeezed == pytest.approx(0.5, abs=1e-5)  # by differences of 1e-5 rad
    assert f"${parts.total_dollars():.2f}" in TEXT


def test_defaults_in_the_table() -> None:
    assert f"| {Settings().seed} |" in TEXT
    assert f"| {Settings().draws} |" in TEXT
