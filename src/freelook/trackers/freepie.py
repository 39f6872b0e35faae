"""FreePIE's UDP packets, as phones send them: flags and floats, orientation in radians.

`freepie:5555` listens on this machine only, `freepie:0.0.0.0:5555` on all its addresses.
A datagram is one unused byte, one byte of flags (1: raw sensor values, 2: orientation) and
little-endian floats: the nine raw values if there are any, then yaw, pitch, roll in radians. Layout
read in OpenTrack's tracker-freepie-udp. Phones differ in what they call yaw, pitch and roll, so the
angles are taken as they are named; turn them with the axis options.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from functools import partial

from scipy.spatial.transform import Rotation

from ..axes import LARGEST_DEG, AxisMap
from ..clock import Clock
from ..types import Counters
from ._udp import UdpTracker, parse_address, posed

KIND = "freepie"
OPTIONS: tuple[str, ...] = ()
AXES = AxisMap()
DEFAULT_PORT = 5555
RAW = 1
ORIENTATION = 2
RAW_FLOATS = 9

_ANGLES = struct.Struct("<3f")


def open(argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock) -> UdpTracker:
    """Listen on `[HOST:]PORT`; TrackerError when that is not possible."""
    host, port = parse_address(argument, DEFAULT_PORT)
    counters = Counters()
    parse = posed(partial(parse_packet, axes=axes, counters=counters))
    return UdpTracker(host, port, "FreePIE", parse, counters, clock)


def parse_packet(datagram: bytes, axes: AxisMap, counters: Counters) -> Rotation | None:
    """`body_from_view`, or None, counted as `short`, `invalid` or `raw` (no orientation in it)."""
    flags = datagram[1] if len(datagram) > 1 else 0
    if len(datagram) > 1 and not flags & ORIENTATION:
        counters.add("raw" if flags & RAW else "invalid")
        return None
    start = 2 + (4 * RAW_FLOATS if flags & RAW else 0)
    if len(datagram) < start + _ANGLES.size:
        counters.add("short")
        return None
    degrees = [math.degrees(a) for a in _ANGLES.unpack_from(datagram, start)]
    if not all(abs(a) <= LARGEST_DEG for a in degrees):
        counters.add("invalid")
        return None
    return axes.body_from_view(*degrees)
