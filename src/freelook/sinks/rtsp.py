"""A live stream published to a media server by RTSP: `rtsp://HOST:PORT/NAME`."""

from __future__ import annotations

import sys
from urllib.parse import urlsplit

from ..addresses import without_password
from ..errors import SinkError
from ..types import Frame, Sink
from . import SinkSettings, refuse
from ._child import ADDRESS, PROCESSES, Child
from ._live import LiveEncoder

KIND = "rtsp"

USUAL_PORT = 554
PUBLISH = f"{PROCESSES}.publish"


def recognises(argument: str) -> bool:
    return argument.startswith("rtsp://")


def check(argument: str, settings: SinkSettings) -> None:
    refuse(settings, "RTSP, which has its own way to describe itself,", "sdp")
    try:
        url = urlsplit(argument)
        complete = url.hostname and (url.port or USUAL_PORT) and url.path.strip("/")
    except ValueError:
        complete = None
    if not complete:
        shown = without_password(argument)
        raise SinkError(f"{shown}: give host and name, like rtsp://127.0.0.1:8554/view")


def open(argument: str, settings: SinkSettings) -> Sink:
    refuse(settings, "a live stream", "audio_from", "sdp")
    check(argument, settings)
    return Published(argument, settings)


class Published:
    """Encodes each frame with the least delay; FFmpeg's libraries, in a process of their own,
    publish it over TCP (ANNOUNCE and RECORD, as MediaMTX and others take it).

    In this process a server that answers slowly would hold up everything (the muxer keeps
    Python's lock while it connects). Counters as of `rtp`, without packets.
    """

    def __init__(self, argument: str, settings: SinkSettings) -> None:
        shown = without_password(argument)
        self._encoder = LiveEncoder(shown, settings)
        self.counters = self._encoder.counters
        width, height = map(str, settings.size)
        command = [sys.executable, "-m", PUBLISH, self._encoder.codec, width, height]
        self._child = Child(shown, command, secrets={ADDRESS: argument})
        try:
            self._child.wait_ready()
        except SinkError:
            self._child.close()
            raise

    def write(self, frame: Frame) -> None:
        for unit in self._encoder.encode(frame):
            self._child.send(unit)

    def close(self) -> None:
        self._child.close()
