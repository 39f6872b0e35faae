"""`freelook bench predict`: recordings read, errors as defined, tables and JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.bench import predict
from freelook.cli import main
from freelook.errors import TrackerError
from freelook.prediction import PREDICTORS, make_predictor
from freelook.rotations import head_angles_deg

HEADER = "timestamp viewpoint w x y z"
SPEED_DEG_S = 50.0


def line(t_s: float, left_deg: float) -> str:
    """A head turned to the left: about z, which is up there."""
    x, y, z, w = Rotation.from_euler("z", left_deg, degrees=True).as_quat().tolist()
    return f"{t_s!r} 0 {w!r} {x!r} {y!r} {z!r}"


@pytest.fixture
def steady(tmp_path: Path) -> Path:
    """Two seconds of a steady turn at 60 Hz."""
    path = tmp_path / "steady.txt"
    times_s = np.arange(120) / 60
    path.write_text("\n".join([HEADER, *(line(float(t), SPEED_DEG_S * t) for t in times_s)]))
    return path


def test_a_recording_turns_as_its_file_says(steady: Path) -> None:
    recording = predict.read_recording(steady)
    assert len(recording.t_ns) == 120
    assert recording.t_ns[60] == 10**9
    # yaw is positive to the right
    np.testing.assert_allclose(
        head_angles_deg(recording.body_from_view[60]), [-SPEED_DEG_S, 0.0, 0.0], atol=1e-9
    )


def test_errors_of_a_steady_turn_are_what_they_must_be(steady: Path) -> None:
    recording = predict.read_recording(steady)
    hold = predict.errors_deg(recording, make_predictor("hold"))
    rate = predict.errors_deg(recording, make_predictor("constant_rate"))
    for ahead_ms, held, turned in zip(predict.HORIZONS_MS, hold, rate, strict=True):
        np.testing.assert_allclose(held, SPEED_DEG_S * ahead_ms / 1000, rtol=1e-6)
        np.testing.assert_allclose(turned, 0.0, atol=1e-5)
        # from the 30th sample to the last whose time plus the horizon was recorded
        assert len(held) == 120 - predict.WARM_UP - np.ceil(ahead_ms / 1000 * 60 - 1e-9)


def test_lines_that_make_no_sense_are_left_out(steady: Path) -> None:
    text = steady.read_text()
    lines = text.splitlines()
    bad = ["", "0.5 0 1 0 0", "nan 0 1 0 0 0", "0.6 0 0 0 0 0", "x y z", "1e300 0 1 0 0 0"]
    bad += [line(0.01, 90.0)]
    steady.write_text("\n".join([*lines[:60], *bad, *lines[60:]]))
    assert len(predict.read_recording(steady).t_ns) == 120


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no column timestamp, w, x, y, z"),
        ("timestamp yaw pitch\n0 1 2\n", "no column w, x, y, z"),
        (HEADER + "\n" + line(0.0, 0.0), " 1 usable samples"),
    ],
)
def test_what_is_no_recording_is_said(tmp_path: Path, text: str, why: str) -> None:
    path = tmp_path / "head.txt"
    path.write_text(text)
    with pytest.raises(TrackerError, match=why):
        predict.read_recording(path)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(TrackerError, match="No such file"):
        predict.read_recording(tmp_path / "none.txt")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TrackerError, match="not a text file"):
        predict.read_recording(tmp_path / "bytes")


def test_lag_of_the_present() -> None:
    assert predict.smoothing_lag_ms("hold", 10.0) == pytest.approx(0.0, abs=1e-6)
    assert 20.0 < predict.smoothing_lag_ms("head", 2.0) < 100.0
    assert predict.smoothing_lag_ms("head", 20.0) < 0.1


@pytest.fixture
def short_still(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(predict, "STILL_SECONDS", 1.5)
    monkeypatch.setattr(predict, "STEADY_SECONDS", 0.5)


@pytest.mark.usefixtures("short_still")
def test_json(steady: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "predict", str(steady), "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    rows = figures["errors_deg"]
    assert [(row["predictor"], row["horizon_ms"]) for row in rows] == [
        (name, ahead_ms) for name in PREDICTORS for ahead_ms in predict.HORIZONS_MS
    ]
    assert rows[1]["p95"] == pytest.approx(SPEED_DEG_S * 0.05)
    assert set(figures["jitter_at_rest_deg_by_horizon_ms"]) == set(PREDICTORS)
    assert set(figures["smoothing_lag_ms_by_deg_s"]["head"]) >= {"1", "100"}


@pytest.mark.usefixtures("short_still")
def test_tables(steady: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "predict", str(steady)]) == 0
    out = capsys.readouterr().out
    assert "steady.txt: error in degrees" in out
    assert "still" in out
    for name in PREDICTORS:
        assert name in out


def test_an_empty_file_is_an_error_of_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty.txt").write_text("")
    assert main(["bench", "predict", str(tmp_path / "empty.txt")]) != 0
    assert "no column timestamp" in capsys.readouterr().err
