"""A live stream, H.264 or H.265 as MPEG-TS over UDP: `udp://HOST:PORT`."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import av
from av.error import FFmpegError

from ..clock import NS_PER_S
from ..errors import SinkError
from ..types import AccessUnit, Frame, Sink
from . import SinkSettings, refuse
from ._live import LiveEncoder, Sender, host_and_port

KIND = "udp"

CLOCK_HZ = 90_000
TICK = Fraction(1, CLOCK_HZ)
DATAGRAM_BYTES = 7 * 188  # whole packets, as many as fit in an Ethernet frame
# tables with every picture: a receiver can begin at any; nothing is held back for order
OPTIONS = {
    "flush_packets": "1",
    "pat_period": "0.1",
    "pcr_period": "20",
}


def recognises(argument: str) -> bool:
    return argument.startswith("udp://")


def check(argument: str, settings: SinkSettings) -> None:
    refuse(settings, "MPEG-TS", "sdp")
    host_and_port(argument)


def open(argument: str, settings: SinkSettings) -> Sink:
    refuse(settings, "a live stream", "audio_from", "sdp")
    return TransportStream(argument, settings)


class TransportStream:
    """Encodes each frame with the least delay and sends it at once; times are capture_ns, counted
    from the first. Nobody needs to listen. Counters as of `rtp`."""

    def __init__(self, argument: str, settings: SinkSettings) -> None:
        self._argument = argument
        self._encoder = LiveEncoder(argument, settings)
        self.counters = self._encoder.counters
        self._sender = Sender(argument, *host_and_port(argument), self.counters)
        self._muxed = Collected()
        self._container = av.open(self._muxed, "w", format="mpegts", options=OPTIONS)
        width, height = settings.size
        self._stream = self._container.add_mux_stream(
            self._encoder.codec, width=width, height=height
        )
        self._first_ns: int | None = None
        self._last_tick = -1

    def write(self, frame: Frame) -> None:
        for unit in self._encoder.encode(frame):
            self._mux(unit)
        data = self._muxed.taken()
        for at in range(0, len(data), DATAGRAM_BYTES):
            self._sender.send(data[at : at + DATAGRAM_BYTES])

    def close(self) -> None:
        self._container.close()
        self._sender.close()

    def _mux(self, unit: AccessUnit) -> None:
        packet: av.Packet[Any] = av.Packet(unit.data)
        packet.stream = self._stream
        packet.time_base = TICK
        packet.pts = packet.dts = self._tick(unit.capture_ns)
        packet.is_keyframe = unit.key
        try:
            self._container.mux(packet)
        except FFmpegError as error:
            raise SinkError(f"{self._argument}: {error.strerror}") from None

    def _tick(self, capture_ns: int) -> int:
        """Of 90 kHz, growing always: the muxer wants it so."""
        self._first_ns = capture_ns if self._first_ns is None else self._first_ns
        tick = (capture_ns - self._first_ns) * CLOCK_HZ // NS_PER_S
        self._last_tick = max(tick, self._last_tick + 1)
        return self._last_tick


class Collected:
    """A file for the muxer: keeps what is written until it is taken."""

    def __init__(self) -> None:
        self._data = bytearray()

    def write(self, data: bytes) -> int:
        self._data += data
        return len(data)

    def taken(self) -> bytes:
        data, self._data = bytes(self._data), bytearray()
        return data
