"""MPEG transport stream (ISO/IEC 13818-1) to access units of its first video stream.

A stream parser gives a picture out when the next one begins, a frame interval late. Here it
goes out with its last packet, which is known by the stuffing that fills it up.
"""

from __future__ import annotations

from ..types import AccessUnit, Counters, StreamInfo
from .annexb import ParameterSets, is_key, join_nals, split_nals
from .sps import stream_info

PACKET_BYTES = 188
MAX_UNIT_BYTES = 8 << 20

_SYNC = b"\x47"
_CODECS = {0x01: "mpeg2video", 0x02: "mpeg2video", 0x1B: "h264", 0x24: "hevc"}
_SEQUENCE_HEADER = b"\0\0\1\xb3"


class TransportStream:
    """Takes bytes as they come, never raises. `problem` says why there can be no picture.

    Counters: packets, malformed (bytes and tables that make no sense), lost (gaps, the numbers
    have only 4 bits), damaged (pictures thrown away because of them), scrambled, oversized.
    """

    def __init__(self, counters: Counters) -> None:
        self.problem: str | None = None
        self._counters = counters
        self._rest = b""
        self._pmt_pid = self._video_pid = -1
        self._tables: dict[int, bytes] = {}
        self._early = True
        self._begin_stream("")

    def push(self, data: bytes, now_ns: int) -> list[AccessUnit]:
        """The units completed by these bytes (a datagram, or any piece of the stream)."""
        data = self._rest + data if self._rest else data
        out: list[AccessUnit] = []
        at = 0
        while at + PACKET_BYTES <= len(data):
            if data[at] != _SYNC[0]:
                following = data.find(_SYNC, at)
                self._counters.add("malformed")
                at = len(data) if following < 0 else following
                continue
            out += self._packet(data[at : at + PACKET_BYTES], now_ns)
            at += PACKET_BYTES
        self._rest = data[at:]
        return out

    def _packet(self, packet: bytes, now_ns: int) -> list[AccessUnit]:
        self._counters.add("packets")
        pid = (packet[1] & 0x1F) << 8 | packet[2]
        start = 4
        if packet[3] & 0x20:
            start += 1 + packet[4]
        if packet[1] & 0x80 or start > PACKET_BYTES:
            self._counters.add("malformed")
            return []
        if not packet[3] & 0x10:
            return []
        if pid == self._video_pid:
            return self._video(packet, packet[start:], now_ns)
        if pid in (0, self._pmt_pid) and packet[1] & 0x40 and start < PACKET_BYTES:
            self._table(pid, packet[start + 1 + packet[start] :])
        return []

    # --- tables ---------------------------------------------------------------------------

    def _table(self, pid: int, section: bytes) -> None:
        size = 3 + (int.from_bytes(section[1:3], "big") & 0xFFF)
        section = section[:size]
        if self._tables.get(pid) == section:
            return
        if len(section) < max(size, 12) or crc32(section):
            self._counters.add("malformed")
            return
        self._tables[pid] = section
        if pid == 0 and section[0] == 0:
            self._programs(section[8:-4])
        elif pid == self._pmt_pid and section[0] == 2:
            self._streams(section[10:-4])

    def _programs(self, entries: bytes) -> None:
        for at in range(0, len(entries) - 3, 4):
            pid = int.from_bytes(entries[at + 2 : at + 4], "big") & 0x1FFF
            if any(entries[at : at + 2]):  # program 0 is the network's
                if pid != self._pmt_pid:
                    self._pmt_pid, self._video_pid = pid, -1
                return

    def _streams(self, body: bytes) -> None:
        at = 2 + (int.from_bytes(body[:2], "big") & 0xFFF)
        kinds = []
        while at + 5 <= len(body):
            pid = int.from_bytes(body[at + 1 : at + 3], "big") & 0x1FFF
            codec = _CODECS.get(body[at])
            if codec:
                self._video_pid, self.problem = pid, None
                self._begin_stream(codec)
                return
            kinds.append(f"0x{body[at]:02x}")
            at += 5 + (int.from_bytes(body[at + 3 : at + 5], "big") & 0xFFF)
        self.problem = (
            "the transport stream has no H.264, H.265 or MPEG-2 video, "
            f"only streams of type {', '.join(kinds) or 'none'}"
        )

    # --- pictures -------------------------------------------------------------------------

    def _begin_stream(self, codec: str) -> None:
        self._codec = codec
        self._stream = StreamInfo(codec)
        self._sets = ParameterSets(codec) if codec in ("h264", "hevc") else None
        self._sps: bytes | None = None
        self._count: int | None = None
        self._drop()

    def _drop(self) -> None:
        self._parts: list[bytes] | None = None
        self._size = self._wanted = 0
        self._given_out = False

    def _video(self, packet: bytes, payload: bytes, now_ns: int) -> list[AccessUnit]:
        if packet[3] & 0xC0:
            self._counters.add("scrambled")
            return []
        if not self._in_sequence(packet):
            return []
        out = []
        if packet[1] & 0x40:
            out = self._finish()
            self._open_pes(payload, now_ns)
        elif self._parts is not None:
            self._parts.append(payload)
            self._size += len(payload)
        elif self._given_out:  # the stuffing was not at the end: this sender stuffs anywhere
            self._early = self._given_out = False
            self._counters.add("damaged")
        if self._size > MAX_UNIT_BYTES:
            self._counters.add("oversized")
            self._drop()
        elif self._parts is not None and self._complete(packet):
            out += self._finish()
            self._given_out = not self._wanted
        return out

    def _in_sequence(self, packet: bytes) -> bool:
        """False for a repeated packet. After a gap the picture begun is thrown away."""
        count, before = packet[3] & 15, self._count
        self._count = count
        if before is None or count == before + 1 & 15:
            return True
        if count == before:
            self._counters.add("duplicate")
            return False
        restarted = packet[3] & 0x20 and packet[4] and packet[5] & 0x80
        if not restarted:
            self._counters.add("lost", count - before - 1 & 15)
        if self._parts is not None:
            self._counters.add("damaged")
        self._drop()
        return True

    def _open_pes(self, payload: bytes, now_ns: int) -> None:
        self._drop()
        header = 9 + payload[8] if len(payload) > 8 else 0
        if payload[:3] != b"\0\0\1" or not header or header > len(payload):
            self._counters.add("malformed")
            return
        length = int.from_bytes(payload[4:6], "big")
        self._wanted = length + 6 - header if length + 6 > header else 0
        self._parts = [payload[header:]]
        self._size = len(payload) - header
        self._arrival_ns = now_ns

    def _complete(self, packet: bytes) -> bool:
        if self._wanted:
            return self._size >= self._wanted
        return self._early and _has_stuffing(packet)

    def _finish(self) -> list[AccessUnit]:
        data = b"".join(self._parts or ())
        self._parts = None
        self._size = 0
        if not data:
            return []
        key = _SEQUENCE_HEADER in data
        if self._sets is not None:
            nals = list(split_nals(data))
            self._sets.update(nals)
            key = is_key(self._codec, nals)
            data = join_nals(self._sets.complete(nals) if key else nals)
            self._learn()
        return [AccessUnit(self._stream, data, key, self._arrival_ns)] if data else []

    def _learn(self) -> None:
        if self._sets is not None and self._sets.sps != self._sps:
            self._sps = self._sets.sps
            self._stream = stream_info(self._codec, self._sps)


def _has_stuffing(packet: bytes) -> bool:
    """Whether the adaptation field holds more than its flags ask for (clause 2.4.3.4)."""
    if not packet[3] & 0x20:
        return False
    length = packet[4]
    if length == 0:
        return True
    flags, used = packet[5], 1
    used += 6 * bool(flags & 0x10) + 6 * bool(flags & 0x08) + bool(flags & 0x04)
    for present in (flags & 0x02, flags & 0x01):  # private data and extension: length, bytes
        if present and 5 + used < PACKET_BYTES:
            used += 1 + packet[5 + used]
    return length > used or flags == 0


def crc32(section: bytes) -> int:
    """The CRC of annex A; 0 over a section that ends in its own CRC."""
    crc = 0xFFFFFFFF
    for byte in section:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1 ^ (0x04C11DB7 if crc & 0x80000000 else 0)) & 0xFFFFFFFF
    return crc
