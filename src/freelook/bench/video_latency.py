"""From the time stamp in the picture to the decoded picture, beside libavformat's own way."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import av
from av.error import FFmpegError

from ..clock import NS_PER_MS, now_ns
from ..datagrams import free_port
from ..latency import read_stamp
from ..media.decoder import Decoder
from ..media.planes import picture_from_av
from ..sources import open_source
from ..types import Picture
from .figures import Figure
from .stamped import FPS

OURS = "stamp to decoded: freelook"
LIBAVFORMAT = "stamp to decoded: libavformat, its low-delay options"
WARM_UP = 30  # pictures until decoder and caches have settled
SETTLING_S = 10  # the camera goes on for so much longer: the receiver starts late, and warms up


@contextmanager
def stamped_camera(seconds: float) -> Iterator[tuple[int, Path]]:
    """A process that sends stamped pictures; yields its port and its SDP file."""
    port = free_port()
    with tempfile.TemporaryDirectory() as folder:
        sdp = Path(folder) / "stamped.sdp"
        command = [sys.executable, "-m", "freelook.bench.stamped", f"rtp://127.0.0.1:{port}"]
        quiet = subprocess.DEVNULL
        with subprocess.Popen([*command, str(sdp), str(seconds)], stdout=quiet) as camera:
            try:
                _wait_for(sdp, camera)
                yield port, sdp
            finally:
                camera.terminate()


def _wait_for(sdp: Path, camera: subprocess.Popen[bytes]) -> None:
    waiting = threading.Event()
    for _ in range(1000):
        if sdp.exists() and sdp.stat().st_size:
            return
        if camera.poll() is not None:
            break
        waiting.wait(0.02)
    raise RuntimeError("the stamped camera did not start")


def ours(seconds: float) -> Figure:
    """Our depacketiser and decoder."""
    figure = Figure(OURS)
    with stamped_camera(seconds + SETTLING_S) as (_, sdp):
        source, decoder = open_source(str(sdp)), Decoder()
        for unit in source.units():
            for frame in decoder.decode(unit):
                _note(figure, frame.picture)
            if len(figure.values_ms) >= WARM_UP + seconds * FPS:
                break
        source.close()
    figure.values_ms = figure.values_ms[WARM_UP:]
    return figure


def libavformat(seconds: float) -> Figure:
    """What most programs do: FFmpeg's RTP demuxer and parser, told to hurry."""
    figure = Figure(LIBAVFORMAT)
    options = {
        "protocol_whitelist": "file,udp,rtp",
        "fflags": "nobuffer",
        "flags": "low_delay",
        "probesize": "32",
        "analyzeduration": "0",
        "reorder_queue_size": "0",
    }
    with stamped_camera(seconds + SETTLING_S) as (_, sdp):
        try:
            container = av.open(str(sdp), format="sdp", options=options, timeout=(8.0, 4.0))
            video = container.streams.video[0]
            video.thread_type = "SLICE"
            for packet in container.demux(video):
                try:
                    frames = packet.decode()
                except FFmpegError:  # until the first key frame
                    continue
                for frame in frames:
                    _note(figure, picture_from_av(frame))
                if len(figure.values_ms) >= WARM_UP + seconds * FPS:
                    break
            container.close()
        except FFmpegError as error:
            figure.skipped = f"libavformat could not open the stream: {error}"
    figure.values_ms = figure.values_ms[WARM_UP:]
    return figure


def _note(figure: Figure, picture: Picture) -> None:
    stamp_ns = read_stamp(picture.planes[0])
    if stamp_ns is not None:
        figure.values_ms.append((now_ns() - stamp_ns) / NS_PER_MS)
