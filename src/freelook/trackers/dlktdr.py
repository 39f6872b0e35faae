"""dlktdr's HeadTracker over USB: its configuration program's protocol, JSON between two bytes.

`dlktdr:/dev/ttyACM0`. Frames are 0x02, JSON, CRC-16, 0x03. After opening, the board is asked for
panoff, tiltoff and rolloff ("RD"; degrees from its own centre), and reminded every 8 seconds that
somebody is here ("IH"). The signs depend on how the board is mounted and on its settings: look at
them with `freelook track`, and turn them with the axis options.

The CRC is that of X.25; a byte of it that would be 0, 2, 3, 6 or 0x15 is inverted. It is checked
by the board on what it hears, and answered with 0x06 (good) or 0x15 (bad: said again, counted as
`refused`). On what the board itself sends it cannot be checked: its firmware computes it before the
bytes are at their place (serial.cpp of github.com/dlktdr/HeadTracker; its own program does not
check it either).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

from scipy.spatial.transform import Rotation

from ..axes import LARGEST_DEG, AxisMap
from ..clock import NS_PER_S, Clock
from ..types import Counters
from . import _serial

KIND = "dlktdr"
OPTIONS = _serial.OPTIONS
AXES = AxisMap()
ITEMS = ("panoff", "tiltoff", "rolloff")
START, END, GOOD, BAD = b"\x02", b"\x03", b"\x06", b"\x15"
ESCAPED = b"\x00\x02\x03\x06\x15"
HERE_EVERY_NS = 8 * NS_PER_S
MOST_REPEATS = 8
LONGEST_FRAME = 4096

_MARKS = re.compile(b"[" + START + GOOD + BAD + b"]")


def open(
    argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock
) -> _serial.SerialTracker:
    """Talk to the board on the port."""
    return _serial.open_port(KIND, argument, options, HeadTrackerDecoder(axes), clock)


def crc16_x25(data: bytes) -> int:
    """CRC-16/X-25: 0x1021 reflected, from 0xffff, inverted."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return crc ^ 0xFFFF


def frame(command: str, **items: object) -> bytes:
    """A command as the board wants to hear it."""
    text = json.dumps({**items, "Cmd": command}, separators=(",", ":")).encode()
    crc = crc16_x25(text).to_bytes(2, "little")
    escaped = bytes(byte ^ 0xFF if byte in ESCAPED else byte for byte in crc)
    return START + text + escaped + END + b"\r\n"


GREETING = frame("RD", **dict.fromkeys(ITEMS, True)) + frame("IH")


class HeadTrackerDecoder(_serial.QuietDecoder):
    """Frames to rotations. Counts `noise` bytes between frames, `invalid` frames, `other` ones, and
    how often the board `refused` what it was told."""

    def __init__(self, axes: AxisMap) -> None:
        self.counters = Counters()
        self._axes = axes
        self.begin()

    def begin(self) -> bytes:
        self._rest = b""
        self._degrees: dict[str, float] = {}
        self._told_ns: int | None = None
        self._refused = 0
        self._repeats = 0
        return GREETING

    def reply(self, now_ns: int) -> bytes:
        if self._told_ns is None:
            self._told_ns = now_ns
        if self._refused and self._repeats < MOST_REPEATS:
            self._refused = 0
            self._repeats += 1
            self._told_ns = now_ns
            return GREETING
        if now_ns - self._told_ns >= HERE_EVERY_NS:
            self._told_ns = now_ns
            return frame("IH")
        return b""

    def feed(self, data: bytes, now_ns: int) -> list[Rotation]:
        buffer, at, found = self._rest + data, 0, []
        while (mark := _MARKS.search(buffer, at)) is not None:
            self._skip(buffer[at : mark.start()])
            at = mark.end()
            if mark[0] != START:
                self._refused += mark[0] == BAD
                self.counters.add("refused", int(mark[0] == BAD))
                continue
            end = buffer.find(END, at)
            if end < 0 and len(buffer) - at <= LONGEST_FRAME:
                at = mark.start()
                break
            if end < 0 or end - at > LONGEST_FRAME:
                self.counters.add("invalid")
                continue
            again = buffer.rfind(START, at, end)  # a frame that was cut off by the next
            if again >= 0:
                self.counters.add("invalid")
                at = again + 1
            rotation = self.parse(buffer[at : end - 2])
            at = end + 1
            if rotation is not None:
                found.append(rotation)
        else:
            self._skip(buffer[at:])
            at = len(buffer)
        self._rest = buffer[at:]
        return found

    def parse(self, text: bytes) -> Rotation | None:
        """`body_from_view` after this JSON, or None while an angle is still unknown."""
        try:
            message = json.loads(text)
            is_data = message["Cmd"] == "Data"
        except (ValueError, TypeError, KeyError, RecursionError):
            self.counters.add("invalid")
            return None
        if not is_data or not any(item in message for item in ITEMS):
            self.counters.add("other")
            return None
        degrees = {item: message[item] for item in ITEMS if item in message}
        if not all(map(_is_angle, degrees.values())):
            self.counters.add("invalid")
            return None
        self._degrees |= degrees
        if len(self._degrees) < len(ITEMS):
            return None
        return self._axes.body_from_view(*(float(self._degrees[item]) for item in ITEMS))

    def _skip(self, between: bytes) -> None:
        self.counters.add("noise", len(between.strip()))


def _is_angle(value: Any) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and abs(value) <= LARGEST_DEG and math.isfinite(value)
