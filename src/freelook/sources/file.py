"""A video file, played at its own pace like a camera, once or in a loop: `flight.mp4`."""

from __future__ import annotations

import threading
from collections.abc import Generator, Iterator, Mapping
from pathlib import Path

import av
from av.bitstream import BitStreamFilterContext
from av.container import InputContainer
from av.error import FFmpegError
from av.stream import Disposition
from av.video.stream import VideoStream

from ..clock import NS_PER_S, Clock
from ..errors import SourceError
from ..media.annexb import ParameterSets, is_key, join_nals, split_nals
from ..types import AccessUnit, Counters, Source, StreamInfo
from . import check_options

KIND = "file"

_ANNEX_B = {"h264": "h264_mp4toannexb", "hevc": "hevc_mp4toannexb"}
_DEFAULT_FRAME_NS = NS_PER_S // 30
_LONGEST_STEP_NS = 5 * NS_PER_S  # a longer one is a broken clock, not a slow camera
_LONGEST_BACK_NS = NS_PER_S
_LATE_NS = NS_PER_S // 5


def recognises(argument: str) -> bool:
    other = argument.lower().endswith(".sdp") or argument.startswith("/dev/video")
    return bool(argument) and "://" not in argument and not other


def open(
    argument: str, *, loop: bool, pace: bool, clock: Clock, options: Mapping[str, str]
) -> Source:
    """Open and probe the file now; SourceError (no retry) when there is no video to be had."""
    check_options(argument, options, ())
    return FileSource(argument, loop=loop, pace=pace, clock=clock)


class FileSource:
    """The first video stream of a file. H.264 and H.265 come as Annex B.

    `media_ns` is the picture's own time in the file. `capture_ns` follows the decoding times,
    never runs backward, goes on through loops, and is when the unit is due; a reader that comes
    late by more than 0.2 s gets the rest at the usual pace, not in a burst. Counters: loops,
    late, damaged (pictures left out), odd_times (steps that were backward, missing or absurd).
    """

    def __init__(self, path: str, *, loop: bool, pace: bool, clock: Clock) -> None:
        self.counters = Counters()
        self._path = path
        self._loop = loop
        self._pace = pace
        self._clock = clock
        self._closing = threading.Event()
        self._container, self._stream = _open_video(path)
        self._info = _stream_info(self._stream)
        self._frame_ns = _frame_ns(self._stream)

    @property
    def stream(self) -> StreamInfo:
        """What the container says about the video."""
        return self._info

    @property
    def frames_per_s(self) -> float:
        """The average rate, or 30 where the file does not say."""
        return NS_PER_S / self._frame_ns

    @property
    def expected_frames(self) -> int | None:
        """How many pictures the file claims to hold; None if it does not say."""
        if self._stream.frames:
            return int(self._stream.frames)
        if self._container.duration is None:
            return None
        return round(self._container.duration / av.time_base * self.frames_per_s)

    def units(self) -> Iterator[AccessUnit]:
        self._start_ns = self._due_ns = self._clock()
        try:
            while not self._closing.is_set():
                played = yield from self._play_once()
                if not played and not self._closing.is_set():
                    raise SourceError(f"{self._path}: not one picture of it can be read")
                if not self._loop:
                    return
                self._due_ns += self._frame_ns
                self.counters.add("loops")
                self._container.close()
                self._container, self._stream = _open_video(self._path)
        finally:
            self._container.close()

    def key_units(self, count: int) -> Iterator[AccessUnit]:
        """The key units before `count` evenly spread times, by seeking; use it instead of `units`.

        Each comes once: fewer where the recording has fewer of them, none where one cannot seek
        in it. `media_ns` is as in `units`; `capture_ns` means nothing.
        """
        self._start_ns = self._due_ns = 0
        seen: set[int | None] = set()
        try:
            base, length = self._stream.time_base, self._container.duration or 0
            if not base or not length:
                return
            for number in range(count):
                after_s = length / av.time_base * (number + 0.5) / count
                place = (self._stream.start_time or 0) + round(after_s / base)
                self._container.seek(place, stream=self._stream)
                units = self._packets()
                unit = next((u for u in map(self._unit, units) if u.key), None)
                units.close()
                if unit is not None and unit.media_ns not in seen:
                    seen.add(unit.media_ns)
                    yield unit
        except (FFmpegError, SourceError):  # its index is wrong, or it is cut off
            return
        finally:
            self._container.close()

    def close(self) -> None:
        self._closing.set()

    def _play_once(self) -> Generator[AccessUnit, None, int]:
        """Yields the units of the file; returns how many there were."""
        self._dts: int | None = None
        played = 0
        for packet in self._packets():
            self._due_ns += self._step_ns(packet.dts)
            if self._pace:
                self._wait()
            if self._closing.is_set():
                break
            yield self._unit(packet)
            played += 1
        return played

    def _packets(self) -> Generator[av.Packet[VideoStream], None, None]:
        bsf_name = _ANNEX_B.get(self._info.codec)
        self._sets = ParameterSets(self._info.codec) if bsf_name else None
        try:
            bsf = BitStreamFilterContext(bsf_name, self._stream) if bsf_name else None
            for packet in self._container.demux(self._stream):
                if not packet.size:
                    continue
                yield from self._filtered(bsf, packet) if bsf else [packet]
        except FFmpegError as error:
            after_s = (self._due_ns - self._start_ns) / NS_PER_S
            raise SourceError(
                f"{self._path}: the file is damaged {after_s:.1f} s after the start: "
                f"{error.strerror}"
            ) from None

    def _filtered(
        self, bsf: BitStreamFilterContext, packet: av.Packet[VideoStream]
    ) -> list[av.Packet[VideoStream]]:
        try:
            return bsf.filter(packet)
        except FFmpegError:  # one damaged picture does not end the recording
            self.counters.add("damaged")
            return []

    def _unit(self, packet: av.Packet[VideoStream]) -> AccessUnit:
        data, key = bytes(packet), packet.is_keyframe
        if self._sets:
            nals = list(split_nals(data))
            self._sets.update(nals)
            key = key or is_key(self._info.codec, nals)
            if key:
                data = join_nals(self._sets.complete(nals))
        time = packet.pts if packet.pts is not None else packet.dts
        media_ns = None if time is None else self._ns(time)
        return AccessUnit(self._info, data, key, self._due_ns, media_ns)

    def _ns(self, ticks: int) -> int:
        base = self._stream.time_base
        return ticks * base.numerator * NS_PER_S // base.denominator if base else 0

    def _step_ns(self, dts: int | None) -> int:
        """Time since the unit before; the usual one where the file's own makes no sense.

        After a small step backward nothing moves until the old time is reached again.
        """
        if self._dts is None or dts is None:
            first, self._dts = self._dts is None, self._dts if dts is None else dts
            return 0 if first else self._frame_ns
        step_ns = self._ns(dts - self._dts)
        if 0 <= step_ns <= _LONGEST_STEP_NS:
            self._dts = dts
            return step_ns
        self.counters.add("odd_times")
        if -_LONGEST_BACK_NS < step_ns < 0:
            return 0
        self._dts = dts
        return self._frame_ns

    def _wait(self) -> None:
        early_ns = self._due_ns - self._clock()
        if early_ns > 0:
            self._closing.wait(early_ns / NS_PER_S)
        elif early_ns < -_LATE_NS:
            self.counters.add("late")
            self._due_ns -= early_ns


