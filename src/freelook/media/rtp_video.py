"""Datagrams of one RTP video stream to access units: everything between socket and decoder."""

from __future__ import annotations

from collections.abc import Iterable

from ..types import AccessUnit, Counters, StreamInfo
from .annexb import ParameterSets
from .depacketise import CodedPicture, Depacketiser, guess_codec
from .rtp import ReorderBuffer, RtpPacket, parse_packet
from .sps import stream_info

SENDER_GONE_NS = 200_000_000


class RtpVideo:
    """Receives one stream; never raises, counts in `counters`.

    With `codec` None the first packets that leave no doubt decide between H.264 and H.265. With
    `payload_type` None the first sender's is taken. Another sender (SSRC) or payload type takes
    over when the present one has been silent for 0.2 s: a restarted camera comes back by itself,
    and two cameras sending to one port do not mix.

    Counters: packets, malformed, foreign (other sender or payload type), undecided (before the
    codec was known), lost, reordered, duplicate, late, restarts, damaged, oversized.
    """

    def __init__(
        self,
        counters: Counters,
        *,
        codec: str | None = None,
        payload_type: int | None = None,
        parameter_sets: Iterable[bytes] = (),
    ) -> None:
        self._counters = counters
        self._codec = codec
        self._any_codec = codec is None
        self._payload_type = payload_type
        self._any_type = payload_type is None
        self._given_sets = tuple(parameter_sets)
        self._order = ReorderBuffer(counters)
        self._sender: int | None = None
        self._heard_ns = 0
        if codec:
            self._start(codec)

    @property
    def deadline_ns(self) -> int | None:
        """When to call `expire`, if nothing else arrives."""
        return self._order.deadline_ns

    def push(self, datagram: bytes, now_ns: int) -> list[AccessUnit]:
        """The access units completed by this datagram; mostly none or one."""
        packet = parse_packet(datagram, now_ns)
        if packet is None:
            self._counters.add("malformed")
            return []
        self._counters.add("packets")
        units = []
        if (packet.ssrc, packet.payload_type) != (self._sender, self._payload_type):
            if not self._may_take_over(packet, now_ns):
                self._counters.add("foreign")
                return []
            units = self._take_over(packet)
        self._heard_ns = now_ns
        if self._codec is None and not self._decide(packet):
            return units
        return units + self._units(self._order.push(packet, now_ns))

    def expire(self, now_ns: int) -> list[AccessUnit]:
        """Units behind packets that are given up now."""
        return self._units(self._order.expire(now_ns))

    def _may_take_over(self, packet: RtpPacket, now_ns: int) -> bool:
        if not self._any_type and packet.payload_type != self._payload_type:
            return False
        return self._sender is None or now_ns - self._heard_ns > SENDER_GONE_NS

    def _take_over(self, packet: RtpPacket) -> list[AccessUnit]:
        left = [] if self._codec is None else self._pictures(self._depacketiser.flush())
        if self._sender is not None:
            self._counters.add("restarts")
        self._sender, self._payload_type = packet.ssrc, packet.payload_type
        self._order.reset()
        if self._any_codec:
            self._codec = None
        return left

    def _decide(self, packet: RtpPacket) -> bool:
        codec = guess_codec(packet.payload)
        if codec is None:
            self._counters.add("undecided")
            return False
        self._codec = codec
        self._start(codec)
        return True

    def _start(self, codec: str) -> None:
        self._sets = ParameterSets(codec, self._given_sets)
        self._depacketiser = Depacketiser(codec, self._sets, self._counters)
        self._sps: bytes | None = None
        self._stream = StreamInfo(codec)

    def _units(self, packets: list[RtpPacket]) -> list[AccessUnit]:
        out: list[AccessUnit] = []
        for packet in packets:
            if pictures := self._depacketiser.push(packet):
                out += self._pictures(pictures)
        return out

    def _pictures(self, pictures: list[CodedPicture]) -> list[AccessUnit]:
        if self._sets.sps != self._sps:
            self._sps = self._sets.sps
            self._stream = stream_info(self._stream.codec, self._sps)
        return [AccessUnit(self._stream, p.data, p.key, p.arrival_ns) for p in pictures]
