"""Files of corners: read rightly, and whatever is wrong in them is said with its line."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.calibration.calibrate import calibrate
from freelook.calibration.corner_files import is_corner_file, read_corner_files
from freelook.errors import CalibrationError

BOARD = "0,2,2,1.0\nt25h7,2.0\n-1,0,1,0.0,0.1,0\n-1,1,1,0.1,0.1,0\n-1,0,0,0.0,0.0,0\n"
CORNERS = (
    "filename: shot.png\nwidth: 64\nheight: 48\nnum_corners: 2\nencoding: ascii\n"
    "0,2,1,10.5,20.25\n0,0,1,11,2e1\n"
)


@pytest.fixture
def shot(tmp_path: Path) -> Path:
    (tmp_path / "board.dsc").write_text(BOARD)
    (tmp_path / "shots").mkdir()
    path = tmp_path / "shots" / "shot.orpc"
    path.write_text(CORNERS)
    return path


def test_corners_are_put_on_their_board(shot: Path) -> None:
    assert is_corner_file(str(shot))
    assert not is_corner_file("shot.png")
    (view,), size = read_corner_files([str(shot)])
    assert size == (64, 48)
    assert view.name == str(shot)
    assert view.points.tolist() == [[0, 0, 0], [0, 0.1, 0]]
    assert view.pixels.tolist() == [[10.5, 20.25], [11, 20]]


FAULTS = [
    ("0,2,1,10.5,20.25", "0,2,1,10.5", r"shot\.orpc, line 6: expected board,number,type,x,y"),
    ("0,2,1", "0,3,1", r"line 6: corner 3; board\.dsc has 0 to 2"),
    ("0,2,1", "0,1.5,1", r"line 6: corner 1\.5"),
    ("10.5", "nan", r"line 6: number, x and y must be numbers"),
    ("10.5", "ten", r"line 6: number, x and y must be numbers"),
    ("width: 64", "width: wide", r"its header must say width"),
    ("height: 48\n", "", r"its header must say height"),
    ("encoding: ascii", "encoding: binary", r"encoding binary; only ascii is read"),
]


@pytest.mark.parametrize(("old", "new", "words"), FAULTS, ids=[words for *_, words in FAULTS])
def test_faults_are_named_with_their_line(shot: Path, old: str, new: str, words: str) -> None:
    shot.write_text(CORNERS.replace(old, new))
    with pytest.raises(CalibrationError, match=words):
        read_corner_files([str(shot)])


def test_the_board_must_be_there_and_be_one(shot: Path) -> None:
    board = shot.parent.parent / "board.dsc"
    board.with_name("other.dsc").write_text(BOARD)
    with pytest.raises(CalibrationError, match=r"which board is it\? .* board\.dsc, other\.dsc"):
        read_corner_files([str(shot)])
    board.with_name("other.dsc").unlink()
    board.write_text("0,2,2,1.0\n")
    with pytest.raises(CalibrationError, match=r"board\.dsc: no line of the kind"):
        read_corner_files([str(shot)])
    board.unlink()
    with pytest.raises(CalibrationError, match=r"no board description \(\*\.dsc\)"):
        read_corner_files([str(shot)])


def test_pictures_of_two_sizes_are_not_mixed(shot: Path) -> None:
    other = shot.with_name("other.orpc")
    other.write_text(CORNERS.replace("width: 64", "width: 640"))
    with pytest.raises(CalibrationError, match=r"other\.orpc: its picture is 640 x 48 .* 64 x 48"):
        read_corner_files([str(shot), str(other)])


def test_files_that_cannot_be_read_are_named(shot: Path) -> None:
    shot.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(CalibrationError, match=r"shot\.orpc: not a text file"):
        read_corner_files([str(shot)])
    with pytest.raises(CalibrationError, match=r"nowhere\.orpc: No such file"):
        read_corner_files([str(shot.with_name("nowhere.orpc"))])


@given(st.integers(0, len(CORNERS) - 1), st.characters(codec="utf-8"))
def test_one_wrong_letter(tmp_path_factory: pytest.TempPathFactory, at: int, letter: str) -> None:
    folder = tmp_path_factory.mktemp("corners")
    (folder / "board.dsc").write_text(BOARD)
    path = folder / "shot.orpc"
    path.write_text(CORNERS[:at] + letter + CORNERS[at + 1 :])
    with contextlib.suppress(CalibrationError):
        (view,), _ = read_corner_files([str(path)])
        assert np.isfinite(view.pixels).all()


@pytest.mark.data
def test_all_corners_of_the_ov_plane_data(shared_data: Path) -> None:
    """6864 corners beyond 90 degrees, which OpenCV's fisheye calibration aborts on; 0.48 px is
    what a Kannala-Brandt fit is known to reach."""
    views, size = read_corner_files(sorted(map(str, shared_data.glob("ov_plane/train/*.orpc"))))
    assert (len(views), sum(len(v.pixels) for v in views)) == (18, 6864)
    result = calibrate(views, size, "kannala_brandt", drop=False)
    assert result.rejected == 0
    assert result.rms_px <= 0.482
    assert np.degrees(result.seen_rad) > 92
