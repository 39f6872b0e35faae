"""Streams received by FFmpeg's programs, which nobody here wrote; receivers that vanish, stall."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from received import SIZE, assert_received, feed_until, ffmpeg, frame

from freelook.bench.resident import resident_bytes
from freelook.datagrams import free_port
from freelook.errors import SinkError
from freelook.sinks import open_sink
from freelook.types import ColorSpace, Sink

# FFmpeg shows H.265 grey before the first key picture; there is one among those of a second
COUNT = {"h264": 3, "h265": 60}

pytestmark = pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="needs the ffmpeg program")


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
