"""OpenTrack's "UDP over network" output: six little-endian doubles, 48 bytes a datagram.

`opentrack:4242` listens on this machine only, `opentrack:0.0.0.0:4242` on all its addresses.
A datagram holds TX TY TZ (cm, not used here) yaw pitch roll (degrees); a longer one is taken for
what its first 48 bytes say. Of many that wait only the newest valid one counts. What `freelook
track send` puts behind the 48 bytes (`_trailer.py`) is used if it is there: packets that come too
late are left out, lost ones are counted, and the pose's time is free of the network's jitter.

Signs: OpenTrack means yaw + right and pitch + up, as here, but roll + left ear down. So its code
says where it turns an image of a face into angles (tracker-neuralnet) and where it hands them to
flight simulators (proto-simconnect, x-plane-plugin), read at github.com/opentrack/opentrack.
Hence the default `roll=-roll`. Its own settings can turn any axis round, so can ours.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping

from ..axes import LARGEST_DEG, Axis, AxisMap
from ..clock import Clock
from ..types import Counters, Pose
from . import _trailer, _udp
from ._udp import UdpTracker

KIND = "opentrack"
OPTIONS: tuple[str, ...] = ()
AXES = AxisMap(roll=Axis("roll", -1.0))
DEFAULT_PORT = 4242

_PACKET = struct.Struct("<6d")


def open(argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock) -> OpenTrack:
    """Listen on `[HOST:]PORT`; TrackerError when that is not possible."""
    host, port = parse_address(argument)
    return OpenTrack(host, port, axes, clock)


def parse_address(argument: str) -> tuple[str, int]:
    """(host, port) of `PORT`, `HOST:PORT`, `[IPv6]:PORT` or nothing at all."""
    return _udp.parse_address(argument, DEFAULT_PORT)


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


def make_packet(
    yaw_deg: float, pitch_deg: float, roll_deg: float, sequence: int, t_ns: int
) -> bytes:
    """A datagram for OpenTrack's "UDP over network" input from head angles in our signs, with
    sequence and time behind it."""
    position = (0.0, 0.0, 0.0)
    return _PACKET.pack(*position, yaw_deg, pitch_deg, -roll_deg) + _trailer.pack(sequence, t_ns)


class OpenTrack(UdpTracker):
    """A `Tracker` that listens for OpenTrack's datagrams."""

    def __init__(self, host: str, port: int, axes: AxisMap, clock: Clock) -> None:
        counters = Counters()
        self._axes = axes
        self._order = _trailer.Order(counters)
        self._sender_clock = _trailer.SenderClock()
        super().__init__(host, port, "OpenTrack", self._pose, counters, clock)

    def _pose(self, datagram: bytes, arrival_ns: int) -> Pose | None:
        angles = parse_packet(datagram, self.counters)
        if angles is None:
            return None
        t_ns = arrival_ns
        trailer = _trailer.unpack(datagram[_PACKET.size :])
        if trailer is not None:
            sequence, sent_ns = trailer
            if not self._order.accept(sequence):
                return None
            t_ns = self._sender_clock.here(sent_ns, arrival_ns)
        return Pose(self._axes.body_from_view(*angles), t_ns)
