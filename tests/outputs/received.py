"""Pictures to send, and FFmpeg's program to receive them."""

from __future__ import annotations

import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest

from freelook.types import ColorSpace, Frame, Picture, Plane, Sink

SIZE = (320, 192)
STEP_NS = 33_333_333
START_NS = 10**12
SHADES = (60, 110, 160, 210)  # of the picture's quarters, from the left


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
        assert count < 4000, "nothing was received in 80 s and more"
    assert process.returncode == 0
    return count


def assert_received(picture: Path) -> None:
    received = cv2.imread(str(picture), cv2.IMREAD_GRAYSCALE)
    assert received is not None
    assert received.shape == SIZE[::-1]
    middles = received[SIZE[1] // 2, SIZE[0] // 8 :: SIZE[0] // 4].astype(float)
    # limited range to full range, and what coding of flat areas costs: a few steps
    assert middles == pytest.approx((np.array(SHADES) - 16.0) * 255 / 219, abs=4)
