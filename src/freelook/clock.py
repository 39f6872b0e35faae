"""The one clock: integer nanoseconds, monotonic.

Only the outermost layers (threads, servers, the command line) call `now_ns`; everything
below takes time as an argument.
"""

from __future__ import annotations

import time
from collections.abc import Callable

Clock = Callable[[], int]

NS_PER_S = 1_000_000_000
NS_PER_MS = 1_000_000


def now_ns() -> int:
    """Nanoseconds of CLOCK_MONOTONIC, comparable between processes on one machine."""
    return time.monotonic_ns()


class FakeClock:
    """A clock for tests: stands still until told to advance."""

    def __init__(self, start_ns: int = 0) -> None:
        self.time_ns = start_ns

    def __call__(self) -> int:
        return self.time_ns

    def advance_ms(self, milliseconds: float) -> int:
        """Move forward and return the new time in nanoseconds."""
        self.time_ns += round(milliseconds * NS_PER_MS)
        return self.time_ns