def _open_video(path: str) -> tuple[InputContainer, VideoStream]:
    file = Path(path)
    try:
        if file.is_dir():
            raise SourceError(f"{path}: this is a folder, not a video file")
        if file.stat().st_size == 0:
            raise SourceError(f"{path}: the file is empty")
        container = av.open(path, options={"protocol_whitelist": "file"}, metadata_errors="replace")
    except FFmpegError as error:
        raise SourceError(
            f"{path}: not a video file, or cut off before its index ({error.strerror})"
        ) from None
    except (OSError, ValueError) as error:
        raise SourceError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    for stream in container.streams.video:
        cover = stream.disposition & Disposition.attached_pic
        unknown = stream.codec_context is None  # no decoder for it
        # "tty" takes any text for a picture
        if not cover and not unknown and container.format.name != "tty":
            return container, stream
    kinds = dict.fromkeys(sorted(str(stream.type) for stream in container.streams))
    container.close()
    found = " and ".join(kinds).replace("video", "video of an unknown kind") or "nothing"
    raise SourceError(f"{path}: there is no video in this file to decode, only {found}")


def _stream_info(stream: VideoStream) -> StreamInfo:
    context = stream.codec_context
    codec = context.codec.canonical_name
    extradata = None if codec in _ANNEX_B else context.extradata
    return StreamInfo(codec, context.width, context.height, context.pix_fmt, extradata)


def _frame_ns(stream: VideoStream) -> int:
    rate = stream.average_rate
    return int(NS_PER_S / rate) if rate and 1 <= rate <= 1000 else _DEFAULT_FRAME_NS
