"""Real coded video for tests: what FFmpeg's encoders and muxers put on the wire and in files."""

from __future__ import annotations

import io
import socket
from collections.abc import Iterator
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import av
import numpy as np

ENCODERS = {"h264": "libx264", "hevc": "libx265"}
GOP = 8
RATE = 30


def pictures(count: int, size: tuple[int, int]) -> Iterator[av.VideoFrame]:
    """A moving pattern with some detail; `pts` counts in 1/RATE s."""
    width, height = size
    y, x = np.mgrid[0:height, 0:width]
    for i in range(count):
        planes = np.full((height * 3 // 2, width), 128, np.uint8)
        planes[:height] = ((x * 3 + y * 2 + 11 * i) ^ (x * y >> 5)) & 0xFF
        frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
        frame.pts, frame.time_base = i, Fraction(1, RATE)
        yield frame


def write(
    target: Any,
    container: str,
    *,
    codec: str = "h264",
    count: int = 2 * GOP,
    size: tuple[int, int] = (320, 240),
    slices: int = 1,
    options: dict[str, str] | None = None,
    container_options: dict[str, str] | None = None,
) -> None:
    """Encode `count` pictures with low delay into a file, file object or address."""
    with av.open(target, "w", format=container, options=container_options or {}) as out:
        stream: Any = out.add_stream(ENCODERS.get(codec, codec), rate=RATE)
        stream.width, stream.height = size
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        stream.options = options or _low_delay(codec, slices)
        for frame in pictures(count, size):
            out.mux(stream.encode(frame))
        out.mux(stream.encode(None))


def _low_delay(codec: str, slices: int) -> dict[str, str]:
    if codec == "h264":
        parameters = f"repeat-headers=1:keyint={GOP}:scenecut=0:sliced-threads=0:slices={slices}"
        return {"preset": "ultrafast", "tune": "zerolatency", "x264-params": parameters}
    if codec == "hevc":
        parameters = f"repeat-headers=1:keyint={GOP}:scenecut=0:log-level=none:pools=1"
        return {"preset": "ultrafast", "tune": "zerolatency", "x265-params": parameters}
    return {}


@cache
def elementary_stream(codec: str, slices: int = 1) -> bytes:
    """Two groups of pictures as Annex B."""
    target = io.BytesIO()
    write(target, codec, codec=codec, slices=slices)
    return target.getvalue()


@cache
def transport_stream(codec: str) -> bytes:
    """Two groups of pictures as MPEG-TS."""
    target = io.BytesIO()
    write(target, "mpegts", codec=codec)
    return target.getvalue()


@cache
def rtp_datagrams(codec: str, slices: int = 1, packet_bytes: int = 600) -> tuple[bytes, ...]:
    """Two groups of pictures as FFmpeg's RTP muxer sends them, read from a loopback socket."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        receiver.bind(("127.0.0.1", 0))
        address = f"rtp://127.0.0.1:{receiver.getsockname()[1]}?pkt_size={packet_bytes}"
        write(address, "rtp", codec=codec, slices=slices, size=(160, 120))
        receiver.settimeout(0.2)
        datagrams = []
        try:
            while True:
                datagrams.append(receiver.recv(65536))
        except TimeoutError:
            return tuple(datagrams)


def video_file(folder: Path, name: str = "flight.mp4", **how: Any) -> Path:
    """A short recording; `how` as for `write`."""
    path = folder / name
    write(str(path), {"mkv": "matroska"}.get(path.suffix[1:], path.suffix[1:]), **how)
    return path


def sequence_of(datagram: bytes) -> int:
    return int.from_bytes(datagram[2:4], "big")


def with_sequence(datagram: bytes, sequence: int) -> bytes:
    return datagram[:2] + (sequence & 0xFFFF).to_bytes(2, "big") + datagram[4:]


def with_ssrc(datagram: bytes, ssrc: int) -> bytes:
    return datagram[:8] + ssrc.to_bytes(4, "big") + datagram[12:]
