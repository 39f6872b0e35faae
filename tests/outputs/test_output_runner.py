"""An output's thread: newest frame only, failures stay inside, everything is counted."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook import load_camera
from freelook.camera import Camera
from freelook.errors import SinkError
from freelook.gimbal import Stabiliser
from freelook.ingest import Ingest
from freelook.mailbox import Mailbox
from freelook.outputs import runner
from freelook.outputs.group import Flight, Outputs
from freelook.outputs.runner import Output, OutputStatus
from freelook.outputs.spec import parse
from freelook.renderers import Renderer
from freelook.session import Session, View
from freelook.types import ColorSpace, Counters, Frame, Picture, Sink
from freelook.viewport import Viewport

SIZE = load_camera("demo").size
SECOND = 10**9
Wait = Callable[..., None]


def frame(t_ns: int) -> Frame:
    return Frame(Picture("gray", (np.full(SIZE[::-1], 99, np.uint8),)), t_ns)


class Plain:
    """A renderer of grey views."""

    def render(
        self, picture: Picture, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> Picture:
        return Picture("gray", (np.full(viewport.size[::-1], 99, np.uint8),))


def plain() -> Renderer:
    return Plain()


class Collecting:
    """A sink that remembers, may be held up, and may fail."""

    def __init__(self) -> None:
        self.counters = Counters()
        self.times: list[int] = []
        self.facts: list[dict[str, str]] = []
        self.go = threading.Event()
        self.go.set()
        self.entered = threading.Event()
        self.error: Exception | None = None
        self.opened = self.closed = 0

    def __call__(self, _color: ColorSpace) -> Sink:
        self.opened += 1
        return self

    def note(self, facts: dict[str, str]) -> None:
        self.facts.append(facts)

    def write(self, frame: Frame) -> None:
        self.entered.set()
        assert self.go.wait(20)
        if self.error is not None:
            raise self.error
        self.times.append(frame.capture_ns)

    def close(self) -> None:
        self.closed += 1


class Ticking:
    """A clock that stands still until it is told to go on."""

    def __init__(self) -> None:
        self.now_ns = 5 * SECOND

    def __call__(self) -> int:
        return self.now_ns


@contextmanager
def running(
    sink: Collecting, clock: Ticking | None = None, **options: Any
) -> Iterator[tuple[Mailbox[Frame], Output]]:
    frames: Mailbox[Frame] = Mailbox()

    def session(box: Mailbox[Frame]) -> Session:
        aim = lambda _now, _then: Rotation.identity()  # noqa: E731
        return Session(box, load_camera("demo"), aim, Plain(), Viewport((32, 18)))

    output = Output("test", frames, session, sink, clock=clock or Ticking(), **options)
    output.start()
    try:
        yield frames, output
    finally:
        sink.go.set()
        output.close()


def status_of(output: Output) -> OutputStatus:
    return output.status(5 * SECOND)


def test_every_frame_is_shown_with_its_time(wait_until: Wait) -> None:
    sink = Collecting()
    describe = lambda view: {"then": str(view.capture_ns)}  # noqa: E731
    with running(sink, describe=describe) as (frames, output):
        for t_ns in (3, 7):
            frames.put(frame(t_ns))
            wait_until(lambda t_ns=t_ns: sink.times[-1:] == [t_ns])
        assert status_of(output).state == "live"
        assert status_of(output).counters["shown"] == 2
    assert sink.facts == [{"then": "3"}, {"then": "7"}]
    assert (sink.opened, sink.closed) == (1, 1)


def test_a_slow_receiver_misses_frames_and_gets_the_newest(wait_until: Wait) -> None:
    slow, quick = Collecting(), Collecting()
    slow.go.clear()
    with running(slow) as (slow_frames, output), running(quick) as (quick_frames, _):
        for t_ns in range(1, 101):
            slow_frames.put(frame(t_ns))
            quick_frames.put(frame(t_ns))
            wait_until(lambda t_ns=t_ns: quick.times[-1:] == [t_ns])
            assert slow.entered.wait(10)
        slow.go.set()
        wait_until(lambda: len(slow.times) == 2)
        assert status_of(output).counters["dropped"] == 98
    assert slow.times == [1, 100]
    assert quick.times == list(range(1, 101))


def test_what_fails_is_opened_again_after_a_longer_and_longer_pause(wait_until: Wait) -> None:
    sink, clock = Collecting(), Ticking()
    sink.error = SinkError("the other end went away")
    with running(sink, clock) as (frames, output):
        for failures, pause_s in enumerate((0.5, 1, 2, 4, 5, 5), 1):
            frames.put(frame(failures))
            wait_until(lambda n=failures: status_of(output).counters.get("failures") == n)
            assert str(status_of(output)) == (
                f"test retrying, {failures} failures, the other end went away"
            )
            clock.now_ns += round(pause_s * SECOND) - 1
            frames.put(frame(0))  # too early: is not even tried
            wait_until(lambda n=failures: status_of(output).counters.get("missed") == n)
            clock.now_ns += 1
        sink.error = None
        frames.put(frame(9))
        wait_until(lambda: sink.times == [9])
        assert status_of(output).state == "live"
        assert status_of(output).message == ""
    assert sink.opened == sink.closed == 7


def test_an_unexpected_error_stays_in_its_output_too(wait_until: Wait) -> None:
    sink = Collecting()
    sink.error = ZeroDivisionError("a fault of ours")
    with running(sink, retry=False) as (frames, output):
        frames.put(frame(1))
        wait_until(lambda: output.failed)
        assert status_of(output).message == "ZeroDivisionError: a fault of ours"
    assert sink.closed == 1


def test_a_fixed_rate_draws_the_last_frame_again(wait_until: Wait) -> None:
    sink, clock = Collecting(), Ticking()
    with running(sink, clock, rate_hz=100.0) as (frames, output):
        frames.put(frame(1))
        wait_until(lambda: len(sink.times) == 1)
        for n in range(2, 5):
            clock.now_ns += SECOND // 100
            wait_until(lambda n=n: len(sink.times) == n)
        clock.now_ns += SECOND // 20
        wait_until(lambda: len(sink.times) == 5)
        assert status_of(output).counters["late"] == 4
    assert np.diff(sink.times).tolist() == [SECOND // 100] * 3 + [SECOND // 20]


def test_closing_wakes_it_and_says_what_could_not_be_finished(
    wait_until: Wait, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runner, "NAP_S", 1000.0)
    sink = Collecting()

    def cannot() -> None:
        raise SinkError("no space left")

    monkeypatch.setattr(sink, "close", cannot)
    with running(sink) as (frames, output):
        frames.put(frame(1))
        wait_until(lambda: sink.times == [1])
    assert status_of(output).message == "no space left"


def flight(**changes: Any) -> Flight:
    def never() -> Any:
        raise SinkError("not opened here")

    ingest = Ingest(never)
    return Flight(ingest, load_camera("demo"), {}, Stabiliser(), plain, **changes)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("stream:rtp://localhost", "host and port"),
        ("stream:nowhere.mp4", "no live stream; for files there is file:PATH"),
        ("stream:gopher://h:1", "do not know how to write"),
        ("file:view.avi", "a video file ends in .mp4"),
        ("file:/no/such/folder/view.mp4", "make it first"),
        ("snapshot:view.jpg", "neither a .png file nor a folder"),
        ("terminal,head=pilot", "there is no head 'pilot'; heads: none; add --tracker"),
    ],
)
def test_what_can_be_wrong_is_said_before_the_flight(text: str, why: str) -> None:
    with pytest.raises(SinkError) as raised:
        Outputs([parse(text)], flight())
    assert why in str(raised.value)


def test_a_view_without_a_head_looks_where_it_is_told() -> None:
    from freelook.outputs.group import aim_of, facts
    from freelook.rotations import head_angles_deg

    spec = parse("terminal,yaw=-35,pitch=20,roll=4")
    looks = aim_of(spec, flight())(0, 0)
    assert head_angles_deg(looks) == pytest.approx((-35, 20, 4))
    view = View(frame(1).picture, looks, 12, None, 34, False)
    assert facts(view, Viewport((32, 18), 80), "{}") == {
        "yaw_deg": "-35.0000",
        "pitch_deg": "20.0000",
        "roll_deg": "4.0000",
        "hfov_deg": "80",
        "projection": "perspective",
        "lens": "{}",
        "capture_ns": "12",
    }
