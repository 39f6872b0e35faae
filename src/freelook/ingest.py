"""The thread between a source and everybody who wants its pictures; reconnects by itself."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from dataclasses import replace as changed

from .clock import NS_PER_S, Clock, now_ns
from .errors import SourceError
from .mailbox import Mailbox
from .media.decode_thread import DecodeThread
from .types import AccessUnit, Counters, Frame, Source, StreamInfo

Listener = Callable[[AccessUnit], None]


@dataclass(frozen=True, slots=True)
class IngestStatus:
    """`state`: connecting (nothing came yet), live, lost (was live, or cannot be reached now),
    ended (the recording is over) or failed (never worked and trying again cannot help).

    `age_ns` is the time since the last unit arrived; `counters` holds the source's own too.
    """

    state: str
    message: str = ""
    age_ns: int | None = None
    stream: StreamInfo | None = None
    counters: dict[str, int] = field(default_factory=dict)


class Ingest:
    """Runs one source after the other, hands units to listeners and frames to mailboxes.

    `retry_s`: the first and the longest pause before opening again; it doubles in between and
    starts over once pictures came. After `stale_s` without a unit the state is lost. `clock` is
    the clock the source stamps with.
    """

    def __init__(
        self,
        open_source: Callable[[], Source],
        *,
        clock: Clock = now_ns,
        retry_s: tuple[float, float] = (0.25, 5.0),
        stale_s: float = 1.0,
    ) -> None:
        self._open_source = open_source
        self._clock = clock
        self._retry_s = retry_s
        self._stale_ns = round(stale_s * NS_PER_S)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="ingest", daemon=True)
        self._lock = threading.Lock()
        self._listeners: dict[object, Listener] = {}
        self._decoding = DecodeThread()
        self._source: Source | None = None
        self._first: Source | None = None
        self._counters = Counters()
        self._past = Counters()
        self._state, self._message, self._complaint = "connecting", "", ""
        self._newest_ns: int | None = None
        self._stream: StreamInfo | None = None

    def start(self) -> None:
        """Open the source and begin.

        What cannot get better (SourceError without retry, a missing library) is raised here, and
        the state is failed; what can is tried again in the background.
        """
        try:
            self._first = self._open_source()
        except SourceError as error:
            self._state, self._message = "lost", str(error)
            if not error.retry:
                self._state = "failed"
                raise
        self._decoding.start()
        self._thread.start()

    def close(self) -> None:
        """Stop and wait for the threads; mailboxes are closed. May be called twice."""
        self._closing.set()
        with self._lock:
            source = self._source or self._first
        if source is not None:
            source.close()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(5.0)
        self._decoding.close()

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """Call `listener` with every unit, on the ingest thread; returns how to stop that.

        A listener that raises is counted (`listener_errors`) and shown in the status; it goes on
        being called.
        """
        token = object()
        with self._lock:
            self._listeners[token] = listener

        def unsubscribe() -> None:
            with self._lock:
                self._listeners.pop(token, None)

        return unsubscribe

    def frames(self) -> Mailbox[Frame]:
        """A new mailbox with the newest decoded frame; decoding runs while there is one."""
        return self._decoding.add()

    def release(self, mailbox: Mailbox[Frame]) -> None:
        """Close a mailbox from `frames` and stop filling it."""
        self._decoding.remove(mailbox)

    def status(self, now_ns: int) -> IngestStatus:
        """How it goes, at `now_ns` of the ingest's clock."""
        newest_ns, state, message = self._newest_ns, self._state, self._message
        age_ns = None if newest_ns is None else max(now_ns - newest_ns, 0)
        if state == "live" and age_ns is not None and age_ns > self._stale_ns:
            state, message = "lost", f"no picture for {age_ns / NS_PER_S:.1f} s"
        stream = self._stream
        if stream is not None and not stream.width and (size := self._decoding.size):
            stream = changed(stream, width=size[0], height=size[1])
        counters = self._all_counters()
        if state == "connecting":
            received = counters.get("packets", 0)
            message = f"no picture yet; {received} packets" if received else "nothing received yet"
        message = message or self._complaint or self._decoding.complaint
        return IngestStatus(state, message, age_ns, stream, counters)

    def _all_counters(self) -> dict[str, int]:
        with self._lock:
            parts = [self._past, self._counters, *self._decoding.counters()]
            if self._source is not None:
                parts.append(self._source.counters)
            total = Counters()
            for part in parts:
                for name, value in list(part.values.items()):
                    total.add(name, value)
        return total.values

    def _run(self) -> None:
        pause_s = self._retry_s[0]
        while not self._closing.is_set():
            units_before = self._counters["units"]
            if self._run_source():
                return
            if self._counters["units"] > units_before:
                pause_s = self._retry_s[0]
            if not self._closing.wait(pause_s):
                self._counters.add("reconnects")
            pause_s = min(2 * pause_s, self._retry_s[1])

    def _run_source(self) -> bool:
        """One source from opening to its end; True when there is nothing more to do."""
        try:
            source, self._first = self._first or self._open_source(), None
            with self._lock:
                self._source = source
            if self._closing.is_set():  # close() came before it could know this source
                source.close()
            try:
                self._consume(source)
            finally:
                source.close()
                self._forget(source)
        except SourceError as error:
            never = self._newest_ns is None and not error.retry
            self._state, self._message = ("failed" if never else "lost"), str(error)
            return never
        except Exception as error:  # a fault in a source must not end the session
            self._counters.add("source_errors")
            self._state, self._message = "lost", f"{type(error).__name__}: {error}"
            return False
        if not self._closing.is_set():
            self._state, self._message = "ended", ""
        self._decoding.finish()
        return True

    def _forget(self, source: Source) -> None:
        with self._lock:
            self._source = None
            for name, value in source.counters.values.items():
                self._past.add(name, value)

    def _consume(self, source: Source) -> None:
        for unit in source.units():
            if self._closing.is_set():
                return
            self._newest_ns = self._clock()
            self._stream = unit.stream
            self._state, self._message = "live", ""
            self._counters.add("units")
            if unit.key:
                self._counters.add("key_units")
            self._decoding.put(unit)
            self._tell(unit)

    def _tell(self, unit: AccessUnit) -> None:
        with self._lock:
            listeners = list(self._listeners.values())
        for listener in listeners:
            try:
                listener(unit)
            except Exception as error:
                self._counters.add("listener_errors")
                self._complaint = f"a listener failed: {type(error).__name__}: {error}"
