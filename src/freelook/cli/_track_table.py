"""How readings of a tracker are shown: a table that changes on a terminal, lines elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ._pose_meter import Reading
from ._progress import say

if TYPE_CHECKING:
    from rich.table import Table

BAR_CELLS = 31
BAR_DEG = 90.0

Show = Callable[[Reading, str, dict[str, int]], None]


@contextmanager
def display(title: str) -> Iterator[tuple[Show, bool]]:
    """(the function that shows a reading, whether it may be called often)."""
    if not sys.stdout.isatty():
        yield lambda *reading: say(line(*reading)), False
        return
    from rich.live import Live

    with Live(auto_refresh=False) as live:
        yield lambda *reading: live.update(table(title, *reading), refresh=True), True


def line(reading: Reading, message: str, counters: dict[str, int]) -> str:
    """One line: `yaw +1.00 pitch +2.00 roll +3.00 deg, 100.0 Hz, ...`."""
    parts = [message] if message else []
    if reading.angles_deg is not None:
        yaw, pitch, roll = reading.angles_deg
        parts.append(f"yaw {yaw:+.2f} pitch {pitch:+.2f} roll {roll:+.2f} deg")
        parts.append(f"{_number(reading.rate_hz, 1)} Hz")
        parts.append(f"jitter {_number(reading.jitter_ms, 2)} ms")
        parts.append(f"dropouts {reading.dropouts}")
        parts.append(f"age {_number(reading.age_ms, 0)} ms")
    parts += [f"{name} {count}" for name, count in sorted(counters.items())]
    return ", ".join(parts)


def table(title: str, reading: Reading, message: str, counters: dict[str, int]) -> Table:
    """The same with bars, as a table."""
    from rich.table import Table
    from rich.text import Text

    made = Table(title=Text(title), title_justify="left", show_header=False)
    angles = reading.angles_deg or (None, None, None)
    spreads = reading.spread_deg or (None, None, None)
    for name, angle, spread in zip(("yaw", "pitch", "roll"), angles, spreads, strict=True):
        text = "-" if angle is None else f"{angle:+8.2f}°"
        made.add_row(name, Text(text), Text(bar(angle)), f"± {_number(spread, 3)}° in 1 s")
    interval = f"median {_number(reading.interval_ms, 2)} ms"
    made.add_row("rate", f"{_number(reading.rate_hz, 1)} Hz", interval, f"{reading.poses} poses")
    jitter = f"{_number(reading.jitter_ms, 2)} ms"
    made.add_row("jitter", jitter, f"longest {_number(reading.longest_ms, 0)} ms", "")
    made.add_row("dropouts", str(reading.dropouts), f"age {_number(reading.age_ms, 0)} ms", "")
    for name, count in sorted(counters.items()):
        made.add_row(Text(name), str(count))
    if message:
        made.caption = Text(message)
    return made


def bar(angle_deg: float | None) -> str:
    """Where an angle stands between -90 and +90 degrees."""
    middle = BAR_CELLS // 2
    cells = ["·"] * BAR_CELLS
    cells[middle] = "|"
    if angle_deg is not None:
        share = max(-1.0, min(1.0, angle_deg / BAR_DEG))
        cells[middle + round(share * middle)] = "█"
    return "".join(cells)


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
