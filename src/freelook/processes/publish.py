"""Publishes the coded pictures from its input (see sinks/_child.py) to an RTSP server.

python -m freelook.processes.publish h264|hevc WIDTH HEIGHT

The address is in the environment (FREELOOK_ADDRESS), as there may be a password in it.
"""

from __future__ import annotations

import os
import sys
from fractions import Fraction
from typing import Any, BinaryIO

import av
from av.container import OutputContainer
from av.error import FFmpegError
from av.stream import Stream

from ..sinks._child import ADDRESS, HEADER

CLOCK_HZ = 90_000
OPTIONS = {"rtsp_transport": "tcp", "timeout": "5000000"}  # microseconds


def main(url: str, codec: str, width: str, height: str) -> int:
    try:
        container = av.open(url, "w", format="rtsp", options=OPTIONS)
        stream = container.add_mux_stream(codec, width=int(width), height=int(height))
        stream.time_base = Fraction(1, CLOCK_HZ)
        container.start_encoding()  # speaks with the server
        os.write(1, b"ready\n")
        publish(sys.stdin.buffer, container, stream)
    except (FFmpegError, OSError) as error:
        print(error.strerror or error, file=sys.stderr, flush=True)
        os._exit(1)  # a server that is gone would be told goodbye for long
    return 0


def publish(pipe: BinaryIO, container: OutputContainer, stream: Stream) -> None:
    first_ns: int | None = None
    last = -1
    while len(header := pipe.read(HEADER.size)) == HEADER.size:
        t_ns, key, length = HEADER.unpack(header)
        first_ns = t_ns if first_ns is None else first_ns
        last = max(last + 1, (t_ns - first_ns) * CLOCK_HZ // 1_000_000_000)
        packet: av.Packet[Any] = av.Packet(pipe.read(length))
        packet.stream, packet.time_base = stream, Fraction(1, CLOCK_HZ)
        packet.pts = packet.dts = last
        packet.is_keyframe = bool(key)
        container.mux(packet)


if __name__ == "__main__":
    sys.exit(main(os.environ[ADDRESS], *sys.argv[1:]))
