"""A live source that another part of the program pushes attitudes into.

A receiver (say, of MAVLink) calls `push` from its own thread; whoever iterates gets the newest.
There is one slot and no queue: an attitude that nobody took before the next came is counted as
overrun, and the buffer interpolates across it.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..mailbox import Mailbox
from ..types import Attitude, Counters

LOOK_AGAIN_S = 0.5


class PushedAttitudes:
    """`push` from any thread, `attitudes` in one; `waiting_for` is its message."""

    def __init__(self, waiting_for: str) -> None:
        self.counters = Counters()
        self._slot: Mailbox[Attitude] = Mailbox()
        self._message = waiting_for

    @property
    def message(self) -> str:
        return self._message

    def push(self, attitude: Attitude) -> None:
        """A new attitude, stamped with the local clock; ignored after `close`."""
        before = self._slot.dropped
        self._slot.put(attitude)
        self.counters.add("received")
        if self._slot.dropped > before:
            self.counters.add("overrun")

    def attitudes(self) -> Iterator[Attitude]:
        while True:
            attitude = self._slot.take(LOOK_AGAIN_S)
            if attitude is not None:
                yield attitude
            elif self._slot.closed:
                return

    def close(self) -> None:
        self._slot.close()
