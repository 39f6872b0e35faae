"""`freelook calibrate` and what people get wrong: each has its own sentence."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from board_pictures import Board, Gray, Held
from freelook.calibration.mistakes import is_blurred, other_size
from freelook.calibration.targets import Chessboard
from freelook.camera import make_camera
from freelook.cli import main
from freelook.cli._target_views import find_views
from freelook.lens import Equidistant

# The centre is far from the picture's middle: a turned picture is of another camera.
CAMERA = make_camera((480, 360), Equidistant(112.0), center=(262.0, 165.0), field_deg=188)
BOARD = Board(CAMERA, (8, 6), 0.03)
PLACES = [
    Held((240, 180), 0.16, (25, 0)),
    Held((350, 185), 0.16, (0, 30), 40),
    Held((140, 180), 0.16, (-20, 20)),
    Held((250, 260), 0.16, (-35, 0), 10),
]


def written(path: Path, picture: Gray) -> str:
    cv2.imwrite(str(path), picture)
    return str(path)


@pytest.fixture(scope="module")
def shots(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("shots")
    return [
        written(folder / f"{number}.png", BOARD.picture(held, 2.0, number))
        for number, held in enumerate(PLACES)
    ]


def said(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The last line of the error."""
    assert main(["calibrate", *arguments]) == 2
    return capsys.readouterr().err.strip().splitlines()[-1]


@pytest.fixture(scope="module")
def upside_down(shots: list[str], tmp_path_factory: pytest.TempPathFactory) -> str:
    picture = BOARD.picture(Held((180, 140), 0.17, (20, -20), 20))[::-1, ::-1]
    return written(tmp_path_factory.mktemp("turned") / "turned.png", picture)


def test_a_larger_board_than_is_seen(shots: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """The right one is named, and how many pictures say so."""
    assert main(["calibrate", *shots, "--model", "equidistant", "--board", "9x7"]) == 0
    line = capsys.readouterr().out.strip().splitlines()[-1]
    assert line.startswith("the board is said to be 9 x 7, but 4 of 4 pictures show one of 8 x 6;")
    assert "give --board 8x6 if that is right" in line


def test_a_smaller_board_than_is_seen(shots: list[str]) -> None:
    """Some pictures are looked at again for it; the right size is doubted neither way round."""
    found = find_views(shots, Chessboard(1.0, (5, 7)), quiet=True)
    said = other_size(Chessboard(1.0, (5, 7)), found.views, found.pictures)
    assert said.startswith("the board is said to be 5 x 7, but 3 of 3 pictures looked at again")
    assert "show 8 x 6; give --board 8x6" in said
    found = find_views(shots, Chessboard(1.0, (6, 8)), quiet=True)
    assert other_size(Chessboard(1.0, (6, 8)), found.views, found.pictures) == ""


def test_a_picture_that_is_upside_down(
    shots: list[str], upside_down: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is left out, and named as that."""
    inputs = [*shots, upside_down, "--model", "equidistant", "--board", "6x8", "--json"]
    assert main(["calibrate", *inputs]) == 0
    figures: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert figures["target_doubt"] == ""
    assert figures["target"] == "chessboard:6x8:1"
    ((dropped),) = figures["views_dropped"]
    assert dropped["name"] == upside_down
    assert dropped["why"].startswith("it fits once turned by 180 degrees")


def test_copies_of_one_picture(
    shots: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = str(shutil.copy(shots[0], tmp_path / "copy.png"))
    line = said(capsys, shots[0], copy)
    assert "one view is left of 2, which is not enough" in line
    assert f"{copy}: the same picture as {shots[0]}" in line


def test_views_that_are_all_alike(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Of one place, each with its own noise."""
    names = [
        written(tmp_path / f"{seed}.png", BOARD.picture(PLACES[0], 3.0, seed)) for seed in range(3)
    ]
    assert "all 3 views show the board in the same place and tilt" in said(capsys, *names)


def test_blurred_pictures_are_told_from_empty_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sharp = BOARD.picture(PLACES[0])
    soft = np.asarray(cv2.GaussianBlur(sharp, (0, 0), 9.0), np.uint8)
    empty = BOARD.picture(None, 2.0)
    blurred = written(tmp_path / "soft.png", soft)
    nothing = written(tmp_path / "empty.png", empty)
    line = said(capsys, blurred, nothing)
    assert "found in none of 2 inputs" in line
    assert "1 of them are blurred: focus" in line
    line = said(capsys, nothing)
    assert "are blurred" not in line
    assert "with a light margin?" in line


def test_a_blurred_picture_is_told_even_if_the_board_is_found(tmp_path: Path) -> None:
    picture = BOARD.picture(Held((220, 150), 0.16, (20, -20), 20))
    soft = np.asarray(cv2.GaussianBlur(picture, (0, 0), 4.5), np.uint8)
    names = [written(tmp_path / "sharp.png", picture), written(tmp_path / "soft.png", soft)]
    found = find_views(names, Chessboard(), quiet=True)
    assert [view.name for view in found.views] == names
    assert found.blurred == names[1:]


def test_what_counts_as_blurred() -> None:
    """By the width of its steepest edges, in a picture of 1280 pixels; noise is no edge."""
    rng = np.random.default_rng(5)
    sharp = BOARD.picture(PLACES[0])

    def with_noise(picture: Gray) -> Gray:
        return np.asarray(np.clip(picture + rng.normal(0, 2, picture.shape), 0, 255), np.uint8)

    for width, blurred in ((0.5, False), (1.5, False), (5.0, True), (9.0, True)):
        soft = np.asarray(cv2.GaussianBlur(sharp, (0, 0), width), np.uint8)
        assert is_blurred(with_noise(soft)) == blurred, width
    assert not is_blurred(with_noise(np.full((300, 400), 90, np.uint8)))
    large = np.asarray(cv2.resize(sharp, (3840, 2880), interpolation=cv2.INTER_CUBIC))
    assert not is_blurred(large)  # each step of the small one is 8 pixels wide


@pytest.mark.data
def test_real_pictures_of_another_board_than_was_said(shared_data: Path) -> None:
    """fish_1: 6 x 8 inner corners, said to be 7 x 9."""
    pictures = sorted(map(str, (shared_data / "fish_1").glob("*.jpg")))[:2]
    found = find_views(pictures, Chessboard(0.0325, (7, 9)), quiet=True)
    said = other_size(Chessboard(0.0325, (7, 9)), found.views, found.pictures)
    assert said.startswith("the board is said to be 7 x 9, but 2 of 2 pictures show one of 8 x 6;")
    assert found.blurred == []
