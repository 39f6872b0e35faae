"""freelook lens fit: tables of points in, ranked models, a profile and a figure out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from freelook.camera import make_camera
from freelook.cli import main
from freelook.formats import load_camera, load_profile
from freelook.lens import Equisolid, Floats, KannalaBrandt

CAMERA = make_camera(
    (960, 960), KannalaBrandt(280, -0.0137, 0.0207, -0.0128, 0.0025), center=(478, 481)
)
QUICK = ["--model", "equidistant", "--model", "equisolid", "--model", "kannala_brandt"]


def fit(*arguments: str | Path) -> int:
    return main(["lens", "fit", *map(str, arguments)])


def fitted(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> dict[str, Any]:
    assert fit(*arguments, "--json") == 0
    facts: dict[str, Any] = json.loads(capsys.readouterr().out)
    return facts


def table(path: Path, header: str, rows: Floats) -> Path:
    lines = [header, *(",".join(f"{value:.6f}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


@pytest.fixture
def angles(tmp_path: Path, rng: np.random.Generator) -> Path:
    """An equisolid lens, f = 300, measured every 3 degrees with 0.3 px; two slips of the pen."""
    degrees = np.arange(3.0, 94, 3)
    radius = Equisolid(300).radius(np.radians(degrees)) + rng.normal(0, 0.3, len(degrees))
    radius[[4, 19]] += [25, -18]
    return table(tmp_path / "angles.csv", "angle_deg,radius_px", np.stack([degrees, radius], -1))


@pytest.fixture
def points(tmp_path: Path, rng: np.random.Generator) -> Path:
    """3-D points of a fisheye camera, out to 85 degrees, seen with 0.2 px."""
    theta, phi = np.radians(rng.uniform(2, 85, 80)), rng.uniform(0, 2 * np.pi, 80)
    sine = np.sin(theta)
    ray = np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)
    pixel = CAMERA.project(ray) + rng.normal(0, 0.2, (80, 2))
    return table(tmp_path / "points.csv", "x,y,z,u,v", np.concatenate([2.5 * ray, pixel], axis=1))


def test_the_right_model_wins_and_slips_are_named(
    angles: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    facts = fitted(capsys, angles, *QUICK)
    assert facts["best"] == "equisolid"
    assert facts["count"] == 31
    assert facts["outlier_lines"] == [6, 21]  # the header is line 1
    best = facts["ranking"][0]
    assert best["delta_aicc"] == 0
    assert best["parameters"]["f"] == pytest.approx(300, abs=4 * best["sigma"]["f"])
    assert best["sigma"]["f"] < 0.3
    assert facts["noise_px"] == pytest.approx(0.3, rel=0.5)
    deltas = [row["delta_aicc"] for row in facts["ranking"]]
    assert deltas == sorted(deltas)


def test_all_models_are_tried_without_a_choice(
    angles: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All of those there are would take long; which they are is what counts here."""
    import freelook.fitting as fitting

    quick = ["perspective", "equidistant", "equisolid", "orthographic"]
    monkeypatch.setattr(fitting, "curve_models", lambda: quick)
    facts = fitted(capsys, angles)
    assert {row["model"] for row in facts["ranking"]} == {
        "equidistant",
        "equisolid",
    }
    assert facts["not_fitted"].keys() == {"perspective", "orthographic"}


