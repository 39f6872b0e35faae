"""`--target` in `freelook calibrate` and `calibrate stereo`: what is held, what is seen of it."""

from __future__ import annotations

import argparse
import json
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from freelook.calibration.targets import Charuco, Chessboard, Circles, parse_target
from freelook.camera import Camera, make_camera
from freelook.cli import main
from freelook.cli._targets import (
    add_target_arguments,
    chosen_target,
    grid_without_names,
    measured,
)
from freelook.errors import CalibrationError
from freelook.lens import Equidistant
from freelook.rotations import angle_between_deg, from_wxyz

Floats = NDArray[np.float64]
Gray = NDArray[np.uint8]

TARGET = Charuco((6, 5), 0.04, 0.03, "4x4_50")
LEFT = make_camera((560, 420), Equidistant(220.0), center=(283.0, 206.0), field_deg=180)
RIGHT = make_camera((520, 440), Equidistant(230.0), center=(255.0, 224.0), field_deg=170)
TURN = Rotation.from_euler("xyz", [1, -3, 2], degrees=True)
SHIFT = np.array([-0.06, 0.002, 0.003])  # the right camera is 6 cm to the right
PX_PER_M = 1500.0  # of the drawn board
PLACES = [  # right and down from the axis, degrees; distance, metres; turns about the board's axes
    (0, 0, 0.24, (25, 10, 5)),
    (25, -15, 0.22, (-20, 25, 180)),
    (-25, 12, 0.22, (10, -30, 80)),
    (15, 20, 0.2, (-25, -15, 30)),
    (-12, -22, 0.2, (15, 30, -20)),
]


def drawn(shown: slice) -> Gray:
    """The board on paper; all of it but some columns of squares hidden behind something gray."""
    drawing = TARGET.drawing
    picture = np.full([round(side * PX_PER_M) for side in drawing.size[::-1]], 225, np.uint8)
    for x, y, w, h in np.rint(drawing.rectangles * PX_PER_M).astype(int):
        picture[y : y + h, x : x + w] = 25
    hidden = np.ones(picture.shape[1], bool)
    hidden[shown] = False
    picture[:, hidden] = 120
    return picture


def fine_rays(camera: Camera) -> Floats:
    """Two along each side of a pixel; between pixels' middles interpolated, wrong by 0.001 px."""
    width, height = camera.size
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float)
    rays = cv2.resize(camera.ray(pixels), (2 * width, 2 * height))
    return np.where(np.isnan(rays), [0, 0, -1.0], rays)


