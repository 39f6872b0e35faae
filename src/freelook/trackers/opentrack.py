"""OpenTrack's "UDP over network" output: six little-endian doubles, 48 bytes a datagram.

`opentrack:4242` listens on this machine only, `opentrack:0.0.0.0:4242` on all its addresses.
A datagram holds TX TY TZ (cm, not used here) yaw pitch roll (degrees); a longer one is taken for
what its first 48 bytes say. Of many that wait only the newest valid one counts.

Signs: OpenTrack means yaw + right and pitch + up, as here, but roll + left ear down. So its code
says where it turns an image of a face into angles (tracker-neuralnet) and where it hands them to
flight simulators (proto-simconnect, x-plane-plugin), read at github.com/opentrack/opentrack.
Hence the default `roll=-roll`. Its own settings can turn any axis round, so can ours.
"""

from __future__ import annotations

import math
import selectors
import socket
import struct
import threading
from collections.abc import Iterator, Mapping

from ..axes import LARGEST_DEG, Axis, AxisMap
from ..clock import Clock
from ..errors import TrackerError
from ..types import Counters, Pose

KIND = "opentrack"
OPTIONS: tuple[str, ...] = ()
AXES = AxisMap(roll=Axis("roll", -1.0))
DEFAULT_PORT = 4242
LOOPBACK = "127.0.0.1"
# More than this waiting at once is a flood, not a tracker; look at it in portions.
LARGEST_BURST = 4096

_PACKET = struct.Struct("<6d")


def open(argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock) -> OpenTrack:
    """Listen on `[HOST:]PORT`; TrackerError when that is not possible."""
    host, port = parse_address(argument)
    return OpenTrack(host, port, axes, clock)


def parse_address(argument: str) -> tuple[str, int]:
    """(host, port) of `PORT`, `HOST:PORT`, `[IPv6]:PORT` or nothing at all."""
    host, _, port_text = argument.rpartition(":")
    port_text = port_text or str(DEFAULT_PORT)
    if not (port_text.isascii() and port_text.isdigit() and int(port_text[:6]) <= 65535):
        raise TrackerError(f"'{argument}' is not a port or host:port; for example 4242")
    return host.strip("[]") or LOOPBACK, int(port_text)


def parse_packet(datagram: bytes, counters: Counters) -> tuple[float, float, float] | None:
    """(yaw, pitch, roll) in degrees as sent, or None, counted as `short` or `invalid`."""
    if len(datagram) < _PACKET.size:
        counters.add("short")
        return None
    values = _PACKET.unpack_from(datagram)
    yaw, pitch, roll = values[3:]
    if not all(map(math.isfinite, values)) or max(map(abs, values[3:])) > LARGEST_DEG:
        counters.add("invalid")
        return None
    return yaw, pitch, roll


class OpenTrack:
    """A `Tracker` that listens for OpenTrack's datagrams."""

    def __init__(self, host: str, port: int, axes: AxisMap, clock: Clock) -> None:
        self._axes = axes
        self._clock = clock
        self._socket = _bind(host, port)
        self._wake_here, self._wake_there = socket.socketpair()
        self._lock = threading.Lock()
        self._reading = False
        self._closed = False
        self.counters = Counters()
        self.address: tuple[str, int] = self._socket.getsockname()[:2]

    @property
    def message(self) -> str:
        return f"waiting for OpenTrack packets on UDP {self.address[0]} port {self.address[1]}"

    def poses(self) -> Iterator[Pose]:
        with self._lock:
            if self._closed:
                return
            self._reading = True
        with selectors.DefaultSelector() as selector, self._socket, self._wake_here:
            selector.register(self._socket, selectors.EVENT_READ)
            selector.register(self._wake_here, selectors.EVENT_READ)
            while not self._closed:
                selector.select()
                angles = self._newest()
                if angles is not None and not self._closed:
                    yield Pose(self._axes.body_from_view(*angles), self._clock())

    def close(self) -> None:
        with self._lock:
            self._closed = True
            self._wake_there.close()
            if not self._reading:  # else the reader wakes up and closes them
                self._socket.close()
                self._wake_here.close()

    def _newest(self) -> tuple[float, float, float] | None:
        newest = None
        for _ in range(LARGEST_BURST):
            try:
                datagram = self._socket.recv(2048)
            except BlockingIOError:
                break
            self.counters.add("received")
            angles = parse_packet(datagram, self.counters)
            if angles is not None:
                if newest is not None:
                    self.counters.add("dropped")
                newest = angles
        return newest


def _bind(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    udp = socket.socket(family, socket.SOCK_DGRAM)
    try:
        udp.bind((host, port))
    except (OSError, UnicodeError) as error:
        udp.close()
        reason = getattr(error, "strerror", None) or error
        raise TrackerError(
            f"cannot listen on UDP {host} port {port}: {reason}; "
            "is another program using the port, or is the address not one of this machine?"
        ) from None
    udp.setblocking(False)
    return udp
