"""`freelook paper` from the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from freelook import cli
from freelook.paper import report


@pytest.fixture
def two_sections(monkeypatch: pytest.MonkeyPatch) -> None:
    """The whole report is made in the tests of `freelook.paper`."""
    monkeypatch.setattr(report, "SECTIONS", ("projections", "parts"))


def paper(*arguments: object) -> int:
    return cli.main(["paper", *map(str, arguments)])


@pytest.mark.usefixtures("two_sections")
def test_makes_a_page_and_says_where(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "report"
    assert paper(out, "--seed", 7, "--draws", 50) == 0
    said = capsys.readouterr()
    assert said.out.strip() == f"{out / 'index.html'}: 2 sections, 1 figures"
    assert "2/2" in said.err
    html = (out / "index.html").read_text("utf-8")
    assert "seed 7 and 50 draws" in html
    assert "freelook paper OUTDIR --seed 7 --draws 50" in html


@pytest.mark.usefixtures("two_sections")
def test_overwrites_only_when_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "index.html").write_text("old")
    (tmp_path / "mine.txt").write_text("precious")
    assert paper(tmp_path, "--draws", 50) == 2
    error = capsys.readouterr().err
    assert error.startswith("freelook paper: ")
    assert "is not empty" in error
    assert "--overwrite" in error
    assert (tmp_path / "index.html").read_text() == "old"
    assert paper(tmp_path, "--draws", 50, "--overwrite") == 0
    assert "<!DOCTYPE html>" in (tmp_path / "index.html").read_text("utf-8")
    assert (tmp_path / "mine.txt").read_text() == "precious"


@pytest.mark.parametrize(
    "arguments", [["--seed", "-1"], ["--seed", "1.5"], ["--draws", "3"], ["--draws", "many"], []]
)
def test_mistakes_are_usage_errors(
    arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = [str(tmp_path / "report")] if arguments else []
    with pytest.raises(SystemExit):
        paper(*folder, *arguments)
    assert "usage" in capsys.readouterr().err
    assert not (tmp_path / "report").exists()