def seen(rays: Floats, board: Gray, turn: Rotation, shift: Floats) -> Gray:
    """The board along `fine_rays`."""
    height, width = (side // 2 for side in rays.shape[:2])
    rays = rays @ turn.as_matrix()
    origin = -shift @ turn.as_matrix()
    ahead = rays[..., 2] * origin[2] < 0
    depth = np.where(ahead, -origin[2] / np.where(ahead, rays[..., 2], 1.0), 0.0)
    on_board = np.clip(origin[:2] + depth[..., None] * rays[..., :2], -9, 9)
    margin = TARGET.square / 2  # around the squares; points count from the corner of these
    at = ((on_board + margin) * PX_PER_M - 0.5).astype(np.float32)
    at[~ahead] = -1e4
    picture = cv2.remap(board, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderValue=(120,))
    small = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), 0.6), np.uint8)


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The left camera never sees the last two columns of squares, the right one never the first."""
    folder = tmp_path_factory.mktemp("rig")
    column = round(TARGET.square * PX_PER_M)
    margin = column // 2
    boards = drawn(slice(0, margin + 4 * column)), drawn(slice(margin + 2 * column, None))
    for side in ("left", "right"):
        (folder / side).mkdir()
    rays = [fine_rays(camera) for camera in (LEFT, RIGHT)]
    for number, (right, down, distance, tilt) in enumerate(PLACES):
        look = Rotation.from_euler("YX", [right, -down], degrees=True)
        turn = look * Rotation.from_euler("xyz", tilt, degrees=True)
        shift = look.apply([0, 0, distance]) - turn.apply([0.12, 0.1, 0])
        views = (
            seen(rays[0], boards[0], turn, shift),
            seen(rays[1], boards[1], TURN * turn, TURN.apply(shift) + SHIFT),
        )
        for side, view in zip(("left", "right"), views, strict=True):
            cv2.imwrite(str(folder / side / f"{number}.png"), view)
    return folder


def test_two_cameras_that_see_different_parts(
    rig: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a board whose points have names, by these: half of them were seen by one camera only."""
    inputs = [str(rig / "left"), str(rig / "right"), "--target", TARGET.text, "--json"]
    assert main(["calibrate", "stereo", *inputs, "--model", "equidistant"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["pairs"] == len(PLACES)
    assert max(figures["rms_px"].values()) < 0.3
    relation = figures["rig"]["right_from_left"]
    # 60 corners in each camera, each good to 0.1 pixel or 0.03 degrees
    assert angle_between_deg(from_wxyz(relation["rotation_wxyz"]), TURN) < 0.2
    np.testing.assert_allclose(relation["translation"], SHIFT, atol=1e-3)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("charuco:6x5:0.04:0.03:5x5_100", "hardly a marker of 5x5_100 was read in them"),
        ("charuco:5x6:0.04:0.03:4x4_50", r"\d+ markers of 4x4_50 were read in .*across and down"),
        ("aprilgrid:6x6:0.03:0.3", "hardly a marker of apriltag_36h11 was read in them"),
    ],
)
def test_another_target_than_was_said(
    rig: Path, capsys: pytest.CaptureFixture[str], text: str, why: str
) -> None:
    """What is on the print is asked about by what was read from it."""
    picture = str(rig / "left" / "0.png")
    assert main(["calibrate", picture, "--target", text]) == 2
    said = capsys.readouterr().err
    assert f"the target ({text}) was found in none of 1 inputs" in said
    assert re.search(why, said)


def arguments(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_target_arguments(parser)
    return parser.parse_args(words)


def test_how_a_target_is_chosen(tmp_path: Path) -> None:
    assert chosen_target(arguments()) == Chessboard(1.0, None)
    assert chosen_target(arguments("--board", "6x8", "--square", "0.03")) == Chessboard(
        0.03, (6, 8)
    )
    assert chosen_target(arguments("--target", "circles", "--board", "6x8")) == Circles(1.0, (6, 8))
    assert chosen_target(arguments("--target", TARGET.text)) == TARGET
    path = tmp_path / "april_6x6.yaml"
    path.write_text(
        "target_type: aprilgrid\ntagCols: 6\ntagRows: 5\ntagSize: 0.08\ntagSpacing: 0.3\n"
    )
    assert chosen_target(arguments("--target", str(path))).text == "aprilgrid:6x5:0.08:0.3"
    with pytest.raises(CalibrationError, match="says sizes, and so does --board and --square"):
        chosen_target(arguments("--target", "circles:0.1", "--board", "3x4", "--square", "1"))
    with pytest.raises(CalibrationError, match="how many"):
        chosen_target(arguments("--target", "charuco"))


def test_what_two_cameras_must_know() -> None:
    """Whether corners are numbered anyhow, and lengths are in metres."""
    assert grid_without_names(Chessboard(1.0, (6, 8))) == (True, (6, 8))
    assert grid_without_names(parse_target("circles:0.1")) == (True, None)
    assert grid_without_names(TARGET) == (False, None)
    assert grid_without_names(parse_target("acircles:4x11:0.02")) == (False, None)
    with pytest.raises(CalibrationError, match="give --board"):
        grid_without_names(parse_target("acircles:0.02"))
    assert measured(parse_target("aprilgrid:6x6:0.088"))
    assert not measured(parse_target("aprilgrid:6x6:1"))
    assert not measured(Chessboard())
