"""freelook calibrate stereo: folders of pictures of one board, seen by two simulated cameras."""

from __future__ import annotations

import json
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from freelook.camera import Camera, make_camera
from freelook.cli import main
from freelook.cli.calibrate_stereo import paired
from freelook.errors import FreelookError
from freelook.formats import load_profile
from freelook.lens import Equidistant
from freelook.rotations import angle_between_deg, from_wxyz

Floats = NDArray[np.float64]

LEFT = make_camera((480, 360), Equidistant(130.0), center=(243.0, 176.0), field_deg=190)
RIGHT = make_camera((400, 400), Equidistant(140.0), center=(201.0, 197.0), field_deg=165)
TURN = Rotation.from_euler("xyz", [1, -4, 2], degrees=True)
SHIFT = np.array([-0.08, 0.002, 0.004])
INNER, SQUARE = (7, 5), 0.03
FINE = 3  # samples along each side of a pixel


def fine_rays(camera: Camera) -> Floats:
    """Between pixels' middles interpolated: wrong by (1 / 130 px)^2 / 8 rad, 0.001 px."""
    width, height = camera.size
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(float)
    return np.asarray(cv2.resize(camera.ray(pixels), (FINE * width, FINE * height)), float)


def drawn(camera: Camera, rays: Floats, turn: Rotation, shift: Floats) -> NDArray[np.uint8]:
    """The board along `fine_rays`, its first inner corner at the target's (0, 0), on gray."""
    width, height = camera.size
    dark = np.isnan(rays[..., 2])
    rays = np.where(dark[..., None], [0, 0, 1.0], rays) @ turn.as_matrix()
    origin = -shift @ turn.as_matrix()
    ahead = rays[..., 2] * origin[2] < 0  # towards the board's plane
    depth = np.where(ahead, -origin[2] / np.where(ahead, rays[..., 2], 1.0), 0.0)
    x, y = (((origin + depth[..., None] * rays) / SQUARE)[..., i] for i in (0, 1))
    i, j = np.floor(np.clip(x, -99, 99)), np.floor(np.clip(y, -99, 99))
    board = (i >= -1) & (i < INNER[0]) & (j >= -1) & (j < INNER[1])
    paper = (np.abs(x - 3) < 5) & (np.abs(y - 2) < 4) & ahead
    value = np.where(paper, np.where(board & ((i + j) % 2 == 0), 30.0, 220.0), 110.0)
    value = np.where(dark, 5.0, value)
    small = cv2.resize(value, (width, height), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(small, (0, 0), 0.6), np.uint8)


