"""A video file, H.264 or H.265 in `out.mp4`, `.m4v`, `.mov` or `.mkv`; frames keep their times."""

from __future__ import annotations

import contextlib
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
from av.codec.context import ThreadType
from av.container import InputContainer, OutputContainer
from av.error import FFmpegError
from av.stream import Stream
from av.video.stream import VideoStream

from ..clock import NS_PER_S
from ..errors import RenderError, SinkError
from ..media.encoder import CODEC_NAMES, LIBRARIES, encodable, set_color
from ..types import Counters, Frame, Sink
from . import SinkSettings, check_output_file, refuse

KIND = "video"

SUFFIXES = (".mp4", ".m4v", ".mov", ".mkv")
TICKS_PER_S = 90_000
KEY_INTERVAL_S = 1.0
QUALITY = {"h264": "18", "hevc": "20"}  # constant rate factor: hard to tell from the original
PRESET = {"h264": "veryfast", "hevc": "ultrafast"}
PRESETS = (
    *("ultrafast", "superfast", "veryfast", "faster", "fast"),
    *("medium", "slow", "slower", "veryslow"),
)
# Self-contained pieces: whatever was written plays, however the program ended. The header waits
# for the first piece, so that it can say when the pictures start after the sound.
FRAGMENTED = {
    "movflags": "frag_keyframe+delay_moov+default_base_moof",
    "movie_timescale": str(TICKS_PER_S),
    "flush_packets": "1",
}


def recognises(argument: str) -> bool:
    return "://" not in argument and argument.lower().endswith(SUFFIXES)


def check(argument: str, settings: SinkSettings) -> None:
    if not recognises(argument):
        raise SinkError(f"{argument}: a video file ends in {', '.join(SUFFIXES)}")
    check_output_file(argument, overwrite=settings.overwrite)


def open(argument: str, settings: SinkSettings) -> Sink:
    refuse(settings, "a video file", "sdp", "bitrate")
    return VideoFile(argument, settings)


class VideoFile:
    """Writes frames at their own media_ns (their capture_ns counted from the first, if none).

    The frame rate may vary. A time that repeats or runs backward is moved to just after the one
    before and counted (nudged). Sound from `audio_from` is copied packet by packet as far as
    the pictures reach; that recording's media times must be the frames' own. What was
    written plays even if the program is killed. SinkError when writing fails.
    """

    def __init__(self, argument: str, settings: SinkSettings) -> None:
        self.counters = Counters()
        self._argument = argument
        self._settings = settings
        self._path = check_output_file(argument, overwrite=settings.overwrite)
        self._first_ns: int | None = None
        self._last_tick = -1
        try:
            self._container = _create(self._path)
            self._video = _add_video(self._container, settings)
            self._sound = _Sound(self._container, settings.audio_from)
        except (FFmpegError, OSError, ValueError) as error:
            raise SinkError(f"{argument}: {_reason(error)}") from None

    def write(self, frame: Frame) -> None:
        if frame.picture.size != self._settings.size:
            width, height = frame.picture.size
            raise SinkError(
                f"{self._argument}: began with {self._settings.size[0]} x "
                f"{self._settings.size[1]} pixels, but this frame has {width} x {height}"
            )
        try:
            picture = encodable(frame.picture, self._settings.color)
        except RenderError as error:
            raise SinkError(f"{self._argument}: {error}") from None
        picture.pts = self._tick(frame)
        picture.time_base = Fraction(1, TICKS_PER_S)
        self._mux(self._video.encode(picture))
        self.counters.add("written")

    def close(self) -> None:
        """Finish the file; one without a single frame is removed."""
        if not self.counters["written"]:
            with contextlib.suppress(FFmpegError, OSError):
                self._container.close()
            self._sound.close()
            self._path.unlink(missing_ok=True)
            return
        try:
            self._mux(self._video.encode(None))
            self._container.close()
        except (FFmpegError, OSError) as error:
            raise SinkError(f"{self._argument}: {_reason(error)}") from None
        finally:
            self._sound.close()

    def _mux(self, packets: list[av.Packet[Any]]) -> None:
        try:
            for packet in packets:
                assert packet.pts is not None
                assert packet.time_base is not None
                self._sound.copy_until(packet.pts * packet.time_base)
                self._container.mux(packet)
        except (FFmpegError, OSError) as error:
            raise SinkError(f"{self._argument}: {_reason(error)}") from None

    def _tick(self, frame: Frame) -> int:
        if frame.media_ns is not None:
            time_ns = frame.media_ns
        else:
            self._first_ns = frame.capture_ns if self._first_ns is None else self._first_ns
            time_ns = frame.capture_ns - self._first_ns
        tick = round(Fraction(time_ns * TICKS_PER_S, NS_PER_S))
        if tick <= self._last_tick:
            self.counters.add("nudged")
            tick = self._last_tick + 1
        self._last_tick = tick
        return tick


