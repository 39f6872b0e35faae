"""Files of corners: read rightly, and whatever is wrong in them is said with its line."""

from __future__ import annotations

import contextlib
import json
import subprocess
from importlib import import_module
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.calibration.calibrate import calibrate
from freelook.calibration.targets import AprilGrid, Chessboard, Circles
from freelook.errors import CalibrationError
from freelook.formats.corners import FORMATS, corner_format, is_corner_file, read_corner_files
from freelook.lens import Floats

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
    found = read_corner_files([str(shot)])
    (view,) = found.views
    assert found.size == (64, 48)
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
    with pytest.raises(
        CalibrationError, match=r"other\.orpc: its pictures are 640 x 48 .* 64 x 48"
    ):
        read_corner_files([str(shot), str(other)])


def test_files_that_cannot_be_read_are_named(shot: Path) -> None:
    shot.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(CalibrationError, match=r"shot\.orpc: not a text file"):
        read_corner_files([str(shot)])
    with pytest.raises(CalibrationError, match=r"nowhere\.orpc: No such file"):
        read_corner_files([str(shot.with_name("nowhere.orpc"))])


TARGET = Chessboard(0.1, (4, 3))
SIZE = (64, 48)


def some_pixels(views: int = 2, seed: int = 1) -> Floats:
    """(views, 12, 2), as exact as FileStorage's floats."""
    rng = np.random.default_rng(seed)
    return rng.uniform(1, 47, (views, 12, 2)).astype(np.float32).astype(np.float64)


def vnl(pixels: Floats, third: str = "level") -> str:
    lines = ["#! made up", f"# filename x y {third}"]
    for i, view in enumerate(pixels):
        lines += [f"shot{i}.png {x:.6f} {y:.6f} 1" for x, y in view]
    return "\n".join(lines) + "\n"


def written(path: Path, text: str) -> str:
    path.write_text(text, "utf-8")
    return str(path)


def test_vnl_is_read_in_the_order_of_the_target(tmp_path: Path) -> None:
    """A corner without level, or with a negative one, is missing; so are pictures of dashes."""
    pixels = some_pixels()
    lines = vnl(pixels).splitlines()
    lines[3] = lines[3][:-1] + "-"
    lines[5] = lines[5][:-1] + "-1"
    lines[6] = "shot0.png - - -"
    lines += ["empty.png - -"]
    found = read_corner_files([written(tmp_path / "a.vnl", "\n".join(lines))], TARGET, SIZE)
    assert (found.size, found.without) == (SIZE, ["empty.png"])
    first, second = found.views
    assert [first.name, second.name] == ["shot0.png", "shot1.png"]
    kept = np.delete(np.arange(12), [1, 3, 4])
    assert first.pixels == pytest.approx(pixels[0][kept], abs=1e-6)
    assert first.points.tolist() == TARGET.points[kept].tolist()
    assert second.pixels == pytest.approx(pixels[1], abs=1e-6)


def test_weights_of_a_vnl_are_none_at_zero(tmp_path: Path) -> None:
    text = vnl(some_pixels(), "weight").replace(" 1\n", " 0\n", 1)
    (first, second) = read_corner_files([written(tmp_path / "a.vnl", text)], TARGET, SIZE).views
    assert (len(first.pixels), len(second.pixels)) == (11, 12)


def test_size_of_the_pictures_is_theirs_if_they_are_here(tmp_path: Path) -> None:
    path = written(tmp_path / "a.vnl", vnl(some_pixels()))
    with pytest.raises(CalibrationError, match=r"shot0\.png is not here; give --size"):
        read_corner_files([path], TARGET)
    cv2.imwrite(str(tmp_path / "shot0.png"), np.zeros((50, 70), np.uint8))
    assert read_corner_files([path], TARGET).size == (70, 50)


