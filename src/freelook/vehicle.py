"""One source of attitudes on its own thread, feeding one stabiliser; what there is to say of it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from .gimbal import Base, Stabiliser
from .types import Attitude, AttitudeSource


@dataclass(frozen=True)
class VehicleStatus:
    """What there is to say about the vehicle's attitude.

    `mode`, `effective` and `state` are the stabiliser's (`freelook.gimbal.Base`); `message` says
    what is wrong, if anything. `received` counts attitudes. `offset` is what there is to say of
    the attitude's time beside the video's, where that is found while flying.
    """

    mode: str
    effective: str
    state: str
    message: str
    received: int
    counters: dict[str, int]
    offset: str = ""


@runtime_checkable
class FindsItsTime(Protocol):
    """A source such as `freelook.offset_finder.OffsetFinder`."""

    @property
    def report(self) -> str: ...


class Vehicle:
    """Safe between threads. A source that fails is reported by `status`; the stabiliser then
    behaves as for one that fell silent."""

    def __init__(self, stabiliser: Stabiliser, source: AttitudeSource | None = None) -> None:
        self.stabiliser = stabiliser
        self._source = source
        self._failure = ""
        self._received = 0
        self._thread: threading.Thread | None = None

    def start(self, on_attitude: Callable[[Attitude], None] = lambda _attitude: None) -> None:
        """Begin to read; `on_attitude` runs on the source's thread after each."""
        if self._source is None:
            return
        self._thread = threading.Thread(
            target=self._run, args=(self._source, on_attitude), name="vehicle", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop the source and wait for its thread (at most two seconds)."""
        if self._source is not None:
            self._source.close()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(2.0)

    def status(self) -> VehicleStatus:
        base = self.stabiliser.newest
        mode = self.stabiliser.mode
        counters = dict(self._source.counters.values) if self._source else {}
        message = self._explain(base) if mode != "body" else ""
        offset = self._source.report if isinstance(self._source, FindsItsTime) else ""
        return VehicleStatus(
            mode, base.effective, base.state, message, self._received, counters, offset
        )

    def _explain(self, base: Base) -> str:
        if self._source is None:
            return "no source of the vehicle's attitude: start with --attitude"
        if base.effective == base.mode:
            return base.notice
        return "; ".join(filter(None, (base.notice, self._failure or self._source.message)))

    def _run(self, source: AttitudeSource, on_attitude: Callable[[Attitude], None]) -> None:
        try:
            for attitude in source.attitudes():
                self.stabiliser.push(attitude)
                self._received += 1
                on_attitude(attitude)
        except Exception as error:  # whatever a source does, the video goes on
            self._failure = f"the attitude failed: {type(error).__name__}: {error}"