PLACES = [  # right and down from the axis, degrees; distance; turns about the board's axes
    (0, 0, 0.22, (25, 10, 5)),
    (35, -20, 0.22, (-20, 25, 180)),
    (-35, 20, 0.22, (10, -30, 80)),
    (30, 30, 0.2, (-25, -10, 0)),
    (-30, -30, 0.2, (15, 30, -20)),
    (5, -35, 0.2, (30, -15, 100)),
]


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folders `left` and `right`; the second moment has no right picture."""
    folder = tmp_path_factory.mktemp("rig")
    for side in ("left", "right"):
        (folder / side).mkdir()
    rays = [fine_rays(camera) for camera in (LEFT, RIGHT)]
    for number, (right, down, distance, tilt) in enumerate(PLACES):
        look = Rotation.from_euler("YX", [right, -down], degrees=True)
        turn = look * Rotation.from_euler("xyz", tilt, degrees=True)
        shift = look.apply([0, 0, distance]) - turn.apply([3 * SQUARE, 2 * SQUARE, 0])
        cv2.imwrite(str(folder / f"left/a{number}.png"), drawn(LEFT, rays[0], turn, shift))
        if number != 1:
            seen = drawn(RIGHT, rays[1], TURN * turn, TURN.apply(shift) + SHIFT)
            cv2.imwrite(str(folder / f"right/b{number}.png"), seen)
    return folder


def stereo(folder: Path, *arguments: str | Path) -> int:
    sides = (folder / "left", folder / "right")
    return main(["calibrate", "stereo", *map(str, (*sides, *arguments))])


OPTIONS = ("--board", "7x5", "--square", "0.03", "--model", "equidistant")


def test_pictures_become_two_profiles_and_a_rig(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert stereo(rig, *OPTIONS, "-o", out) == 0
    said = capsys.readouterr().out
    assert said.startswith("RMS ")
    assert "5 pairs, 1 single views" in said
    found = json.loads((out / "rig.json").read_text("utf-8"))
    relation = found["right_from_left"]
    # corners of such small pictures are good to 0.1 px: 0.04 degrees, over some 170 of them
    assert angle_between_deg(from_wxyz(relation["rotation_wxyz"]), TURN) < 0.15
    np.testing.assert_allclose(relation["translation"], SHIFT, atol=5e-4)
    assert found["baseline"] == pytest.approx(np.linalg.norm(SHIFT), abs=5e-4)
    assert found["epipolar_median_deg"] < 0.06
    left, right = (load_profile(str(out / found[side])).camera for side in ("left", "right"))
    assert getattr(left.lens, "f", 0) == pytest.approx(130, abs=0.3)
    assert getattr(right.lens, "f", 0) == pytest.approx(140, abs=0.3)
    between = right.camera_from_body * left.camera_from_body.inv()
    assert angle_between_deg(between, from_wxyz(relation["rotation_wxyz"])) < 1e-6


def test_json_has_it_all_and_files_are_kept(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert stereo(rig, *OPTIONS, "--json") == 0
    figures = json.loads(capsys.readouterr().out)
    assert (figures["pairs"], figures["singles"], figures["swapped"]) == (5, 1, False)
    assert figures["sigma"]["left.f"] > 0
    assert figures["rms_px"]["right"] < 0.25
    (tmp_path / "left.json").write_text("mine", "utf-8")
    assert stereo(rig, *OPTIONS, "-o", tmp_path) == 2
    assert "has left.json already" in capsys.readouterr().err


def test_swapped_folders_are_told(rig: Path, capsys: pytest.CaptureFixture[str]) -> None:
    swapped = [str(rig / "right"), str(rig / "left")]
    assert main(["calibrate", "stereo", *swapped, *OPTIONS]) == 0
    assert "RIGHT stands to the left of LEFT" in capsys.readouterr().out


def test_pictures_are_paired_by_name_or_by_number() -> None:
    assert paired(["1.png", "2.png"], ["2.jpg", "3.jpg"]) == (["1", "2"], ["2", "3"])
    assert paired(["left_07.png", "left_08.png"], ["r2_8.png"]) == (["7", "8"], ["8"])
    with pytest.raises(FreelookError, match="same number at its end"):
        paired(["left_1.png"], ["right_2.png"])
    with pytest.raises(FreelookError, match="same number at its end"):  # which 1?
        paired(["a_1.png", "b_1.png"], ["c_1.png"])


def test_what_is_no_pair_of_inputs_is_said(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", "stereo", str(rig / "left"), "right.mp4"]) == 2
    assert "give two of a kind" in capsys.readouterr().err
    assert main(["calibrate", "stereo", str(rig / "left"), str(tmp_path)]) == 2
    assert "no pictures in it" in capsys.readouterr().err


def test_a_camera_that_sees_no_board_is_named(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cv2.imwrite(str(tmp_path / "0.png"), np.full((400, 400), 90, np.uint8))
    assert main(["calibrate", "stereo", str(rig / "left"), str(tmp_path), *OPTIONS]) == 2
    assert "not found in any picture of the right camera" in capsys.readouterr().err


def film(folder: Path, out: Path) -> Path:
    """Every picture held for two frames; where one is missing, nothing but gray."""
    pictures = {path.stem[-1]: path for path in folder.iterdir()}
    size = np.asarray(cv2.imread(str(next(iter(pictures.values()))))).shape
    with av.open(str(out), "w") as file:
        stream = file.add_stream("libx264", rate=10, options={"crf": "8"})
        stream.height, stream.width, stream.pix_fmt = size[0], size[1], "yuv420p"
        for number in range(len(PLACES)):
            path = pictures.get(str(number))
            shown = cv2.imread(str(path)) if path else np.full(size, 90, np.uint8)
            for _ in range(2):
                frame = av.VideoFrame.from_ndarray(np.asarray(shown, np.uint8), format="bgr24")
                file.mux(stream.encode(frame))
        file.mux(stream.encode(None))
    return out


def test_videos_are_paired_by_frame(
    rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    videos = [film(rig / side, tmp_path / f"{side}.mp4") for side in ("left", "right")]
    assert main(["calibrate", "stereo", *map(str, videos), *OPTIONS, "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert (figures["pairs"], figures["singles"]) == (5, 1)
    translation = figures["rig"]["right_from_left"]["translation"]
    np.testing.assert_allclose(translation, SHIFT, atol=1e-3)  # compressed: twice as wide
