"""Access units to RTP packets: H.264 (RFC 6184, mode 1) and H.265 (RFC 7798), no sockets."""

from __future__ import annotations

from collections.abc import Iterator

from .annexb import split_nals
from .rtp import HEADER

PAYLOAD_BYTES = 1200  # fits any path with room for headers
PAYLOAD_TYPE = 96
CLOCK_HZ = 90_000
NAMES = {"h264": "H264", "hevc": "H265"}


class Packetiser:
    """Cuts access units of one stream into RTP packets; numbers them from where it is told."""

    def __init__(self, codec: str, ssrc: int, sequence: int = 0) -> None:
        self._fragments = _fragments_h264 if codec == "h264" else _fragments_h265
        self._ssrc = ssrc
        self._sequence = sequence

    def packets(self, data: bytes, timestamp: int) -> list[bytes]:
        """All packets of one Annex B access unit; the last one carries the marker."""
        payloads = [part for nal in split_nals(data) for part in self._payloads(nal)]
        last = len(payloads) - 1
        return [self._packet(p, i == last, timestamp) for i, p in enumerate(payloads)]

    def _payloads(self, nal: bytes) -> Iterator[bytes]:
        if len(nal) <= PAYLOAD_BYTES:
            yield nal
        else:
            yield from self._fragments(nal)

    def _packet(self, payload: bytes, marker: bool, timestamp: int) -> bytes:
        kind = PAYLOAD_TYPE | marker << 7
        header = HEADER.pack(0x80, kind, self._sequence, timestamp & 0xFFFFFFFF, self._ssrc)
        self._sequence = (self._sequence + 1) & 0xFFFF
        return header + payload


def _fragments_h264(nal: bytes) -> Iterator[bytes]:
    """FU-A: indicator with type 28, then start and end bits and the NAL unit's own type."""
    indicator, kind = nal[0] & 0xE0 | 28, nal[0] & 31
    for part, edges in _parts(nal[1:], PAYLOAD_BYTES - 2):
        yield bytes([indicator, edges | kind]) + part


def _fragments_h265(nal: bytes) -> Iterator[bytes]:
    """FU: payload header with type 49, then start and end bits and the NAL unit's own type."""
    kind = nal[0] >> 1 & 63
    header = bytes([nal[0] & 0x81 | 49 << 1, nal[1]])
    for part, edges in _parts(nal[2:], PAYLOAD_BYTES - 3):
        yield header + bytes([edges | kind]) + part


def _parts(body: bytes, size: int) -> Iterator[tuple[bytes, int]]:
    for start in range(0, len(body), size):
        first, last = start == 0, start + size >= len(body)
        yield body[start : start + size], first << 7 | last << 6


def describe(codec: str, host: str, port: int) -> str:
    """The SDP (RFC 8866) of the stream; parameter sets come in the stream itself."""
    family = "IP6" if ":" in host else "IP4"
    name = NAMES[codec]
    lines = [
        "v=0",
        f"o=- 0 0 IN {family} {host}",
        "s=freelook",
        f"c=IN {family} {host}",
        "t=0 0",
        f"m=video {port} RTP/AVP {PAYLOAD_TYPE}",
        f"a=rtpmap:{PAYLOAD_TYPE} {name}/{CLOCK_HZ}",
    ]
    if codec == "h264":
        lines.append(f"a=fmtp:{PAYLOAD_TYPE} packetization-mode=1")
    return "\r\n".join([*lines, ""])
