"""How old a pose is when the screen shows it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

MOST = 100_000  # values kept, the newest: half an hour at 60 Hz


@dataclass
class Ages:
    """Times in nanoseconds go in, milliseconds come out."""

    values_ns: deque[int] = field(default_factory=lambda: deque(maxlen=MOST))

    def add(self, age_ns: int) -> None:
        self.values_ns.append(age_ns)

    def percentile_ms(self, percent: float) -> float:
        """NaN while there are none."""
        if not self.values_ns:
            return float("nan")
        return float(np.percentile(np.array(self.values_ns), percent) / 1e6)

    def __str__(self) -> str:
        if not self.values_ns:
            return "none measured"
        p50, p95 = self.percentile_ms(50), self.percentile_ms(95)
        return f"{p50:.1f} ms median, {p95:.1f} ms at the 95th percentile"


@dataclass
class Figures:
    """What a flight in a window was like.

    pose_to_swap   from when a pose was measured (or a hand moved) to when the screen took its view;
                   each pose once, with the first view that shows it
    latch_to_swap  from when the pose was read to then
    video_age      from when a frame came to when the screen took its first view
    missed         views that were begun in time and came a screen's period late
    """

    pose_to_swap: Ages = field(default_factory=Ages)
    latch_to_swap: Ages = field(default_factory=Ages)
    video_age: Ages = field(default_factory=Ages)
    views: int = 0
    missed: int = 0
    first_ns: int = 0
    last_ns: int = 0

    @property
    def rate_hz(self) -> float:
        """Views per second; NaN for fewer than two."""
        lasted_ns = self.last_ns - self.first_ns
        return (self.views - 1) * 1e9 / lasted_ns if lasted_ns > 0 else float("nan")
