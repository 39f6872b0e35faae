"""`freelook calibrate board`: files that are written, and what is refused."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from freelook.calibration.targets import KINDS, parse_target
from freelook.cli import _targets, main


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["calibrate", "board", *arguments]) == 2
    return capsys.readouterr().err.strip()


@pytest.mark.parametrize("suffix", [".pdf", ".SVG"])
def test_a_page_is_written(suffix: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / f"board{suffix}"
    assert main(["calibrate", "board", "-o", str(path)]) == 0
    begins = b"%PDF" if suffix == ".pdf" else b"<svg"
    assert path.read_bytes().startswith(begins)
    said = capsys.readouterr().out
    assert "210 x 297 mm; print at 100 %" in said
    (word,) = [word for word in said.split() if ":" in word and "x" in word]
    assert parse_target(word).text == word  # what it says to give is read


def test_kinds_with_sizes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = str(tmp_path / "board.svg")
    options = ["--target", "charuco", "--board", "5x7", "--square", "0.03", "--paper", "letter"]
    assert main(["calibrate", "board", *options, "-o", path]) == 0
    assert "--target charuco:5x7:0.03:0.0225:5x5_1000" in capsys.readouterr().out


def test_what_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "board.pdf"
    out = ["-o", str(path)]
    assert "ends in .pdf or .svg" in refused(capsys, "-o", "board.png")
    assert "unknown target 'mosaic'" in refused(capsys, *out, "--target", "mosaic")
    assert "unknown paper 'b4'" in refused(capsys, *out, "--paper", "b4")
    said = refused(capsys, *out, "--target", "chessboard:9x6:0.02", "--square", "0.03")
    assert "says sizes, and so does --square" in said
    assert "too large for a4" in refused(capsys, *out, "--square", "0.1")
    assert "No such file" in refused(capsys, "-o", str(tmp_path / "nowhere" / "board.svg"))
    path.write_text("mine")
    assert f"{path} exists; --overwrite" in refused(capsys, *out)
    assert path.read_text() == "mine"


class NoReportLab:
    """As if it were not installed."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        if name == "reportlab":
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)


def test_a_pdf_needs_its_library(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """An SVG does not."""
    for name in [name for name in sys.modules if name.split(".")[0] == "reportlab"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "freelook.report.sheet_pdf", raising=False)
    monkeypatch.setattr(sys, "meta_path", [NoReportLab(), *sys.meta_path])
    assert "pip install 'freelook[print]'" in refused(capsys, "-o", str(tmp_path / "a.pdf"))
    assert main(["calibrate", "board", "-o", str(tmp_path / "a.svg")]) == 0


def test_help_names_every_kind(capsys: pytest.CaptureFixture[str]) -> None:
    """With an example that is one."""
    for command in ([], ["board"], ["stereo"]):
        with pytest.raises(SystemExit):
            main(["calibrate", *command, "--help"])
        assert _targets.KINDS.splitlines()[1] in capsys.readouterr().out
    examples = [
        line.split()[0].replace("[", "").replace("]", "") for line in _targets.KINDS.splitlines()
    ]
    kinds = [example for example in examples if ":" in example]
    assert [parse_target(example).text.split(":")[0] for example in kinds] == list(KINDS)


def test_every_kind_has_its_row_in_the_documentation() -> None:
    page = (Path(__file__).parents[2] / "docs" / "calibration.md").read_text("utf-8")
    for kind in KINDS.values():
        assert f" | `{kind.usage}` | " in page
