"""Lenses to start from: near, of the model asked for, and seeing all that was seen."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.calibration.nearby import nearby
from freelook.lens import (
    DoubleSphere,
    Equidistant,
    Equisolid,
    ExtendedUnified,
    KannalaBrandt,
    Lens,
    Polynomial,
    Stereographic,
    model_name,
    vector,
)

THETA = np.radians(97.0)
BENT = KannalaBrandt(300.0, 0.0035, 0.0007, -0.0021, 0.0002)


@pytest.mark.parametrize(
    "lens",
    [
        Stereographic(321.0),
        Equidistant(321.0),
        Equisolid(321.0),
        Polynomial(300.0, 2.0, -5.0, 8.0, -4.0),
        ExtendedUnified(300.0, 0.6, 1.0),
        DoubleSphere(320.0, -0.2, 0.55),
    ],
    ids=model_name,
)
def test_a_lens_is_nearest_to_itself(lens: Lens) -> None:
    """beta of 1 and xi of -0.2 are among those tried."""
    found = nearby(model_name(lens), lens, THETA)
    assert found is not None
    assert vector(found) == pytest.approx(vector(lens), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(("model", "within_px"), [("eucm", 1.5), ("double_sphere", 0.3)])
def test_another_lens_is_followed_closely(model: str, within_px: float) -> None:
    """What is left of 530 pixels is no more than the steps in which one parameter is tried."""
    found = nearby(model, BENT, THETA)
    assert found is not None
    theta = np.linspace(0, THETA, 200)[1:]
    assert np.abs(found.radius(theta) - BENT.radius(theta)).max() < within_px


def test_a_kannala_brandt_lens_is_itself_with_prisms_of_nothing() -> None:
    found = nearby("thin_prism_fisheye", BENT, THETA)
    assert found is not None
    theta = np.linspace(0, THETA, 50)
    assert (found.radius(theta) == BENT.radius(theta)).all()


def test_a_model_that_ends_before_the_points_is_not_found_so() -> None:
    assert nearby("perspective", BENT, THETA) is None


def test_models_that_take_more_are_not_found_so() -> None:
    assert nearby("ocamcalib", BENT, THETA) is None
