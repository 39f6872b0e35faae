"""freelook calibrate mount: from points, from pictures and from a simulated video."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from freelook.cli import main
from freelook.cli.calibrate_mount import known_point, read_attitudes
from freelook.errors import FreelookError
from freelook.formats import load_profile
from freelook.rotations import head_angles_deg

LENS: dict[str, Any] = {
    "freelook_lens": 1,
    "name": "test lens",
    "source": "made for this test",
    "size": [360, 360],
    "model": "equidistant",
    "parameters": {"f": 107.0},
    "field_deg": 188,
}
AHEAD, RIGHT = "179.5,160.8248:0,0", "347.576,179.5:90,0"  # 10 degrees up; 90 to the right


def profile(path: Path, yaw: float = 0, pitch: float = 0) -> Path:
    path.write_text(json.dumps({**LENS, "mount_deg": {"yaw": yaw, "pitch": pitch}}), "utf-8")
    return path


@pytest.fixture
def lens(tmp_path: Path) -> Path:
    return profile(tmp_path / "lens.json")


def mount(*arguments: str | Path) -> int:
    return main(["calibrate", "mount", *map(str, arguments)])


def angles(path: Path) -> tuple[float, float, float]:
    return head_angles_deg(load_profile(str(path)).camera.camera_from_body.inv())


def test_points_put_the_mounting_into_the_profile(
    lens: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is straight ahead is 10 degrees above the middle: the camera looks 10 degrees down."""
    assert mount("--lens", lens, "--point", AHEAD, "--point", RIGHT, "-o", lens) == 0
    assert angles(lens) == pytest.approx((0, -10, 0), abs=1e-3)
    kept = load_profile(str(lens))
    assert kept.name == "test lens"
    assert kept.source == "made for this test; mounting from 2 x known points"
    assert "-10.00 degrees (down)" in capsys.readouterr().out


def test_nothing_else_is_replaced_unasked(lens: Path, capsys: pytest.CaptureFixture[str]) -> None:
    other = lens.with_name("other.json")
    other.write_text("mine", "utf-8")
    asked = ("--lens", lens, "--point", AHEAD, "--point", RIGHT, "-o", other)
    assert mount(*asked) == 2
    assert "--overwrite" in capsys.readouterr().err
    assert other.read_text("utf-8") == "mine"
    assert mount(*asked, "--overwrite") == 0
    assert angles(other)[1] == pytest.approx(-10, abs=1e-3)


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A video of a camera mounted 5 degrees right and 10 down, and its truth."""
    folder = tmp_path_factory.mktemp("flight")
    video, truth = folder / "flight.mp4", folder / "truth.csv"
    lens = profile(folder / "true.json", yaw=5, pitch=-10)
    options = ["--lens", str(lens), "--truth", str(truth), "--seconds", "16", "--fps", "0.25"]
    assert main(["simulate", str(video), *options]) == 0
    return video, truth


def test_a_simulated_flight_gives_its_mounting_back(
    flight: tuple[Path, Path], lens: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """To half a degree, a pixel of this small picture: yaw too, since it banks."""
    video, truth = flight
    out = lens.with_name("found.json")
    assert mount("--lens", lens, video, "--attitude", truth, "--json", "-o", out) == 0
    found = json.loads(capsys.readouterr().out)
    assert angles(out) == pytest.approx((5, -10, 0), abs=0.5)
    assert found["yaw"] == "found"
    assert len(found["used"]) == 4
    assert found["mount_deg"]["pitch"] == pytest.approx(angles(out)[1])
    assert 0 < found["sigma_deg"]["pitch"] < 0.3


def test_a_picture_leaves_the_yaw_as_told(
    flight: tuple[Path, Path], lens: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still, attitudes = lens.with_name("still.png"), lens.with_name("shots.csv")
    true = flight[0].with_name("true.json")
    assert main(["simulate", str(still), "--lens", str(true), "--start", "0"]) == 0
    attitudes.write_text("name,roll_deg,pitch_deg\nstill.png,0,0\n", "utf-8")
    asked = ("--lens", lens, still, "--attitude", attitudes, "--mount=5,0,0")
    assert mount(*asked) == 0
    said = capsys.readouterr().out
    assert "yaw       5.00 degrees (right), as told" in said
    assert "pitch   -10." in said or "pitch    -9.9" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "either --point"),
        (["--point", AHEAD, "shot.png"], "either --point"),
        (["--point", "1,2,3"], "not X,Y:YAW,PITCH"),
        (["--point", AHEAD], "two are needed"),
        (["shot.png"], "--attitude CSV"),
        (["shot.png", "--attitude", "none.csv"], "none.csv: No such file"),
    ],
)
def test_what_is_missing_is_said(
    arguments: list[str], said: str, lens: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert mount("--lens", lens, *arguments) == 2
    assert said in capsys.readouterr().err


def test_points_are_understood() -> None:
    point = known_point("812.5, 455:-30,+10")
    assert (point.pixel, point.yaw_deg, point.pitch_deg) == ((812.5, 455.0), -30.0, 10.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "columns name, roll_deg, pitch_deg"),
        ("name,roll\na,1\n", "there are: name, roll"),
        ("name,roll_deg,pitch_deg\na,1,x\n", "line 2"),
        ("name,roll_deg,pitch_deg\na,1,2\nb,1\n", "line 3"),
        ("name,roll_deg,pitch_deg\na,nan,2\n", "line 2"),
        ("qw,qx,qy,qz\n0,0,0,0\n", "line 2"),
    ],
)
def test_wrong_attitudes_are_named(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    file.write_text(text, "utf-8")
    with pytest.raises(FreelookError, match=said):
        read_attitudes(str(file))


def test_quaternions_are_attitudes_too(tmp_path: Path) -> None:
    """Half a right angle to the right side: (cos 22.5, sin 22.5, 0, 0) degrees."""
    file = tmp_path / "a.csv"
    file.write_text("t_s,qw,qx,qy,qz\n0,0.9238795,0.3826834,0,0\n", "utf-8")
    ((name, (roll, pitch)),) = read_attitudes(str(file))
    assert name is None
    assert (roll, pitch) == pytest.approx((45, 0), abs=1e-4)


def test_a_picture_without_a_row_is_named(lens: Path, capsys: pytest.CaptureFixture[str]) -> None:
    attitudes = lens.with_name("shots.csv")
    attitudes.write_text("name,roll_deg,pitch_deg\nb.png,0,0\n", "utf-8")
    assert mount("--lens", lens, lens.with_name("a.png"), "--attitude", attitudes) == 2
    assert "no row for a.png among the attitudes; there are: b.png" in capsys.readouterr().err


def test_a_video_needs_a_row_for_every_frame(
    flight: tuple[Path, Path], lens: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    short = lens.with_name("short.csv")
    short.write_text("\n".join(flight[1].read_text("utf-8").splitlines()[:-1]), "utf-8")
    assert mount("--lens", lens, flight[0], "--attitude", short) == 2
    assert "4 frames, the attitudes are 3" in capsys.readouterr().err
