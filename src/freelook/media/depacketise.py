"""RTP payloads to access units: H.264 (RFC 6184, modes 0 and 1) and H.265 (RFC 7798).

An access unit goes out on the marker bit of its last packet. Waiting for the next picture's
first packet instead, as stream parsers do, costs a whole frame interval.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..types import Counters
from .annexb import ParameterSets, is_key, is_picture, join_nals, nal_type
from .rtp import RtpPacket

MAX_UNIT_BYTES = 8 << 20  # more than any real picture: intra-only 8K is about 4 MB


@dataclass(frozen=True, slots=True)
class CodedPicture:
    """One access unit as Annex B. `damaged`: packets were lost in it or just before it.

    `arrival_ns` is when its first packet came, the nearest to when it was taken.
    """

    data: bytes
    key: bool
    damaged: bool
    timestamp: int
    arrival_ns: int


class Depacketiser:
    """Takes the packets of one stream in sequence order; gaps in the sequence are losses.

    `codec` is h264 or hevc. Fragments that are incomplete are thrown away, the other NAL units
    of a damaged picture are kept (decoders conceal missing slices). Nothing raises; counters:
    malformed (payloads that make no sense), damaged, oversized.
    """

    def __init__(self, codec: str, sets: ParameterSets, counters: Counters) -> None:
        self._codec = codec
        self._sets = sets
        self._counters = counters
        self._split = self._split_h264 if codec == "h264" else self._split_h265
        self._next: int | None = None
        self._timestamp = -1
        self._damaged = False
        self._begin(-1, 0)

    def push(self, packet: RtpPacket) -> list[CodedPicture]:
        """Pictures that this packet completed: none, one, or two after a lost marker."""
        out = []
        if packet.sequence != self._next:
            self._note_gap()
        if packet.timestamp != self._timestamp:
            out = self._finish()
            self._begin(packet.timestamp, packet.arrival_ns)
        self._next = (packet.sequence + 1) & 0xFFFF
        self._add(packet.payload)
        if packet.marker and (self._has_picture or self._oversized):
            out += self._finish()
            self._begin(packet.timestamp, packet.arrival_ns)
            self._timestamp = -1
        return out

    def flush(self) -> list[CodedPicture]:
        """What is left when the stream ends or changes."""
        out = self._finish()
        self._begin(-1, 0)
        self._next = None
        return out

    def _begin(self, timestamp: int, arrival_ns: int) -> None:
        self._timestamp, self._arrival_ns = timestamp, arrival_ns
        self._nals: list[bytes] = []
        self._fragment: list[bytes] | None = None
        self._size = 0
        self._has_picture = self._oversized = False

    def _note_gap(self) -> None:
        self._damaged = self._next is not None
        self._fragment = None

    def _add(self, payload: bytes) -> None:
        self._size += len(payload)
        if self._oversized:
            return
        if self._size > MAX_UNIT_BYTES:
            self._counters.add("oversized")
            self._oversized, self._nals, self._fragment = True, [], None
            return
        try:
            if payload[0] & 0x80:
                raise ValueError("forbidden_zero_bit: damaged on the way")
            self._split(payload)
        except (IndexError, ValueError):
            self._counters.add("malformed")

    def _split_h264(self, payload: bytes) -> None:
        kind = payload[0] & 31
        if kind == 28:
            header = bytes([payload[0] & 0xE0 | payload[1] & 31])
            self._add_fragment(header, payload[1], payload[2:])
        elif kind == 24:
            self._add_aggregate(payload, 1)
        elif 1 <= kind <= 23:
            self._add_nal(payload)
        else:
            raise ValueError(f"payload structure {kind}")

    def _split_h265(self, payload: bytes) -> None:
        kind = payload[0] >> 1 & 63
        if kind == 49:
            header = bytes([payload[0] & 0x81 | (payload[2] & 63) << 1, payload[1]])
            self._add_fragment(header, payload[2], payload[3:])
        elif kind == 48:
            self._add_aggregate(payload, 2)
        elif kind < 48 and len(payload) > 2:
            self._add_nal(payload)
        else:
            raise ValueError(f"payload structure {kind}")

    def _add_nal(self, nal: bytes) -> None:
        """One whole NAL unit."""
        kind = nal_type(self._codec, nal)
        self._nals.append(nal)
        self._has_picture = self._has_picture or is_picture(self._codec, kind)

    def _add_aggregate(self, payload: bytes, at: int) -> None:
        """NAL units with their lengths in front (STAP-A, AP)."""
        while at < len(payload):
            size = int.from_bytes(payload[at : at + 2], "big")
            nal = payload[at + 2 : at + 2 + size]
            if not size or len(nal) != size:
                raise ValueError("aggregate cut short")
            self._add_nal(nal)
            at += 2 + size

    def _add_fragment(self, header: bytes, flags: int, body: bytes) -> None:
        """Part of a NAL unit (FU-A, FU); `header` is the one of the whole unit."""
        if flags & 0x80:
            self._damaged = self._damaged or self._fragment is not None  # one without end
            self._fragment = [header]
        elif self._fragment is None:
            self._damaged = True  # its beginning was lost
            return
        self._fragment.append(body)
        if flags & 0x40:
            whole, self._fragment = b"".join(self._fragment), None
            self._add_nal(whole)

    def _finish(self) -> list[CodedPicture]:
        if self._fragment is not None:
            self._damaged, self._fragment = True, None
        nals, damaged = self._nals, self._damaged
        self._sets.update(nals)
        if self._oversized:
            self._damaged = True
            return []
        if not self._has_picture:  # only parameter sets, or nothing whole: the damage stays
            return []
        self._damaged = False
        if damaged:
            self._counters.add("damaged")
        key = is_key(self._codec, nals)
        data = join_nals(self._sets.complete(nals) if key else nals)
        return [CodedPicture(data, key, damaged, self._timestamp, self._arrival_ns)]


def guess_codec(payload: bytes) -> str | None:
    """h264 or hevc where the payload's first bytes leave no doubt, else None."""
    if len(payload) > 2 and payload[1] == 1 and payload[0] in (0x40, 0x42, 0x44, 0x60, 0x62):
        return "hevc"  # VPS, SPS, PPS, AP or FU of layer 0, temporal id 1
    if len(payload) > 3 and payload[0] < 0x80 and payload[0] & 31 in (7, 24, 28):
        return "h264"
    return None
