"""Coded pictures to decoded ones, without the delays a player can afford."""

from __future__ import annotations

from typing import Any

import av
from av.codec.context import Flags, ThreadType
from av.error import FFmpegError

from ..errors import SourceError
from ..types import AccessUnit, Counters, Frame, StreamInfo
from .planes import picture_from_av

_PREFERRED = {"av1": "libdav1d"}  # FFmpeg's own av1 only drives hardware
_MAX_PIXELS = 16384 * 8192  # damaged headers must not allocate more
_Times = tuple[int, int | None]


class Decoder:
    """Decodes the units of one source; starts anew when the stream changes.

    Low delay: each picture comes out with its own unit (slice threads; frame threads would keep
    back as many pictures as there are threads). `low_delay=False` is for files: frame threads.
    H.265 begins at the first key unit, before it there is only grey. Bad data never raises;
    counters: decoded, undecodable (units), waiting_for_key (units), corrupt (pictures the
    decoder patched up).
    """

    def __init__(self, *, low_delay: bool = True, threads: int = 0) -> None:
        self.counters = Counters()
        self._low_delay = low_delay
        self._threads = threads
        self._context: av.VideoCodecContext | None = None
        self._made_for: tuple[object, ...] = ()
        self._started = False
        self._newest_ns: int | None = None

    def decode(self, unit: AccessUnit) -> list[Frame]:
        """The pictures that this unit completes, oldest first; usually one.

        `capture_ns` never runs backward from one frame to the next. SourceError if this
        installation has no decoder for the codec.
        """
        context = self._context_for(unit.stream)
        self._started = self._started or unit.key or unit.stream.codec != "hevc"
        if not self._started:
            self.counters.add("waiting_for_key")
            return []
        if not unit.data:  # libavcodec would take it for the end of the stream
            self.counters.add("undecodable")
            return []
        packet: av.Packet[Any] = av.Packet(unit.data)
        packet.opaque = (unit.capture_ns, unit.media_ns)
        return self._run(context, packet)

    def flush(self) -> list[Frame]:
        """The pictures still inside; afterwards a new stream can begin."""
        if self._context is None:
            return []
        frames = self._run(self._context, None)
        self._context, self._made_for, self._started = None, (), False
        return frames

    def _run(self, context: av.VideoCodecContext, packet: av.Packet[Any] | None) -> list[Frame]:
        out = []
        try:
            for frame in context.decode(packet):
                out.append(self._frame(frame))
        except (FFmpegError, ValueError):
            self.counters.add("undecodable")
        self.counters.add("decoded", len(out))
        return out

    def _frame(self, frame: av.VideoFrame) -> Frame:
        times: _Times = frame.opaque or (self._newest_ns or 0, None)  # type: ignore[assignment]
        if frame.is_corrupt:
            self.counters.add("corrupt")
        self._newest_ns = max(times[0], self._newest_ns or times[0])
        return Frame(picture_from_av(frame), self._newest_ns, times[1])

    def _context_for(self, stream: StreamInfo) -> av.VideoCodecContext:
        made_for: tuple[object, ...] = (stream.codec, stream.extradata)
        if stream.codec == "rawvideo":
            made_for += (stream.width, stream.height, stream.pixel_format)
        if self._context is None or made_for != self._made_for:
            self._context = self._make(stream)
            self._made_for, self._started = made_for, False
        return self._context

    def _make(self, stream: StreamInfo) -> av.VideoCodecContext:
        name = _PREFERRED.get(stream.codec, stream.codec)
        try:
            context = av.CodecContext.create(name, "r")
        except (FFmpegError, ValueError):
            raise SourceError(f"no decoder for '{stream.codec}' in this installation") from None
        assert isinstance(context, av.VideoCodecContext)
        if stream.extradata:
            context.extradata = stream.extradata
        if stream.codec == "rawvideo":
            context.width, context.height = stream.width, stream.height
            context.pix_fmt = stream.pixel_format
        context.thread_count = self._threads
        context.thread_type = ThreadType.SLICE if self._low_delay else ThreadType.AUTO
        if self._low_delay:
            context.flags |= Flags.low_delay
        context.copy_opaque = True
        context.options = {"max_pixels": str(_MAX_PIXELS)}
        return context
