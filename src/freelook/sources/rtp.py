"""RTP over UDP, H.264 or H.265: `rtp://HOST:PORT` to listen on, or an SDP file, `camera.sdp`."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator, Mapping
from pathlib import Path

from ..clock import NS_PER_S, Clock
from ..datagrams import DatagramListener, listen
from ..errors import SourceError
from ..media.rtp_video import RtpVideo
from ..media.sdp import parse_sdp
from ..types import AccessUnit, Counters, Source
from . import check_options, number, split_url

KIND = "rtp"

_CODECS = {"auto": None, "h264": "h264", "h265": "hevc", "hevc": "hevc"}
_DEFAULT_PORT = 5004


def recognises(argument: str) -> bool:
    return argument.startswith("rtp://") or argument.lower().endswith(".sdp")


def open(
    argument: str, *, loop: bool, pace: bool, clock: Clock, options: Mapping[str, str]
) -> Source:
    """Listen. Options of an address: `codec` (auto, h264, h265) and `pt`, the payload type.

    In an SDP file a multicast address is joined and a loopback address is listened on; any other
    is where the sender sends to, so every address of this machine is listened on.
    """
    counters = Counters()
    if argument.startswith("rtp://"):
        return _open_address(argument, counters, clock, options)
    check_options(argument, options, ())
    try:
        text = Path(argument).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SourceError(f"{argument}: {getattr(error, 'strerror', 'not a text file')}") from None
    try:
        description = parse_sdp(text)
        if not description.port:
            raise SourceError("the SDP gives port 0; write the port that the camera sends to")
    except SourceError as error:
        raise SourceError(f"{argument}: {error}") from None
    video = RtpVideo(
        counters,
        codec=description.codec,
        payload_type=description.payload_type,
        parameter_sets=description.parameter_sets,
    )
    host = _listen_address(description.address)
    return RtpSource(listen(argument, host, description.port), video, counters, clock)


def _open_address(
    argument: str, counters: Counters, clock: Clock, options: Mapping[str, str]
) -> RtpSource:
    host, port, chosen = split_url(argument, options, ("codec", "pt"))
    codec = chosen.get("codec", "auto").lower()
    if codec not in _CODECS:
        raise SourceError(f"{argument}: codec must be one of {', '.join(_CODECS)}, not {codec!r}")
    payload_type = int(number(argument, chosen, "pt", 0)) or None
    if payload_type and payload_type > 127:
        raise SourceError(f"{argument}: pt (payload type) must be below 128")
    listener = listen(argument, host, _DEFAULT_PORT if port is None else port)
    video = RtpVideo(counters, codec=_CODECS[codec], payload_type=payload_type)
    return RtpSource(listener, video, counters, clock)


def _listen_address(address: str | None) -> str:
    if address is None:
        return ""
    ip = ipaddress.ip_address(address)
    if ip.is_multicast or ip.is_loopback:
        return address
    return "::" if ip.version == 6 else ""


class RtpSource:
    """One stream from one port. Silence is no error: it listens until the sender is back."""

    def __init__(
        self, listener: DatagramListener, video: RtpVideo, counters: Counters, clock: Clock
    ) -> None:
        self.counters = counters
        self._listener = listener
        self._video = video
        self._clock = clock

    @property
    def port(self) -> int:
        """The UDP port listened on."""
        return self._listener.port

    def units(self) -> Iterator[AccessUnit]:
        listener, video, clock = self._listener, self._video, self._clock
        try:
            while not listener.closed:
                deadline_ns = video.deadline_ns
                wait_s = None if deadline_ns is None else (deadline_ns - clock()) / NS_PER_S
                datagram = listener.receive(None if wait_s is None else max(wait_s, 0))
                if datagram is not None:
                    yield from video.push(datagram, clock())
                elif not listener.closed:
                    yield from video.expire(clock())
        finally:
            self.close()

    def close(self) -> None:
        self._listener.close()
