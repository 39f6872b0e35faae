"""Decoding beside the thread that receives, with the newest frame for everybody who wants it."""

from __future__ import annotations

import threading
from collections import deque

from ..mailbox import Mailbox
from ..types import AccessUnit, Counters, Frame
from .decoder import Decoder

_BACKLOG = 8  # units that may wait for the decoder: a quarter of a second at 30 Hz
_PATIENCE = 300  # units without a key unit; then the stream refreshes some other way


class DecodeThread:
    """Decodes on its own thread: a slow decoder must delay neither socket nor listeners.

    At most a few units wait. When the decoder cannot keep up they are thrown away (`skipped`)
    until the next key unit: late pictures are worth nothing. `size` is the newest frame's,
    `complaint` what could not be decoded at all.
    """

    def __init__(self) -> None:
        self._news = threading.Condition()
        self._waiting: deque[AccessUnit | None] = deque()
        self._boxes: list[Mailbox[Frame]] = []
        self._decoder: Decoder | None = None
        self._need_key = True
        self._waited = 0
        self._closed = False
        self._counters = Counters()
        self._past_drops = 0
        self._thread = threading.Thread(target=self._run, name="decode", daemon=True)
        self.size: tuple[int, int] | None = None
        self.complaint = ""

    def start(self) -> None:
        self._thread.start()

    def add(self) -> Mailbox[Frame]:
        box: Mailbox[Frame] = Mailbox()
        with self._news:
            if self._closed:
                box.close()
            self._boxes.append(box)
        return box

    def remove(self, box: Mailbox[Frame]) -> None:
        box.close()
        with self._news:
            if box in self._boxes:
                self._boxes.remove(box)
                self._past_drops += box.dropped
            if not self._boxes:
                self._need_key = True

    def put(self, unit: AccessUnit) -> None:
        with self._news:
            if not self._boxes:
                self._need_key = True
                return
            if len(self._waiting) >= _BACKLOG:
                self._counters.add("skipped", len(self._waiting))
                self._waiting.clear()
                self._need_key = True
            if self._must_wait(unit):
                self._counters.add("skipped")
                return
            self._waiting.append(unit)
            self._news.notify_all()

    def _must_wait(self, unit: AccessUnit) -> bool:
        """Whether this unit comes before a picture that decoding can start at."""
        self._waited = 0 if unit.key or not self._need_key else self._waited + 1
        self._need_key = 0 < self._waited < _PATIENCE
        return self._need_key

    def finish(self) -> None:
        """The stream is over: give out what the decoder still holds."""
        with self._news:
            self._waiting.append(None)
            self._news.notify_all()

    def close(self) -> None:
        with self._news:
            self._closed = True
            self._news.notify_all()
            boxes = list(self._boxes)
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(5.0)
        for box in boxes:
            box.close()

    def counters(self) -> list[Counters]:
        with self._news:
            dropped = self._past_drops + sum(box.dropped for box in self._boxes)
        parts = [self._counters, Counters({"dropped_frames": dropped})]
        return parts + ([self._decoder.counters] if self._decoder else [])

    def _run(self) -> None:
        self._decoder = decoder = Decoder()
        while True:
            with self._news:
                self._news.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                unit = self._waiting.popleft()
            try:
                frames = decoder.flush() if unit is None else decoder.decode(unit)
            except Exception as error:  # no decoder for this codec, or a fault of ours
                self._counters.add("undecodable")
                self.complaint = f"cannot decode: {error}"
                continue
            self._deliver(frames)

    def _deliver(self, frames: list[Frame]) -> None:
        with self._news:
            boxes = list(self._boxes)
        for frame in frames:
            self.size = frame.picture.size
            for box in boxes:
                box.put(frame)
