"""One output on its own thread: the newest frame, the pose read just before it is rendered.

Whatever happens in one output stays in it. One that is slow misses frames (`dropped`), one that
fails is opened again after a pause, or has failed for good where that cannot help.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from ..clock import NS_PER_S, Clock
from ..errors import FreelookError
from ..head import RateMeter
from ..mailbox import Mailbox
from ..session import Session, View
from ..types import ColorSpace, Counters, Frame, Picture, Sink

NAP_S = 0.5  # how long to wait for a frame before looking around again
RETRY_S = (0.5, 5.0)  # the first and the longest pause before opening again
LAST_S = 5.0  # how long closing waits

MakeSession = Callable[[Mailbox[Frame]], Session]
OpenSink = Callable[[ColorSpace], Sink]
Describe = Callable[[View], dict[str, str]]
Finish = Callable[[View], Picture]


@dataclass(frozen=True)
class OutputStatus:
    """`state`: waiting (for the first picture), live, retrying, or failed (for good).

    `rate_hz` counts the last second's views. Counters: shown, dropped (frames never shown because
    the output was busy; not counted at a fixed rate), late (views left out at a fixed rate), missed
    (views between a failure and the next attempt), failures; and the sink's own.
    """

    name: str
    state: str
    message: str
    rate_hz: float
    counters: dict[str, int]

    def __str__(self) -> str:
        parts = [f"{self.name} {self.state}"]
        if self.state == "live":
            parts[0] += f" {self.rate_hz:.0f}/s"
        parts += [f"{self.counters[key]} {key}" for key in WORTH_SAYING if self.counters.get(key)]
        return ", ".join([*parts, *filter(None, [self.message])])


WORTH_SAYING = ("dropped", "late", "unsent", "unread", "refused", "failures")


class Output:
    """Shows views of the frames in a mailbox until `close`.

    `make_session` and `open_sink` are called on the output's thread: the first once, the other
    with the pictures' colours, again after a failure if `retry`. `rate_hz` views a second, or
    None for one of every frame. A sink that has `note(facts)` is told `describe(view)` before
    each write. What is written is `finish(view)`.
    """

    def __init__(
        self,
        name: str,
        frames: Mailbox[Frame],
        make_session: MakeSession,
        open_sink: OpenSink,
        *,
        clock: Clock,
        rate_hz: float | None = None,
        retry: bool = True,
        describe: Describe = lambda _view: {},
        finish: Finish = lambda view: view.picture,
    ) -> None:
        self.name = name
        self._frames = frames
        self._make_session = make_session
        self._open_sink = open_sink
        self._clock = clock
        self._period_ns = None if rate_hz is None else round(NS_PER_S / rate_hz)
        self._retry = retry
        self._describe = describe
        self._finish = finish
        self._box: Mailbox[Frame] = Mailbox()
        self._session: Session | None = None
        self._sink: Sink | None = None
        self._counters = Counters()
        self._rate = RateMeter()
        self._state, self._message = "waiting", ""
        self._pause_s, self._open_at_ns = RETRY_S[0], 0
        self._due_ns: int | None = None
        self._any = False
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"output {name}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        """Finish the output; waits for it, at most a few seconds. May be called twice."""
        self._stop.set()
        self._frames.close()
        if self._thread.is_alive():
            self._thread.join(LAST_S)

    def status(self, now_ns: int) -> OutputStatus:
        counters = dict(self._counters.values)
        if self._period_ns is None:  # else frames between the views are meant to be left out
            counters["dropped"] = self._frames.dropped
        own = getattr(self._sink, "counters", None)
        if own is not None:
            counters |= dict(own.values)
        rate_hz = self._rate.rate_hz(now_ns)
        return OutputStatus(self.name, self._state, self._message, rate_hz, counters)

    @property
    def failed(self) -> bool:
        """For good."""
        return self._state == "failed"

    def _run(self) -> None:
        try:
            while not self._stop.is_set() and not self.failed:
                if self._await_turn():
                    self._turn()
        finally:
            self._close_sink()

    def _await_turn(self) -> bool:
        """Wait for what there is to show; false when there is nothing yet."""
        if self._frames.closed:
            self._stop.wait(NAP_S)
        if self._period_ns is None:
            frame = self._frames.take(NAP_S)
        else:
            self._await_due(self._period_ns)
            frame = self._frames.take(0.0 if self._any else NAP_S)
        if frame is not None:
            self._box.put(frame)
            self._any = True
        return frame is not None or (self._period_ns is not None and self._any)

    def _await_due(self, period_ns: int) -> None:
        """Until the next multiple of the period; those that are over are counted as late."""
        if self._due_ns is None or not self._any:
            due_ns = self._clock()
        else:
            due_ns = self._due_ns + period_ns
        while (left_ns := due_ns - self._clock()) > 0:
            if self._stop.wait(left_ns / NS_PER_S):
                return
        if missed := (self._clock() - due_ns) // period_ns:
            self._counters.add("late", missed)
            due_ns += missed * period_ns
        self._due_ns = due_ns

    def _turn(self) -> None:
        now_ns = self._clock()
        if self._stop.is_set():
            return
        if now_ns < self._open_at_ns:
            self._counters.add("missed")
            return
        try:
            view = self._view(now_ns)
            self._show(view)
        except Exception as error:  # of whatever kind: the other outputs go on
            self._fail(error)

    def _view(self, now_ns: int) -> View:
        if self._session is None:
            self._session = self._make_session(self._box)
        view = self._session.step(now_ns)
        assert view is not None
        return view

    def _show(self, view: View) -> None:
        if self._sink is None:
            self._sink = self._open_sink(view.picture.color)
        if note := getattr(self._sink, "note", None):
            note(self._describe(view))
        # at a fixed rate a frame is shown more than once, and its own time would repeat
        t_ns = view.capture_ns if self._period_ns is None else view.display_ns
        self._sink.write(Frame(self._finish(view), t_ns))
        self._counters.add("shown")
        self._rate.add(self._clock())
        self._state, self._message, self._pause_s = "live", "", RETRY_S[0]

    def _fail(self, error: Exception) -> None:
        known = isinstance(error, FreelookError)
        self._message = str(error) if known else f"{type(error).__name__}: {error}"
        self._counters.add("failures")
        self._state = "retrying" if self._retry else "failed"
        self._close_sink()
        self._open_at_ns = self._clock() + round(self._pause_s * NS_PER_S)
        self._pause_s = min(2 * self._pause_s, RETRY_S[1])

    def _close_sink(self) -> None:
        sink, self._sink = self._sink, None
        if sink is None:
            return
        try:
            sink.close()
        except Exception as error:  # a file that could not be finished, say
            self._message = str(error)
            self._counters.add("failures")
