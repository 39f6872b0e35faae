"""A coarse picture in the terminal, two pixels to a character: `terminal`."""

from __future__ import annotations

import shutil
from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np

from ..types import Frame, Plane, Sink
from . import SinkSettings, refuse
from ._rgb import rgb24

if TYPE_CHECKING:  # may be missing, and other sinks work without
    from rich.console import Console
    from rich.style import Style
    from rich.text import Text

KIND = "terminal"

HALF = "▀"  # its upper half in the letter's colour, the lower one in the background's
STATE_ROWS = 1
LEAST = (16, 8)  # pixels of a view, also in a terminal that says it has no size
LEVELS = 16  # of each colour: fewer changes of style, and no flicker of noise


def recognises(argument: str) -> bool:
    return argument == "terminal"


def check(argument: str, settings: SinkSettings) -> None:
    import_module("rich")  # a missing one is noticed before the flight


def open(argument: str, settings: SinkSettings) -> Sink:
    from rich.console import Console

    refuse(settings, "a terminal", "audio_from", "sdp", "bitrate")
    return TerminalView(Console())


def view_size() -> tuple[int, int]:
    """Of a view that fills the terminal as it is now, below it one line of words."""
    columns, rows = shutil.get_terminal_size()
    return max(columns, LEAST[0]), max(2 * (rows - STATE_ROWS), LEAST[1])


class TerminalView:
    """Draws each frame over the last one, and under it the state that it was told (`note`)."""

    def __init__(self, console: Console) -> None:
        from rich.live import Live

        self._live = Live(console=console, screen=console.is_terminal, auto_refresh=False)
        self._live.start()
        self._line = ""

    def note(self, facts: dict[str, str]) -> None:
        where = ", ".join(
            f"{name} {float(facts[f'{name}_deg']):+.0f}°"
            for name in ("yaw", "pitch", "roll")
            if f"{name}_deg" in facts
        )
        self._line = "; ".join(filter(None, (where, facts.get("state", ""))))

    def write(self, frame: Frame) -> None:
        from rich.console import Group
        from rich.text import Text

        line = Text(self._line, no_wrap=True, overflow="ellipsis")
        self._live.update(Group(half_blocks(rgb24(frame.picture)), line), refresh=True)

    def close(self) -> None:
        self._live.stop()


def half_blocks(rgb: Plane) -> Text:
    """Rows of characters, each two pixels on top of each other; an odd last row is left out.

    Neighbours of one colour are one stretch of text: little to send over a slow line.
    """
    from rich.text import Text

    step = 256 // LEVELS
    coarse = (rgb // step * step + step // 2).astype(np.uint8)
    text = Text(no_wrap=True, end="")
    for top, bottom in zip(coarse[0::2], coarse[1::2], strict=False):
        pairs = np.concatenate([top, bottom], axis=1)
        starts = [0, *(np.flatnonzero(np.any(np.diff(pairs, axis=0), axis=1)) + 1).tolist()]
        for start, end in zip(starts, [*starts[1:], len(pairs)], strict=True):
            text.append(HALF * (end - start), _style(pairs[start].tolist()))
        text.append("\n")
    return text


def _style(pair: list[int]) -> Style:
    from rich.style import Style

    r, g, b, r2, g2, b2 = pair
    return Style(color=f"#{r:02x}{g:02x}{b:02x}", bgcolor=f"#{r2:02x}{g2:02x}{b2:02x}")
