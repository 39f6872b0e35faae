"""The part of SDP (RFC 8866) that describes one H.264 or H.265 stream over RTP."""

from __future__ import annotations

import base64
import binascii
import ipaddress
from collections.abc import Iterator
from dataclasses import dataclass, field

from ..errors import SourceError

CODECS = {"H264": "h264", "H265": "hevc"}
_SPROP = {
    "h264": ("sprop-parameter-sets",),
    "hevc": ("sprop-vps", "sprop-sps", "sprop-pps"),
}
_MAX_CHARACTERS = 65536


@dataclass(frozen=True, slots=True)
class VideoDescription:
    """One video stream; `parameter_sets` are NAL units, `codec` is h264 or hevc.

    `address` is as written (unicast, multicast or None when the text has none); `port` 0 means
    that RTSP will negotiate it.
    """

    codec: str
    payload_type: int
    port: int
    address: str | None
    clock_rate: int
    parameter_sets: tuple[bytes, ...] = ()


@dataclass(slots=True)
class _Media:
    kind: str
    port: int
    protocol: str
    formats: list[str]
    address: str | None = None
    rtpmap: dict[str, str] = field(default_factory=dict)
    fmtp: dict[str, str] = field(default_factory=dict)


def parse_sdp(text: str) -> VideoDescription:
    """The first H.264 or H.265 video stream described.

    SourceError (no retry) when there is none, or when it uses what cannot be received here:
    another codec, encryption, interleaved packets. The message says what was found.
    """
    videos = [media for media in _read(text) if media.kind == "video"]
    if not videos:
        raise SourceError("the SDP describes no video (it has no 'm=video ...' line)")
    for media in videos:
        for payload_type in media.formats:
            codec = CODECS.get(media.rtpmap.get(payload_type, "").split("/")[0].upper())
            if codec:
                return _describe(media, payload_type, codec)
    offered = sorted({name for media in videos for name in media.rtpmap.values()})
    raise SourceError(
        f"the SDP's video is {', '.join(offered) or 'not named by any a=rtpmap line'}; "
        f"only {' and '.join(CODECS)} can be received"
    )


def _read(text: str) -> list[_Media]:
    if not text.lstrip("\ufeff \r\n").startswith("v=0") or len(text) > _MAX_CHARACTERS:
        raise SourceError("this is not SDP (it must begin with the line 'v=0')")
    address: str | None = None
    medias: list[_Media] = []
    for number, line in enumerate(text.splitlines(), 1):
        kind, _, value = line.strip().partition("=")
        try:
            if kind == "m":
                medias.append(_media(value, address))
            elif kind == "c" and medias:
                medias[-1].address = _address(value)
            elif kind == "c":
                address = _address(value)
            elif kind == "a" and medias:
                _attribute(medias[-1], value)
        except ValueError as error:
            raise SourceError(f"SDP line {number}, {line.strip()[:80]!r}: {error}") from None
    return medias


def _media(value: str, address: str | None) -> _Media:
    words = value.split()
    if len(words) < 4:
        raise ValueError("expected 'm=video PORT RTP/AVP PAYLOAD_TYPE'")
    port = _number(words[1].split("/")[0], 65535, "the port")
    return _Media(words[0], port, words[2], words[3:], address)


def _address(value: str) -> str:
    words = value.split()
    if len(words) != 3 or words[0] != "IN" or words[1] not in ("IP4", "IP6"):
        raise ValueError("expected 'c=IN IP4 ADDRESS' or 'c=IN IP6 ADDRESS'")
    return str(ipaddress.ip_address(words[2].split("/")[0]))


def _attribute(media: _Media, value: str) -> None:
    name, _, content = value.partition(":")
    if name not in ("rtpmap", "fmtp"):
        return
    payload_type, _, rest = content.strip().partition(" ")
    if name == "rtpmap":
        media.rtpmap[payload_type] = rest.strip()
    else:
        media.fmtp[payload_type] = rest.strip()


def _describe(media: _Media, payload_type: str, codec: str) -> VideoDescription:
    if media.protocol not in ("RTP/AVP", "RTP/AVPF", "RTP/AVP/TCP"):
        raise SourceError(
            f"the SDP's video comes as {media.protocol}; only plain RTP (RTP/AVP) can be received"
        )
    parameters = dict(_parameters(media.fmtp.get(payload_type, "")))
    interleaved = parameters.get("packetization-mode") == "2"
    if interleaved or parameters.get("sprop-max-don-diff", "0") != "0":
        raise SourceError("the SDP's video is sent interleaved (out of order), which is not done")
    try:
        _, _, rate = media.rtpmap[payload_type].partition("/")
        return VideoDescription(
            codec,
            _number(payload_type, 127, "the payload type"),
            media.port,
            media.address,
            _number(rate or "90000", 1 << 31, "the clock rate"),
            tuple(_parameter_sets(codec, parameters)),
        )
    except ValueError as error:
        raise SourceError(f"SDP, payload type {payload_type}: {error}") from None


def _parameters(text: str) -> Iterator[tuple[str, str]]:
    for part in text.split(";"):
        name, _, value = part.strip().partition("=")
        yield name.strip().lower(), value.strip()


def _parameter_sets(codec: str, parameters: dict[str, str]) -> Iterator[bytes]:
    for name in _SPROP[codec]:
        for text in filter(None, parameters.get(name, "").split(",")):
            try:
                nal = base64.b64decode(text.strip(), validate=True)
            except binascii.Error:
                raise ValueError(f"{name} is not base64: {text[:40]!r}") from None
            if nal:
                yield nal


def _number(text: str, largest: int, what: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 12 and int(text) <= largest):
        raise ValueError(f"{what} must be a number up to {largest}, not {text[:20]!r}")
    return int(text)