def test_table_of_numbered_corners(tmp_path: Path) -> None:
    """As of an AprilGrid: any corners in any order; other columns are passed over."""
    grid = AprilGrid((2, 2), 0.1)
    text = "# timestamp corner_id u v sigma\n100 15 1.5 2.5 0.1\n100 0 3 4 0.1\n\n200 3 5 6 0.1\n"
    found = read_corner_files([written(tmp_path / "a.txt", text)], grid, SIZE)
    first, second = found.views
    assert (first.name, second.name) == ("100", "200")
    assert first.pixels.tolist() == [[1.5, 2.5], [3, 4]]
    assert first.points.tolist() == grid.points[[15, 0]].tolist()
    text = "Image,Y,X,Corner\nmy shot.png, 2 ,1,3\n"
    (view,) = read_corner_files([written(tmp_path / "a.csv", text)], grid, SIZE).views
    assert (view.name, view.pixels.tolist()) == ("my shot.png", [[1, 2]])


def storage(path: Path, values: dict[str, Any]) -> str:
    """Written by OpenCV itself."""
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in values.items():
        if isinstance(value, list):
            file.startWriteStruct(key, cv2.FILE_NODE_SEQ)
            for one in value:
                file.write("", one)
            file.endWriteStruct()
        else:
            file.write(key, value)
    file.release()
    return str(path)


CALIBRATION = {"image_width": 64, "image_height": 48, "board_width": 4, "board_height": 3}


@pytest.mark.parametrize("suffix", [".yml", ".xml", ".json"])
def test_what_opencv_writes(tmp_path: Path, suffix: str) -> None:
    """A matrix of all views as its calibration program has it; one for each; its own grid."""
    pixels = some_pixels().astype(np.float32)
    values = CALIBRATION | {"square_size": 0.1, "image_points": pixels}
    one = read_corner_files([storage(tmp_path / f"one{suffix}", values)])
    values["image_points"] = list(pixels)
    each = read_corner_files([storage(tmp_path / f"each{suffix}", values)])
    column = values | {"image_points": [view[:, None] for view in pixels]}
    columns = read_corner_files([storage(tmp_path / f"columns{suffix}", column)])
    for found in (one, each, columns):
        assert found.size == (64, 48)
        at = [view.pixels for view in found.views]
        assert at == pytest.approx(pixels, rel=1e-7)  # written with nine digits
        assert found.views[1].points == pytest.approx(TARGET.points)
    values["grid_points"] = (2 * TARGET.points).astype(np.float32)
    found = read_corner_files([storage(tmp_path / f"grid{suffix}", values)])
    assert found.views[0].points == pytest.approx(2 * TARGET.points)


def test_object_points_as_python_dumps_them(tmp_path: Path) -> None:
    """Nested lists, each view with its own points."""
    pixels = some_pixels()
    points = [TARGET.points[:7], TARGET.points]
    dumped = {
        "imgpoints": [[[at] for at in pixels[0][:7].tolist()], pixels[1].tolist()],
        "objpoints": [part.tolist() for part in points],
    }
    path = written(tmp_path / "a.json", json.dumps(dumped))
    found = read_corner_files([path], size=SIZE)
    for view, part in zip(found.views, points, strict=True):
        assert view.points.tolist() == part.tolist()
    assert found.views[0].pixels.tolist() == pixels[0][:7].tolist()


def test_the_users_target_goes_before_the_files(tmp_path: Path) -> None:
    values = CALIBRATION | {"image_points": some_pixels().astype(np.float32)}
    path = storage(tmp_path / "a.yml", values)
    circles = Circles(0.02, (4, 3), asymmetric=True)
    assert read_corner_files([path], circles).views[0].points == pytest.approx(circles.points)
    (view, _) = read_corner_files([path], Chessboard(0.5)).views  # a square, but no size
    assert view.points == pytest.approx(5 * TARGET.points)
    with pytest.raises(CalibrationError, match="view 1 has 12 corners, the target 54"):
        read_corner_files([path], Chessboard(0.1, (9, 6)))


