"""The capture-device source on a real driver: vivid, the kernel's software camera.

Run by scripts/test-devices in a virtual machine; skipped on machines without the driver.
"""

from __future__ import annotations

import time
from itertools import islice
from pathlib import Path

import pytest

from freelook.clock import NS_PER_S
from freelook.errors import SourceError
from freelook.media.decoder import Decoder
from freelook.sources import open_source
from freelook.sources.v4l2 import devices
from freelook.types import AccessUnit, Source


def vivid_device() -> str | None:
    for name in Path("/sys/class/video4linux").glob("video*/name"):
        if name.read_text().startswith("vivid"):
            return f"/dev/{name.parent.name}"
    return None


DEVICE = vivid_device()
pytestmark = pytest.mark.skipif(DEVICE is None, reason="no vivid driver (scripts/test-devices)")


def opened(options: str) -> Source:
    """The device, once the driver's last read of the test before has let go of it."""
    deadline = time.monotonic() + 10
    while True:
        try:
            return open_source(f"{DEVICE}?{options}", clock=time.monotonic_ns)
        except SourceError as error:
            if not (error.retry and "in use" in str(error)) or time.monotonic() > deadline:
                raise


def take(source: Source, count: int) -> list[AccessUnit]:
    try:
        return list(islice(source.units(), count))
    finally:
        source.close()


@pytest.mark.parametrize(
    ("options", "size"),
    [
        ("size=640x360&rate=30&format=yuyv422", (640, 360)),
        ("size=1280x720&format=nv12", (1280, 720)),
        ("", None),
    ],
)
def test_pictures_of_a_real_driver_are_decoded(options: str, size: tuple[int, int] | None) -> None:
    source = opened(options)
    decoder = Decoder()
    frames = [frame for unit in take(source, 5) for frame in decoder.decode(unit)]
    assert len(frames) >= 4
    if size is not None:
        assert frames[0].picture.size == size
    luma = frames[-1].picture.planes[0]
    assert int(luma.max()) - int(luma.min()) > 100  # vivid's colour bars


def test_capture_times_are_the_drivers() -> None:
    """Monotonic, one frame time apart, and in the past when the picture comes."""
    source = opened("size=640x360&format=yuyv422")
    units = take(source, 8)
    arrived_ns = time.monotonic_ns()
    times = [unit.capture_ns for unit in units]
    assert times == sorted(set(times))
    assert all(0 < arrived_ns - at < 20 * NS_PER_S for at in times)


def test_a_size_the_driver_lacks_is_said_not_hidden() -> None:
    """V4L2 drivers may take the nearest size; then the stream says which one it is."""
    source = opened("size=641x361&format=yuyv422")
    units, decoder = take(source, 2), Decoder()
    frames = [frame for unit in units for frame in decoder.decode(unit)]
    got = (units[0].stream.width, units[0].stream.height)
    assert got != (641, 361)
    assert [frame.picture.size for frame in frames] == [got, got], decoder.counters


def test_an_unknown_pixel_format_is_refused() -> None:
    with pytest.raises(SourceError, match="asked for format=nonsense"):
        open_source(f"{DEVICE}?format=nonsense", clock=time.monotonic_ns)


def test_the_device_is_among_those_named() -> None:
    assert DEVICE in devices()


def test_it_can_be_opened_again_after_it_was_closed() -> None:
    for _ in range(2):
        source = opened("size=640x360&format=yuyv422")
        assert len(take(source, 2)) == 2
