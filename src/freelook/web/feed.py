"""From the camera to the hub: coded pictures as they are, or coded anew where they must be."""

from __future__ import annotations

import threading
from collections.abc import Callable

from ..errors import FreelookError
from ..ingest import Ingest
from ..media.encoder import Encoder
from ..media.passthrough import why_transcode
from ..types import AccessUnit, Counters, Frame, StreamInfo
from .units import Hub

# How long the transcoder sleeps when no frames come; closing wakes it at once.
NAP_S = 1.0


class Feed:
    """Passes H.264 on untouched, and says why wherever it cannot.

    `why` is None while passing on, else the reason for transcoding. One transcoder serves all
    viewers, and runs only while there are any.
    """

    def __init__(self, ingest: Ingest, hub: Hub) -> None:
        self.why: str | None = None
        self.error: str | None = None
        self.counters = Counters()
        self._ingest = ingest
        self._hub = hub
        self._wanted = False
        self._stream: StreamInfo | None = None
        self._transcoder: Transcoder | None = None
        self._lock = threading.Lock()
        self._unsubscribe: Callable[[], None] | None = None

    def start(self) -> None:
        self._unsubscribe = self._ingest.subscribe(self._on_unit)

    def close(self) -> None:
        if self._unsubscribe is not None:
            self._unsubscribe()
        self.want(False)

    def want(self, wanted: bool) -> None:
        """Whether anybody is watching."""
        self._wanted = wanted
        self._update()

    def request_key(self) -> bool:
        """Ask the encoder for a key picture; False when the camera does the encoding."""
        transcoder = self._transcoder
        if transcoder is None:
            return False
        transcoder.key.set()
        return True

    def _on_unit(self, unit: AccessUnit) -> None:
        """On the ingest thread. Once a stream cannot be passed on, it is not tried again."""
        known = self.why if unit.stream == self._stream else None
        self._stream = unit.stream
        why = known or why_transcode(unit)
        if why != self.why:
            self.why = why
            self._hub.restart()
            self._update()
        if why is None:
            self._hub.offer(unit)

    def _update(self) -> None:
        """Start or stop the transcoder; from the ingest thread and from the event loop."""
        with self._lock:
            needed = self._wanted and self.why is not None
            if needed and self._transcoder is None:
                self._transcoder = Transcoder(self._ingest, self._hub, self._failed, self.counters)
            elif not needed and self._transcoder is not None:
                self._transcoder.stop()
                self._transcoder = None
                self.error = None

    def _failed(self, message: str | None) -> None:
        self.error = message


class Transcoder:
    """A thread that decodes nothing itself: newest frame in, H.264 to the hub."""

    def __init__(
        self,
        ingest: Ingest,
        hub: Hub,
        report: Callable[[str | None], None],
        counters: Counters,
    ) -> None:
        self.key = threading.Event()
        self._ingest = ingest
        self._hub = hub
        self._report = report
        self._counters = counters
        self._frames = ingest.frames()
        self._encoder: Encoder | None = None
        self._stopped = False
        self._thread = threading.Thread(target=self._run, name="transcoder", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Ends by itself soon; does not wait."""
        self._stopped = True
        self._ingest.release(self._frames)

    def _run(self) -> None:
        while not self._stopped:
            frame = self._frames.take(NAP_S)
            if frame is None and self._frames.closed:
                return
            if frame is not None:
                self._transcode(frame)

    def _transcode(self, frame: Frame) -> None:
        key = self.key.is_set()
        self.key.clear()
        try:
            units = self._encoder_for(frame).encode(frame, key=key)
        except FreelookError as error:
            self._counters.add("not_transcoded")
            self._report(f"this video cannot be transcoded: {error}")
            return
        self._report(None)
        self._counters.add("transcoded", len(units))
        for unit in units:
            if not self._stopped:
                self._hub.offer(unit)

    def _encoder_for(self, frame: Frame) -> Encoder:
        picture = frame.picture
        encoder = self._encoder
        if encoder is None or (encoder.size, encoder.color) != (picture.size, picture.color):
            encoder = self._encoder = Encoder(picture.size, color=picture.color)
            self._hub.restart()
        return encoder
