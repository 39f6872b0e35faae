"""What trackers that are asked at a steady rate have in common: the waiting and the end."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Protocol

from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S, Clock
from ..types import Counters, Pose


class Sampler(Protocol):
    """Something that can be asked where the head looks now."""

    counters: Counters

    @property
    def message(self) -> str: ...

    def sample(self, now_ns: int) -> Rotation | None:
        """`body_from_view` if there is something new. StopIteration when there will be no more."""


class PolledTracker:
    """A `Tracker` that asks a sampler `rate_hz` times a second; `close` ends it at once."""

    def __init__(self, sampler: Sampler, rate_hz: float, clock: Clock) -> None:
        self._sampler = sampler
        self._period_ns = round(NS_PER_S / rate_hz)
        self._clock = clock
        self._closed = threading.Event()
        self.counters = sampler.counters

    @property
    def message(self) -> str:
        return self._sampler.message

    def poses(self) -> Iterator[Pose]:
        due_ns = self._clock()
        while not self._closed.is_set():
            now_ns = self._clock()
            try:
                rotation = self._sampler.sample(now_ns)
            except StopIteration:
                return
            if rotation is not None:
                self.counters.add("received")
                yield Pose(rotation, now_ns)
            due_ns = max(due_ns + self._period_ns, now_ns)
            wait_ns = min(due_ns - self._clock(), self._period_ns)
            self._closed.wait(max(wait_ns, 0) / NS_PER_S)

    def close(self) -> None:
        self._closed.set()
