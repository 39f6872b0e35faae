"""An RTSP server that players pull from (GStreamer's): `rtsp-server://127.0.0.1:8554/view`."""

from __future__ import annotations

import secrets
import subprocess
import sys
from functools import cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

from ..addresses import is_loopback, without_password
from ..errors import SinkError
from ..types import Frame, Sink
from . import SinkSettings, refuse
from ._child import Child
from ._live import LiveEncoder, host_and_port

KIND = "rtsp-server"

HELPER = Path(__file__).parents[1] / "processes" / "gst_rtsp_server.py"
# freelook's own Python rarely has GStreamer; the system's has what apt installs
PYTHONS = (sys.executable, "/usr/bin/python3")
PROBE = (
    "import gi; gi.require_version('GstRtspServer', '1.0');"
    "from gi.repository import Gst, GstRtspServer; Gst.init(None);"
    "names = ('appsrc', 'rtph264pay', 'rtph265pay', 'udpsink', 'rtpbin');"
    "assert all(Gst.ElementFactory.find(name) for name in names)"
)
PROBE_S = 30
PACKAGES = (
    "python3-gi gir1.2-gst-rtsp-server-1.0 gstreamer1.0-plugins-base gstreamer1.0-plugins-good"
)
DEFAULT_PATH = "/view"
USER, PASSWORD = "FREELOOK_RTSP_USER", "FREELOOK_RTSP_PASSWORD"  # as the helper reads them
MADE_UP_USER = "pilot"


def recognises(argument: str) -> bool:
    return argument.startswith("rtsp-server://")


def check(argument: str, settings: SinkSettings) -> None:
    refuse(settings, "RTSP, which has its own way to describe itself,", "sdp")
    _who_may(argument)
    _needed_python(without_password(argument))


def secured(argument: str) -> str:
    """With a password made up, where other machines reach the server and nothing was said about
    who may."""
    host, _ = host_and_port(argument)
    if "@" in urlsplit(argument).netloc or is_loopback(host):
        return argument
    who = f"{MADE_UP_USER}:{secrets.token_urlsafe(12)}"
    return argument.replace("://", f"://{who}@", 1)


def invitation(argument: str) -> str:
    """What players are given: the address, password included."""
    url = urlsplit(argument)
    path = url.path.rstrip("/") or DEFAULT_PATH
    return f"rtsp://{url.netloc}{path}"


def open(argument: str, settings: SinkSettings) -> Sink:
    refuse(settings, "a live stream", "audio_from", "sdp")
    return RtspServer(argument, settings)


class RtspServer:
    """Encodes each frame with the least delay; GStreamer's server, in a process of its own, hands
    it to whoever asks, by UDP or TCP. A viewer who comes gets a key picture at once; one who stalls
    loses his own pictures only.

    The server listens where the address says: at 127.0.0.1 for this machine only; anywhere else
    viewers need the user and password in the address (SinkError without). Counters: sent
    (pictures), keys_asked, clients (that came), refused (of them), unread (pictures thrown away as
    their viewer was behind).
    """

    def __init__(self, argument: str, settings: SinkSettings) -> None:
        who, address = _who_may(argument), argument
        argument = without_password(argument)
        self._encoder = LiveEncoder(argument, settings)
        self.counters = self._encoder.counters
        self.clients = 0
        host, port = host_and_port(address)
        path = urlsplit(address).path.rstrip("/") or DEFAULT_PATH
        command = [_needed_python(argument), str(HELPER), host, str(port), path]
        self._child = Child(argument, [*command, self._encoder.codec], self._heard, who)
        try:
            self._child.wait_ready()
        except SinkError:
            self._child.close()
            raise

    @property
    def pid(self) -> int:
        """Of the server's process."""
        return self._child.pid

    def write(self, frame: Frame) -> None:
        for unit in self._encoder.encode(frame):
            self._child.send(unit)

    def close(self) -> None:
        self._child.close()

    def _heard(self, words: str) -> None:
        """On the child's thread."""
        what, _, number = words.partition(" ")
        if what == "key":
            self._encoder.want_key()
        elif what == "clients" and number.isdigit():
            self.counters.add("clients", max(0, int(number) - self.clients))
            self.clients = int(number)
        elif what in ("refused", "unread"):
            self.counters.add(what)


@cache
def python_with_gstreamer() -> str | None:
    """The first Python here that can run the server; asked once, as that takes a moment."""
    for python in PYTHONS:
        try:
            run = subprocess.run([python, "-c", PROBE], capture_output=True, timeout=PROBE_S)
        except (OSError, subprocess.TimeoutExpired):
            continue
        if run.returncode == 0:
            return python
    return None


def _who_may(argument: str) -> dict[str, str]:
    """User and password for the helper's environment; none where only this machine comes."""
    host, _ = host_and_port(argument)
    url = urlsplit(argument)
    if url.username and url.password:
        return {USER: unquote(url.username), PASSWORD: unquote(url.password)}
    if url.username or url.password or not is_loopback(host):
        address = without_password(argument)
        raise SinkError(
            f"{address}: give user and password, as other machines can come: "
            f"{address.replace('://', '://USER:PASSWORD@', 1)}"
        )
    return {}


def _needed_python(argument: str) -> str:
    python = python_with_gstreamer()
    if python is None:
        raise SinkError(
            f"{argument}: this needs GStreamer's RTSP server; on Debian and Ubuntu: "
            f"sudo apt install {PACKAGES}"
        )
    return python
