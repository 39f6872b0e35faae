"""freelook calibrate lines: a lens from clicked lines, and from a picture."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from freelook.camera import make_camera
from freelook.cli import main
from freelook.formats import load_profile
from freelook.lens import Equisolid

SIZE, RIM_PX, FIELD_DEG = (800, 800), 390.0, 160
TRUTH = make_camera(
    SIZE, Equisolid(RIM_PX / (2 * np.sin(np.radians(FIELD_DEG / 4)))), field_deg=FIELD_DEG
)
ROWS_OF_A_LINE = 12


def calibrate_lines(*arguments: object) -> int:
    return main(["calibrate", "lines", *map(str, arguments)])


def table(*, along: bool = False) -> str:
    """Nine lines of a room, in a CSV."""
    random = np.random.default_rng(2)
    axes = np.linalg.qr(random.normal(size=(3, 3)))[0]
    rows = ["name,line,x,y" + ",along" * along]
    number = 0
    while number < 9:
        axis = axes[:, number % 3]
        across = np.cross(axis, random.normal(size=3))
        across /= np.linalg.norm(across)
        turn = np.radians(random.uniform(0, 360) + np.linspace(0, 80, ROWS_OF_A_LINE))[:, None]
        pixels = TRUTH.project(np.cos(turn) * axis + np.sin(turn) * across)
        if not np.isfinite(pixels).all():
            continue
        pixels += 0.2 * random.normal(size=pixels.shape)
        way = f",{'xyz'[number % 3]}" * along
        rows += [f"hall.png,{number},{x:.2f},{y:.2f}{way}" for x, y in pixels]
        number += 1
    return "\n".join(rows) + "\n"


@pytest.fixture
def start(tmp_path: Path) -> Path:
    path = tmp_path / "start.json"
    profile = {
        "freelook_lens": 1,
        "size": SIZE,
        "model": "equidistant",
        "parameters": {"f": RIM_PX / np.radians(FIELD_DEG / 2)},
        "field_deg": FIELD_DEG,
    }
    path.write_text(json.dumps(profile), "utf-8")
    return path


@pytest.fixture
def clicked(tmp_path: Path) -> Path:
    path = tmp_path / "lines.csv"
    path.write_text(table(along=True), "utf-8")
    return path


def off_px(profile: Path) -> float:
    theta = np.radians(np.array([20.0, 40.0, 60.0]))
    off = load_profile(profile).camera.lens.radius(theta) - TRUTH.lens.radius(theta)
    return float(np.abs(off).max())


def test_clicked_lines_make_a_profile(
    tmp_path: Path, start: Path, clicked: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "lens.json"
    assert calibrate_lines("--lens", start, "--lines", clicked, "-o", out) == 0
    said = capsys.readouterr().out
    assert said.startswith("from lines: less certain than a board\n9 of 9 lines in 1 picture")
    assert "assumed: 160 ± 1 degrees" in said
    assert load_profile(out).source.startswith("from lines: less certain than a board: 9 straight")
    assert off_px(out) < 0.4 * off_px(start)
    assert calibrate_lines("--lens", start, "--lines", clicked, "-o", out) == 2
    assert "exists already" in capsys.readouterr().err


def test_figures_as_json(start: Path, clicked: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert calibrate_lines("--lens", start, "--lines", clicked, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["grade"] == "from lines: less certain than a board"
    assert found["lines"] == found["lines_kept"] == 9
    assert found["rms_after_px"] < found["rms_before_px"]
    assert found["assumed"]["field_deg"] == pytest.approx(FIELD_DEG)
    assert not found["field_contradicts_lines"]
    assert [row["sigma_px"] > 0 for row in found["radius_sigma_px"]] == [True] * 4


def picture(path: Path) -> Path:
    """A light hall with dark beams, seen by TRUTH; black outside of the image circle."""
    image = cv2.circle(np.zeros(SIZE, np.uint8), (400, 400), int(RIM_PX), 170, -1, cv2.LINE_AA)
    for at in np.linspace(-1.4, 1.4, 5):
        for axis in (0, 1):
            sides = []
            for beside in (at, at + 0.09):
                points = np.ones((300, 3))
                points[:, axis] = np.linspace(-5, 5, 300)
                points[:, 1 - axis] = beside
                pixels = TRUTH.project(points)
                sides.append(pixels[np.isfinite(pixels[:, 0])])
            outline = np.rint(np.concatenate([sides[0], sides[1][::-1]]) * 16).astype(np.int32)
            cv2.fillPoly(image, [outline], 60 + 40 * axis, cv2.LINE_AA, 4)
    cv2.imwrite(str(path), cv2.GaussianBlur(image, (0, 0), 0.8))
    return path


def test_picture_alone(tmp_path: Path, start: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The circle and the lines are both found in it."""
    hall, out, drawn = (tmp_path / name for name in ("hall.png", "lens.json", "drawn.png"))
    assert calibrate_lines(picture(hall), "--fov", 160, "-o", out, "--draw", drawn) == 0
    assert "across the image circle" in capsys.readouterr().out
    assert off_px(out) < 0.5 * off_px(start)
    seen = np.asarray(cv2.imread(str(drawn)), int)
    assert ((seen[..., 1] > 150) & (seen[..., 0] < 120)).sum() > 1000  # green and amber lines


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name,line,x\n", "there are: name, line, x"),
        ("", "there are: none"),
        ("line,x,y\na,1,2\na,one,2\n", "line 3: x and y are no numbers"),
        ("line,x,y\na,1,nan\n", "line 2: x and y are no numbers"),
        ("line,x,y\na,1\n", "line 2: x and y are no numbers"),
        ("line,x,y,along\na,1,2,x\na,3,4,y\n", "line 3: line a runs along two directions"),
        ("line,x,y\n", "no lines"),
        ("line,x,y\na,1,2\na,3,4\n", "line a has 2 points"),
    ],
)
def test_table_that_is_wrong(
    text: str, words: str, tmp_path: Path, start: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text, "utf-8")
    assert calibrate_lines("--lens", start, "--lines", path) == 2
    assert words in capsys.readouterr().err


def test_what_is_missing_is_named(
    tmp_path: Path, start: Path, clicked: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = {
        "give pictures or a video": ("--lens", start),
        "need a picture": ("--fov", 160, "--lines", clicked),
        "--fov-error must be": ("--lens", start, "--lines", clicked, "--fov-error", -1),
        "No such file": ("--lens", start, "--lines", tmp_path / "none.csv"),
        "which is none of: other.png": (
            *(picture(tmp_path / "other.png"), "--lens", start, "--lines", clicked),
        ),
    }
    for words, arguments in wrong.items():
        assert calibrate_lines(*arguments) == 2
        assert words in capsys.readouterr().err
