"""Programs that nobody here wrote, as receivers of stamped streams: one class for each.

Each has `name`, `streams` (the kinds it can take), `missing()` (why it cannot run here, or None),
`ready()`, within which it waits for streams that are brought to it (and yields where to), and
`receive(stream, seconds)`, which yields when it began to want pictures, and what it sees: when each
picture came out (nanoseconds of our clock), and its stamp (None where it is damaged).
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import IO, ClassVar, Protocol

import numpy as np

from ..clock import now_ns
from ..latency import read_stamp

SIZE = (640, 360)
PICTURE_BYTES = SIZE[0] * SIZE[1] * 3 // 2
FRAME = b"FRAME\n"
PULLED = ("rtp", "udp", "rtsp-server, UDP", "rtsp-server, TCP")
Seen = Iterator[tuple[int, int | None]]
Receiving = AbstractContextManager[tuple[int, Seen]]


@dataclass(frozen=True)
class Stream:
    """Where a stream is, and its description (of rtp)."""

    kind: str
    url: str
    port: int
    sdp: Path

    @property
    def transport(self) -> str:
        return self.kind.rpartition(" ")[2].lower()


class Receiver(Protocol):
    @property
    def name(self) -> str: ...

    @property
    def streams(self) -> Sequence[str]: ...

    def missing(self) -> str | None: ...

    def ready(self) -> AbstractContextManager[str | None]: ...

    def receive(self, stream: Stream, seconds: float) -> Receiving: ...


class Ffmpeg:
    """FFmpeg's program, with the options that the documentation gives ffplay."""

    name = "ffmpeg"
    streams = PULLED
    HURRY: ClassVar = ("-fflags", "nobuffer", "-flags", "low_delay", "-analyzeduration", "0")
    PROBE: ClassVar = {"udp": "32768"}  # bytes until it knows what it is; others say it in SDP

    def missing(self) -> str | None:
        return None if shutil.which("ffmpeg") else "ffmpeg is not installed"

    def ready(self) -> AbstractContextManager[None]:
        return nullcontext()

    def receive(self, stream: Stream, seconds: float) -> Receiving:
        how: dict[str, list[str]] = {
            "rtp": ["-protocol_whitelist", "file,udp,rtp", "-i", str(stream.sdp)],
            "udp": ["-i", stream.url],
        }
        pulled = ["-rtsp_transport", stream.transport, "-i", stream.url]
        command = ["ffmpeg", "-v", "fatal", "-nostdin", *self.HURRY]
        command += ["-probesize", self.PROBE.get(stream.kind, "32")]
        command += [
            *how.get(stream.kind, pulled),
            "-fps_mode",
            "passthrough",
            "-pix_fmt",
            "yuv420p",
            "-f",
            "rawvideo",
            "pipe:1",
        ]
        return raw_pictures(command, seconds)


class GStreamer:
    """GStreamer's `gst-launch-1.0`: no jitter buffer, pictures shown when decoded."""

    name = "GStreamer"
    streams = PULLED
    DECODERS: ClassVar = ("avdec_h264", "openh264dec")
    CAPS = "application/x-rtp,media=video,clock-rate=90000,encoding-name=H264,payload=96"

    def missing(self) -> str | None:
        if shutil.which("gst-launch-1.0") is None:
            return "gst-launch-1.0 is not installed (gstreamer1.0-tools)"
        return None if self.decoder() else "no H.264 decoder (gstreamer1.0-libav)"

    @staticmethod
    @cache
    def decoder() -> str | None:
        for name in GStreamer.DECODERS:
            asked = subprocess.run(["gst-inspect-1.0", "--exists", name], capture_output=True)
            if asked.returncode == 0:
                return name
        return None

    def ready(self) -> AbstractContextManager[None]:
        return nullcontext()

    def receive(self, stream: Stream, seconds: float) -> Receiving:
        how = {
            "rtp": f"udpsrc port={stream.port} caps={self.CAPS} ! rtpjitterbuffer latency=0 "
            "! rtph264depay",
            "udp": f"udpsrc port={stream.port} ! tsdemux latency=0 ! h264parse",
        }
        pulled = (
            f"rtspsrc location={stream.url} protocols={stream.transport} latency=0 ! rtph264depay"
        )
        launch = f"{how.get(stream.kind, pulled)} ! {self.decoder()} ! videoconvert "
        launch += "! video/x-raw,format=I420 ! fdsink fd=1 sync=false"
        return raw_pictures(["gst-launch-1.0", "-q", *launch.split()], seconds)


class Vlc:
    """VLC with a short cache; without `clock-synchro=0` it falls behind any live MPEG-TS.

    Debian's has no RTSP, and no RTP with a description.
    """

    name = "VLC"
    streams = ("udp",)
    HURRY: ClassVar = ("--network-caching=100", "--clock-synchro=0", "--no-audio")

    def missing(self) -> str | None:
        return None if shutil.which("vlc") else "VLC is not installed"

    def ready(self) -> AbstractContextManager[None]:
        return nullcontext()

    @contextmanager
    def receive(self, stream: Stream, seconds: float) -> Iterator[tuple[int, Seen]]:
        with tempfile.TemporaryDirectory() as folder:
            os.chmod(folder, 0o755)
            pipe = Path(folder) / "pictures"
            os.mkfifo(pipe)
            os.chmod(pipe, 0o666)
            command = ["vlc", "-I", "dummy", "-q", *self.HURRY, "--vout=yuv", f"--yuv-file={pipe}"]
            command += [
                "--yuv-chroma=I420",
                f"udp://@127.0.0.1:{stream.port}",
            ]
            with raw_pictures(command, seconds, pipe) as seen:
                yield seen


@contextmanager
def raw_pictures(
    command: list[str], seconds: float, pipe: Path | None = None
) -> Iterator[tuple[int, Seen]]:
    """What a program writes as I420, for so long at most: to its standard output, or as YUV4MPEG2
    to a named pipe."""
    begin_ns = now_ns()
    # VLC will not be run by the system's administrator
    who = "nobody" if os.geteuid() == 0 and pipe is not None else None
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, user=who, bufsize=0
    )
    end = threading.Timer(seconds, process.kill)
    end.start()
    try:
        assert process.stdout is not None
        opened: IO[bytes] = process.stdout if pipe is None else _both_ends(pipe)
        with opened, process.stdout:
            yield begin_ns, _seen(opened, process, headed=pipe is not None)
    finally:
        end.cancel()
        process.kill()
        process.wait()


def _both_ends(pipe: Path) -> IO[bytes]:
    """Opened at once, even if nobody ever writes."""
    return os.fdopen(os.open(pipe, os.O_RDONLY | os.O_NONBLOCK), "rb", buffering=0)


def _seen(opened: IO[bytes], process: subprocess.Popen[bytes], headed: bool) -> Seen:
    """`headed`: there is a line before every picture, as in YUV4MPEG2."""
    width, height = SIZE
    never, kept, begun = threading.Event(), bytearray(), not headed
    while True:
        if data := opened.read(PICTURE_BYTES):
            kept += data
        elif process.poll() is not None:
            return
        else:  # a named pipe, before or between pictures
            never.wait(0.0005)
        if not begun and (found := kept.find(FRAME)) >= 0:
            del kept[: found + len(FRAME)]
            begun = True
        if begun and len(kept) >= PICTURE_BYTES:
            arrived_ns = now_ns()
            luma = np.frombuffer(bytes(kept), np.uint8, width * height).reshape(height, width)
            del kept[:PICTURE_BYTES]
            begun = not headed
            yield arrived_ns, read_stamp(luma)