VNL = vnl(some_pixels())
TABLE = "name,corner,x,y\na.png,0,1,2\na.png,11,3,4\n"
OPENCV = json.dumps(CALIBRATION | {"image_points": some_pixels().tolist()})
WRONG = [
    ("a.vnl", VNL.replace("# filename x y level\n", ""), r"line 2: no legend before it"),
    ("a.vnl", VNL.replace("# filename x y", "# image x y"), r"line 2: the legend must begin"),
    ("a.vnl", VNL.replace(" 1\n", " 1 1\n", 1), r"line 3: 5 fields, the legend has 4"),
    ("a.vnl", VNL.replace(" 1\n", " fine\n", 1), r"line 3: level must be numbers"),
    ("a.vnl", VNL.replace("shot0.png ", "shot0.png x", 1), r"line 3: x and y must be numbers"),
    ("a.vnl", VNL + "shot0.png 1 2 0\n", r"line 27: shot0\.png again, after another"),
    ("a.vnl", VNL + "shot1.png 1 2 0\n", r"line 27: shot1\.png has 13 corners, the target 12"),
    ("a.vnl", "# filename x y\n", r"a\.vnl: no corner in it"),
    ("a.csv", TABLE.replace("corner,", "which,"), r"line 1: it must name one column 'corner'"),
    ("a.csv", TABLE.replace("11", "12"), r"line 3: corner 12; the target has 0 to 11"),
    ("a.csv", TABLE.replace("11", "0"), r"line 3: corner 0 of this picture again"),
    ("a.csv", TABLE.replace(",3,4", ",3"), r"line 3: 3 fields"),
    ("a.csv", TABLE.replace("3,4", "3,1e99"), r"line 3: corner, x and y must be numbers"),
    ("a.csv", "name,corner,x,y\n", r"a\.csv: no corner in it"),
    ("a.txt", "\n", r"a\.txt: it is empty"),
    ("a.json", "{}", r"a\.json: not OpenCV's FileStorage"),
    ("a.json", '{"K": 1}', r"no image points \(.*\) in it; its keys are: K"),
    ("a.json", OPENCV[:-3], r"not JSON: .* in line 1, column"),
    ("a.json", OPENCV.replace("[[[", '[[["", '), r"image_points\[0\] must be numbers"),
    ("a.json", OPENCV.replace('"board_width": 4', '"board_width": 5'), r"board is 5 x 3, but its"),
    ("a.yml", "image_points: !!opencv-matrix\n  rows: 2\n  cols: 6\n  dt: 2f\n  data: [1]\n",
     r"image_points must have 24 numbers in data"),
    ("a.yml", "image_points: [[1, 2], [3\n", r"not YAML: .* in line"),
    ("a.xml", "<opencv_storage><image_points>", r"not OpenCV's FileStorage: not XML"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "words"), WRONG, ids=[words for *_, words in WRONG])
def test_what_is_wrong_is_told_with_its_place(
    tmp_path: Path, name: str, text: str, words: str
) -> None:
    target = None if name.endswith(("json", "yml", "xml")) else TARGET
    with pytest.raises(CalibrationError, match=words):
        read_corner_files([written(tmp_path / name, text)], target, SIZE)


def test_a_target_that_is_not_known_is_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path / "a.vnl", VNL)
    with pytest.raises(CalibrationError, match="which target is it"):
        read_corner_files([path])
    with pytest.raises(CalibrationError, match="how many inner corners"):
        read_corner_files([path], Chessboard(0.1))


SOUND = {"a.vnl": VNL, "a.csv": TABLE, "a.json": OPENCV, "a.orpc": CORNERS}
SOUND["a.yml"] = "image_points:\n  - [1.0, 2.0, 3.0, 4.0]\nobject_points:\n  - [1, 1, 0, 2, 2, 0]\n"
SOUND["a.xml"] = (
    "<opencv_storage><image_points><_>1. 2. 3. 4.</_></image_points>"
    "<grid_points>1 1 0 2 2 0</grid_points></opencv_storage>"
)


def check_survives(folder: Path, name: str, data: bytes) -> None:
    """Whatever is in it: views whose numbers are numbers, or a CalibrationError."""
    (folder / "board.dsc").write_text(BOARD)
    (folder / "a.orpc").write_text(CORNERS)
    (folder / name).write_bytes(data)
    name = "a.orpc" if name == "board.dsc" else name
    with contextlib.suppress(CalibrationError):
        for view in read_corner_files([str(folder / name)], TARGET, SIZE).views:
            assert view.pixels.shape == (len(view.points), 2)
            assert np.isfinite(view.pixels).all()
            assert np.isfinite(view.points).all()


