"""freelook lens show: numbers, words and pictures of one lens."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from freelook.cli import main
from freelook.cli.lens._report import digits, percent, rounded, span, spark


def show(*arguments: str | Path) -> int:
    return main(["lens", "show", *map(str, arguments)])


def shown(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> dict[str, Any]:
    assert show(*arguments, "--json") == 0
    facts: dict[str, Any] = json.loads(capsys.readouterr().out)
    return facts


@pytest.fixture
def profile(tmp_path: Path) -> Path:
    """An equidistant lens, its axis right of the middle, the camera looking down."""
    data = {
        "freelook_lens": 1,
        "name": "test lens",
        "source": "made for this test",
        "size": [960, 720],
        "model": "equidistant",
        "parameters": {"f": 280.0},
        "center": [519.5, 359.5],
        "field_deg": 188,
        "mount_deg": {"pitch": -30},
    }
    path = tmp_path / "cam.json"
    path.write_text(json.dumps(data), "utf-8")
    return path


def test_the_numbers_of_a_lens(profile: Path, capsys: pytest.CaptureFixture[str]) -> None:
    facts = shown(capsys, profile)
    assert (facts["name"], facts["source"]) == ("test lens", "made for this test")
    assert facts["model"] == "equidistant"
    assert facts["formula"].startswith("r = f theta")
    assert facts["parameters"] == {"f": 280.0}
    assert facts["mount_deg"] == {"yaw": 0, "pitch": -30, "roll": 0}
    field = facts["field_deg"]
    assert field["circle"] == 188
    assert field["left"] == 94  # 519 px are 106 degrees: the lens ends first
    assert field["right"] == pytest.approx(440 / 280 * 57.29578, rel=1e-5)
    assert field["vertical"] == pytest.approx(720 / 280 * 57.29578, rel=1e-5)
    assert (facts["grows_to_deg"], facts["formula_ends_deg"]) == (180, 180)
    assert 0 <= facts["residual_px"]["table"] < 0.01
    assert facts["residual_px"]["grid"] is None


def test_pixels_per_degree_from_centre_to_rim(
    profile: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = shown(capsys, profile)["pixels_per_degree"]
    assert [row["where"] for row in rows] == ["centre", "45", "90", "rim"]
    assert [row["angle_deg"] for row in rows] == [0, 45, 90, 94]
    for row in rows:
        assert row["radial"] == pytest.approx(280 * 0.01745329, rel=1e-5)
    assert rows[2]["tangential"] == pytest.approx(rows[2]["radial"] * 1.570796, rel=1e-5)
    assert rows[0]["share_in_picture"] == 1
    assert 0 < rows[3]["share_in_picture"] < 1


def test_the_usual_views_and_one_that_is_asked_for(
    profile: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    forward, left, asked = shown(capsys, profile, "--view=10,-30,60,640x360")["views"]
    assert (forward["name"], left["name"], asked["name"]) == ("forward", "60 left", "10, -30")
    assert (left["yaw_deg"], left["size"]) == (-60, [1280, 720])
    assert (asked["hfov_deg"], asked["size"], asked["view_pixels"]) == (60, [640, 360], 230_400)
    # the camera looks 30 degrees down, and so does this view: all but on the axis
    assert asked["source_px_per_degree"]["centre"] == pytest.approx([4.88692, 4.91], abs=0.01)
    assert asked["seen"] == 1
    share = asked["source_pixels"] / (960 * 720)
    assert asked["share_of_picture"] == pytest.approx(share, rel=1e-4)
    assert asked["largest_size_not_enlarged"][0] < 640
    assert asked["enlarged"] == 1


def test_what_a_view_does_not_see_is_null_and_not_zero(capsys: pytest.CaptureFixture[str]) -> None:
    left = shown(capsys, "demo")["views"][1]
    assert left["source_px_per_view_px"]["left"] == [None, None]


def test_the_json_is_the_same_every_time(profile: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert shown(capsys, profile) == shown(capsys, profile)
    assert list(shown(capsys, "demo")) == [
        *("profile", "name", "source", "notes", "model", "formula", "parameters", "size"),
        *("center", "stretch", "mount_deg", "field_deg", "grows_to_deg", "formula_ends_deg"),
        *("residual_px", "pixels_per_degree", "views"),
    ]


def test_in_words(profile: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert show(profile) == 0
    out = capsys.readouterr().out
    for words in (
        "test lens",
        "made for this test",
        "f = 280",
        "960 x 720 pixels, axis at (519.5, 359.5)",
        "pitch -30",
        "whole circle 188.0",
        "90 degrees ",
        "60 left",
        "largest not enlarged",
    ):
        assert words in " ".join(out.split()), words


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_plots(
    profile: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str
) -> None:
    plot = tmp_path / f"lens.{suffix}"
    assert show(profile, "--plot", plot, "--json") == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["name"] == "test lens"
    assert f"drawn: {plot}" in captured.err
    assert plot.stat().st_size > 20_000


def test_plot_stands_first_in_the_help(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        show("--help")
    out = capsys.readouterr().out
    assert out.index("--plot cam.png") < out.index("the numbers, in the terminal")
    assert out.index("  --plot FILE") < out.index("  --view YAW") < out.index("  --json")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nosuch.json"], "nosuch.json"),
        (["demo", "--plot", "out.pdf"], ".png or .svg"),
        (["demo", "--view=0,0,170,1280x720"], "10 to 150"),
        (["demo", "--lens-format", "opencv"], "lens profile demo"),
    ],
)
def test_what_is_wrong_is_said(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert show(*arguments) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize("view", ["1,2,3", "a,0,90,1280x720", "0,0,90,1280"])
def test_a_view_that_is_none(view: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        show("demo", f"--view={view}")
    assert "1280x720" in capsys.readouterr().err


@pytest.mark.data
def test_a_real_calibration(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The author's numbers for a 1440 x 1440 camera, of which the rim is outside the picture."""
    plot = tmp_path / "real.png"
    facts = shown(capsys, shared_data / "lilyth_video/author_calibration.json", "--plot", plot)
    assert facts["model"] == "kannala_brandt"
    assert facts["pixels_per_degree"][0]["radial"] == pytest.approx(11.97, abs=0.01)
    assert facts["field_deg"]["horizontal"] == pytest.approx(158.44, abs=0.01)
    assert facts["views"][0]["seen"] == 1
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_how_numbers_are_put() -> None:
    assert rounded({"a": [1.23456789, float("nan")], "b": (2, "x", None)}) == {
        "a": [1.23457, None],
        "b": [2, "x", None],
    }
    assert [percent(share) for share in (0, 0.0004, 0.5, 0.9999, 1)] == [
        *("0.0 %", "< 0.1 %", "50.0 %", "> 99.9 %", "100.0 %")
    ]
    assert [digits(v) for v in (None, float("nan"), 0.012345, 5.6, 123.4, 12345.6)] == [
        *("-", "-", "0.0123", "5.60", "123", "12,346")
    ]
    assert span((5.001, 5.002)) == "5.00"
    assert span((5, 6.28)) == "5.00 to 6.28"
    assert spark([0, 1, 2]) == "▁▅█"
    assert spark([0, 0]) == "▁▁"
