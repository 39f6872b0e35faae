"""A camera or capture card of this machine (V4L2, UVC): `/dev/video0`."""

from __future__ import annotations

import errno
import threading
from collections import deque
from collections.abc import Iterator, Mapping
from pathlib import Path

import av
from av.container import InputContainer
from av.error import FFmpegError

from ..clock import NS_PER_S, Clock
from ..errors import SourceError
from ..types import AccessUnit, Counters, Source, StreamInfo
from . import check_options, number

KIND = "v4l2"

# our names -> FFmpeg's (https://ffmpeg.org/ffmpeg-devices.html#video4linux2_002c-v4l2)
_OPTIONS = {"size": "video_size", "rate": "framerate", "format": "input_format"}
_BACKLOG = 4
_OLDEST_NS = 2 * NS_PER_S


def recognises(argument: str) -> bool:
    return argument.startswith("/dev/video")


def open(
    argument: str, *, loop: bool, pace: bool, clock: Clock, options: Mapping[str, str]
) -> Source:
    """Options, also as `/dev/video0?size=1280x720&rate=60`: `size`, `rate`, `format` (mjpeg,
    h264, yuyv422, nv12, ...) and `timeout`, the silence in seconds that counts as lost (2)."""
    path, _, query = argument.partition("?")
    chosen = {**options, **dict(part.partition("=")[::2] for part in query.split("&") if part)}
    check_options(argument, chosen, [*_OPTIONS, "timeout"])
    timeout_s = number(argument, chosen, "timeout", 2.0)
    return DeviceSource(path, _open_device(path, chosen), timeout_s, clock)


def devices() -> list[str]:
    """The video devices of this machine, by name."""
    return sorted(str(path) for path in Path("/dev").glob("video*"))


class DeviceSource:
    """Coded or raw pictures of a capture device; `capture_ns` is the driver's own time stamp.

    The driver's read cannot be interrupted, so it has its own thread; `close` and a silent
    device end `units` at once all the same. A reader that is too slow loses the oldest pictures
    (`dropped`).
    """

    def __init__(
        self, path: str, container: InputContainer, timeout_s: float, clock: Clock
    ) -> None:
        self.counters = Counters()
        self._path = path
        self._container = container
        self._timeout_s = timeout_s
        self._clock = clock
        self._news = threading.Condition()
        self._units: deque[AccessUnit] = deque()
        self._closing = False
        self._failure: str | None = None
        context = container.streams.video[0].codec_context
        self._info = StreamInfo(
            context.codec.canonical_name,
            context.width,
            context.height,
            context.pix_fmt,
            context.extradata,
        )

    def units(self) -> Iterator[AccessUnit]:
        threading.Thread(target=self._read, name=f"read {self._path}", daemon=True).start()
        try:
            while (unit := self._next()) is not None:
                yield unit
        finally:
            self.close()

    def close(self) -> None:
        with self._news:
            self._closing = True
            self._news.notify_all()

    def _next(self) -> AccessUnit | None:
        with self._news:
            ready = self._news.wait_for(
                lambda: self._units or self._closing or self._failure, self._timeout_s
            )
            if self._closing:
                return None
            if self._units:
                return self._units.popleft()
            reason = self._failure if ready else f"no picture for {self._timeout_s:g} s"
            raise SourceError(f"{self._path}: {reason}", retry=True)

    def _read(self) -> None:
        failure = "the device ended the stream"
        try:
            for packet in self._container.demux(video=0):
                if self._closing:
                    break
                if packet.size:
                    self._put(self._unit(packet))
        except FFmpegError as error:
            failure = error.strerror or str(error)
        finally:
            self._container.close()
        with self._news:
            self._failure = failure
            self._news.notify_all()

    def _put(self, unit: AccessUnit) -> None:
        with self._news:
            if len(self._units) >= _BACKLOG:
                self._units.popleft()
                self.counters.add("dropped")
            self._units.append(unit)
            self._news.notify_all()

    def _unit(self, packet: av.Packet) -> AccessUnit:  # type: ignore[type-arg]
        now_ns = self._clock()
        capture_ns = now_ns
        if packet.pts is not None and packet.time_base:
            driver_ns = int(packet.pts * packet.time_base * NS_PER_S)
            if 0 <= now_ns - driver_ns <= _OLDEST_NS:  # else it is not of the monotonic clock
                capture_ns = driver_ns
        return AccessUnit(self._info, bytes(packet), packet.is_keyframe, capture_ns)


def _open_device(path: str, chosen: Mapping[str, str]) -> InputContainer:
    options = {_OPTIONS[name]: value for name, value in chosen.items() if name in _OPTIONS}
    try:
        # not `options`: those go to the decoder too, which would believe the size asked for
        return av.open(path, format=KIND, container_options=options)
    except FileNotFoundError:
        there = ", ".join(devices()) or "none"
        raise SourceError(
            f"{path}: there is no such device (video devices here: {there})", retry=True
        ) from None
    except PermissionError:
        raise SourceError(
            f"{path}: no permission; add yourself to the group 'video' and log in again"
        ) from None
    except OSError as error:  # FFmpeg's errors of the system are these too
        if error.errno != errno.EBUSY:
            raise _refused(path, chosen, error) from None
        # it may be ours: the driver's read holds a device for one more picture after `close`
        raise SourceError(f"{path}: in use by another program", retry=True) from None
    except (FFmpegError, ValueError) as error:
        raise _refused(path, chosen, error) from None


def _refused(path: str, chosen: Mapping[str, str], error: Exception) -> SourceError:
    reason = getattr(error, "strerror", None) or error
    wanted = ", ".join(f"{name}={value}" for name, value in chosen.items())
    asked = f" (asked for {wanted})" if wanted else ""
    return SourceError(f"{path}: {reason}{asked}", retry=not wanted)
