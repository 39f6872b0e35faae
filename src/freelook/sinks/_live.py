"""What live streams share: an encoder that gives a key picture when asked, and sending by UDP."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from urllib.parse import urlsplit

from ..addresses import without_password
from ..clock import NS_PER_S
from ..errors import RenderError, SinkError
from ..media.encoder import Encoder
from ..types import AccessUnit, Counters, Frame
from . import SinkSettings

KEY_INTERVAL_NS = NS_PER_S
ANSWER_BYTES = 2000
MOST_ANSWERS = 16  # read for one picture; what floods us must not hold up the pictures


class LiveEncoder:
    """Frames in, access units out; a key picture every second of capture time, and when asked.

    Counters: sent (pictures), keys_asked. SinkError where this machine or these settings cannot.
    """

    def __init__(self, argument: str, settings: SinkSettings) -> None:
        self.counters = Counters()
        self._argument = argument
        self._key = True
        self._key_ns = 0
        try:
            self._encoder = Encoder(
                settings.size,
                codec=settings.codec,
                fps=settings.fps,
                bitrate=settings.bitrate,
                color=settings.color,
                by=settings.encoder,
            )
        except RenderError as error:
            raise SinkError(f"{argument}: {error}") from None

    @property
    def codec(self) -> str:
        return self._encoder.codec

    def want_key(self) -> None:
        """The next picture is a key picture. From any thread."""
        self.counters.add("keys_asked")
        self._key = True

    def encode(self, frame: Frame) -> list[AccessUnit]:
        key = self._key or frame.capture_ns - self._key_ns >= KEY_INTERVAL_NS
        if key:
            self._key, self._key_ns = False, frame.capture_ns
        try:
            units = self._encoder.encode(frame, key=key)
        except RenderError as error:
            raise SinkError(f"{self._argument}: {error}") from None
        self.counters.add("sent", len(units))
        return units


class Sender:
    """Sends datagrams; nothing a receiver does or fails to do comes back as an error.

    The socket is not connected: a port that nobody listens at cannot refuse it. Counters:
    packets, unsent (refused by the system: full buffers, or a network that is away for now).
    """

    def __init__(self, argument: str, host: str, port: int, counters: Counters) -> None:
        self._counters = counters
        try:
            found = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
        except OSError as error:
            raise SinkError(f"{argument}: {error.strerror}") from None
        family, kind, _, _, address = found
        self.host, self._address = str(address[0]), (str(address[0]), int(address[1]))
        self._socket = socket.socket(family, kind)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20)
        self._socket.setblocking(False)

    def send(self, packet: bytes) -> None:
        try:
            self._socket.sendto(packet, self._address)
            self._counters.add("packets")
        except OSError:
            self._counters.add("unsent")

    def answers(self) -> Iterator[bytes]:
        """What came back since the last call."""
        for _ in range(MOST_ANSWERS):
            try:
                yield self._socket.recv(ANSWER_BYTES)
            except OSError:
                return

    def close(self) -> None:
        self._socket.close()


def host_and_port(argument: str) -> tuple[str, int]:
    """Of an address. SinkError where they are missing."""
    scheme = argument.partition(":")[0]
    try:
        url = urlsplit(argument)
        host, port = url.hostname, url.port
    except ValueError:
        host = port = None
    if not host or not port:
        shown = without_password(argument)
        raise SinkError(f"{shown}: give host and port, like {scheme}://127.0.0.1:5004")
    return host, port
