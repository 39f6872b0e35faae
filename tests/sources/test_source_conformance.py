"""What every source must do, on each one found; a source without a rig here fails the suite."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import av
import pytest
from rtsp_camera import RtspCamera

from freelook.media.decoder import Decoder
from freelook.sources import modules, open_source, v4l2
from freelook.types import AccessUnit, Source
from video_streams import rtp_datagrams, transport_stream, video_file

INTERVAL_S = 0.002


@contextmanager
def file_rig(folder: Path, _: pytest.MonkeyPatch) -> Iterator[Source]:
    yield open_source(str(video_file(folder)), loop=True)


@contextmanager
def sent_by_udp(port: int, datagrams: list[bytes]) -> Iterator[None]:
    """Send these over and over until the end."""
    stop = threading.Event()

    def send() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while True:
                for datagram in datagrams:
                    if stop.wait(INTERVAL_S):
                        return
                    sender.sendto(datagram, ("127.0.0.1", port))

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


@contextmanager
def rtp_rig(_: Path, __: pytest.MonkeyPatch) -> Iterator[Source]:
    source = open_source("rtp://127.0.0.1:0")
    with sent_by_udp(source.port, list(rtp_datagrams("h264"))):  # type: ignore[attr-defined]
        yield source


@contextmanager
def mpegts_rig(_: Path, __: pytest.MonkeyPatch) -> Iterator[Source]:
    source = open_source("udp://127.0.0.1:0")
    data = transport_stream("h264")
    with sent_by_udp(source.port, [data[i : i + 1316] for i in range(0, len(data), 1316)]):  # type: ignore[attr-defined]
        yield source


@contextmanager
def rtsp_rig(_: Path, __: pytest.MonkeyPatch) -> Iterator[Source]:
    pytest.importorskip("aiortsp")
    camera = RtspCamera()
    try:
        yield open_source(camera.url())
    finally:
        camera.close()


class FakeDevice:
    """No test machine is sure to have a camera: a Motion JPEG file at a camera's pace."""

    def __init__(self, path: str) -> None:
        self._container = av.open(path)
        self.streams = self._container.streams
        self.close = self._container.close
        self._pace = threading.Event()

    def demux(self, video: int) -> Iterator[object]:
        for packet in self._container.demux(video=video):
            self._pace.wait(0.02)
            yield packet


@contextmanager
def v4l2_rig(folder: Path, patch: pytest.MonkeyPatch) -> Iterator[Source]:
    path = video_file(folder, "camera.avi", codec="mjpeg", count=100)
    patch.setattr(v4l2, "_open_device", lambda path, _: FakeDevice(path))
    yield open_source(f"v4l2:{path}")


RIGS = {
    "file": file_rig,
    "rtp": rtp_rig,
    "mpegts": mpegts_rig,
    "rtsp": rtsp_rig,
    "v4l2": v4l2_rig,
}


@pytest.fixture(params=sorted(modules()))
def source(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Source]:
    with RIGS[request.param](tmp_path, monkeypatch) as opened:
        try:
            yield opened
        finally:
            opened.close()


def take(source: Source, count: int) -> list[AccessUnit]:
    units = source.units()
    taken = [next(units) for _ in range(count)]
    units.close()  # type: ignore[attr-defined]
    return taken


def test_every_source_has_a_rig() -> None:
    assert set(modules()) == set(RIGS)


@pytest.mark.parametrize("kind", sorted(modules()))
def test_the_module_says_what_it_is(kind: str) -> None:
    module = modules()[kind]
    assert module.__doc__
    assert module.__doc__.splitlines()[0].endswith(".") or ":" in module.__doc__.splitlines()[0]
    assert not module.recognises("")
    assert not module.recognises("nonsense://somewhere")


def test_units_decode_and_come_in_order(source: Source) -> None:
    decoder = Decoder()
    units = take(source, 12)
    frames = [frame for unit in units for frame in decoder.decode(unit)]
    assert len(frames) >= 8
    assert frames[0].picture.size in ((160, 120), (320, 240))
    times = [unit.capture_ns for unit in units]
    assert times == sorted(times)
    assert any(unit.key for unit in units)
    assert all(unit.data and unit.stream.codec for unit in units)


def test_key_units_carry_their_parameter_sets(source: Source) -> None:
    key = next(unit for unit in take(source, 12) if unit.key)
    (frame,) = Decoder().decode(key) or Decoder(low_delay=False).flush()
    assert frame.capture_ns == key.capture_ns


def test_close_from_another_thread_ends_a_waiting_reader(source: Source) -> None:
    units = source.units()
    next(units)
    ended = threading.Event()

    def read() -> None:
        for _ in units:
            pass
        ended.set()

    reader = threading.Thread(target=read)
    reader.start()
    source.close()
    reader.join(5)
    assert ended.is_set()
    source.close()


def test_close_before_reading_ends_it_too(source: Source) -> None:
    source.close()
    assert list(source.units()) == []


def test_counters_only_grow(source: Source) -> None:
    units = source.units()
    before: dict[str, int] = {}
    for _ in range(6):
        next(units)
        for name, value in before.items():
            assert source.counters[name] >= value
        before = dict(source.counters.values)
    units.close()  # type: ignore[attr-defined]
