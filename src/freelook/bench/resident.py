"""How much memory programs hold over time, and whether it grows."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import FreelookError

PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
WARM_UP = 0.2  # of the time: compilers, caches and buffers fill


@dataclass
class Resident:
    """What one program held: seconds since the beginning, and bytes at each."""

    name: str
    times_s: list[float] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)

    def add(self, time_s: float, size: int) -> None:
        self.times_s.append(time_s)
        self.sizes.append(size)

    def settled(self) -> tuple[list[float], list[int]]:
        """Without the first fifth of the time."""
        begin_s = self.times_s[0] + WARM_UP * (self.times_s[-1] - self.times_s[0])
        first = next(i for i, time_s in enumerate(self.times_s) if time_s >= begin_s)
        return self.times_s[first:], self.sizes[first:]

    def slope(self) -> float:
        """Bytes a second, of the straight line nearest to what was settled; NaN of one sample."""
        times_s, sizes = self.settled()
        if len(times_s) < 2:
            return float("nan")
        return float(np.polyfit(np.array(times_s) - times_s[0], np.array(sizes, float), 1)[0])


def resident_bytes(pid: int) -> int:
    """Of a process; 0 when it is gone. FreelookError where the system does not tell."""
    if not Path("/proc/self/statm").exists():
        raise FreelookError("memory is read from /proc, which only Linux has")
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE_BYTES
    except (OSError, IndexError):
        return 0


def descendants(pid: int) -> Iterator[int]:
    """The processes that a process started, and theirs."""
    for child in _children(pid):
        yield child
        yield from descendants(child)


def _children(pid: int) -> Iterable[int]:
    try:
        threads = list(Path(f"/proc/{pid}/task").iterdir())
        return [int(c) for t in threads for c in (t / "children").read_text().split()]
    except OSError:
        return []
