"""`freelook calibrate` from pictures to a profile: what it prints, writes and refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from board_pictures import Board, Gray, Held
from freelook.camera import make_camera
from freelook.cli import main
from freelook.formats import load_camera
from freelook.lens import Equidistant

CAMERA = make_camera((640, 480), Equidistant(150.0), center=(327.0, 233.0), field_deg=188)
BOARD = Board(CAMERA, (8, 6), 0.03)
PLACES = [
    Held((320, 240), 0.16, (25, 0)),
    Held((470, 250), 0.16, (0, 30), 40),
    Held((180, 240), 0.16, (-20, 20)),
    Held((330, 120), 0.16, (10, -30), 90),
    Held((330, 350), 0.16, (-35, 0), 10),
    Held((440, 140), 0.18, (20, 20), -30),
]


def refuse(constant: str) -> Any:
    raise AssertionError(f"{constant} is not JSON")


@pytest.fixture(scope="module")
def shots(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Six pictures of the board."""
    folder = tmp_path_factory.mktemp("shots")
    names = []
    for number, held in enumerate(PLACES):
        names.append(written(folder / f"{number}.png", BOARD.picture(held, 2.0, number)))
    return names


def written(path: Path, picture: Gray) -> str:
    cv2.imwrite(str(path), picture)
    return str(path)


def calibrated(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["calibrate", *arguments, "--json"]) == 0
    figures: dict[str, Any] = json.loads(capsys.readouterr().out, parse_constant=refuse)
    return figures


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["calibrate", *arguments]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    return lines[-1]


