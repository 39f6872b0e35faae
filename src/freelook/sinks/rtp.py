"""A live stream, H.264 or H.265 in RTP over UDP: `rtp://HOST:PORT`."""

from __future__ import annotations

import secrets

from ..clock import NS_PER_S
from ..media.packetise import CLOCK_HZ, Packetiser, describe
from ..media.rtcp import asks_for_key
from ..types import Frame, Sink
from . import SinkSettings, check_output_file, refuse
from ._live import LiveEncoder, Sender, host_and_port

KIND = "rtp"


def recognises(argument: str) -> bool:
    return argument.startswith("rtp://")


def check(argument: str, settings: SinkSettings) -> None:
    host_and_port(argument)
    if settings.sdp is not None:
        check_output_file(settings.sdp, overwrite=True)


def open(argument: str, settings: SinkSettings) -> Sink:
    """Ready to send; writes the SDP file, if one is asked for, over an older one."""
    refuse(settings, "a live stream", "audio_from")
    return RtpStream(argument, settings)


class RtpStream:
    """Encodes each frame with the least delay and sends it at once, stamped with capture_ns.

    Nobody needs to listen; a receiver that asks for a key picture by RTCP (PLI or FIR, to the
    port that the packets come from) gets one. Counters: sent (pictures), packets, unsent (refused
    by the system), keys_asked.
    """

    def __init__(self, argument: str, settings: SinkSettings) -> None:
        self._encoder = LiveEncoder(argument, settings)
        self.counters = self._encoder.counters
        host, port = host_and_port(argument)
        codec = self._encoder.codec
        # RFC 3550: numbers start at random, so that streams cannot be mixed up
        self._packetiser = Packetiser(codec, secrets.randbits(32), secrets.randbits(16))
        self._offset = secrets.randbits(32)
        self._sender = Sender(argument, host, port, self.counters)
        if settings.sdp is not None:
            path = check_output_file(settings.sdp, overwrite=True)
            path.write_text(describe(codec, self._sender.host, port), "utf-8")

    def write(self, frame: Frame) -> None:
        if any(asks_for_key(packet) for packet in self._sender.answers()):
            self._encoder.want_key()
        for unit in self._encoder.encode(frame):
            timestamp = self._offset + unit.capture_ns * CLOCK_HZ // NS_PER_S
            for packet in self._packetiser.packets(unit.data, timestamp):
                self._sender.send(packet)

    def close(self) -> None:
        self._sender.close()
