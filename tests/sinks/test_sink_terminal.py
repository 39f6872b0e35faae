"""The view in a terminal: characters and colours as a terminal would show them."""

from __future__ import annotations

import io
import re

import numpy as np
import pytest
from rich.console import Console

from freelook.sinks import terminal
from freelook.types import Frame, Picture

RUN = re.compile(r"\x1b\[38;2;(\d+);(\d+);(\d+);48;2;(\d+);(\d+);(\d+)m(▀+)")


def console(width: int, height: int) -> Console:
    return Console(
        file=io.StringIO(),
        force_terminal=True,
        color_system="truecolor",
        width=width,
        height=height,
        legacy_windows=False,
    )


def shown(text: str) -> list[tuple[list[int], int]]:
    """(colours above and below, how many characters) of every stretch."""
    return [([int(n) for n in found[:6]], len(found[6])) for found in RUN.findall(text)]


def test_two_pixels_are_one_character() -> None:
    red, blue, grey = (200, 8, 8), (8, 8, 200), (120, 120, 120)
    picture = np.array([[red] * 4, [blue] * 4, [grey] * 4, [red, red, red, blue]], np.uint8)
    screen = console(20, 8)
    screen.print(terminal.half_blocks(picture))
    assert isinstance(screen.file, io.StringIO)
    assert shown(screen.file.getvalue()) == [
        ([200, 8, 8, 8, 8, 200], 4),
        ([120, 120, 120, 200, 8, 8], 3),
        ([120, 120, 120, 8, 8, 200], 1),
    ]


def test_colours_are_off_by_half_a_level_at_most(rng: np.random.Generator) -> None:
    picture = rng.integers(0, 256, (2, 40, 3), np.uint8)
    screen = console(60, 8)
    screen.print(terminal.half_blocks(picture))
    assert isinstance(screen.file, io.StringIO)
    stretches = shown(screen.file.getvalue())
    colours = np.repeat([c for c, _ in stretches], [n for _, n in stretches], axis=0)
    there = np.concatenate([picture[0], picture[1]], axis=1).astype(int)
    assert np.abs(colours - there).max() <= 8


def test_frames_are_drawn_over_each_other_with_the_state_below() -> None:
    screen = console(64, 8)
    view = terminal.TerminalView(screen)
    for shade in (40, 200):
        view.note({"yaw_deg": "-12.4", "pitch_deg": "3", "roll_deg": "0", "state": "source: live"})
        view.write(Frame(Picture("rgb24", (np.full((12, 16, 3), shade, np.uint8),)), 0))
    view.close()
    assert isinstance(screen.file, io.StringIO)
    text = screen.file.getvalue()
    assert "\x1b[?1049h" in text  # the other screen, and back again
    assert "\x1b[?1049l" in text
    assert [c[0] for c, _ in shown(text)][-1] == 200
    assert "yaw -12°, pitch +3°, roll +0°; source: live" in text


def test_a_view_fills_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setenv("LINES", "31")
    assert terminal.view_size() == (100, 60)
    monkeypatch.setenv("LINES", "1")
    assert terminal.view_size() == (100, 8)
