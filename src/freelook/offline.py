"""Rendering a recording: every frame once, in order, as fast as it goes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from .mailbox import Mailbox
from .media.decoder import Decoder
from .session import Session
from .types import AccessUnit, Frame, Sink


def decoded(units: Iterable[AccessUnit], decoder: Decoder) -> Iterator[Frame]:
    """All frames of a recording, in the order they are shown.

    The decoder, made with low_delay=False, counts what was damaged.
    """
    for unit in units:
        yield from decoder.decode(unit)
    yield from decoder.flush()


def render_recording(
    frames: Iterable[Frame],
    mailbox: Mailbox[Frame],
    session: Session,
    sink: Sink,
    on_frame: Callable[[], None] = lambda: None,
) -> int:
    """Write the view of every frame to `sink`, aimed for the frame's time since the first one.

    `mailbox` is the session's. Returns how many frames were written.
    """
    count = 0
    first_ns: int | None = None
    for frame in frames:
        media_ns = frame.media_ns if frame.media_ns is not None else frame.capture_ns
        first_ns = media_ns if first_ns is None else first_ns
        mailbox.put(frame)
        view = session.step(media_ns - first_ns)
        assert view is not None
        sink.write(Frame(view.picture, frame.capture_ns, media_ns))
        count += 1
        on_frame()
    return count