def test_what_is_printed_says_it_in_words(angles: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert fit(angles, *QUICK, "--model", "perspective") == 0
    out = capsys.readouterr().out
    assert "31 points from 3 to 93 degrees" in out
    assert "best: equisolid, noise 0." in out
    assert "outliers, look at line 6, 21" in out
    assert "equisolid: f 300." in out or "equisolid: f 299." in out
    assert " ± 0." in out
    assert "not fitted: perspective: lenses end at 90 degrees from the axis" in out


def test_models_that_cannot_be_told_apart_are_named_so(
    tmp_path: Path, rng: np.random.Generator, capsys: pytest.CaptureFixture[str]
) -> None:
    """Out to 15 degrees and with a pixel of noise all lenses are alike."""
    degrees = np.arange(1.0, 16)
    radius = Equisolid(300).radius(np.radians(degrees)) + rng.normal(0, 1.0, 15)
    few = table(tmp_path / "few.csv", "angle_deg,radius_px", np.stack([degrees, radius], -1))
    assert (
        fit(few, "--model", "equidistant", "--model", "equisolid", "--model", "orthographic") == 0
    )
    out = " ".join(capsys.readouterr().out.split())
    assert "cannot be told apart from it by these points (AICc within 2): " in out


def test_too_many_parameters_are_called_overfit(
    tmp_path: Path, rng: np.random.Generator, capsys: pytest.CaptureFixture[str]
) -> None:
    degrees = np.arange(10.0, 90, 11)
    radius = Equisolid(300).radius(np.radians(degrees)) + rng.normal(0, 1.0, len(degrees))
    few = table(tmp_path / "few.csv", "angle_deg,radius_px", np.stack([degrees, radius], -1))
    facts = fitted(capsys, few, "--model", "equisolid", "--model", "polynomial", "--loss", "linear")
    overfit = {row["model"]: row["overfit"] for row in facts["ranking"]}
    assert overfit == {"equisolid": False, "polynomial": True}
    assert facts["best"] == "equisolid"
    assert fit(few, "--model", "equisolid", "--model", "polynomial", "--loss", "linear") == 0
    assert "overfit, predict points they have not seen much worse" in capsys.readouterr().out


def test_a_profile_is_written_that_holds_where_it_was_measured(
    angles: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "lens.json"
    options = ["--size", "960x900", "--center", "470.5,455", "-o", str(out)]
    assert fit(angles, "--model", "equisolid", *options) == 0
    assert f"written: {out}, equisolid" in capsys.readouterr().out
    camera = load_camera(out)
    assert camera.size == (960, 900)
    assert camera.center == (470.5, 455)
    assert np.degrees(camera.theta_max) == pytest.approx(93)
    assert "31 points of angles.csv" in load_profile(out).source
    assert fit(angles, "--model", "equisolid", *options) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_where_the_axis_was_can_be_sought(
    tmp_path: Path, rng: np.random.Generator, capsys: pytest.CaptureFixture[str]
) -> None:
    degrees = np.arange(0.0, 85, 3)
    position = 469 + Equisolid(300).radius(np.radians(degrees)) + rng.normal(0, 0.3, len(degrees))
    path = table(tmp_path / "scale.csv", "angle_deg,radius_px", np.stack([degrees, position], -1))
    facts = fitted(capsys, path, "--free-offset", "--model", "equisolid")
    values, sigma = facts["ranking"][0]["parameters"], facts["ranking"][0]["sigma"]
    assert values["offset_px"] == pytest.approx(469, abs=4 * sigma["offset_px"])
    assert sigma["offset_px"] < 0.3


def test_weights_are_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    degrees = np.arange(10.0, 90, 10)
    radius, sigma = Equisolid(300).radius(np.radians(degrees)), np.full(8, 0.1)
    radius[-1], sigma[-1] = 500, 1000
    rows = np.stack([degrees, radius, sigma], -1)
    path = table(tmp_path / "a.csv", "angle_deg,radius_px,sigma_px", rows)
    facts = fitted(capsys, path, "--model", "equisolid", "--loss", "linear")
    assert facts["ranking"][0]["parameters"]["f"] == pytest.approx(300, abs=0.01)


def test_3d_points_give_a_whole_camera(
    points: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "lens.json"
    options = ["--size", "960x960", "--stretch", "none", "-o", str(out)]
    models = ["--model", "equidistant", "--model", "kannala_brandt"]
    assert fit(points, *models, *options) == 0
    assert "best: kannala_brandt, noise 0." in capsys.readouterr().out
    camera = load_camera(out)
    # the middle of 80 points with 0.2 px
    assert camera.center == pytest.approx((478, 481), abs=0.15)
    theta = np.radians([10.0, 40, 80])
    np.testing.assert_allclose(camera.lens.radius(theta), CAMERA.lens.radius(theta), atol=0.4)


@pytest.mark.parametrize("name", ["fit.png", "fit.svg"])
def test_the_figure_is_drawn(
    name: str, angles: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / name
    assert fit(angles, *QUICK, "--plot", out) == 0
    head = out.read_bytes()[:100]
    assert head.startswith(b"\x89PNG") if name.endswith("png") else b"<?xml" in head
    assert f"drawn: {out}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is empty; a table needs a header: angle_deg,radius_px"),
        ("angle_deg,radius_px\n", "has a header and no points"),
        ("10,52\n20,105\n", "line 1: the first line must be a header"),
        ("angle,radius\n10,52\n", "line 1: the columns are angle,radius; they must be angle_deg"),
        ("angle_deg;radius_px\n10;52\n", "put commas between the columns"),
        ("angle_deg,radius_px\n10,52\n20\n", "line 3: 1 values, but there are 2 columns"),
        ("angle_deg,radius_px\n# a remark\n10,abc\n", "line 3: radius_px is 'abc', which is no"),
        ("angle_deg,radius_px\n10,nan\n", "line 2: radius_px is 'nan'"),
        ("angle_deg,radius_px\n10,52\n", "needs"),
        ("angle_deg,radius_px\n" + "200,52\n" * 9, "none beyond pi"),
        ("x,y,z,u,v\n0,0,1,480,480\n", "give --size"),
    ],
)
def test_what_is_wrong_in_a_table_is_told_with_its_line(
    text: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text, "utf-8")
    assert fit(path, "--model", "equidistant") == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["-o", "lens.json"], "give --size, such as 1440x1440"),
        (["-o", "lens.yaml", "--size", "960x960"], "'freelook lens convert' makes any other"),
        (["--plot", "fit.gif"], "its name must end in .png or .svg"),
        (["--model", "perspective"], "perspective lenses end at 90 degrees; the data go"),
    ],
)
def test_options_are_checked_before_long_work(
    options: list[str],
    message: str,
    angles: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(angles.parent)
    if "perspective" in options:
        angles.write_text("angle_deg,radius_px\n95,450\n60,300\n30,150\n", "utf-8")
        message = "perspective lenses end at 90 degrees from the axis"
    assert fit(angles, *options) == 2
    assert message in capsys.readouterr().err


def test_a_missing_file_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert fit("none.csv") == 2
    assert "cannot read none.csv: No such file" in capsys.readouterr().err


@pytest.mark.parametrize("option", [["--center", "480,480"], ["--free-offset"]])
def test_what_3d_points_say_themselves_is_not_taken_twice(
    option: list[str], points: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert fit(points, "--size", "960x960", *option) == 2
    assert f"{option[0]} is for angle_deg,radius_px" in capsys.readouterr().err
