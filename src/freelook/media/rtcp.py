"""What receivers of RTP send back, as far as a sender of video cares (RFC 3550, 4585, 5104)."""

from __future__ import annotations

PAYLOAD_FEEDBACK = 206
PICTURE_LOSS, FULL_INTRA = 1, 4  # its formats
OLD_FULL_INTRA = 192  # RFC 2032


def asks_for_key(datagram: bytes) -> bool:
    """Whether one of the packets in a compound asks for a key picture. Anything that is not RTCP
    asks for nothing."""
    at = 0
    while at + 4 <= len(datagram):
        first, kind = datagram[at], datagram[at + 1]
        if first >> 6 != 2:
            return False
        if kind == OLD_FULL_INTRA:
            return True
        if kind == PAYLOAD_FEEDBACK and first & 31 in (PICTURE_LOSS, FULL_INTRA):
            return True
        at += 4 + 4 * int.from_bytes(datagram[at + 2 : at + 4], "big")
    return False
