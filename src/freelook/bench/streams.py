"""How soon and how late other programs show what is streamed: from the stamp in the picture, put on
before it is encoded, to the same picture out of the program."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from ..clock import NS_PER_MS, NS_PER_S
from ..datagrams import free_port
from ..errors import FreelookError
from ..sinks.rtspserver import python_with_gstreamer
from .browser_receiver import Chromium
from .figures import Figure
from .receivers import SIZE, Ffmpeg, GStreamer, Receiver, Stream, Vlc
from .video_latency import WARM_UP

RECEIVERS: tuple[Receiver, ...] = (Ffmpeg(), GStreamer(), Vlc(), Chromium())
MORE_S = 15.0  # until the first picture, at most


@dataclass
class Row:
    """One stream in one receiver: seconds from its start to its first picture (NaN: none came),
    and how late each later picture was; `skipped` says why nothing was measured."""

    stream: str
    receiver: str
    first_s: float = float("nan")
    late: Figure = field(default_factory=lambda: Figure("stamp to picture"))
    skipped: str | None = None


def run(seconds: float, said: Callable[[str], None] = lambda _: None) -> Iterator[Row]:
    """Every stream in every receiver, one after the other, for so long each. What goes wrong with
    one is said in its row."""
    for receiver in RECEIVERS:
        for kind in receiver.streams:
            said(f"{kind} into {receiver.name} ...")
            row = Row(kind, receiver.name, skipped=receiver.missing() or _unserved(kind))
            try:
                if row.skipped is None:
                    with (
                        receiver.ready() as where,
                        stamped(kind, where, seconds + 2 * MORE_S) as stream,
                    ):
                        _measure(row, receiver, stream, seconds)
            except FreelookError as error:
                row.skipped = str(error)
            yield row


def _unserved(kind: str) -> str | None:
    if kind.startswith("rtsp-server") and python_with_gstreamer() is None:
        return "GStreamer's RTSP server is not installed"
    return None


def _measure(row: Row, receiver: Receiver, stream: Stream, seconds: float) -> None:
    first_ns: int | None = None
    with receiver.receive(stream, seconds + MORE_S) as (begin_ns, seen):
        for arrived_ns, stamp_ns in seen:
            if stamp_ns is None:
                continue
            if first_ns is None:
                first_ns = arrived_ns
                row.first_s = (arrived_ns - begin_ns) / NS_PER_S
            row.late.values_ms.append((arrived_ns - stamp_ns) / NS_PER_MS)
            if arrived_ns - first_ns > seconds * NS_PER_S:
                break
    row.late.values_ms = row.late.values_ms[WARM_UP:]
    if first_ns is None:
        row.skipped = "nothing was received"


@contextmanager
def stamped(kind: str, where: str | None, seconds: float) -> Iterator[Stream]:
    """A process that streams stamped pictures, to `where` if it is brought there; else from when
    there are pictures to pull. FreelookError when it does not begin."""
    port = free_port()
    path = "/view" if kind.startswith("rtsp") else ""
    address = where or f"{kind.partition(',')[0]}://127.0.0.1:{port}{path}"
    with tempfile.TemporaryDirectory() as folder:
        sdp = Path(folder) / "stamped.sdp"
        command = [sys.executable, "-m", "freelook.bench.stamped", address]
        command += [str(sdp) if kind == "rtp" else "-", str(seconds), "x".join(map(str, SIZE))]
        with subprocess.Popen(command, stdout=subprocess.PIPE) as camera:
            try:
                assert camera.stdout is not None
                if where is None and not camera.stdout.readline():
                    raise FreelookError("the stamped camera did not start")
                yield Stream(kind, address.replace("rtsp-server", "rtsp"), port, sdp)
            finally:
                camera.kill()
