from __future__ import annotations

import re
import shutil
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from rtsp_camera import RtspCamera

from freelook.errors import SourceError
from freelook.media.decoder import Decoder
from freelook.sources import open_source
from freelook.types import Source
from video_streams import GOP

pytest.importorskip("aiortsp")

PICTURES = 2 * GOP
CAMERAS: list[RtspCamera] = []


@pytest.fixture(autouse=True)
def _close_cameras() -> Iterator[None]:
    yield
    while CAMERAS:
        CAMERAS.pop().close()


def camera(codec: str = "h264", **faults: Any) -> RtspCamera:
    CAMERAS.append(RtspCamera(codec, **faults))
    return CAMERAS[-1]


def error_of(source: Source) -> SourceError:
    with pytest.raises(SourceError) as caught:
        for _ in source.units():
            pass
    return caught.value


@pytest.mark.parametrize("codec", ["h264", "hevc"])
@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_pictures_come_by_udp_and_tcp(codec: str, transport: str) -> None:
    served = camera(codec)
    source = open_source(served.url(f"?transport={transport}"))
    units, decoder = source.units(), Decoder()
    taken = [next(units) for _ in range(PICTURES + 3)]
    units.close()  # type: ignore[attr-defined]
    assert sum(len(decoder.decode(unit)) for unit in taken) == PICTURES + 3
    assert taken[0].stream.codec == codec
    assert taken[0].key
    assert served.methods[-1] == "TEARDOWN"
    assert source.counters["lost"] == 0


def test_the_password_of_the_address_is_used() -> None:
    served = camera(password="pilot:s3cret")
    source = open_source(f"rtsp://pilot:s3cret@127.0.0.1:{served.port}/cam")
    assert next(iter(source.units())).key
    source.close()


def test_a_wrong_password_is_not_tried_again_and_not_shown() -> None:
    served = camera(password="pilot:s3cret")
    error = error_of(open_source(f"rtsp://pilot:wr0ng@127.0.0.1:{served.port}/cam"))
    assert "wrong user or password" in str(error)
    assert "wr0ng" not in str(error)
    assert not error.retry


@pytest.mark.parametrize(
    ("faults", "query", "says", "retry"),
    [
        ({"status": 404}, "", "answers RTSP 404", True),
        ({"refuse_tcp": True}, "?transport=tcp", "refuses this transport", False),
        (
            {"go_silent_after": 0},
            "?timeout=0.2",
            r"nothing came for 0.2 s; try \?transport=tcp",
            True,
        ),
        ({"go_silent_after": 40}, "?timeout=0.2", "nothing came for 0.2 s$", True),
        ({"hang_up_after": 40}, "?transport=tcp", "ended the session", True),
        ({"answer": b"HTTP/1.1 400 Bad Request\r\n\r\n"}, "", "not RTSP", True),
        ({"answer": b"RTSP/1.0 nonsense\r\n\r\n"}, "", "not RTSP", True),
        ({"answer": b""}, "?timeout=0.2", "in time|Timeout", True),
        ({"sdp": "v=0\r\nm=audio 0 RTP/AVP 0\r\n"}, "", "no video", False),
        ({"sdp": "not sdp"}, "", "must begin with", False),
    ],
)
def test_faults_end_in_an_error_that_says_what_happened(
    faults: dict[str, Any], query: str, says: str, retry: bool
) -> None:
    error = error_of(open_source(camera(**faults).url(query)))
    assert re.search(says, str(error)), str(error)
    assert error.retry == retry


def test_nobody_there() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    error = error_of(open_source(f"rtsp://127.0.0.1:{port}/cam"))
    assert error.retry
    assert "refused" in str(error) or "Connect call failed" in str(error)


def test_close_while_connecting_is_immediate(wait_until: Callable[..., None]) -> None:
    served = camera(answer=b"")
    source = open_source(served.url("?timeout=60"))
    reader = threading.Thread(target=lambda: list(source.units()))
    reader.start()
    wait_until(lambda: served.methods)
    source.close()
    reader.join(2)
    assert not reader.is_alive()


GST_SERVER = """
import sys, gi
gi.require_version("Gst", "1.0"); gi.require_version("GstRtspServer", "1.0")
from gi.repository import Gst, GstRtspServer, GLib
Gst.init(None)
server = GstRtspServer.RTSPServer(); server.set_address("127.0.0.1"); server.set_service("0")
factory = GstRtspServer.RTSPMediaFactory(); factory.set_shared(True)
factory.set_launch("( videotestsrc is-live=true ! video/x-raw,width=320,height=240,framerate=30/1"
    " ! x264enc tune=zerolatency speed-preset=ultrafast key-int-max=15"
    " ! rtph264pay name=pay0 pt=96 config-interval=1 )")
server.get_mount_points().add_factory("/cam", factory); server.attach(None)
print(server.get_bound_port(), flush=True)
GLib.timeout_add_seconds(60, sys.exit)
GLib.MainLoop().run()
"""


@pytest.fixture(scope="module")
def gst_port() -> Iterator[int]:
    python = shutil.which("python3", path="/usr/bin")
    check = "import gi; gi.require_version('GstRtspServer', '1.0')"
    if not python or subprocess.run([python, "-c", check], capture_output=True).returncode:
        pytest.skip("gst-rtsp-server is not installed (apt: gir1.2-gst-rtsp-server-1.0)")
    encoder = ["gst-inspect-1.0", "--exists", "x264enc"]
    if shutil.which(encoder[0]) and subprocess.run(encoder, capture_output=True).returncode:
        pytest.skip("GStreamer has no x264enc (apt: gstreamer1.0-plugins-ugly)")
    with subprocess.Popen([python, "-c", GST_SERVER], stdout=subprocess.PIPE) as server:
        assert server.stdout is not None
        try:
            line = server.stdout.readline()
            if not line.strip():
                pytest.skip("gst-rtsp-server does not start here")
            yield int(line)
        finally:
            server.terminate()


@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_a_real_server(gst_port: int, transport: str) -> None:
    url = f"rtsp://127.0.0.1:{gst_port}/cam?transport={transport}&timeout=10"
    source = open_source(url)
    units, decoder = source.units(), Decoder()
    frames = [frame for _ in range(30) for frame in decoder.decode(next(units))]
    units.close()  # type: ignore[attr-defined]
    assert len(frames) >= 15
    assert frames[0].picture.size == (320, 240)