def test_from_pictures_to_a_profile(
    shots: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    profile = tmp_path / "lens.json"
    inputs = [*shots, "--square", "0.03", "--model", "equidistant", "-o", str(profile)]
    figures = calibrated(capsys, *inputs, "--name", "test lens")
    assert figures["rms_px"] < 0.2  # drawn corners; 2 grey levels of noise
    assert figures["median_px"] < figures["rms_px"] <= figures["rms_all_px"]
    assert figures["cross_validated_px"] < 0.25
    assert figures["points"] == sum(view["points"] for view in figures["views"]) > 0.95 * 6 * 48
    assert [view["name"] for view in figures["views"]] == shots
    assert figures["parameters"]["f"] == pytest.approx(150.0, rel=2e-3)
    assert figures["center"] == pytest.approx(CAMERA.center, abs=0.3)
    assert figures["sigma"]["f"] < 0.5
    assert np.array(figures["correlation"]).shape == (4, 4)
    assert figures["uncertainty_px"] < 0.5

    camera = load_camera(str(profile))
    assert camera.size == (640, 480)
    assert np.degrees(2 * camera.theta_max) == pytest.approx(figures["field_deg"])
    assert camera.center == pytest.approx(figures["center"], abs=1e-9)
    at = np.array([[320.0, 240.0], [420.0, 300.0], [200.0, 150.0]])
    assert camera.project(CAMERA.ray(at)) == pytest.approx(at, abs=0.5)
    assert "test lens" in profile.read_text("utf-8")


def test_what_people_read(shots: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """One line starts with RMS and says what it is; the figures are those of the JSON."""
    assert main(["calibrate", *shots, "--model", "equidistant"]) == 0
    text = capsys.readouterr().out
    (line,) = [line for line in text.splitlines() if line.startswith("RMS")]
    match = re.fullmatch(
        r"RMS ([\d.]+) px \(2-D, per point\), median ([\d.]+) px, (\d+) points in 6 views", line
    )
    assert match
    figures = calibrated(capsys, *shots, "--model", "equidistant")
    assert float(match[1]) == pytest.approx(figures["rms_px"], abs=6e-4)
    assert float(match[2]) == pytest.approx(figures["median_px"], abs=6e-4)
    assert int(match[3]) == figures["points"] - figures["points_dropped"]
    for view in figures["views"]:
        assert f"{view['rms_px']:.3f}" in text
    assert f"on views left out: {figures['cross_validated_px']:.3f} px" in text


def test_auto_lists_what_it_tried(shots: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    figures = calibrated(capsys, *shots[:4])
    tried = {candidate["model"]: candidate for candidate in figures["candidates"]}
    assert {"equidistant", "kannala_brandt", "radial_spline"} <= set(tried)
    assert figures["model"] in tried
    best = min(c["cross_validated_px"] for c in tried.values() if c["cross_validated_px"])
    assert figures["cross_validated_px"] <= 1.0102 * best


def test_options_of_the_solution(shots: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    inputs = [*shots, "--model", "equidistant"]
    square = calibrated(capsys, *inputs, "--square-pixels", "--keep-all")
    assert square["stretch"] == [[1.0, 0.0], [0.0, 1.0]]
    assert square["points_dropped"] == 0
    assert square["rms_px"] == square["rms_all_px"]
    assert "skew" in calibrated(capsys, *inputs, "--skew")["sigma"]


def test_pictures_without_the_board_are_named(
    shots: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A picture without a board, and one out of focus, are left out; the others are used."""
    blurred = cv2.GaussianBlur(BOARD.picture(PLACES[0]), (0, 0), 9.0)
    empty = written(tmp_path / "empty.png", BOARD.picture(None, 2.0))
    soft = written(tmp_path / "soft.png", np.asarray(blurred, np.uint8))
    figures = calibrated(capsys, *shots, empty, soft, "--model", "equidistant")
    assert figures["without_target"] == [empty, soft]
    assert len(figures["views"]) == 6
    assert main(["calibrate", *shots, empty, "--model", "equidistant"]) == 0
    assert f"{empty}: target not found" in capsys.readouterr().err


def test_pictures_turned_by_180_degrees_are_as_good(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """All of them: it is the camera that hangs upside down."""
    turned = [
        written(tmp_path / f"{number}.png", BOARD.picture(held, 2.0, number)[::-1, ::-1])
        for number, held in enumerate(PLACES)
    ]
    figures = calibrated(capsys, *turned, "--model", "equidistant")
    assert figures["rms_px"] < 0.2
    assert figures["center"] == pytest.approx([639 - 327.0, 479 - 233.0], abs=0.3)


def test_what_is_refused(
    shots: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small = written(tmp_path / "small.png", cv2.resize(BOARD.picture(PLACES[1]), (320, 240)))
    empty = written(tmp_path / "empty.png", BOARD.picture(None, 2.0))
    taken = tmp_path / "taken.json"
    taken.write_text("mine")
    assert "one view is not enough" in refused(capsys, shots[0])
    said = refused(capsys, *shots, small)
    assert "320 x 240 pixels, the pictures before it are 640 x 480" in said
    said = refused(capsys, empty)
    assert "the target (chessboard:1) was found in none of 1 inputs" in said
    assert f"{taken} exists; --overwrite" in refused(capsys, *shots, "-o", str(taken))
    assert taken.read_text() == "mine"
    assert "give pictures, videos or corner files" in refused(capsys)
    said = refused(capsys, *shots, "--control", "16x12")
    assert "--control goes with --model splined_stereographic" in said


@pytest.mark.data
def test_real_pictures(
    shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """fish_1: all 15 pictures, at most 0.40 pixels, at most 3 % of the corners dropped."""
    pictures = sorted(map(str, (shared_data / "fish_1").glob("*.jpg")))
    profile = tmp_path / "fish.json"
    inputs = [*pictures, "--board", "6x8", "--square", "0.0325", "-o", str(profile)]
    figures = calibrated(capsys, *inputs)
    assert len(figures["views"]) == 15
    assert figures["without_target"] == []
    assert figures["rms_px"] <= 0.40
    assert figures["points"] >= 0.98 * 15 * 48
    assert figures["points_dropped"] <= 0.03 * figures["points"]
    assert figures["cross_validated_px"] < 0.42
    camera = load_camera(str(profile))
    rays = camera.ray(np.array([[300.0, 300.0], [700.0, 500.0]]))
    assert camera.project(rays) == pytest.approx(np.array([[300.0, 300.0], [700.0, 500.0]]))
