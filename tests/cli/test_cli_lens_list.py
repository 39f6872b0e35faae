"""freelook lens list: what comes with the program, and what lies in a folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from freelook.cli import main
from freelook.cli.lens._folder import general
from freelook.formats import FORMATS, builtin_names
from freelook.lens import MODELS


def lens_list(*arguments: str | Path) -> int:
    return main(["lens", "list", *map(str, arguments)])


def listed(capsys: pytest.CaptureFixture[str], *arguments: str | Path) -> dict[str, Any]:
    assert lens_list(*arguments, "--json") == 0
    facts: dict[str, Any] = json.loads(capsys.readouterr().out)
    return facts


def test_everything_there_is(capsys: pytest.CaptureFixture[str]) -> None:
    facts = listed(capsys)
    assert [row["profile"] for row in facts["profiles"]] == builtin_names()
    assert [row["model"] for row in facts["models"]] == list(MODELS)
    assert [row["format"] for row in facts["formats"]] == list(FORMATS)
    models = {row["model"]: row for row in facts["models"]}
    assert models["kannala_brandt"]["parameters"] == ["f", "k1", "k2", "k3", "k4"]
    assert models["perspective"]["holds_to_deg"] == 90
    formats = {row["format"]: row for row in facts["formats"]}
    assert formats["freelook"]["suffix"] == ".json"
    assert set(formats["freelook"]["models"]) == set(MODELS)
    profiles = {row["profile"]: row for row in facts["profiles"]}
    assert profiles["demo"]["field_deg"] == 188
    assert all(row["source"] for row in facts["profiles"])


def test_everything_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert lens_list() == 0
    out = capsys.readouterr().out
    for name in (*MODELS, *FORMATS, *builtin_names()):
        assert f"│ {name} " in out
    assert "all models" in out


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    good = {
        "freelook_lens": 1,
        "size": [960, 960],
        "model": "equidistant",
        "parameters": {"f": 280.0},
        "field_deg": 188,
    }
    inner = tmp_path / "lenses" / "inner"
    inner.mkdir(parents=True)

    def put(path: Path, data: Any) -> None:
        path.write_text(data if isinstance(data, str) else json.dumps(data), "utf-8")

    put(inner.parent / "good.json", good)
    put(inner / "folding [1].json", good | {"model": "orthographic", "field_deg": 200})
    put(inner / "folding 2.json", good | {"model": "orthographic", "field_deg": 210})
    put(inner / "broken.json", '{"freelook_lens": 1,')
    put(inner / "strange.json", {"hello": "world"})
    put(inner / "picture.png", "no picture either")
    return inner.parent


def test_a_folder(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    facts = listed(capsys, folder)
    rows = {row["profile"]: row for row in facts["profiles"]}
    assert list(rows) == sorted(rows)
    assert rows["good.json"]["model"] == "equidistant"
    assert rows["good.json"]["field_deg"] == 188
    assert "stops growing at 90.00" in rows["inner/folding [1].json"]["refused"]
    assert "not JSON" in rows["inner/broken.json"]["refused"]
    assert "hello" in rows["inner/strange.json"]["refused"]
    counts = {key: facts[key] for key in ("cameras", "refused", "no_profiles", "other_files")}
    assert counts == {"cameras": 1, "refused": 2, "no_profiles": 2, "other_files": 1}
    most = facts["reasons"][0]
    assert most["count"] == 2
    assert most["first"] == "inner/folding 2.json"
    assert "the claimed field of # degrees" in most["reason"]


def test_a_folder_in_words(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert lens_list(folder) == 0
    captured = capsys.readouterr()
    out = captured.out
    assert "good.json" in out
    assert "folding [1].json" in out  # no markup of it
    assert "not read, and why" in out
    sentence = " ".join(out.split("\n┗")[-1].split("└")[-1].split("┘")[-1].split())
    assert sentence == (
        "1 cameras (0 of them with notes), 2 refused, 2 files that are no profiles, 1 files of "
        "other kinds, not looked at."
    )
    assert "reading profiles" in captured.err


def test_each_of_several_cameras_in_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    camera = """{name}:
  camera_model: pinhole
  intrinsics: [{f}, {f}, 255.0, 257.0]
  distortion_model: equidistant
  distortion_coeffs: [0.003, 0.0, 0.0, 0.0]
  resolution: [512, 512]
"""
    chain = camera.format(name="cam0", f=190.0) + camera.format(name="cam1", f=-190.0)
    (tmp_path / "chain.yaml").write_text(chain, "utf-8")
    first, second = listed(capsys, tmp_path)["profiles"]
    assert (first["profile"], first["format"]) == ("chain.yaml#cam0", "kalibr")
    assert first["model"] == "kannala_brandt"
    assert second["profile"] == "chain.yaml#cam1"
    assert "positive" in second["refused"]


def test_nothing_to_list(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert lens_list(tmp_path) == 2
    assert "no lens profile in" in capsys.readouterr().err
    assert lens_list(tmp_path / "missing") == 2
    assert "is no folder" in capsys.readouterr().err


def test_reasons_are_counted_without_their_numbers() -> None:
    first = "the radius stops growing at 61.20 degrees, inside the field of 1e2; claim less"
    second = "the radius stops growing at -3 degrees, inside the field of 99.5; claim 5"
    assert general(first) == general(second)
    assert general(first) == "the radius stops growing at # degrees, inside the field of #"
    assert general("k1 in file 'a b' is 7") == "k1 in file '#' is #"


@pytest.mark.data
def test_the_gyroflow_collection(shared_data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Every one of the 200 is a camera or is refused with a reason."""
    if "gyroflow" not in FORMATS:
        pytest.skip("this version does not read Gyroflow profiles")
    facts = listed(capsys, shared_data / "gyroflow_profiles" / "profiles")
    assert len(facts["profiles"]) == 200
    assert facts["no_profiles"] == 0
    assert facts["cameras"] + facts["refused"] == 200
    assert facts["refused"] == sum(row["count"] for row in facts["reasons"])
    assert all(row["refused"] for row in facts["profiles"] if "model" not in row)
