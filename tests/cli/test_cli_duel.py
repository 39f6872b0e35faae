"""freelook duel: what it says, what it writes, and two real heads."""

from __future__ import annotations

import json
from pathlib import Path

import av
import pytest

from freelook.cli import main
from freelook.duel.figures import GIMBALS, LINKS, figures

SHORT = ["--seconds", "5", "--predictor", "constant_rate"]


def duel(*arguments: str | Path) -> int:
    return main(["duel", *map(str, arguments)])


def tables(out: str) -> list[dict[str, dict[str, float]]]:
    """For each head, in their order, both sides' numbers as they were printed."""
    names = ("p50", "p95", "p99", "lag", "10", "50", "90", "age")
    rows = [line.split() for line in out.splitlines()]
    sides = [
        (row[0], dict(zip(names, map(float, row[1:]), strict=True)))
        for row in rows
        if row[:1] in (["freelook"], ["gimbal"]) and len(row) == 9
    ]
    return [dict(sides[index : index + 2]) for index in range(0, len(sides), 2)]


def test_a_made_up_head_is_named_as_such(capsys: pytest.CaptureFixture[str]) -> None:
    assert duel(*SHORT) == 0
    out = capsys.readouterr().out
    assert "gimbal hobby-servo, link analogue, prediction: freelook" in out
    assert "40 ms for freelook without prediction, 86 ms for the gimbal" in out
    assert "synthetic head, 5 s" in out
    (table,) = tables(out)
    assert table["freelook"]["p95"] < table["gimbal"]["p95"] / 3
    assert table["freelook"]["lag"] < 15 < 86 < table["gimbal"]["lag"]


def test_it_writes_numbers_a_plot_and_a_video(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "made"
    short = ["--seconds", "4.2", "--predict", "none"]
    changes = ["--set", "slew_deg_s=250", "--set", "dead_band_deg=0"]
    assert duel(*short, *changes, "--out", out, "--video", "--video-seconds", "0.2") == 0
    assert (out / "synthetic-head.svg").read_text("utf-8").startswith("<?xml")
    document = json.loads((out / "duel.json").read_text("utf-8"))
    assert document["settings"]["slew_deg_s"] == {"value": 250.0, "source": "given"}
    assert "SG90" in document["settings"]["command_period_ms"]["source"]
    entry = document["heads"][0]
    assert entry["seconds"] == pytest.approx(4.2, abs=0.01)
    assert set(entry["gimbal"]["turn_ms"]) == {"10", "50", "90"}
    with av.open(str(out / "synthetic-head.mp4")) as container:
        frames = list(container.decode(video=0))
    assert len(frames) == 6
    assert (frames[0].width, frames[0].height) == (1280, 520)
    assert "synthetic-head.mp4" in capsys.readouterr().out

    assert duel(*short, "--out", out) == 2
    assert "duel.json exists already" in capsys.readouterr().err


def test_slow_motors_are_later_at_every_level_of_a_turn(
    capsys: pytest.CaptureFixture[str],
) -> None:
    delays = []
    for slew in (600, 120):
        assert duel("--seconds", "5", "--predict", "none", "--set", f"slew_deg_s={slew}") == 0
        (table,) = tables(capsys.readouterr().out)
        delays.append([table["gimbal"][level] for level in ("10", "50", "90")])
    assert all(slow > quick for quick, slow in zip(*delays, strict=True))
    # 90 % of 60 degrees takes 450 ms at 120 degrees/s; the head itself has taken 300
    assert delays[1][2] - delays[0][2] > 100


def test_prediction_for_the_gimbal_too_brings_it_nearer(
    capsys: pytest.CaptureFixture[str],
) -> None:
    errors = {}
    for who in ("freelook", "both"):
        assert duel(*SHORT, "--gimbal", "brushless", "--predict", who) == 0
        (table,) = tables(capsys.readouterr().out)
        errors[who] = [table[side]["p95"] for side in ("freelook", "gimbal")]
    assert errors["both"][1] < errors["freelook"][1]
    assert errors["both"][0] == errors["freelook"][0]
    assert errors["both"][0] < errors["both"][1]


def test_the_list_has_every_figure_with_its_source(capsys: pytest.CaptureFixture[str]) -> None:
    assert duel("--list") == 0
    out = capsys.readouterr().out
    for name in (*(f"--gimbal {name}" for name in GIMBALS), *(f"--link {name}" for name in LINKS)):
        assert name in out
    for figure in figures("payload", "openhd").values():
        assert figure.source in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--gimbal", "stepper"], "unknown gimbal 'stepper'; known: hobby-servo, brushless"),
        (["--link", "wire"], "unknown link 'wire'; known: analogue, digital"),
        (["--set", "slew=3"], "unknown setting 'slew'; known: "),
        (["--predictor", "oracle"], "oracle"),
        (["--predictor", "hold", "--predict", "none"], "--predict none that nobody does"),
        (["--video"], "--video needs --out DIR"),
        (["absent.txt"], "absent.txt"),
        (["--start", "300"], "nothing between 300 and"),
        (["--seconds", "1"], "a duel needs four seconds or more"),
    ],
)
def test_what_cannot_be_is_one_line(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert duel(*arguments) == 2
    err = capsys.readouterr().err
    assert words in err.splitlines()[-1]


def test_two_heads_of_one_name_would_overwrite_each_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [tmp_path / folder / "head.csv" for folder in ("a", "b")]
    for path in files:
        path.parent.mkdir()
        path.write_text("t_s,yaw_deg,pitch_deg,roll_deg\n0,0,0,0\n5,30,0,0\n")
    assert duel(*files, "--out", tmp_path / "out") == 2
    assert "two heads are called head" in capsys.readouterr().err


def test_settings_are_names_and_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        duel("--set", "slew_deg_s")
    assert "is not NAME=VALUE, such as slew_deg_s=300" in capsys.readouterr().err


@pytest.mark.data
def test_real_heads(shared_data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two users of a headset, 6 s of each; both sides predict."""
    files = sorted((shared_data / "head_motion").glob("*_quaternion.txt"))
    who = ["--gimbal", "brushless", "--predict", "both", "--predictor", "constant_rate"]
    assert duel(*files, *who, "--start", "40", "--seconds", "6") == 0
    out = capsys.readouterr().out
    assert "user1_quaternion, 6 s" in out
    assert "user2_quaternion, 6 s" in out
    found = tables(out)
    assert len(found) == 2
    for table in found:
        assert table["freelook"]["p95"] < 0.6 * table["gimbal"]["p95"]
        assert table["freelook"]["lag"] < table["gimbal"]["lag"] < 86
        assert table["gimbal"]["age"] == pytest.approx(37, abs=2)
        assert table["freelook"]["age"] == pytest.approx(37 + 83 + 1000 / 60, abs=2)
