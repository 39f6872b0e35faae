"""Random calibrations, a few of the two hundred, and the measure they are judged by."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from freelook.bench import calibration_trials
from freelook.bench.boards import board, simulate
from freelook.bench.calibration_trials import Summary, Trial, apart, round_models, sigmas_off, trial
from freelook.calibration.calibrate import calibrate
from freelook.camera import make_camera
from freelook.cli import main
from freelook.errors import CalibrationError
from freelook.lens import Equidistant

CAMERA = make_camera((1280, 960), Equidistant(290.0), field_deg=188)


@pytest.mark.parametrize("seed", [3, 6, 16])
def test_random_lenses(seed: int) -> None:
    """Equisolid, Kannala-Brandt, radial spline; `freelook bench calibrate --trials 200` has all."""
    found = trial(seed)
    assert found.failed == ""
    assert 0 < found.sigmas < 3


def test_every_round_model_has_its_turn() -> None:
    models = round_models()
    assert len(models) >= 15
    assert {"equidistant", "kannala_brandt", "eucm", "ocamcalib", "radial_spline"} <= set(models)
    assert not {"mei", "thin_prism_fisheye", "splined_stereographic"} & set(models)


def test_a_turned_camera_is_not_apart() -> None:
    """Nobody sees a turn: boards have no place of their own."""
    pixels = np.array([[200.0, 300.0], [900.0, 500.0], [640.0, 480.0]])
    assert np.abs(apart(CAMERA, CAMERA, pixels)).max() < 1e-6
    shifted = replace(CAMERA, center=(CAMERA.center[0] + 1.0, CAMERA.center[1]))
    # for an equidistant lens a shift is a turn near the axis, and most of it elsewhere
    assert np.abs(apart(CAMERA, shifted, pixels)).max() < 0.7


def test_sigmas_grow_with_the_error() -> None:
    """Five sigmas of the focal length added: off by about so much more."""
    made = simulate(CAMERA, board(9, 6), 8, np.random.default_rng(1), noise_px=0.2)
    found = calibrate(made.views, CAMERA.size, "equidistant")
    sigma = float(np.sqrt(found.solution.covariance[0, 0]))
    right = sigmas_off(CAMERA, found)
    wrong = replace(CAMERA, lens=Equidistant(290.0 + 20 * sigma))
    assert right < 2
    assert sigmas_off(wrong, found) > 5


def made_up(**changed: object) -> Trial:
    return replace(Trial(0, "eucm", 188.0, 0.2, 1.0), **changed)  # type: ignore[arg-type]


def test_failures_are_counted_and_listed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def pretended(seed: int, model: str | None = None) -> Trial:
        return [made_up(), made_up(sigmas=np.nan, failed="no lens"), made_up(sigmas=2.0)][seed]

    monkeypatch.setattr(calibration_trials, "trial", pretended)
    assert main(["bench", "calibrate", "--trials", "3"]) == 1
    printed = capsys.readouterr().out
    assert "trial 0, eucm, 188 degrees: no lens" in printed
    assert "3 calibrations of random lenses: 1 failed" in printed
    assert main(["bench", "calibrate", "--trials", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["summary"]["spread"] == 1.0
    assert main(["bench", "calibrate", "--trials", "0"]) == 2


def test_no_result_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def refusing(*_: object) -> None:
        raise CalibrationError("no lens fits these views")

    monkeypatch.setattr(calibration_trials, "calibrate", refusing)
    found = trial(0)
    assert found.failed == "no lens fits these views"
    summary = Summary.of([found, made_up(sigmas=0.5)])
    assert (summary.trials, summary.failed, summary.within, summary.worst) == (2, 1, 1, 0.5)
