from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from freelook.clock import FakeClock
from freelook.errors import SourceError
from freelook.ingest import Ingest
from freelook.media.rtp_video import RtpVideo
from freelook.sources import open_source
from freelook.types import AccessUnit, Counters, Source
from video_streams import GOP, rtp_datagrams, video_file

PICTURES = 2 * GOP
WaitUntil = Callable[..., None]
SOON = (0.001, 0.01)


def real_units() -> list[AccessUnit]:
    video = RtpVideo(Counters())
    return [u for i, d in enumerate(rtp_datagrams("h264")) for u in video.push(d, i)]


class ScriptedSource:
    """Yields the given units, then raises, ends, or waits until closed."""

    def __init__(self, units: list[AccessUnit], then: Exception | str = "wait") -> None:
        self.counters = Counters({"packets": len(units)})
        self.closed = threading.Event()
        self._units = units
        self._then = then

    def units(self) -> Iterator[AccessUnit]:
        yield from self._units
        if isinstance(self._then, Exception):
            raise self._then
        if self._then == "wait":
            self.closed.wait(30)

    def close(self) -> None:
        self.closed.set()


class Script:
    """Opens one after the other; an exception in the list is raised instead."""

    def __init__(self, *steps: Source | Exception) -> None:
        self._steps = list(steps)
        self.opened = 0

    def __call__(self) -> Source:
        step = self._steps[min(self.opened, len(self._steps) - 1)]
        self.opened += 1
        if isinstance(step, Exception):
            raise step
        return step


@pytest.fixture
def ingest_of() -> Iterator[Callable[..., Ingest]]:
    made: list[Ingest] = []

    def make(*steps: Source | Exception, **how: Any) -> Ingest:
        made.append(Ingest(Script(*steps), retry_s=SOON, **{"clock": FakeClock(), **how}))
        return made[-1]

    yield make
    for ingest in made:
        ingest.close()


def state(ingest: Ingest, now_ns: int = 0) -> str:
    return ingest.status(now_ns).state


