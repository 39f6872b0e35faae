"""An RTSP server that players pull from (GStreamer's): `rtsp-server://127.0.0.1:8554/view`."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from pathlib import Path
from urllib.parse import urlsplit

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


def recognises(argument: str) -> bool:
    return argument.startswith("rtsp-server://")


def check(argument: str, settings: SinkSettings) -> None:
    refuse(settings, "RTSP, which has its own way to describe itself,", "sdp")
    host_and_port(argument)
    _needed_python(argument)


def open(argument: str, settings: SinkSettings) -> Sink:
    refuse(settings, "a live stream", "audio_from", "sdp")
    return RtspServer(argument, settings)


class RtspServer:
    """Encodes each frame with the least delay; GStreamer's server, in a process of its own, hands
    it to whoever asks, by UDP or TCP. A viewer who comes gets a key picture at once; one who stalls
    loses his own pictures only.

    The server listens where the address says: at 127.0.0.1 for this machine only. Counters: sent
    (pictures), keys_asked, clients (that came).
    """

    def __init__(self, argument: str, settings: SinkSettings) -> None:
        self._encoder = LiveEncoder(argument, settings)
        self.counters = self._encoder.counters
        self.clients = 0
        host, port = host_and_port(argument)
        path = urlsplit(argument).path.rstrip("/") or DEFAULT_PATH
        command = [_needed_python(argument), str(HELPER), host, str(port), path]
        self._child = Child(argument, [*command, self._encoder.codec], self._heard)
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


def _needed_python(argument: str) -> str:
    python = python_with_gstreamer()
    if python is None:
        raise SinkError(
            f"{argument}: this needs GStreamer's RTSP server; on Debian and Ubuntu: "
            f"sudo apt install {PACKAGES}"
        )
    return python
