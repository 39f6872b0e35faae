"""When to begin a view so that it is ready just before the screen takes it.

After the screen took a view (`swapped`), the next is wanted one period later, and begun as late
as its cost allows: a pose read then is as young as it can be when it is seen.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from ..clock import NS_PER_S

RECENT = 30  # views by which the cost of the next is judged
LEAST_MARGIN = 0.06  # of a period, between the end of drawing and the swap
MOST_MARGIN = 0.5
CALM = 0.995  # by which the margin shrinks with each view that was in time


@dataclass
class Pacer:
    """`period_ns` is the screen's. Times are those of one monotonic clock."""

    period_ns: int
    missed: int = 0

    def __post_init__(self) -> None:
        self._costs_ns: deque[int] = deque(maxlen=RECENT)
        self._margin = LEAST_MARGIN
        self._swapped_ns: int | None = None

    def begin_ns(self, now_ns: int) -> int:
        """When to begin the next view: now at the earliest."""
        if self._swapped_ns is None:
            return now_ns
        ahead_ns = max(self._costs_ns, default=0) + round(self._margin * self.period_ns)
        return max(now_ns, self._swapped_ns + self.period_ns - ahead_ns)

    def swapped(self, begun_ns: int, drawn_ns: int, swapped_ns: int) -> None:
        """A view was begun, was ready, and was shown.

        One that came more than half a period late, though it was begun in time, was begun too
        late: the margin doubles.
        """
        before_ns, self._swapped_ns = self._swapped_ns, swapped_ns
        self._costs_ns.append(drawn_ns - begun_ns)
        waited = before_ns is not None and begun_ns < before_ns + self.period_ns
        late = before_ns is not None and swapped_ns - before_ns > 1.5 * self.period_ns
        if waited and late:
            self.missed += 1
            self._margin = min(2 * self._margin, MOST_MARGIN)
        else:
            self._margin = max(CALM * self._margin, LEAST_MARGIN)

    def paused(self) -> None:
        """Nothing was shown for a while, and the time of the last swap says nothing."""
        self._swapped_ns = None


def period_ns(refresh_hz: float) -> int:
    """Of a screen; 60 Hz where it does not say."""
    return round(NS_PER_S / (refresh_hz if refresh_hz >= 1 else 60))
