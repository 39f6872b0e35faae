"""When to take the next live frame: on time, and never an old one."""

from __future__ import annotations

from dataclasses import dataclass

from ..clock import NS_PER_S


@dataclass
class Pacer:
    """Frames at multiples of 1/fps; those whose successor is due already are skipped, counted."""

    fps: float
    taken: int = 0
    skipped: int = 0

    def due_ns(self, elapsed_ns: int) -> int:
        """The time of the frame to take next, `elapsed_ns` after the start; often still ahead."""
        following = self.taken + self.skipped
        newest = int(elapsed_ns * self.fps / NS_PER_S)
        self.skipped += max(newest - following, 0)
        self.taken += 1
        return round(max(newest, following) * NS_PER_S / self.fps)
