"""Open Sound Control over UDP: OpenTrack's quaternion, or any message of four or three numbers.

`osc:53101` listens on this machine only, `osc:0.0.0.0:53101` on all its addresses. A message of
four numbers at the address `/bridge/quat` (option `address`) is a quaternion w x y z, one of three
numbers is yaw pitch roll in degrees. Messages at other addresses are counted as `other`.

OpenTrack makes its quaternion by Qt's fromEulerAngles(pitch, yaw, -roll), which is R_y(yaw)
R_x(pitch) R_z(-roll); its roll counts the other way than ours, so the quaternion is our own
`head_from_view` (x right, y down, z forward) as it stands (proto-osc of OpenTrack; Qt's
documentation of QQuaternion). It has no Euler angles that can flip.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping
from functools import partial

from scipy.spatial.transform import Rotation

from ..axes import LARGEST_DEG, AxisMap
from ..clock import Clock
from ..errors import TrackerError
from ..rotations import FRD_FROM_RDF, from_wxyz
from ..types import Counters
from ._udp import UdpTracker, parse_address, posed

KIND = "osc"
OPTIONS = ("address",)
AXES = AxisMap()
DEFAULT_PORT = 53101
DEFAULT_ADDRESS = "/bridge/quat"
DEEPEST_BUNDLE = 4

_NUMBERS = {"f": ">f", "d": ">d", "i": ">i", "h": ">q"}


def open(argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock) -> UdpTracker:
    """Listen on `[HOST:]PORT`; TrackerError when that is not possible."""
    address = options.get("address", DEFAULT_ADDRESS)
    if not (address.startswith("/") and address.isascii() and address.isprintable()):
        raise TrackerError(f"address must begin with /, such as {DEFAULT_ADDRESS}, not '{address}'")
    host, port = parse_address(argument, DEFAULT_PORT)
    counters = Counters()
    parse = posed(partial(parse_packet, address=address, axes=axes, counters=counters))
    return UdpTracker(host, port, f"OSC {address}", parse, counters, clock)


def parse_packet(
    datagram: bytes, address: str, axes: AxisMap, counters: Counters
) -> Rotation | None:
    """The last pose in a datagram (a message, or a bundle of them), or None.

    Counted: `invalid` for what is no OSC or no pose, `other` for other addresses.
    """
    newest = None
    try:
        for name, numbers in messages(datagram):
            if name != address:
                counters.add("other")
            else:
                newest = _rotation(numbers, axes)
    except (ValueError, struct.error):
        counters.add("invalid")
    return newest


def messages(packet: bytes, depth: int = 0) -> Iterator[tuple[str, list[float]]]:
    """(address, numbers) of every message. ValueError or struct.error for what is no OSC.

    Open Sound Control 1.0 specification: strings and everything else padded to four bytes; a
    bundle is "#bundle", eight bytes of time, and elements with their sizes.
    """
    if not packet.startswith(b"#bundle\0"):
        yield _message(packet)
        return
    if depth == DEEPEST_BUNDLE or len(packet) < 16:
        raise ValueError("bundles in bundles in bundles, or one without its time")
    at = 16
    while at < len(packet):
        (size,) = struct.unpack_from(">I", packet, at)
        at += 4
        if size == 0 or at + size > len(packet):
            raise ValueError("an element longer than its bundle")
        yield from messages(packet[at : at + size], depth + 1)
        at += size


def _message(packet: bytes) -> tuple[str, list[float]]:
    address, at = _text(packet, 0)
    tags, at = _text(packet, at)
    if not (address.startswith("/") and tags.startswith(",")):
        raise ValueError("not an OSC message")
    numbers = []
    for tag in tags[1:]:
        if tag not in _NUMBERS:  # something else than numbers; so the rest cannot be a pose
            return address, []
        layout = struct.Struct(_NUMBERS[tag])
        numbers.append(float(layout.unpack_from(packet, at)[0]))
        at += layout.size
    return address, numbers


def _text(packet: bytes, at: int) -> tuple[str, int]:
    """A string and where the next thing begins."""
    end = packet.index(b"\0", at)
    return packet[at:end].decode("ascii"), (end + 4) & ~3


def _rotation(numbers: list[float], axes: AxisMap) -> Rotation:
    """From four numbers or three; ValueError for any other count or value."""
    if len(numbers) == 3 and all(abs(a) <= LARGEST_DEG for a in numbers):
        return axes.body_from_view(*numbers)
    if len(numbers) == 4 and 0.9 < math.hypot(*numbers) < 1.1:
        # fifteen decimals: smaller numbers carry nothing and their squares underflow
        return axes.remap(FRD_FROM_RDF * from_wxyz([round(n, 15) for n in numbers]))
    raise ValueError("not a pose")
