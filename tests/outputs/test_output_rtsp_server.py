"""The RTSP server, pulled by programs that nobody here wrote; who may, who vanishes, who stalls."""

from __future__ import annotations

import contextlib
import re
import shutil
import signal
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from received import SIZE, START_NS, STEP_NS, assert_received, feed_until, ffmpeg, frame

from freelook.bench.resident import resident_bytes
from freelook.cli._shows import reachable
from freelook.datagrams import free_port
from freelook.errors import SinkError
from freelook.outputs.spec import parse
from freelook.sinks import open_sink
from freelook.sinks.rtspserver import RtspServer, invitation, python_with_gstreamer, secured
from freelook.types import ColorSpace, Frame, Sink
from freelook.web import security

pytestmark = pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs the ffmpeg program")
needs_gstreamer = pytest.mark.skipif(
    python_with_gstreamer() is None, reason="needs GStreamer's RTSP server"
)


@contextmanager
def served(port: int, **options: Any) -> Iterator[RtspServer]:
    address = options.pop("address", f"127.0.0.1:{port}/view")
    sink = open_sink(
        f"rtsp-server://{address}", size=SIZE, color=ColorSpace("bt601"), fps=50, **options
    )
    assert isinstance(sink, RtspServer)
    try:
        yield sink
    finally:
        sink.close()


def feed_while(sink: Sink, condition: Callable[[], Any]) -> None:
    assert fed_until(sink, lambda: not condition(), 4000), "still so after 80 s and more"


def fed_until(sink: Sink, condition: Callable[[], Any], most: int) -> bool:
    """Whether it came true within so many pictures."""
    pause = threading.Event()
    for count in range(most):
        if condition():
            return True
        sink.write(frame(count))
        pause.wait(0.02)
    return False


@contextmanager
def seeing(sink: Sink, picture: Path, *source: str) -> Iterator[subprocess.Popen[bytes]]:
    """A viewer who has seen pictures. As people do he calls again if there are none: on a machine
    with far too much to do GStreamer 1.22 leaves one viewer in a hundred without."""
    for _ in range(3):
        with ffmpeg(picture, *source, count=10**6) as viewer:
            if fed_until(sink, picture.exists, 1500):
                yield viewer
                return
    pytest.fail("no pictures, at three attempts")


def stalling_viewer(port: int) -> socket.socket:
    """Asks for everything over TCP and reads nothing of it."""
    viewer = socket.create_connection(("127.0.0.1", port), timeout=20)
    url = f"rtsp://127.0.0.1:{port}/view"
    session = ""
    asks = [
        (f"DESCRIBE {url}", "Accept: application/sdp"),
        (f"SETUP {url}/stream=0", "Transport: RTP/AVP/TCP;unicast;interleaved=0-1"),
        (f"PLAY {url}", "Range: npt=now-"),
    ]
    for number, (ask, header) in enumerate(asks, 1):
        viewer.sendall(f"{ask} RTSP/1.0\r\nCSeq: {number}\r\n{header}\r\n{session}\r\n".encode())
        reply = viewer.recv(65536).decode(errors="replace")
        assert reply.startswith("RTSP/1.0 200"), reply
        for line in reply.splitlines():
            if line.startswith("Session:"):
                session = line.split(";")[0] + "\r\n"
    return viewer


@needs_gstreamer
@pytest.mark.parametrize(("codec", "transport"), [("h264", "udp"), ("h265", "tcp")])
def test_rtsp_is_pulled(codec: str, transport: str, tmp_path: Path) -> None:
    port, picture = free_port(), tmp_path / "view.png"
    sink = open_sink(
        f"rtsp-server://127.0.0.1:{port}/pilot",
        size=SIZE,
        codec=codec,
        color=ColorSpace("bt601"),
        fps=50,
    )
    assert isinstance(sink, RtspServer)
    source = ("-rtsp_transport", transport, "-i", f"rtsp://127.0.0.1:{port}/pilot")
    try:
        for _ in range(2):  # comes, goes, and comes again
            with ffmpeg(picture, *source) as process:
                feed_until(sink, process)
            assert_received(picture)
            picture.unlink()
        assert sink.counters["clients"] >= 2
        assert sink.counters["keys_asked"] >= 2
    finally:
        sink.close()


