"""ExpressLRS backpack: head tracking as MSP frames on a serial port, three channels of 0 to 2047.

`elrs:/dev/ttyUSB0?order=pan-roll-tilt&span=90`. An MSPv2 frame is "$X<", flags, u16 function, u16
size, payload, CRC-8 DVB-S2; function 0x0383 (MSP_ELRS_BACKPACK_SET_PTR) carries three u16 channel
values in CRSF's units, 192 to 1792 for `span` degrees to either side of 992; 0xffff leaves a
channel as it was. All little-endian.

Senders disagree about the order of the channels. `pan-tilt-roll` (the default) is that of the
backpack's own head tracking (module_base.cpp of ExpressLRS/Backpack), `pan-roll-tilt` that of its
fake trainer (fake_vrx_fake_trainer.cpp) and of trackers made after it. ExpressLRS itself passes the
three on as they come.
"""

from __future__ import annotations

import itertools
import struct
from collections.abc import Mapping

from scipy.spatial.transform import Rotation

from ..axes import AxisMap
from ..clock import Clock
from ..errors import TrackerError
from ..types import Counters
from . import _serial, number_option

KIND = "elrs"
OPTIONS = (*_serial.OPTIONS, "order", "span")
AXES = AxisMap()
DEFAULT_BAUD = 460800
DEFAULT_ORDER = "pan-tilt-roll"
ORDERS = {"-".join(p): p for p in itertools.permutations(("pan", "tilt", "roll"))}
SET_PTR = 0x0383
CENTRE, HALF_RANGE = 992, 800
LARGEST_VALUE = 2047
UNCHANGED = 0xFFFF
LONGEST_PAYLOAD = 64
STARTS = (b"$X<", b"$X>")

_HEADER = struct.Struct("<3xBHH")


def open(
    argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock
) -> _serial.SerialTracker:
    """Read frames from the port."""
    order = options.get("order", DEFAULT_ORDER)
    if order not in ORDERS:
        raise TrackerError(f"order must be one of {', '.join(ORDERS)}, not '{order}'")
    span_deg = number_option(options, "span", 90.0, 1, 360)
    decoder = MspDecoder(axes, ORDERS[order], span_deg)
    with_baud = {"baud": str(DEFAULT_BAUD), **options}
    return _serial.open_port(KIND, argument, with_baud, decoder, clock)


def crc8_dvb_s2(data: bytes) -> int:
    """Polynomial 0xD5, from 0, nothing reflected (ETSI EN 302 307)."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ (0xD5 if crc & 0x80 else 0)) & 0xFF
    return crc


class MspDecoder(_serial.QuietDecoder):
    """Frames to rotations. Counts `noise` bytes between frames, `checksum` errors, `other`
    functions and `invalid` payloads."""

    def __init__(self, axes: AxisMap, order: tuple[str, ...], span_deg: float) -> None:
        self.counters = Counters()
        self._axes = axes
        self._order = order
        self._span_deg = span_deg
        self.begin()

    def begin(self) -> bytes:
        self._rest = b""
        self._angles_deg = {"pan": 0.0, "tilt": 0.0, "roll": 0.0}
        return b""

    def feed(self, data: bytes, now_ns: int) -> list[Rotation]:
        buffer, at, found = self._rest + data, 0, []
        while True:
            start = buffer.find(b"$", at)
            self.counters.add("noise", (len(buffer) if start < 0 else start) - at)
            at = len(buffer) if start < 0 else start
            size = _frame_size(buffer[at:])
            if size is None:
                break
            if size == 0 or crc8_dvb_s2(buffer[at + 3 : at + size - 1]) != buffer[at + size - 1]:
                self.counters.add("checksum", int(size > 0))
                self.counters.add("noise")
                at += 1
                continue
            rotation = self._frame(buffer[at : at + size])
            at += size
            if rotation is not None:
                found.append(rotation)
        self._rest = buffer[at:]
        return found

    def _frame(self, frame: bytes) -> Rotation | None:
        _, function, size = _HEADER.unpack_from(frame)
        if function != SET_PTR:
            self.counters.add("other")
            return None
        if size < 6 or size % 2:
            self.counters.add("invalid")
            return None
        values = struct.unpack_from("<3H", frame, _HEADER.size)
        if any(LARGEST_VALUE < value != UNCHANGED for value in values):
            self.counters.add("invalid")
            return None
        for name, value in zip(self._order, values, strict=True):
            if value != UNCHANGED:
                self._angles_deg[name] = (value - CENTRE) / HALF_RANGE * self._span_deg
        pan, tilt, roll = self._angles_deg.values()
        return self._axes.body_from_view(pan, tilt, roll)


def _frame_size(data: bytes) -> int | None:
    """Bytes of the frame that begins here; None if that is not known yet, or not all of them are
    here; 0 if none begins here."""
    if not any(data.startswith(start[: len(data)]) for start in STARTS):
        return 0
    if len(data) < _HEADER.size:
        return None
    (_, _, payload) = _HEADER.unpack_from(data)
    if payload > LONGEST_PAYLOAD:
        return 0
    size = _HEADER.size + int(payload) + 1
    return size if len(data) >= size else None
