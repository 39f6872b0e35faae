from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator

import pytest

from freelook.clock import NS_PER_MS, NS_PER_S, FakeClock
from freelook.gimbal import Gimbal, GimbalSettings
from freelook.head import Head, RateMeter
from freelook.rotations import body_from_view, head_angles_deg
from freelook.types import Counters, Pose

WaitUntil = Callable[..., None]


class ScriptedTracker:
    """Yields the poses it is given, then waits for `close`, ends or fails."""

    message = "waiting for the script"

    def __init__(self, poses: list[Pose], then: Exception | str = "wait") -> None:
        self._poses = poses
        self._then = then
        self._closed = threading.Event()
        self.counters = Counters({"received": len(poses)})

    def poses(self) -> Iterator[Pose]:
        yield from self._poses
        if isinstance(self._then, Exception):
            raise self._then
        if self._then == "wait":
            self._closed.wait(20)

    def close(self) -> None:
        self._closed.set()


def poses_at_yaw(yaw_deg: float, count: int = 101) -> list[Pose]:
    """At 100 Hz, beginning at 0."""
    return [Pose(body_from_view(yaw_deg, 0), i * 10 * NS_PER_MS) for i in range(count)]


def test_poses_reach_the_aim_and_are_announced(wait_until: WaitUntil) -> None:
    clock = FakeClock()
    head = Head("test", ScriptedTracker(poses_at_yaw(30)), Gimbal(), clock)
    seen: list[float] = []
    head.start(lambda: seen.append(head_angles_deg(head.aim(NS_PER_S).body_from_view)[0]))
    try:
        wait_until(lambda: len(seen) == 101)
        assert seen[-1] == pytest.approx(30)
        status = head.status(NS_PER_S + 5 * NS_PER_MS)
        assert (status.name, status.state, status.message) == ("test", "tracking", "")
        assert status.age_ns == 5 * NS_PER_MS
        assert status.rate_hz == pytest.approx(100)
        assert status.counters == {"received": 101}
    finally:
        head.close()


def test_status_says_in_words_what_goes_on(wait_until: WaitUntil) -> None:
    settings = GimbalSettings(lost_after_s=0.3, hold_s=1.0, ease_s=1.5)
    head = Head("test", ScriptedTracker(poses_at_yaw(30)), Gimbal(settings), FakeClock())
    waiting = head.status(7)
    assert (waiting.state, waiting.age_ns) == ("waiting", None)
    assert waiting.message == "waiting for the script"
    head.start()
    try:
        wait_until(lambda: head.aim(NS_PER_S).pose_ns == NS_PER_S)
        told = [head.status(round((1 + s) * NS_PER_S)) for s in (0.5, 2.0, 9.0)]
    finally:
        head.close()
    assert [t.state for t in told] == ["holding", "easing", "centred"]
    assert told[0].message == "no pose for 0.5 s: holding the view"
    assert told[1].message == "no pose for 2.0 s: going to the centre"
    assert told[2].message == "no pose for 9.0 s; waiting for the script"
    head.disable(10 * NS_PER_S)
    assert head.status(10 * NS_PER_S).message == "disabled: looking straight ahead"


def test_recentre_disable_and_enable_reach_the_gimbal(wait_until: WaitUntil) -> None:
    head = Head("test", ScriptedTracker(poses_at_yaw(30)), clock=FakeClock())
    head.start()
    try:
        wait_until(lambda: head.aim(NS_PER_S).pose_ns == NS_PER_S)
        head.recentre(NS_PER_S)
        assert head_angles_deg(head.aim(NS_PER_S).body_from_view)[0] == pytest.approx(0)
        head.disable(NS_PER_S)
        assert head.aim(NS_PER_S).state == "disabled"
        head.enable(NS_PER_S)
        assert head.aim(NS_PER_S).state == "tracking"
    finally:
        head.close()


def test_a_tracker_that_fails_is_announced_and_the_view_eases_to_the_centre(
    wait_until: WaitUntil,
) -> None:
    tracker = ScriptedTracker(poses_at_yaw(30), then=OSError("cable pulled"))
    head = Head("test", tracker, clock=FakeClock())
    head.start()
    wait_until(lambda: head.status(NS_PER_S).state == "failed")
    assert head.status(NS_PER_S).message == "the tracker failed: OSError: cable pulled"
    assert head.aim(NS_PER_S).state == "tracking"
    assert head.aim(9 * NS_PER_S).state == "centred"
    head.close()


def test_a_tracker_that_ends_is_silent(wait_until: WaitUntil) -> None:
    head = Head("test", ScriptedTracker(poses_at_yaw(30), then="end"), clock=FakeClock())
    head.start()
    wait_until(lambda: head.aim(NS_PER_S).pose_ns == NS_PER_S)
    assert head.status(2 * NS_PER_S).state == "holding"
    head.close()


def test_close_before_start_and_twice() -> None:
    head = Head("test", ScriptedTracker([]), clock=FakeClock())
    head.close()
    head.start()
    head.close()
    head.close()


@pytest.mark.parametrize(("spacing_ms", "rate_hz"), [(4, 250), (10, 100), (200, 5)])
def test_rate_comes_from_the_times_alone(spacing_ms: int, rate_hz: float) -> None:
    meter = RateMeter()
    for i in range(2000 // spacing_ms):
        meter.add(i * spacing_ms * NS_PER_MS)
    assert meter.rate_hz(2 * NS_PER_S) == pytest.approx(rate_hz)
    assert meter.rate_hz(4 * NS_PER_S) == 0, "nothing in the last second"


def test_rate_of_nothing_of_one_and_of_a_heap() -> None:
    meter = RateMeter()
    assert meter.rate_hz(0) == 0
    meter.add(0)
    assert meter.rate_hz(0) == 0
    meter.add(0)
    assert meter.rate_hz(0) == 0


def test_rate_is_asked_for_while_times_come_in() -> None:
    meter, done = RateMeter(), threading.Event()
    for i in range(2048):
        meter.add(i)

    def add() -> None:
        i = 0
        while not done.is_set():
            meter.add(i := i + 1)

    before_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    adding = threading.Thread(target=add)
    adding.start()
    try:
        for _ in range(300):
            meter.rate_hz(10)
    finally:
        sys.setswitchinterval(before_s)
        done.set()
        adding.join()
