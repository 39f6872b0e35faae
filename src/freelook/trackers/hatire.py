"""Hatire's frames over a serial port: 30 bytes, as Arduino head trackers for OpenTrack send them.

`hatire:/dev/ttyUSB0?baud=115200`. A frame is 0xAAAA, u16 code, three floats of rotation and three
of translation, 0x5555, little-endian (`endian=big` for the other). Codes to 1000 number the frames;
higher ones are texts (counted as `info`), 9000 and more errors of the device (`errors`). As in
OpenTrack the three rotations are yaw, roll, pitch in degrees, and roll is + left ear down. `start`
is sent after opening, for devices that want to be told.

Layout, order and codes: tracker-hatire of OpenTrack (ftnoir_arduino_type.h and its settings).
"""

from __future__ import annotations

import struct
from collections.abc import Mapping

from scipy.spatial.transform import Rotation

from ..axes import LARGEST_DEG, Axis, AxisMap
from ..clock import Clock
from ..errors import TrackerError
from ..types import Counters
from . import _serial

KIND = "hatire"
OPTIONS = (*_serial.OPTIONS, "endian", "start")
AXES = AxisMap(roll=Axis("roll", -1.0))
BEGIN = b"\xaa\xaa"
END = b"\x55\x55"
FRAME_BYTES = 30
LAST_FRAME_CODE = 1000
FIRST_ERROR_CODE = 9000
ENDIANS = {"little": "<", "big": ">"}


def open(
    argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock
) -> _serial.SerialTracker:
    """Read frames from the port."""
    endian = options.get("endian", "little")
    if endian not in ENDIANS:
        raise TrackerError(f"endian must be one of {', '.join(ENDIANS)}, not '{endian}'")
    start = options.get("start", "")
    if not start.isascii():
        raise TrackerError(f"start must be plain ASCII, not '{start}'")
    decoder = HatireDecoder(axes, ENDIANS[endian], start.encode("ascii"))
    return _serial.open_port(KIND, argument, options, decoder, clock)


class HatireDecoder(_serial.QuietDecoder):
    """Frames to rotations. Counts `noise` bytes between frames, `invalid` angles."""

    def __init__(self, axes: AxisMap, endian: str = "<", start: bytes = b"") -> None:
        self.counters = Counters()
        self._axes = axes
        self._start = start
        self._layout = struct.Struct(f"{endian}2xH3f12x2x")
        self._rest = b""

    def begin(self) -> bytes:
        self._rest = b""
        return self._start

    def feed(self, data: bytes, now_ns: int) -> list[Rotation]:
        buffer, at, found = self._rest + data, 0, []
        while (start := buffer.find(BEGIN, at)) >= 0:
            self.counters.add("noise", start - at)
            at = start
            if len(buffer) - at < FRAME_BYTES:
                break
            frame = buffer[at : at + FRAME_BYTES]
            if not frame.endswith(END):
                self.counters.add("noise")
                at += 1
                continue
            at += FRAME_BYTES
            rotation = self.parse(frame)
            if rotation is not None:
                found.append(rotation)
        else:
            keep = len(buffer) - buffer.endswith(BEGIN[:1])  # perhaps half of a beginning
            self.counters.add("noise", max(keep - at, 0))
            at = max(keep, at)
        self._rest = buffer[at:]
        return found

    def parse(self, frame: bytes) -> Rotation | None:
        """`body_from_view` of one whole frame, or None, counted."""
        code, yaw, roll, pitch = self._layout.unpack(frame)
        if code > LAST_FRAME_CODE:
            self.counters.add("errors" if code >= FIRST_ERROR_CODE else "info")
            return None
        if not all(abs(angle) <= LARGEST_DEG for angle in (yaw, pitch, roll)):
            self.counters.add("invalid")
            return None
        return self._axes.body_from_view(yaw, pitch, roll)
