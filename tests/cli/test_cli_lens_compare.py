"""freelook lens compare: how far two profiles are apart, and what explains it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from freelook.cli import main

Make = Callable[..., Path]


def compare(*arguments: str | Path) -> int:
    return main(["lens", "compare", *map(str, arguments)])


def compared(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> dict[str, Any]:
    assert compare(*arguments, "--json") == 0
    facts: dict[str, Any] = json.loads(capsys.readouterr().out)
    return facts


@pytest.fixture
def make(tmp_path: Path) -> Make:
    def made(name: str, **changes: Any) -> Path:
        data = {
            "freelook_lens": 1,
            "size": [960, 720],
            "model": "equidistant",
            "parameters": {"f": 280.0},
            "field_deg": 180,
        }
        path = tmp_path / f"{name}.json"
        path.write_text(json.dumps(data | changes), "utf-8")
        return path

    return made


def test_a_moved_picture(make: Make, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = make("a"), make("b", center=[483.5, 356.5])
    facts = compared(capsys, a, b)
    assert facts["as_is"]["rms_px"] == 5
    assert facts["mean_shift_px"] == [4, -3]
    assert facts["rms_px_without_mean_shift"] < 1e-9
    # what B calls forward lies to the right of A's, and above
    assert 0.5 < facts["turn_deg"]["yaw"] < 1.2
    assert 0.3 < facts["turn_deg"]["pitch"] < 1
    assert compare(a, b) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "moved by 4 pixels right, -3 down" in out
    assert "the same lens but for a picture moved on the sensor" in out


def test_a_turned_picture(make: Make, capsys: pytest.CaptureFixture[str]) -> None:
    b = make("b", stretch=[[0.99985, -0.01745], [0.01745, 0.99985]])
    facts = compared(capsys, make("a"), b)
    assert facts["turn_deg"]["roll"] == pytest.approx(1, abs=1e-3)
    assert facts["turned"]["rms_px"] < 0.01 < 1 < facts["as_is"]["rms_px"]
    assert compare(make("a"), b) == 0
    assert "the same lens but for a turn of the camera" in " ".join(capsys.readouterr().out.split())


def test_another_lens(make: Make, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = make("a"), make("b", parameters={"f": 282.8}, field_deg=170)
    facts = compared(capsys, a, b)
    rows = facts["by_angle"]
    assert [row["angle_deg"] for row in rows] == [0, 45, 85]
    assert [row["where"] for row in rows] == ["centre", "45", "rim"]
    assert rows[1]["as_is"]["rms_px"] == pytest.approx(2.8 * 0.785398, rel=1e-4)
    assert rows[1]["as_is"]["rms_deg"] == pytest.approx(45 / 101, rel=1e-4)
    assert rows[0]["as_is"]["rms_px"] < 1e-9
    assert facts["half_field_deg"] == {"a": 90, "b": 85}
    assert facts["seen"]["only_a"] > 0.01
    assert facts["seen"]["only_b"] == 0
    assert compare(a, b) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "Another lens" in out
    assert "(A to 90 degrees, B to 85)" in out


def test_b_is_scaled_to_a_s_picture(make: Make, capsys: pytest.CaptureFixture[str]) -> None:
    half = make("half", size=[480, 360], parameters={"f": 140.0})
    facts = compared(capsys, make("a"), half)
    assert facts["size"] == [960, 720]
    assert facts["as_is"]["max_px"] < 1e-6
    assert compare(make("a"), half) == 0
    assert "the same within 0.05 pixels" in capsys.readouterr().out


def test_other_shapes_are_refused(make: Make, capsys: pytest.CaptureFixture[str]) -> None:
    assert compare(make("a"), make("b", size=[960, 540])) == 2
    err = capsys.readouterr().err
    assert "960 x 720 and 960 x 540" in err
    assert "same shape" in err


def test_a_picture_that_ends_before_the_lens(
    make: Make, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its sides are 480 / 400 rad from the axis: told there, and not on a rim nobody sees."""
    wide = make("wide", parameters={"f": 400.0}, field_deg=200)
    rows = compared(capsys, wide, wide)["by_angle"]
    assert [row["where"] for row in rows] == ["centre", "45", "edge", "90"]
    assert rows[2]["angle_deg"] == pytest.approx(0.999 * 480 / 400 * 57.29578, rel=1e-5)
    assert rows[2]["as_is"]["max_px"] < 1e-6
    assert rows[3]["as_is"] is None  # its corners see 86
    assert compare(wide, wide) == 0
    assert "68.69, edge of the picture" in capsys.readouterr().out


def test_plot(make: Make, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plot = tmp_path / "difference.svg"
    assert compare(make("a"), "demo", "--plot", plot) == 2  # 4:3 and square
    assert not plot.exists()
    assert compare(make("a"), make("b", center=[480, 360]), "--plot", plot) == 0
    assert plot.read_bytes().startswith(b"<?xml")
    assert f"drawn: {plot}" in capsys.readouterr().out


def test_a_wrong_plot_name_is_refused_before_any_work(capsys: pytest.CaptureFixture[str]) -> None:
    assert compare("nosuch", "nosuch", "--plot", "out.jpeg") == 2
    assert "out.jpeg" in capsys.readouterr().err


@pytest.mark.data
def test_a_real_calibration_and_a_plain_guess(
    shared_data: Path, make: Make, capsys: pytest.CaptureFixture[str]
) -> None:
    """What r = f theta with the same f leaves of a real lens: large, and no turn explains it."""
    real = shared_data / "lilyth_video/author_calibration.json"
    guess = make(
        "guess", size=[720, 720], parameters={"f": 342.8}, center=[356.4, 328.0], field_deg=160
    )
    facts = compared(capsys, real, guess)
    assert facts["size"] == [1440, 1440]
    assert facts["as_is"]["rms_px"] > 20
    assert facts["turned"]["rms_px"] > 0.9 * facts["as_is"]["rms_px"]
    assert facts["by_angle"][0]["as_is"]["rms_px"] < 1
