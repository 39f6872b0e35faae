"""One tracker on its own thread, feeding one gimbal; what the station asks for the aim."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from .clock import NS_PER_S, Clock, now_ns
from .gimbal import Aim, Gimbal
from .types import Tracker

RATE_WINDOW_S = 1.0
LATCHED = ("disabled", "front")


@runtime_checkable
class HasButtons(Protocol):
    """A tracker that also hears buttons: "recentre", "toggle" (off and on), "eyes_front"."""

    on_action: Callable[[str], None] | None


@dataclass(frozen=True)
class HeadStatus:
    """What there is to say about a head.

    `state` is the aim's state, or failed; `message` explains anything but tracking. `age_ns` is
    the age of the newest pose, None before the first. `rate_hz` counts the last second.
    """

    name: str
    state: str
    message: str
    age_ns: int | None
    rate_hz: float
    counters: dict[str, int]


class RateMeter:
    """How often something happened lately, from the times it was told. Safe between threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._times_ns: deque[int] = deque(maxlen=2048)

    def add(self, t_ns: int) -> None:
        with self._lock:
            self._times_ns.append(t_ns)

    def rate_hz(self, now_ns: int) -> float:
        """Events in the last second, by their spacing; 0 for fewer than two."""
        with self._lock:
            recent = [t for t in self._times_ns if now_ns - t <= RATE_WINDOW_S * NS_PER_S]
        if len(recent) < 2 or recent[-1] <= recent[0]:
            return 0.0
        return (len(recent) - 1) * NS_PER_S / (recent[-1] - recent[0])


class Head:
    """Safe between threads. A tracker that fails is reported by `status`; the aim then behaves as
    for one that fell silent."""

    def __init__(
        self, name: str, tracker: Tracker, gimbal: Gimbal | None = None, clock: Clock = now_ns
    ) -> None:
        self.name = name
        self._tracker = tracker
        self._gimbal = Gimbal() if gimbal is None else gimbal
        self._clock = clock
        self._lock = threading.Lock()
        self._rate = RateMeter()
        self._failure = ""
        self._thread: threading.Thread | None = None

    def start(self, on_pose: Callable[[], None] = lambda: None) -> None:
        """Begin to read poses; `on_pose` runs on the tracker's thread after each."""
        if isinstance(self._tracker, HasButtons):
            self._tracker.on_action = self._act
        self._thread = threading.Thread(
            target=self._run, args=(on_pose,), name=f"head {self.name}", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop the tracker and wait for its thread (at most two seconds)."""
        self._tracker.close()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(2.0)

    def aim(self, now_ns: int, capture_ns: int | None = None) -> Aim:
        """Where to look now, in a frame taken at `capture_ns` (None: the newest one known)."""
        with self._lock:
            return self._gimbal.aim(now_ns, capture_ns)

    def recentre(self, now_ns: int) -> None:
        with self._lock:
            self._gimbal.recentre(now_ns)

    def enable(self, now_ns: int) -> None:
        with self._lock:
            self._gimbal.enable(now_ns)

    def disable(self, now_ns: int) -> None:
        with self._lock:
            self._gimbal.disable(now_ns)

    def eyes_front(self, now_ns: int) -> None:
        with self._lock:
            self._gimbal.eyes_front(now_ns)

    def _act(self, action: str) -> None:
        """A button of the tracker, on its thread. What is latched is released by it."""
        now_ns = self._clock()
        if action == "recentre":
            return self.recentre(now_ns)
        state = self.aim(now_ns).state
        if state == "front" or (action == "toggle" and state in LATCHED):
            self.enable(now_ns)
        elif action == "toggle":
            self.disable(now_ns)
        else:
            self.eyes_front(now_ns)

    def status(self, now_ns: int) -> HeadStatus:
        with self._lock:
            aim = self._gimbal.aim(now_ns)
            rate_hz = self._rate.rate_hz(now_ns)
        age_ns = None if aim.pose_ns is None else max(0, now_ns - aim.pose_ns)
        state = "failed" if self._failure else aim.state
        message = self._failure or self._explain(aim.state, age_ns)
        counters = dict(self._tracker.counters.values)
        if self._gimbal.jumps:
            counters["jumps"] = self._gimbal.jumps
        return HeadStatus(self.name, state, message, age_ns, rate_hz, counters)

    def _explain(self, state: str, age_ns: int | None) -> str:
        if state == "tracking":
            return ""
        if state == "disabled":
            return "disabled: looking straight ahead"
        if state == "front":
            return "eyes front: looking straight ahead until enabled"
        if age_ns is None:
            return self._tracker.message
        doing = {"holding": "holding the view", "easing": "going to the centre"}.get(state)
        silence = f"no pose for {age_ns / NS_PER_S:.1f} s"
        return f"{silence}: {doing}" if doing else f"{silence}; {self._tracker.message}"

    def _run(self, on_pose: Callable[[], None]) -> None:
        try:
            for pose in self._tracker.poses():
                with self._lock:
                    self._gimbal.push(pose)
                    self._rate.add(pose.t_ns)
                on_pose()
        except Exception as error:  # whatever a tracker does, the video goes on
            self._failure = f"the tracker failed: {type(error).__name__}: {error}"
