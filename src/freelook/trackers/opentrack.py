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
import struct
from collections.abc import Iterator, Mapping

from ..axes import LARGEST_DEG, Axis, AxisMap
from ..clock import Clock
from ..datagrams import DatagramListener
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
        self._listener = _listen(host, port)
        self.counters = Counters()
        self.address = (host, self._listener.port)

    @property
    def message(self) -> str:
        host, port = self.address
        return f"waiting for OpenTrack packets on UDP {host} port {port}"

    def poses(self) -> Iterator[Pose]:
        while not self._listener.closed:
            angles = self._newest()
            if angles is not None:
                yield Pose(self._axes.body_from_view(*angles), self._clock())

    def close(self) -> None:
        self._listener.close()

    def _newest(self) -> tuple[float, float, float] | None:
        """Waits for a datagram, then empties the socket; None if nothing in it was valid."""
        newest = None
        datagram = self._listener.receive()
        for _ in range(LARGEST_BURST):
            if datagram is None:
                break
            self.counters.add("received")
            angles = parse_packet(datagram, self.counters)
            if angles is not None and newest is not None:
                self.counters.add("dropped")
            newest = angles or newest
            datagram = self._listener.receive(timeout_s=0)
        return newest


def _listen(host: str, port: int) -> DatagramListener:
    try:
        return DatagramListener(host, port)
    except (OSError, ValueError) as error:  # ValueError: text that cannot be a host's name
        reason = getattr(error, "strerror", None) or error
        raise TrackerError(
            f"cannot listen on UDP {host} port {port}: {reason}; "
            "is another program using the port, or is the address not one of this machine?"
        ) from None
