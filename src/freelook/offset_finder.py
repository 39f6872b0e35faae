"""A live source of attitudes whose time beside the video's is found and refined as both go by.

It stands between the source and whoever reads it: attitudes are handed on as they come, and noted;
frames come from a mailbox on a thread of their own, for a lens and pictures take time. Whatever is
found is told to `use`, such as `Stabiliser.set_offset`.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator

from .alignment.image_turns import ImageTurns
from .alignment.live_offset import LiveOffset
from .camera import Camera
from .clock import NS_PER_MS
from .errors import FreelookError
from .mailbox import Mailbox
from .types import Attitude, AttitudeSource, Counters, Frame

LOOK_AGAIN_S = 0.5


class OffsetFinder:
    """An `AttitudeSource` around another one; `frames` is its own mailbox, which `close` closes.

    Decoding and following corners costs some milliseconds a frame; frames that come faster are
    dropped by the mailbox, and turns go from one frame that was seen to the next.
    """

    def __init__(
        self,
        source: AttitudeSource,
        camera: Camera,
        frames: Mailbox[Frame],
        use: Callable[[int], None],
        live: LiveOffset | None = None,
    ) -> None:
        self.counters: Counters = source.counters
        self._source = source
        self._frames = frames
        self._use = use
        self._live = LiveOffset() if live is None else live
        self._turns = ImageTurns(camera)
        self._lock = threading.Lock()
        self._failure = ""
        self._thread = threading.Thread(target=self._run, name="offset", daemon=True)

    @property
    def message(self) -> str:
        return self._source.message

    @property
    def report(self) -> str:
        """What there is to say of the offset, for people."""
        with self._lock:
            live = self._live
            latest = f"; last look: {live.latest.evidence}" if live.latest is not None else ""
            if self._failure:
                return f"time beside the video's: {self._failure}"
            if live.state == "searching":
                return f"time beside the video's: not found yet{latest}"
            milliseconds = live.offset_ns / NS_PER_MS
            return f"time beside the video's: {milliseconds:+.1f} ms, {live.state}{latest}"

    def attitudes(self) -> Iterator[Attitude]:
        self._thread.start()
        for attitude in self._source.attitudes():
            with self._lock:
                self._live.push_attitude(attitude)
            yield attitude

    def close(self) -> None:
        self._frames.close()
        self._source.close()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(2.0)

    def _run(self) -> None:
        try:
            while True:
                frame = self._frames.take(LOOK_AGAIN_S)
                if frame is not None:
                    self._look(frame)
                elif self._frames.closed:
                    return
        except FreelookError as error:  # frames that do not fit the lens: they will not later
            self._failure = str(error)
        except Exception as error:  # whatever a picture does to it, the flight goes on
            self._failure = f"stopped: {type(error).__name__}: {error}"

    def _look(self, frame: Frame) -> None:
        turn = self._turns.push(frame)
        if turn is None:
            return
        with self._lock:
            self._live.push_turn(turn)
            refined = self._live.refine(frame.capture_ns)
            if refined is None or self._live.state != "found":
                return
            offset_ns = self._live.offset_ns
        self._use(offset_ns)
