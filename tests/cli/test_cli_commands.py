"""All commands together: listed, unknown, or lacking something that is not installed."""

from __future__ import annotations

import subprocess
import sys

import pytest

from freelook.cli import COMMANDS, main, make_parser, parse


def without(library: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The command as where a library is not installed."""
    code = f"import sys; sys.modules[{library!r}] = None; from freelook.cli import main"
    command = [sys.executable, "-c", f"{code}; sys.exit(main({list(arguments)}))"]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("arguments", [[], ["fyl"], ["-x"]], ids=str)
def test_what_is_no_command_ends(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2


def test_an_unknown_command_lists_the_known_ones(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["fyl", "--lens", "demo"])
    said = capsys.readouterr().err
    assert "'fyl'" in said
    assert all(name in said for name in COMMANDS)


@pytest.mark.parametrize("arguments", [["--help"], ["-h", "fly"]], ids=str)
def test_help_says_what_each_command_is_for(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert not ended.value.code
    said = capsys.readouterr().out
    full = make_parser().format_help()
    assert said == full
    assert "Look around in live video" in said


def test_a_command_of_two_words_is_one() -> None:
    assert parse(["calibrate", "board", "-o", "b.pdf"]).command == "calibrate board"


def test_what_a_command_lacks_is_said() -> None:
    found = without("cv2", "render", "--help")
    assert found.returncode == 2
    assert found.stderr.startswith("freelook render: this needs the library 'cv2'")
    assert "freelook[render]" in found.stderr


@pytest.mark.parametrize("arguments", [["--help"], ["doctor", "--help"]], ids=str)
def test_what_one_command_lacks_does_not_hinder_others(arguments: list[str]) -> None:
    found = without("cv2", *arguments)
    assert (found.returncode, found.stderr) == (0, "")
    assert found.stdout.startswith("usage: freelook")
