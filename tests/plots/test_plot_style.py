"""Figures are written the same every time, as PNG or SVG, and nowhere else."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import matplotlib
import pytest
from matplotlib.figure import Figure

from freelook.errors import SinkError
from freelook.plots._style import (
    COLORS,
    check_path,
    new_figure,
    panel,
    picture_panel,
    save,
    style,
)


@style()
def example() -> Figure:
    figure = new_figure(4, 3)
    axes = panel(figure.add_subplot(1, 1, 1), "curve", "angle, degrees", "radius, pixels")
    axes.plot([0, 1, 2], [0, 1, 4])
    return figure


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".SVG", b"<?xml")])
def test_the_suffix_says_the_kind_and_the_bytes_repeat(
    tmp_path: Path, suffix: str, start: bytes
) -> None:
    for name in "ab":
        save(example(), tmp_path / f"{name}{suffix}")
    first, second = ((tmp_path / f"{name}{suffix}").read_bytes() for name in "ab")
    assert first.startswith(start)
    assert first == second
    assert b"<dc:date>" not in first


@pytest.mark.parametrize("name", ["figure.pdf", "figure", "missing/figure.png"])
def test_what_cannot_be_written_is_refused_at_once(tmp_path: Path, name: str) -> None:
    with pytest.raises(SinkError, match="cannot draw into"):
        check_path(tmp_path / name)
    with pytest.raises(SinkError, match="cannot draw into"):
        save(example(), tmp_path / name)


def test_what_the_system_refuses_is_an_error_with_words(tmp_path: Path) -> None:
    (tmp_path / "there.png").mkdir()
    with pytest.raises(SinkError, match=r"there\.png: Is a directory"):
        save(example(), tmp_path / "there.png")


def test_the_look_is_on_the_figure_and_gone_afterwards() -> None:
    before = dict(matplotlib.rcParams)
    axes = example().axes[0]
    assert axes.get_lines()[0].get_color() == COLORS[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("angle, degrees", "radius, pixels")
    assert dict(matplotlib.rcParams) == before


def test_a_picture_lies_as_it_is_seen() -> None:
    """Pixel (0, 0) is the top-left one; its middle is the origin."""
    axes = picture_panel(new_figure(4, 3).add_subplot(1, 1, 1), "map", (640, 480))
    assert axes.get_xlim() == (-0.5, 639.5)
    assert axes.get_ylim() == (479.5, -0.5)


def test_no_window_library_is_loaded() -> None:
    script = (
        "import sys, freelook.plots._style; assert 'matplotlib.pyplot' not in sys.modules;"
        "assert 'tkinter' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
