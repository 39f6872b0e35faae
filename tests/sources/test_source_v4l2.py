from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import pytest
from av.error import FFmpegError

from freelook.clock import NS_PER_S
from freelook.errors import SourceError
from freelook.sources import open_source
from freelook.sources.v4l2 import DeviceSource

NOW_NS = 1000 * NS_PER_S


class ScriptedDevice:
    """Stands in for PyAV's container: yields the given time stamps (µs), then waits or fails."""

    def __init__(self, stamps: list[int | None], then: Exception | None = None) -> None:
        codec = SimpleNamespace(canonical_name="rawvideo")
        context = SimpleNamespace(codec=codec, width=4, height=2, pix_fmt="gray", extradata=None)
        self.streams = SimpleNamespace(video=[SimpleNamespace(codec_context=context)])
        self.closed = threading.Event()
        self.released = threading.Event()
        self._stamps = stamps
        self._then = then

    def demux(self, video: int) -> Iterator[Any]:
        for stamp in self._stamps:
            yield Packet(stamp)
        if self._then is not None:
            raise self._then
        self.released.wait(30)  # a driver's read cannot be interrupted

    def close(self) -> None:
        self.closed.set()


class Packet(bytes):
    def __new__(cls, _: int | None) -> Packet:
        return super().__new__(cls, bytes(8))

    def __init__(self, stamp: int | None) -> None:
        self.pts = stamp
        self.time_base = Fraction(1, 1_000_000)
        self.size = 8
        self.is_keyframe = True


def source_of(device: ScriptedDevice, timeout_s: float = 5.0) -> DeviceSource:
    return DeviceSource("/dev/video9", device, timeout_s, lambda: NOW_NS)  # type: ignore[arg-type]


def test_a_missing_device_is_retried_and_the_others_are_named() -> None:
    with pytest.raises(SourceError, match="there is no such device") as caught:
        open_source("/dev/video97")
    assert caught.value.retry


def test_a_file_that_is_no_device(tmp_path: Any) -> None:
    path = tmp_path / "video0"
    path.write_bytes(b"x")
    with pytest.raises(SourceError, match="video0") as caught:
        open_source(f"v4l2:{path}?size=640x480")
    assert "asked for size=640x480" in str(caught.value)


def test_the_drivers_time_is_used_when_it_can_be_true() -> None:
    recent, wall_clock, future = 999_990_000, 1_700_000_000_000_000, 1_000_001_000
    device = ScriptedDevice([recent, wall_clock, future, None])
    units = source_of(device).units()
    times = [next(units).capture_ns for _ in range(4)]
    assert times == [recent * 1000, NOW_NS, NOW_NS, NOW_NS]
    units.close()  # type: ignore[attr-defined]
    device.released.set()


def test_a_slow_reader_loses_the_oldest(wait_until: Callable[..., None]) -> None:
    stamps: list[int | None] = [999_000_000 + i for i in range(10)]
    device = ScriptedDevice(stamps)
    source = source_of(device)
    units = source.units()
    first = next(units)
    wait_until(lambda: source.counters["dropped"] + len(source._units) >= 9 - 1)
    later = next(units)
    assert first.capture_ns < later.capture_ns
    source.close()
    device.released.set()


def test_a_silent_device_is_lost_and_an_unplugged_one_too() -> None:
    silent = ScriptedDevice([])
    with pytest.raises(SourceError, match=r"no picture for 0\.05 s") as caught:
        next(iter(source_of(silent, 0.05).units()))
    assert caught.value.retry
    silent.released.set()
    unplugged = ScriptedDevice([], FFmpegError(19, "No such device"))
    with pytest.raises(SourceError, match="No such device"):
        next(iter(source_of(unplugged).units()))
    assert unplugged.closed.wait(5)
