"""A camera for latency measurements: moving stripes with the time drawn in, as a live stream.

python -m freelook.bench.stamped rtp://127.0.0.1:5004 FILE.sdp SECONDS [WIDTHxHEIGHT]

FILE.sdp is `-` for streams without a description. Says `sending` after the first picture.
"""

from __future__ import annotations

import os
import sys
import threading

import numpy as np

from ..clock import NS_PER_S, now_ns
from ..latency import draw_stamp
from ..sinks import open_sink
from ..types import Frame, Picture

SIZE = (1280, 720)
FPS = 30


def send(address: str, sdp: str | None, seconds: float, size: tuple[int, int] = SIZE) -> None:
    """Send at `FPS`; each picture is stamped just before it is encoded."""
    width, height = size
    stripes = (np.add.outer(np.arange(height), np.arange(width * 2)) // 8 % 256).astype(np.uint8)
    grey = np.full((height // 2, width // 2), 128, np.uint8)
    sink = open_sink(address, size=size, fps=FPS, bitrate=4_000_000, sdp=sdp)
    start_ns, never = now_ns(), threading.Event()
    for index in range(round(seconds * FPS)):
        never.wait(max(0, start_ns + index * NS_PER_S // FPS - now_ns()) / NS_PER_S)
        luma = stripes[:, index * 4 % width :][:, :width].copy()
        time_ns = now_ns()
        draw_stamp(luma, time_ns)
        sink.write(Frame(Picture("i420", (luma, grey, grey)), time_ns))
        if index == 0:
            os.write(1, b"sending\n")
    sink.close()


def main(address: str, sdp: str, seconds: str, size: str = "x".join(map(str, SIZE))) -> None:
    width, height = map(int, size.split("x"))
    send(address, None if sdp == "-" else sdp, float(seconds), (width, height))


if __name__ == "__main__":
    main(*sys.argv[1:])