GSTREAMER_PULLS = """
import sys, gi
gi.require_version("Gst", "1.0")
from gi.repository import Gst
Gst.init(None)
launch = "rtspsrc location={} latency=0 ! rtph264depay ! fakesink num-buffers=5"
pulling = Gst.parse_launch(launch.format(sys.argv[1]))
pulling.set_state(Gst.State.PLAYING)
ends = Gst.MessageType.EOS | Gst.MessageType.ERROR
message = pulling.get_bus().timed_pop_filtered(40 * Gst.SECOND, ends)
pulling.set_state(Gst.State.NULL)
sys.exit(message is None or message.type != Gst.MessageType.EOS)
"""


@needs_gstreamer
def test_gstreamer_pulls_rtsp_too() -> None:
    python = python_with_gstreamer()
    assert python is not None
    port = free_port()
    sink = open_sink(f"rtsp-server://127.0.0.1:{port}/view", size=SIZE, color=ColorSpace("bt601"))
    puller = subprocess.Popen([python, "-c", GSTREAMER_PULLS, f"rtsp://127.0.0.1:{port}/view"])
    try:
        feed_until(sink, puller)
    finally:
        puller.kill()
        puller.wait()
        sink.close()


@needs_gstreamer
def test_rtsp_port_that_is_taken() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(SinkError, match="cannot listen"):
            open_sink(f"rtsp-server://127.0.0.1:{port}/view", size=SIZE)


@needs_gstreamer
def test_an_rtsp_viewer_that_stalls(tmp_path: Path, rng: np.random.Generator) -> None:
    """It holds up neither the sender nor another viewer, and what it leaves unread is not kept."""
    port, picture = free_port(), tmp_path / "view.png"
    sink = open_sink(
        f"rtsp-server://127.0.0.1:{port}/view",
        size=SIZE,
        color=ColorSpace("bt601"),
        bitrate=50_000_000,
        fps=50,
    )
    assert isinstance(sink, RtspServer)
    noise = [frame(0, rng.integers(0, 255, SIZE[::-1], np.uint8)).picture for _ in range(2)]
    done = threading.Event()

    def feed() -> None:
        index = 0
        while not done.wait(0.002):
            sink.write(Frame(noise[index % 2], START_NS + index * STEP_NS))
            index += 1

    feeder = threading.Thread(target=feed)
    feeder.start()
    try:
        viewer = stalling_viewer(port)
        before = sink.counters["sent"]
        while sink.counters["sent"] < before + 50:
            done.wait(0.01)
        first_bytes = resident_bytes(sink.pid)
        while sink.counters["sent"] < before + 250:
            done.wait(0.01)
        grown_bytes = resident_bytes(sink.pid) - first_bytes
        done.set()
        feeder.join(20)
        assert not feeder.is_alive()
        with ffmpeg(picture, "-i", f"rtsp://127.0.0.1:{port}/view") as process:
            feed_until(sink, process)
        assert_received(picture)
        viewer.close()
    finally:
        done.set()
        feeder.join(20)
        sink.close()
    # 200 pictures of noise are 8 MB and more
    assert grown_bytes < 4e6


@needs_gstreamer
@pytest.mark.timeout(400)  # on a busy machine players take long to begin
@pytest.mark.parametrize("transport", ["udp", "tcp"])
def test_a_viewer_that_is_killed(transport: str, tmp_path: Path) -> None:
    """Another one, there all the time, goes on; the one that is gone is forgotten."""
    port = free_port()
    pictures = tmp_path / "killed.png", tmp_path / "stays.png"
    source = ("-rtsp_transport", transport, "-i", f"rtsp://127.0.0.1:{port}/view")
    with served(port) as sink:
        with (
            seeing(sink, pictures[0], *source) as killed,
            seeing(sink, pictures[1], *source),
        ):
            feed_while(sink, lambda: sink.clients != 2)
            killed.kill()
            feed_while(sink, lambda: sink.clients > 1)
            pictures[1].unlink()
            feed_while(sink, lambda: not pictures[1].exists())
        pictures[0].unlink()
        with seeing(sink, pictures[0], *source):
            pass


@needs_gstreamer
def test_a_viewer_that_is_stopped_for_a_while(tmp_path: Path, rng: np.random.Generator) -> None:
    """What it cannot take is thrown away and counted; then it sees new pictures again."""
    port, picture = free_port(), tmp_path / "view.png"
    luma = rng.integers(0, 255, SIZE[::-1], np.uint8)
    source = ("-rtsp_transport", "tcp", "-i", f"rtsp://127.0.0.1:{port}/view")
    with (
        served(port, bitrate=50_000_000) as sink,
        seeing(sink, picture, *source) as viewer,
    ):
        viewer.send_signal(signal.SIGSTOP)
        pause, index = threading.Event(), 0
        while not sink.counters["unread"]:
            sink.write(Frame(frame(0, luma[:: (-1) ** index]).picture, START_NS + index * STEP_NS))
            index += 1
            pause.wait(0.002)
            assert index < 5000, "200 MB were taken"
        viewer.send_signal(signal.SIGCONT)
        picture.unlink()
        feed_while(sink, lambda: not flat(picture))
        assert viewer.poll() is None


