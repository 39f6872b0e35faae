"""Sequence number and time behind a pose's datagram, where a reader that does not know looks away.

    4 bytes "flk1", u32 sequence, u64 time of the pose in nanoseconds, little-endian

The sequence begins anywhere and wraps round; the time is that of the sender's own monotonic clock.
"""

from __future__ import annotations

import struct

from ..clock import NS_PER_S
from ..types import Counters

MARK = b"flk1"
WRAP = 1 << 32
# Further behind, or further ahead, than this is a sender that was started again.
LATE_AT_MOST = 64
LARGEST_GAP = 10_000
DRIFT = 200e-6  # two clocks part by less than this: quartz, 100 ppm each
RESTART_NS = NS_PER_S

_TRAILER = struct.Struct("<4sIQ")
SIZE = _TRAILER.size


def pack(sequence: int, t_ns: int) -> bytes:
    return _TRAILER.pack(MARK, sequence % WRAP, t_ns % (1 << 64))


def unpack(data: bytes) -> tuple[int, int] | None:
    """(sequence, time in ns), or None when this is not such a trailer."""
    if len(data) != SIZE or not data.startswith(MARK):
        return None
    _, sequence, t_ns = _TRAILER.unpack(data)
    return sequence, t_ns


class Order:
    """Which packets were lost on the way, and which came too late to be used."""

    def __init__(self, counters: Counters) -> None:
        self._counters = counters
        self._newest: int | None = None

    def accept(self, sequence: int) -> bool:
        """False for a packet that was overtaken (`reordered`) or came before (`duplicate`); `lost`
        counts the numbers that were jumped over, also those that come later after all."""
        newest, self._newest = self._newest, sequence
        if newest is None:
            return True
        ahead = (sequence - newest) % WRAP
        if ahead == 0 or ahead >= WRAP - LATE_AT_MOST:
            self._newest = newest
            self._counters.add("duplicate" if ahead == 0 else "reordered")
            return False
        if ahead > LARGEST_GAP:
            self._counters.add("restarted")
        elif ahead > 1:
            self._counters.add("lost", ahead - 1)
        return True


class SenderClock:
    """The sender's times on the receiver's clock.

    The fastest packet so far is taken to have needed no time at all; every other is as much older
    than its arrival as it was slower. So the network's jitter leaves the times of the poses, its
    smallest delay does not. Never later than the arrival.
    """

    def __init__(self) -> None:
        self._offset_ns: float | None = None
        self._arrival_ns = 0

    def here(self, sent_ns: int, arrival_ns: int) -> int:
        offset_ns = float(arrival_ns - sent_ns)
        if self._offset_ns is not None:
            drifted_ns = self._offset_ns + DRIFT * (arrival_ns - self._arrival_ns)
            if abs(offset_ns - drifted_ns) < RESTART_NS:
                offset_ns = min(offset_ns, drifted_ns)
        self._offset_ns, self._arrival_ns = offset_ns, arrival_ns
        return min(arrival_ns, sent_ns + round(offset_ns))
