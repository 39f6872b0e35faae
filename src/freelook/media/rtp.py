"""RTP (RFC 3550) without sockets: the packet header, and putting packets back in order."""

from __future__ import annotations

from dataclasses import dataclass
from struct import Struct

from ..types import Counters

HEADER = Struct("!BBHII")
MAX_DROPOUT = 3000  # a longer jump forward is a restarted sender (RFC 3550, appendix A.1)
MAX_MISORDER = 100  # likewise backward
RTCP_TYPES = range(72, 77)  # RTCP's 200..204 as seen where RTP has marker and payload type


@dataclass(frozen=True, slots=True)
class RtpPacket:
    """One packet; `payload` is without header, extension and padding."""

    sequence: int
    timestamp: int
    ssrc: int
    payload_type: int
    marker: bool
    payload: bytes
    arrival_ns: int


def parse_packet(datagram: bytes, arrival_ns: int) -> RtpPacket | None:
    """The packet in a datagram, or None if it is not well-formed RTP (or is RTCP)."""
    if len(datagram) <= HEADER.size:
        return None
    flags, kind, sequence, timestamp, ssrc = HEADER.unpack_from(datagram)
    if flags >> 6 != 2 or (kind & 0x7F) in RTCP_TYPES:
        return None
    start, end = HEADER.size, len(datagram)
    if flags != 0x80:  # contributing sources, an extension or padding
        start, end = _payload_limits(datagram, flags)
    if start >= end:
        return None
    return RtpPacket(
        sequence, timestamp, ssrc, kind & 0x7F, kind >= 0x80, datagram[start:end], arrival_ns
    )


def _payload_limits(datagram: bytes, flags: int) -> tuple[int, int]:
    start, end = HEADER.size + 4 * (flags & 0x0F), len(datagram)
    if flags & 0x10:
        start += 4 + 4 * int.from_bytes(datagram[start + 2 : start + 4], "big")
    if flags & 0x20:
        padding = datagram[-1]
        end = end - padding if padding else 0  # a count of 0 cannot be: it counts itself
    return start, end


class ReorderBuffer:
    """Gives packets out in sequence, without delay when they come in sequence.

    Packets behind a gap are held until the gap fills, until `depth` of them wait, or until the
    oldest has waited `wait_ns`; then the missing ones count as lost. Counts lost, reordered,
    duplicate, late (came after being given up) and restarts in `counters`.
    """

    def __init__(self, counters: Counters, *, depth: int = 16, wait_ns: int = 10_000_000) -> None:
        self._counters = counters
        self._depth = depth
        self._wait_ns = wait_ns
        self.reset()

    def reset(self) -> None:
        """Forget everything: the next packet starts a new sequence."""
        self._next: int | None = None
        self._held: dict[int, RtpPacket] = {}
        self._given_up: dict[int, None] = {}
        self._restart_at: int | None = None
        self.deadline_ns: int | None = None

    def push(self, packet: RtpPacket, now_ns: int) -> list[RtpPacket]:
        """Packets that may go on, in order; often just this one."""
        if self._next is None:
            self._next = packet.sequence
        ahead = (packet.sequence - self._next) & 0xFFFF
        if ahead == 0:
            self._restart_at = None
            if not self._held:
                self._next = (packet.sequence + 1) & 0xFFFF
                return [packet]
            self._counters.add("reordered")
            return self._advance(packet)
        if ahead <= MAX_DROPOUT:
            return self._hold(packet, now_ns)
        if ahead >= 0x10000 - MAX_MISORDER:
            self._count_old(packet.sequence)
            return []
        return self._maybe_restart(packet, now_ns)

    def expire(self, now_ns: int) -> list[RtpPacket]:
        """Packets that have waited long enough; call it when `deadline_ns` has passed."""
        if self.deadline_ns is None or now_ns < self.deadline_ns:
            return []
        return self._give_up(now_ns)

    def _advance(self, packet: RtpPacket) -> list[RtpPacket]:
        ready = [packet]
        following = (packet.sequence + 1) & 0xFFFF
        while following in self._held:
            ready.append(self._held.pop(following))
            following = (following + 1) & 0xFFFF
        self._next = following
        oldest = min((p.arrival_ns for p in self._held.values()), default=None)
        self.deadline_ns = None if oldest is None else oldest + self._wait_ns
        return ready

    def _hold(self, packet: RtpPacket, now_ns: int) -> list[RtpPacket]:
        if packet.sequence in self._held:
            self._counters.add("duplicate")
            return []
        self._held[packet.sequence] = packet
        if self.deadline_ns is None:
            self.deadline_ns = now_ns + self._wait_ns
        if len(self._held) >= self._depth:
            return self._give_up(now_ns)
        return self.expire(now_ns)

    def _give_up(self, now_ns: int) -> list[RtpPacket]:
        """Skip the first gap and hand out what waits behind it."""
        assert self._next is not None
        first = min(self._held, key=lambda s: (s - (self._next or 0)) & 0xFFFF)
        missing = (first - self._next) & 0xFFFF
        self._counters.add("lost", missing)
        for back in range(min(missing, MAX_MISORDER), 0, -1):
            self._given_up[(first - back) & 0xFFFF] = None
        while len(self._given_up) > MAX_MISORDER:
            del self._given_up[next(iter(self._given_up))]
        ready = self._advance(self._held.pop(first))
        return ready + self.expire(now_ns)

    def _count_old(self, sequence: int) -> None:
        late = sequence in self._given_up
        if late:
            del self._given_up[sequence]
        self._counters.add("late" if late else "duplicate")

    def _maybe_restart(self, packet: RtpPacket, now_ns: int) -> list[RtpPacket]:
        """Two packets in sequence far away from the others: the sender started again."""
        if packet.sequence != self._restart_at:
            self._restart_at = (packet.sequence + 1) & 0xFFFF
            self._counters.add("malformed")
            return []
        self._counters.add("restarts")
        self.reset()
        return self.push(packet, now_ns)