def flat(picture: Path) -> bool:
    """Whether it shows what `frame` makes; not so if it is only half written."""
    with contextlib.suppress(AssertionError):
        assert_received(picture)
        return True
    return False


@needs_gstreamer
@pytest.mark.parametrize("who", ["", "pilot:wrong@", "pilot:se%2Ccret@"])
def test_other_machines_need_the_password(who: str, tmp_path: Path) -> None:
    port, picture = free_port(), tmp_path / "view.png"
    with served(port, address=f"pilot:se%2Ccret@0.0.0.0:{port}/view") as sink:
        source = ("-i", f"rtsp://{who}127.0.0.1:{port}/view")
        with ffmpeg(picture, *source) as process:
            feed_while(sink, lambda: process.poll() is None)
        assert (process.returncode == 0) == (who == "pilot:se%2Ccret@")
        command = Path(f"/proc/{sink.pid}/cmdline").read_bytes()
    assert b"cret" not in command, "other users of the machine see it"


@pytest.mark.parametrize("who", ["", "pilot@", ":secret@", "pilot:@"])
def test_a_server_for_other_machines_is_not_open_to_all(who: str) -> None:
    with pytest.raises(SinkError, match=r"rtsp-server://USER:PASSWORD@0\.0\.0\.0:8554/view"):
        open_sink(f"rtsp-server://{who}0.0.0.0:8554/view", size=SIZE)


def test_a_password_is_made_up_where_one_is_needed() -> None:
    made = secured("rtsp-server://0.0.0.0:8554/view")
    assert re.fullmatch(r"rtsp-server://pilot:[\w-]{16}@0\.0\.0\.0:8554/view", made)
    assert secured("rtsp-server://0.0.0.0:8554/view") != made
    assert invitation(made) == made.replace("rtsp-server", "rtsp")
    given = [f"rtsp-server://{who}@0.0.0.0:1" for who in ("a:b", "a", "a:", ":b")]
    for address in ("rtsp-server://127.0.0.1:8554", made, *given):
        assert secured(address) == address


def test_viewers_are_told_where_and_the_status_line_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(security, "local_addresses", lambda: ["192.168.1.7", "fd00::7"])
    url = "rtsp://pilot:x@{}:8554/view"
    assert reachable(url.format("192.168.1.7")) == [url.format("192.168.1.7")]
    everywhere = [url.format(host) for host in ("127.0.0.1", "192.168.1.7", "[fd00::7]")]
    assert reachable(url.format("0.0.0.0")) == everywhere[:2]
    assert reachable(url.format("[::]")) == everywhere
    spec = parse("stream:rtsp-server://pilot:x@0.0.0.0:8554/view,size=64x48")
    assert spec.name == "stream:rtsp-server://0.0.0.0:8554/view"


@needs_gstreamer
def test_junk_and_crowds_at_the_door(tmp_path: Path, rng: np.random.Generator) -> None:
    port, picture = free_port(), tmp_path / "view.png"
    junk = [
        rng.bytes(100_000),
        b"\0" * 5000,
        b"DESCRIBE rtsp://x RTSP/9.9\r\n" * 99,
        b"$\0\xff\xff",
    ]
    junk += [b"SETUP * RTSP/1.0\r\nCSeq: 1\r\nTransport: " + b"A" * 70_000 + b"\r\n\r\n"]
    with served(port) as sink, contextlib.ExitStack() as opened:
        for data in junk:
            caller = opened.enter_context(socket.create_connection(("127.0.0.1", port), 20))
            with contextlib.suppress(OSError):  # it may hang up before it heard all
                caller.sendall(data)
        crowd = [socket.create_connection(("127.0.0.1", port), 20) for _ in range(40)]
        feed_while(sink, lambda: not sink.counters["refused"])
        assert sink.clients <= 32
        for caller in crowd:
            caller.close()
        opened.close()
        feed_while(sink, lambda: sink.clients)
        with ffmpeg(picture, "-i", f"rtsp://127.0.0.1:{port}/view") as process:
            feed_until(sink, process)
    assert_received(picture)
