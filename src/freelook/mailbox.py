"""A one-slot mailbox: the newest value, never a queue.

Putting into a full box replaces the old value and counts it as dropped.
"""

from __future__ import annotations

import threading
from typing import Generic, TypeVar

T = TypeVar("T")


class Mailbox(Generic[T]):
    """Holds at most one value; safe between threads.

    `received` counts values put in, `dropped` those replaced before anybody took them.
    """

    def __init__(self) -> None:
        self._condition = threading.Condition()
        self._value: T | None = None
        self._closed = False
        self.received = 0
        self.dropped = 0

    def put(self, value: T) -> None:
        """Replace whatever is in the box. After `close` the value is ignored."""
        with self._condition:
            if self._closed:
                return
            self.received += 1
            if self._value is not None:
                self.dropped += 1
            self._value = value
            self._condition.notify_all()

    def take(self, timeout_s: float = 0.0) -> T | None:
        """Empty the box. Waits up to `timeout_s` for a value; None if none came."""
        with self._condition:
            if self._value is None and timeout_s > 0 and not self._closed:
                self._condition.wait_for(lambda: self._value is not None or self._closed, timeout_s)
            value, self._value = self._value, None
            return value

    def close(self) -> None:
        """Wake whoever waits; nothing more is accepted. A value already in can still be taken."""
        with self._condition:
            self._closed = True
            self._condition.notify_all()

    @property
    def closed(self) -> bool:
        return self._closed
