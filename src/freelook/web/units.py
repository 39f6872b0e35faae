"""Coded pictures on their way to many viewers.

Delta-coded video cannot lose single pictures: what is behind the gap could not be decoded.
So these queues are bounded, and lose everything up to the next key picture or nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections import deque
from collections.abc import Callable

from ..types import AccessUnit, Counters

Listener = Callable[[AccessUnit], None]

# One second at 30 pictures a second: whoever is further behind is better off at a key picture.
LONGEST_QUEUE = 30
# What a newcomer may be sent to see a picture before the next key picture.
LONGEST_REPLAY = 300
LARGEST_REPLAY_BYTES = 2_000_000


class UnitQueue:
    """A bounded queue of coded pictures, safe between two threads.

    Starts at a key picture. When full, everything in it goes, and nothing enters before the
    next key picture; `counters` then has `overflows` and `dropped` pictures.
    """

    def __init__(self, limit: int = LONGEST_QUEUE, counters: Counters | None = None) -> None:
        self.counters = Counters() if counters is None else counters
        self._limit = limit
        self._units: deque[AccessUnit] = deque()
        self._lock = threading.Lock()
        self._needs_key = True

    def put(self, unit: AccessUnit) -> bool:
        """False when the picture was not taken."""
        with self._lock:
            if len(self._units) >= self._limit:
                self.counters.add("overflows")
                self.counters.add("dropped", len(self._units))
                self._units.clear()
                self._needs_key = True
            if self._needs_key and not unit.key:
                self.counters.add("dropped")
                return False
            self._needs_key = False
            self._units.append(unit)
            return True

    def follow(self) -> None:
        """Take what comes next, key picture or not: the reader has all that went before."""
        with self._lock:
            self._units.clear()
            self._needs_key = False

    def wait_for_key(self) -> None:
        """What comes next does not follow from what went before."""
        with self._lock:
            self._needs_key = True

    def take(self) -> AccessUnit | None:
        """The oldest picture, or None when there is none."""
        with self._lock:
            return self._units.popleft() if self._units else None


class Replay:
    """The pictures since the last key picture, as long as they are few enough to be sent."""

    def __init__(
        self, limit: int = LONGEST_REPLAY, limit_bytes: int = LARGEST_REPLAY_BYTES
    ) -> None:
        self._limit = limit
        self._limit_bytes = limit_bytes
        self._units: list[AccessUnit] = []
        self._bytes = 0

    def put(self, unit: AccessUnit) -> None:
        if unit.key:
            self.clear()
        elif not self._units:
            return
        self._units.append(unit)
        self._bytes += len(unit.data)
        if len(self._units) > self._limit or self._bytes > self._limit_bytes:
            self.clear()

    def clear(self) -> None:
        self._units = []
        self._bytes = 0

    def units(self) -> list[AccessUnit]:
        return list(self._units)


class Hub:
    """Hands one stream of coded pictures from any thread to listeners on the event loop."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.counters = Counters()
        self.replay = Replay()
        self._loop = loop
        self._inbox = UnitQueue(counters=self.counters)
        self._listeners: list[Listener] = []
        self._woken = False

    def offer(self, unit: AccessUnit) -> None:
        """From any one thread at a time. Pictures the loop is too busy for are dropped."""
        if not self._inbox.put(unit) or self._woken:
            return
        self._woken = True
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody is left to tell
            self._loop.call_soon_threadsafe(self._fan_out)

    def restart(self) -> None:
        """From any thread: what is offered from now on is another stream."""
        self._inbox.wait_for_key()

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """On the event loop: hear every picture from now on, until the result is called."""
        self._listeners.append(listener)

        def unsubscribe() -> None:
            with contextlib.suppress(ValueError):
                self._listeners.remove(listener)

        return unsubscribe

    def _fan_out(self) -> None:
        self._woken = False
        while (unit := self._inbox.take()) is not None:
            self.replay.put(unit)
            for listener in tuple(self._listeners):
                listener(unit)
