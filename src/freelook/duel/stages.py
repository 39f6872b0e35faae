"""What a chain is made of: clocks that tick, and holding the newest until the next tick."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..clock import NS_PER_MS

Times = NDArray[np.int64]
Indices = NDArray[np.intp]


def ticks(end_ns: int, period_ms: float, offset_ms: float = 0.0) -> Times:
    """Times of a clock from `offset_ms` on, none after `end_ns`."""
    count = int((end_ns / NS_PER_MS - offset_ms) // period_ms) + 1
    return np.rint((offset_ms + np.arange(count) * period_ms) * NS_PER_MS).astype(np.int64)


def newest(there_ns: Times, now_ns: Times) -> Indices:
    """Of things that are there from growing times (n,) on, which is the newest at times (m,).

    Before the first is there, the first: both sides begin with everything at rest.
    """
    found = np.searchsorted(there_ns, now_ns, side="right") - 1
    return np.maximum(found, 0)


def later(times_ns: Times, delay_ms: float) -> Times:
    return times_ns + round(delay_ms * NS_PER_MS)