def test_units_reach_every_listener_in_order(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    ingest = ingest_of(ScriptedSource(real_units()))
    heard: list[list[AccessUnit]] = [[], []]
    for ears in heard:
        ingest.subscribe(ears.append)
    assert state(ingest) == "connecting"
    ingest.start()
    wait_until(lambda: len(heard[1]) == PICTURES)
    assert heard[0] == heard[1] == real_units()
    status = ingest.status(0)
    assert status.state == "live"
    assert (status.counters["units"], status.counters["key_units"]) == (PICTURES, 2)
    assert status.stream is not None
    assert status.stream.width == 160


def test_frames_are_decoded_only_while_somebody_wants_them(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    ingest = ingest_of(ScriptedSource(real_units()))
    box = ingest.frames()
    ingest.start()
    wait_until(lambda: ingest.status(0).counters.get("decoded", 0) >= 8)
    frame = box.take(1)
    assert frame is not None
    assert frame.picture.size == (160, 120)
    ingest.release(box)
    assert box.closed
    idle = ingest_of(ScriptedSource(real_units()))
    idle.start()
    wait_until(lambda: idle.status(0).counters.get("units") == PICTURES)
    assert "decoded" not in idle.status(0).counters


def test_an_unsubscribed_listener_hears_nothing_more(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    heard: list[AccessUnit] = []
    ingest = ingest_of(ScriptedSource(real_units()))

    def once(unit: AccessUnit) -> None:
        heard.append(unit)
        stop()

    stop = ingest.subscribe(once)
    ingest.start()
    wait_until(lambda: ingest.status(0).counters.get("units") == PICTURES)
    assert len(heard) == 1
    stop()


def test_a_listener_that_raises_is_counted_and_shown(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    ingest = ingest_of(ScriptedSource(real_units()))
    heard: list[AccessUnit] = []

    def broken(unit: AccessUnit) -> None:
        raise ZeroDivisionError("out of paper")

    ingest.subscribe(broken)
    ingest.subscribe(heard.append)
    ingest.start()
    wait_until(lambda: len(heard) == PICTURES)
    wait_until(lambda: ingest.status(0).counters["listener_errors"] == PICTURES)
    assert "ZeroDivisionError: out of paper" in ingest.status(0).message
    assert state(ingest) == "live"


def test_a_broken_stream_is_opened_again(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    units = real_units()
    lost = SourceError("the cable is out", retry=True)
    ingest = ingest_of(
        ScriptedSource(units[:4], lost),
        lost,
        SourceError("gone", retry=False),
        ScriptedSource(units),
    )
    ingest.start()
    wait_until(lambda: ingest.status(0).counters.get("units") == 4 + PICTURES)
    wait_until(lambda: state(ingest) == "live")
    counters = ingest.status(0).counters
    assert counters["reconnects"] == 3
    assert counters["packets"] == 4 + PICTURES  # of both sources


def test_a_fault_in_a_source_is_survived(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    ingest = ingest_of(
        ScriptedSource(real_units()[:1], RuntimeError("bug")), ScriptedSource(real_units())
    )
    ingest.start()
    wait_until(lambda: ingest.status(0).counters.get("units") == 1 + PICTURES)
    assert ingest.status(0).counters["source_errors"] == 1


def test_what_cannot_get_better_fails_at_once(ingest_of: Callable[..., Ingest]) -> None:
    ingest = ingest_of(SourceError("no such file"))
    with pytest.raises(SourceError, match="no such file"):
        ingest.start()
    status = ingest.status(0)
    assert (status.state, status.message, status.age_ns) == ("failed", "no such file", None)


def test_what_cannot_get_better_while_connecting_fails_too(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    ingest = ingest_of(ScriptedSource([], SourceError("wrong password")))
    ingest.start()
    wait_until(lambda: state(ingest) == "failed")
    assert ingest.status(0).message == "wrong password"


def test_a_missing_library_is_raised_by_start(ingest_of: Callable[..., Ingest]) -> None:
    ingest = ingest_of(ModuleNotFoundError("No module named 'aiortsp'", name="aiortsp"))
    with pytest.raises(ModuleNotFoundError):
        ingest.start()


def test_a_camera_that_is_not_there_yet_is_waited_for(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    nobody = SourceError("nobody answers", retry=True)
    ingest = ingest_of(nobody, nobody, ScriptedSource(real_units()))
    ingest.start()
    wait_until(lambda: state(ingest) == "live")


def test_silence_is_lost_with_its_age_and_comes_back(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    clock = FakeClock()
    source = ScriptedSource(real_units())
    ingest = ingest_of(source, clock=clock, stale_s=1.0)
    ingest.start()
    wait_until(lambda: ingest.status(0).counters.get("units") == PICTURES)
    assert state(ingest, clock.advance_ms(900)) == "live"
    status = ingest.status(clock.advance_ms(1600))
    assert (status.state, status.message) == ("lost", "no picture for 2.5 s")
    assert status.age_ns == 2_500_000_000


def test_before_the_first_picture_it_says_what_came(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    source = ScriptedSource([])
    ingest = ingest_of(source)
    ingest.start()
    assert ingest.status(0).message == "nothing received yet"
    source.counters.add("packets", 7)
    wait_until(lambda: ingest.status(0).message == "no picture yet; 7 packets")
    assert state(ingest) == "connecting"


def test_the_end_of_a_recording_gives_all_its_frames(
    tmp_path: Any, ingest_of: Callable[..., Ingest], wait_until: WaitUntil
) -> None:
    path = video_file(tmp_path, options={"bf": "2", "x264-params": "b-adapt=0"}, count=6)
    ingest = ingest_of(open_source(str(path)))
    box = ingest.frames()
    ingest.start()
    wait_until(lambda: state(ingest) == "ended")
    wait_until(lambda: box.received == 6)
    assert ingest.status(0).counters["decoded"] == 6


@pytest.mark.parametrize("units", [0, 3])
def test_close_is_immediate_and_may_be_repeated(
    ingest_of: Callable[..., Ingest], wait_until: WaitUntil, units: int
) -> None:
    source = ScriptedSource(real_units()[:units])
    ingest = ingest_of(source)
    box = ingest.frames()
    ingest.start()
    wait_until(lambda: ingest.status(0).counters.get("units", 0) == units)
    ingest.close()
    ingest.close()
    assert source.closed.is_set()
    assert box.closed
    assert not any(t.name in ("ingest", "decode") for t in threading.enumerate())


def test_close_does_not_wait_for_the_back_off() -> None:
    ingest = Ingest(Script(SourceError("nobody", retry=True)), retry_s=(60, 60))
    ingest.start()
    ingest.close()
    assert not any(t.name == "ingest" for t in threading.enumerate())


def test_close_before_start() -> None:
    Ingest(Script(ScriptedSource([]))).close()


def test_a_real_stream_over_loopback(wait_until: WaitUntil) -> None:
    import socket

    source: Any = open_source("rtp://127.0.0.1:0")
    ingest = Ingest(lambda: source)
    box = ingest.frames()
    ingest.start()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for datagram in rtp_datagrams("hevc"):
            sender.sendto(datagram, ("127.0.0.1", source.port))
    wait_until(lambda: ingest.status(0).counters.get("units") == PICTURES)
    wait_until(lambda: box.received > 0)
    ingest.close()
    assert ingest.status(0).counters["packets"] == len(rtp_datagrams("hevc"))