def test_the_sound_ones_are_read(tmp_path: Path) -> None:
    """So that the damaged ones are damaged in what is read."""
    for name, text in SOUND.items():
        (tmp_path / "board.dsc").write_text(BOARD)
        target = None if name in ("a.yml", "a.xml") else TARGET
        assert read_corner_files([written(tmp_path / name, text)], target, SIZE).views, name
    assert len({corner_format(name) for name in SOUND}) == len(FORMATS)


@pytest.mark.parametrize("name", [*SOUND, "board.dsc"])
@given(data=st.data())
def test_hostile_bytes(tmp_path_factory: pytest.TempPathFactory, name: str, data: Any) -> None:
    """Some bytes of a sound file replaced by any others, or nothing but any bytes."""
    sound = (SOUND | {"board.dsc": BOARD})[name].encode()
    start = data.draw(st.integers(0, len(sound)))
    stop = data.draw(st.integers(start, min(start + 20, len(sound))))
    middle = data.draw(st.binary(max_size=8) | st.sampled_from(PARTS))
    folder = tmp_path_factory.mktemp("corners", numbered=True)
    check_survives(folder, name, sound[:start] + middle + sound[stop:])
    check_survives(folder, name, data.draw(st.binary(max_size=60)))


PARTS = [
    b"-",
    b"nan",
    b"1e999",
    b"99999999999999999999",
    b"\0",
    b"[[[",
    b"{",
    b"\n",
    b"#",
    b",",
    b"<_>",
]
PARTS += [b"null", b"true", b'"', b"\xff\xfe", b"&a", b"*a", b"]", b"}"]


MRCAL = """
import json, sys, mrcal
observations, _, paths = mrcal.compute_chessboard_corners(
    4, 3, corners_cache_vnl=sys.argv[1], jobs=-1
)
print(json.dumps([paths, observations.reshape(len(paths), -1, 3).tolist()]))
"""


def test_mrcal_reads_the_same(tmp_path: Path) -> None:
    """Where the system's Python has mrcal: the same pictures, corners and missing ones."""
    python = "/usr/bin/python3"
    if (
        not Path(python).exists()
        or subprocess.run(
            [python, "-c", "import mrcal"], capture_output=True, check=False
        ).returncode
    ):
        pytest.skip("mrcal is not installed for the system's Python")
    lines = vnl(some_pixels(3)).splitlines()
    lines[4], lines[7], lines[9] = (
        lines[i][:-1] + end for i, end in ((4, "-"), (7, "-2"), (9, "0"))
    )
    path = written(tmp_path / "a.vnl", "\n".join([*lines, "empty.png - - -", ""]))
    ran = subprocess.run(
        [python, "-c", MRCAL, path], capture_output=True, check=True, cwd=tmp_path, text=True
    )
    paths, observations = json.loads(ran.stdout)
    found = read_corner_files([path], TARGET, SIZE)
    assert [view.name for view in found.views] == [Path(path).name for path in paths]
    for view, theirs in zip(found.views, np.array(observations), strict=True):
        there = theirs[:, 2] > 0
        assert view.pixels == pytest.approx(theirs[there, :2], abs=1e-9)
        assert view.points.tolist() == TARGET.points[there].tolist()


def test_every_format_has_its_row_in_the_documentation() -> None:
    page = Path(__file__).parents[2] / "docs" / "calibration.md"
    for name in FORMATS:
        module = import_module(f"freelook.formats.corners.{name}")
        endings = " ".join(f"`{suffix}`" for suffix in module.SUFFIXES)
        row = f"| {endings} | {(module.__doc__ or '').splitlines()[0]} |"
        assert row in page.read_text("utf-8"), row


@pytest.mark.data
def test_all_corners_of_the_ov_plane_data(shared_data: Path) -> None:
    """6864 corners beyond 90 degrees, which OpenCV's fisheye calibration aborts on; 0.48 px is
    what a Kannala-Brandt fit is known to reach."""
    found = read_corner_files(sorted(map(str, shared_data.glob("ov_plane/train/*.orpc"))))
    views, size = found.views, found.size
    assert (len(views), sum(len(v.pixels) for v in views)) == (18, 6864)
    result = calibrate(views, size, "kannala_brandt", drop=False)
    assert result.rejected == 0
    assert result.rms_px <= 0.482
    assert np.degrees(result.seen_rad) > 92
