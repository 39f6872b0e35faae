"""A live stream published by WebRTC: `whip+https://HOST/PATH` (or whip+http), WHIP's address."""

from __future__ import annotations

import sys
from importlib import import_module
from urllib.parse import urlsplit

from ..addresses import without_password
from ..errors import SinkError
from ..types import Frame, Sink
from . import SinkSettings, refuse
from ._child import ADDRESS, PROCESSES, Child
from ._live import LiveEncoder

KIND = "whip"

SCHEMES = ("whip+http://", "whip+https://")
CONNECT_S = 20.0
WHIP_CLIENT = f"{PROCESSES}.whip_client"


def recognises(argument: str) -> bool:
    return argument.startswith(SCHEMES)


def check(argument: str, settings: SinkSettings) -> None:
    refuse(settings, "WHIP, which has its own way to describe itself,", "sdp")
    shown = without_password(argument)
    if settings.codec != "h264":
        raise SinkError(f"{shown}: WebRTC takes H.264 everywhere, and H.265 hardly anywhere")
    try:
        host = urlsplit(argument).hostname
    except ValueError:
        host = None
    if not host:
        raise SinkError(f"{shown}: give host and path, like whip+http://127.0.0.1:8889/view/whip")
    import_module("aiortc")  # a missing one is noticed before the flight
    import_module("aiohttp")


def open(argument: str, settings: SinkSettings) -> Sink:
    refuse(settings, "a live stream", "audio_from", "sdp")
    check(argument, settings)
    return WhipStream(argument, settings)


class WhipStream:
    """Encodes each frame with the least delay; aiortc, in a process of its own, sends it.

    A server that lost a picture gets a key picture. Counters: sent (pictures), keys_asked, unread
    (pictures thrown away as the network was behind).
    """

    def __init__(self, argument: str, settings: SinkSettings) -> None:
        shown = without_password(argument)
        self._encoder = LiveEncoder(shown, settings)
        self.counters = self._encoder.counters
        address = {ADDRESS: argument.removeprefix("whip+")}
        command = [sys.executable, "-m", WHIP_CLIENT]
        self._child = Child(shown, command, self._heard, address)
        try:
            self._child.wait_ready(CONNECT_S)
        except SinkError:
            self._child.close()
            raise

    def write(self, frame: Frame) -> None:
        for unit in self._encoder.encode(frame):
            self._child.send(unit)

    def close(self) -> None:
        self._child.close()

    def _heard(self, words: str) -> None:
        if words == "key":
            self._encoder.want_key()
        elif words == "unread":
            self.counters.add("unread")
