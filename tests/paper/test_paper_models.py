"""Which lens model the printed curve supports; an independent fit beside ours."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.optimize import minimize

from freelook.lens import Floats
from freelook.paper import evidence, printed, printed_models
from freelook.paper.exhibit import Settings
from freelook.paper.printed_models import NEAR, WHOLE, fit_table, fits, scaled_misfits
from freelook.paper.projections import FISHEYES, FIVE, five_models, unit_radius
from freelook.paper.rounding import Design, within_rounding

FORMULAS: dict[str, Callable[[Floats], Floats]] = {
    "perspective": np.tan,
    "stereographic": lambda t: 2 * np.tan(t / 2),
    "equidistant": lambda t: t,
    "equisolid": lambda t: 2 * np.sin(t / 2),
    "orthographic": np.sin,
}


@pytest.mark.parametrize("model", FIVE)
def test_fig_4_has_the_formulas(model: str) -> None:
    table = five_models()
    inner = table["theta_deg"] < 90
    theta = np.radians(table["theta_deg"][inner])
    np.testing.assert_allclose(table[model][inner], FORMULAS[model](theta), rtol=1e-12)


def test_fig_4_beyond_90_degrees() -> None:
    table = five_models()
    beyond = table["theta_deg"] > 90
    assert beyond.sum() == 50
    assert np.isnan(table["perspective"][beyond]).all()
    assert np.isnan(table["orthographic"][beyond]).all()
    for model in ("stereographic", "equidistant", "equisolid"):
        assert (np.diff(table[model]) > 0).all()
    assert float(unit_radius("orthographic", np.array(np.pi / 2))) == 1


@pytest.mark.parametrize(
    ("design", "rms"),
    [
        (
            WHOLE,
            {"equisolid": 5.8, "equidistant": 8.1, "orthographic": 10.8, "stereographic": 14.2},
        ),
        (NEAR, {"equisolid": 3.5, "orthographic": 3.7, "equidistant": 4.1, "stereographic": 5.6}),
    ],
)
def test_fits_to_equation_7(design: Design, rms: dict[str, float]) -> None:
    """Against a search that shares nothing with ours: simplex over f and offset."""
    theta, p = np.radians(design.angles_deg), printed.quintic(design.angles_deg)
    found = {fit.model: fit for fit in fits(design, FISHEYES)}
    for model, expected in rms.items():
        curve = FORMULAS[model](theta)

        def miss(x: np.ndarray, curve: np.ndarray = curve) -> float:
            return float(np.sqrt(np.mean((x[0] * curve + x[1] - p) ** 2)))

        other = minimize(miss, [200.0, 400.0], method="Nelder-Mead", options={"xatol": 1e-6})
        assert found[model].rms_px == pytest.approx(other.fun, abs=1e-3)
        assert found[model].rms_px == pytest.approx(expected, abs=0.05)


def test_ranking_of_the_printed_curve() -> None:
    whole = fit_table(WHOLE, FISHEYES)
    assert whole.words["model"] == ("equisolid", "equidistant", "orthographic", "stereographic")
    assert whole["f px"][0] == pytest.approx(207, abs=0.5)
    near = fit_table(NEAR, FIVE)
    assert near.words["model"][0] == "equisolid"
    assert near.words["model"][-1] == "perspective"
    # nothing to choose between: by the usual rule of thumb 2 to 4 is weak evidence
    scores = dict(zip(near.words["model"], near["AICc above best"], strict=True))
    assert scores["orthographic"] < 4
    assert scores["equidistant"] < 4


def test_quick_misfits_are_those_of_the_fits(rng: np.random.Generator) -> None:
    curves = within_rounding(rng, 3) @ printed.powers(WHOLE.angles_deg).T
    curves[0] = printed.quintic(WHOLE.angles_deg)
    quick = scaled_misfits(curves, WHOLE.angles_deg, FISHEYES)
    exact = {fit.model: fit.rms_px for fit in fits(WHOLE, FISHEYES)}
    np.testing.assert_allclose(quick[0], [exact[model] for model in FISHEYES], rtol=1e-6)


def test_support_under_the_rounding() -> None:
    support = printed_models.support(Settings(seed=5, draws=1000), 90)
    assert support.rounding.sum() == pytest.approx(1)
    assert support.together.sum() == pytest.approx(1)
    at = dict(zip(FISHEYES, support.together, strict=True))
    assert at["orthographic"] < 0.01
    assert max(at, key=lambda model: at[model]) == "equisolid"
    assert support.rounding[FISHEYES.index("orthographic")] > 0.1
    assert support.sets == 16


def test_orthographic_bends_and_equidistant_does_not() -> None:
    assert printed_models.bend_px("equidistant", 216) < 1e-9
    assert 10 < printed_models.bend_px("orthographic", 268) < 12
    assert 2 < printed_models.bend_px("equisolid", 228) < 3


def test_an_experiment_to_90_degrees_tells_models_apart_and_one_to_60_hardly() -> None:
    table = evidence.shares(Settings(seed=2, draws=400))
    short, whole = evidence.EXPERIMENTS
    assert evidence.least_found(table, whole, 1.0) == 100
    assert evidence.least_found(table, short, 0.5) > 99
    assert evidence.least_found(table, short, 6.0) < 50
    assert evidence.least_found(table, whole, 6.0) > 80
