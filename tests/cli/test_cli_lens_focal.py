"""freelook lens focal: the paper's equation 1, and how wrong it is."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from freelook.camera import make_camera
from freelook.cli import main
from freelook.lens import MODELS

BASE = ["--distance", "100", "--height", "12", "--image-height"]


def focal(*arguments: str) -> int:
    return main(["lens", "focal", *arguments])


def found(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert focal(*arguments, "--json") == 0
    facts: dict[str, Any] = json.loads(capsys.readouterr().out)
    return facts


def test_f_over_h_is_d_over_h(capsys: pytest.CaptureFixture[str]) -> None:
    facts = found(capsys, *BASE, "36")
    assert facts["f_px"] == 300
    assert facts["f_mm"] is None
    assert facts["half_angle_deg"] == pytest.approx(np.degrees(np.arctan(0.06)), rel=1e-5)


def test_the_unit_of_distance_and_height_does_not_matter(
    capsys: pytest.CaptureFixture[str],
) -> None:
    metres = found(capsys, "--distance", "0.1", "--height", "0.012", "--image-height", "36px")
    assert metres["f_px"] == 300


def test_pixels_and_millimetres(capsys: pytest.CaptureFixture[str]) -> None:
    in_px = found(capsys, *BASE, "36", "--pixel-size", "5")
    assert (in_px["f_px"], in_px["f_mm"]) == (300, 1.5)
    in_mm = found(capsys, *BASE, "0.18mm", "--pixel-size", "5")
    assert (in_mm["f_px"], in_mm["f_mm"]) == (300, 1.5)
    assert found(capsys, *BASE, "0.18mm")["f_px"] is None


@pytest.mark.parametrize(
    "model", ["perspective", "stereographic", "equidistant", "equisolid", "orthographic"]
)
@pytest.mark.parametrize("height", [2.0, 60.0])
def test_the_correction_gives_the_lens_back(
    model: str, height: float, capsys: pytest.CaptureFixture[str]
) -> None:
    """An object is projected by a camera of f = 300, its image measured, and f found again."""
    camera = make_camera((2000, 2000), MODELS[model](300.0), field_deg=120)  # type: ignore[call-arg]
    ends = camera.project(np.array([[0, -height / 2, 100], [0, height / 2, 100]]))
    image = f"{ends[1, 1] - ends[0, 1]:.9f}"
    options = ["--distance", "100", "--height", str(height), "--image-height", image]
    facts = found(capsys, *options)
    (row,) = [row for row in facts["models"] if row["model"] == model]
    assert row["f_px"] == pytest.approx(300, rel=1e-5)
    assert facts["f_px"] == pytest.approx(300, rel=1e-4 if height == 2 else 0.13)


def test_where_one_percent_is_reached(capsys: pytest.CaptureFixture[str]) -> None:
    """Closed forms: for orthographic cos(a) = 0.99, for stereographic 2 tan(a/2) = 0.99 tan(a)."""
    rows = {row["model"]: row for row in found(capsys, *BASE, "36")["models"]}
    assert rows["perspective"]["good_to_1_percent_deg"] is None
    limit = rows["orthographic"]["good_to_1_percent_deg"]
    assert limit == pytest.approx(np.degrees(np.arccos(0.99)), abs=1e-4)
    limit = rows["stereographic"]["good_to_1_percent_deg"]
    # 2 tan(a/2) / tan(a) = 1 - tan^2(a/2)
    assert limit == pytest.approx(2 * np.degrees(np.arctan(0.1)), abs=1e-4)


def test_a_small_object_is_good_and_a_large_one_is_warned_of(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert focal(*BASE, "36") == 0
    out = capsys.readouterr().out
    assert "f = 300 pixels" in out
    assert "3.43 degrees to each side: good to 1 % for any lens" in out
    assert focal("--distance", "100", "--height", "80", "--image-height", "200") == 0
    out = capsys.readouterr().out
    assert "careful: at 21.8 degrees to each side of the axis the models differ" in out
    assert "orthographic  lens: -7.2 % (1 % off at 8.1 degrees)" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--distance", "0", "--height", "1", "--image-height", "3"],
            "--distance must be a number",
        ),
        (["--distance", "1", "--height", "-1", "--image-height", "3"], "--height must be a number"),
        (["--distance", "1", "--height", "nan", "--image-height", "3"], "above 0"),
        ([*BASE, "3", "--pixel-size", "0"], "--pixel-size must be a number above 0"),
    ],
)
def test_impossible_lengths_are_refused(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert focal(*arguments) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("image", ["fuzz", "3cm", "1e3", "-4"])
def test_an_image_height_is_a_length(image: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        focal(*BASE[:4], f"--image-height={image}")
    assert "is no length, such as 38 (pixels) or 0.21mm" in capsys.readouterr().err


def test_the_limits_in_the_documentation_are_these(capsys: pytest.CaptureFixture[str]) -> None:
    text = (Path(__file__).parents[2] / "docs" / "lenses.md").read_text("utf-8")
    said = dict(re.findall(r"^\| (\w+) \| ([\d.]+|never) \|$", text, re.M))
    rows = found(capsys, *BASE, "36")["models"]
    assert len(rows) == 5
    for row in rows:
        limit = row["good_to_1_percent_deg"]
        assert said[row["model"]] == ("never" if limit is None else f"{limit:.1f}")
