"""A live stream, H.264 or H.265 in RTP over UDP: `rtp://HOST:PORT`."""

from __future__ import annotations

import secrets
import socket
from urllib.parse import urlsplit

from ..clock import NS_PER_S
from ..errors import RenderError, SinkError
from ..media.encoder import Encoder
from ..media.packetise import CLOCK_HZ, Packetiser, describe
from ..types import Counters, Frame, Sink
from . import SinkSettings, check_output_file, refuse

KIND = "rtp"


def recognises(argument: str) -> bool:
    return argument.startswith("rtp://")


def open(argument: str, settings: SinkSettings) -> Sink:
    """Ready to send; writes the SDP file, if one is asked for, over an older one."""
    refuse(settings, "a live stream", "audio_from")
    return RtpStream(argument, settings)


class RtpStream:
    """Encodes each frame with the least delay and sends it at once, stamped with capture_ns.

    Nobody needs to listen. Counters: sent (pictures), packets, unsent (refused by the system).
    """

    def __init__(self, argument: str, settings: SinkSettings) -> None:
        self.counters = Counters()
        self._argument = argument
        host, port = _host_and_port(argument)
        self._encoder = _encoder(settings)
        codec = self._encoder.codec
        # RFC 3550: numbers start at random, so that streams cannot be mixed up
        self._packetiser = Packetiser(codec, secrets.randbits(32), secrets.randbits(16))
        self._offset = secrets.randbits(32)
        self._socket, self._address = _socket_to(argument, host, port)
        if settings.sdp is not None:
            path = check_output_file(settings.sdp, overwrite=True)
            path.write_text(describe(codec, self._address[0], port), "utf-8")

    def write(self, frame: Frame) -> None:
        try:
            units = self._encoder.encode(frame)
        except RenderError as error:
            raise SinkError(f"{self._argument}: {error}") from None
        for unit in units:
            timestamp = self._offset + unit.capture_ns * CLOCK_HZ // NS_PER_S
            for packet in self._packetiser.packets(unit.data, timestamp):
                self._send(packet)
            self.counters.add("sent")

    def close(self) -> None:
        self._socket.close()

    def _send(self, packet: bytes) -> None:
        try:
            self._socket.sendto(packet, self._address)
            self.counters.add("packets")
        except OSError:  # full buffers, or a network that is away for now
            self.counters.add("unsent")


def _encoder(settings: SinkSettings) -> Encoder:
    try:
        return Encoder(
            settings.size,
            codec=settings.codec,
            fps=settings.fps,
            bitrate=settings.bitrate,
            color=settings.color,
        )
    except RenderError as error:
        raise SinkError(str(error)) from None


def _host_and_port(argument: str) -> tuple[str, int]:
    try:
        url = urlsplit(argument)
        host, port = url.hostname, url.port
    except ValueError:
        host = port = None
    if not host or not port:
        raise SinkError(f"{argument}: give host and port, like rtp://127.0.0.1:5004")
    return host, port


def _socket_to(argument: str, host: str, port: int) -> tuple[socket.socket, tuple[str, int]]:
    try:
        family, kind, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
    except OSError as error:
        raise SinkError(f"{argument}: {error.strerror}") from None
    sender = socket.socket(family, kind)
    sender.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20)
    return sender, (str(address[0]), int(address[1]))