class _Sound:
    """Copies the first sound stream of another file, packet by packet."""

    def __init__(self, target: OutputContainer, path: str | None) -> None:
        self._source: InputContainer | None = None
        self._next: av.Packet[Any] | None = None
        if path is None:
            return
        self._source = av.open(path)
        if not self._source.streams.audio:
            self.close()
            return
        source = self._source.streams.audio[0]
        self._target: Stream = target.add_stream_from_template(source)
        self._container = target
        self._packets = self._source.demux(source)
        self._step()

    def copy_until(self, time_s: Fraction) -> None:
        """Copy what is to be heard up to this time."""
        while self._next is not None:
            packet = self._next
            assert packet.pts is not None
            assert packet.time_base is not None
            if packet.pts * packet.time_base > time_s:
                return
            packet.stream = self._target
            self._container.mux(packet)
            self._step()

    def close(self) -> None:
        if self._source is not None:
            self._source.close()
        self._source = self._next = None

    def _step(self) -> None:
        self._next = next((p for p in self._packets if p.pts is not None), None)


def _create(path: Path) -> OutputContainer:
    options = {"flush_packets": "1"} if path.suffix.lower() == ".mkv" else FRAGMENTED
    return av.open(str(path), "w", options=options)


def _add_video(container: OutputContainer, settings: SinkSettings) -> VideoStream:
    codec = CODEC_NAMES.get(settings.codec)
    if codec is None:
        raise ValueError(f"unknown codec '{settings.codec}'; known: {', '.join(CODEC_NAMES)}")
    width, height = settings.size
    if width % 2 or height % 2:
        raise ValueError(f"{width} x {height} pixels: video needs an even width and height")
    if not 0 < settings.fps <= 1000:
        raise ValueError(f"frames per second must lie above 0 and up to 1000, not {settings.fps}")
    rate = Fraction(settings.fps).limit_denominator(1001)
    stream = container.add_stream(LIBRARIES[codec], rate=rate)
    assert isinstance(stream, VideoStream)
    stream.width, stream.height = width, height
    stream.pix_fmt = "yuv420p"
    stream.time_base = stream.codec_context.time_base = Fraction(1, TICKS_PER_S)
    stream.codec_context.gop_size = max(1, round(KEY_INTERVAL_S * settings.fps))
    # whole frames beside each other, not slices of one: faster, and smaller at the same quality
    stream.codec_context.thread_type = ThreadType.AUTO
    set_color(stream.codec_context, settings.color)
    preset = settings.preset or PRESET[codec]
    if preset not in PRESETS:
        raise ValueError(f"unknown preset '{preset}'; known: {', '.join(PRESETS)}")
    # no B-frames: they would need a pause before the first picture in a fragmented file
    stream.options = {"crf": QUALITY[codec], "preset": preset, "bf": "0"}
    if codec == "hevc":
        stream.options |= {"x265-params": "log-level=error"}
        if container.format.name != "matroska":
            stream.codec_context.codec_tag = "hvc1"  # what Apple's players look for
    return stream


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)
