"""Streams received by FFmpeg's programs, which nobody here wrote; receivers that vanish, stall."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest

from freelook.datagrams import free_port
from freelook.errors import SinkError
from freelook.sinks import open_sink
from freelook.sinks.rtspserver import RtspServer, python_with_gstreamer
from freelook.types import ColorSpace, Frame, Picture, Plane, Sink

SIZE = (320, 192)
STEP_NS = 33_333_333
START_NS = 10**12
# FFmpeg shows H.265 grey before the first key picture; there is one among those of a second
COUNT = {"h264": 3, "h265": 60}
SHADES = (60, 110, 160, 210)  # of the picture's quarters, from the left

pytestmark = pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs the ffmpeg program")
needs_gstreamer = pytest.mark.skipif(
    python_with_gstreamer() is None, reason="needs GStreamer's RTSP server"
)


def frame(index: int, luma: Plane | None = None) -> Frame:
    if luma is None:
        luma = np.repeat(np.array(SHADES, np.uint8), SIZE[0] // 4)[None].repeat(SIZE[1], axis=0)
    chroma = np.full((SIZE[1] // 2, SIZE[0] // 2), 128, np.uint8)
    picture = Picture("i420", (luma, chroma, chroma), ColorSpace("bt601"))
    return Frame(picture, START_NS + index * STEP_NS)


@contextmanager
def ffmpeg(picture: Path, *source: str, count: int = 3) -> Iterator[subprocess.Popen[bytes]]:
    """Receives so many pictures and writes the last one."""
    command = ["ffmpeg", "-v", "fatal", "-y", "-analyzeduration", "500000", *source]
    process = subprocess.Popen([*command, "-frames:v", str(count), "-update", "1", str(picture)])
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def feed_until(sink: Sink, process: subprocess.Popen[bytes]) -> int:
    """Live pictures until the program has enough; how many."""
    pause = threading.Event()
    count = 0
    while process.poll() is None:
        sink.write(frame(count))
        count += 1
        pause.wait(0.02)
        assert count < 2500, "nothing was received in 50 s"
    assert process.returncode == 0
    return count


def assert_received(picture: Path) -> None:
    received = cv2.imread(str(picture), cv2.IMREAD_GRAYSCALE)
    assert received is not None
    assert received.shape == SIZE[::-1]
    middles = received[SIZE[1] // 2, SIZE[0] // 8 :: SIZE[0] // 4].astype(float)
    # limited range to full range, and what coding of flat areas costs: a few steps
    assert middles == pytest.approx((np.array(SHADES) - 16.0) * 255 / 219, abs=4)


@pytest.mark.parametrize("codec", ["h264", "h265"])
def test_rtp_and_its_description(codec: str, tmp_path: Path) -> None:
    port, sdp, picture = free_port(), tmp_path / "view.sdp", tmp_path / "view.png"
    argument = f"rtp://127.0.0.1:{port}"
    sink = open_sink(
        argument, size=SIZE, codec=codec, sdp=str(sdp), color=ColorSpace("bt601"), fps=50
    )
    source = ("-protocol_whitelist", "file,udp,rtp", "-i", str(sdp))
    with ffmpeg(picture, *source, count=COUNT[codec]) as process:
        count = feed_until(sink, process)
    assert_received(picture)
    for index in range(50):  # to a port that refuses them now
        sink.write(frame(count + index))
    sink.close()


@pytest.mark.parametrize("codec", ["h264", "h265"])
def test_mpeg_ts(codec: str, tmp_path: Path) -> None:
    address, picture = f"udp://127.0.0.1:{free_port()}", tmp_path / "view.png"
    sink = open_sink(address, size=SIZE, codec=codec, color=ColorSpace("bt601"), fps=50)
    with ffmpeg(picture, "-i", address, count=COUNT[codec]) as process:
        count = feed_until(sink, process)
    assert_received(picture)
    for index in range(50):
        sink.write(frame(count + index))
    sink.close()


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


def resident_bytes(pid: int) -> int:
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


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


def test_publishing_to_a_server(tmp_path: Path) -> None:
    """FFmpeg as the server; when it leaves, the sink says so."""
    url, picture = f"rtsp://127.0.0.1:{free_port()}/view", tmp_path / "view.png"
    with ffmpeg(picture, "-rtsp_flags", "listen", "-i", url) as process:
        sink = opened_when_it_listens(url, process)
        with pytest.raises(SinkError, match=f"^{url}: "):
            feed_until_gone(sink, process)
        sink.close()
    assert_received(picture)


def opened_when_it_listens(url: str, process: subprocess.Popen[bytes]) -> Sink:
    while process.poll() is None:
        try:
            return open_sink(url, size=SIZE, color=ColorSpace("bt601"), fps=50)
        except SinkError as error:
            if "refused" not in str(error):
                raise
    raise AssertionError("ffmpeg ended")


def feed_until_gone(sink: Sink, process: subprocess.Popen[bytes]) -> None:
    count = feed_until(sink, process)
    for index in range(2000):
        sink.write(frame(count + index))


def test_memory_stays_flat_with_receivers_that_are_not_there() -> None:
    sinks = [
        open_sink(f"{scheme}://127.0.0.1:{free_port()}", size=SIZE, color=ColorSpace("bt601"))
        for scheme in ("rtp", "udp")
    ]
    sizes = []
    for index in range(600):
        for sink in sinks:
            sink.write(frame(index))
        if index in (200, 599):
            sizes.append(resident_bytes(os.getpid()))
    for sink in sinks:
        sink.close()
    # what is kept of one picture alone would be 35 MB
    assert sizes[1] - sizes[0] < 4e6
