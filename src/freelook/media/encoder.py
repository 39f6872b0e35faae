"""Live encoding to H.264 or H.265: one picture in, one access unit out, nothing held back."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, Literal

import av
from av.error import FFmpegError
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType
from av.video.reformatter import ColorRange, Colorspace

from ..errors import RenderError
from ..types import AccessUnit, ColorSpace, Frame, Picture, StreamInfo
from . import hardware
from .planes import av_from_picture

By = Literal["auto", "software", "hardware"]

LIBRARIES = {"h264": "libx264", "hevc": "libx265"}
CODEC_NAMES = {"h264": "h264", "h265": "hevc", "hevc": "hevc"}
KEY_INTERVAL_S = 1.0
BITS_PER_PIXEL = 0.15  # default bit rate: 4 Mbit/s for 960x960 at 30 frames a second

# numbers of ITU-T H.273, tables 2 to 4
PRIMARIES = {"bt601": 6, "bt709": 1}


class Encoder:
    """x264 or x265 tuned for the least delay: no B-frames, no look-ahead, one slice.

    Annex B, with parameter sets on every key picture (one a second, or when asked for). The
    stream states its colour matrix and range. `codec` is h264 or h265 (hevc); `bitrate` is in
    bits per second. Only even sizes: the chroma of 4:2:0 needs them. RenderError otherwise.

    `by` is software, hardware (RenderError where none works), or auto: hardware where it works
    (`freelook.media.hardware`). `library` is FFmpeg's name of what encodes.
    """

    def __init__(
        self,
        size: tuple[int, int],
        *,
        codec: str = "h264",
        fps: float = 30,
        bitrate: int | None = None,
        color: ColorSpace = ColorSpace(),  # noqa: B008 - frozen
        by: By = "software",
    ) -> None:
        if codec not in CODEC_NAMES:
            raise RenderError(f"unknown codec '{codec}'; known: {', '.join(CODEC_NAMES)}")
        if size[0] % 2 or size[1] % 2 or min(size) < 16:
            raise RenderError(
                f"cannot encode {size[0]} x {size[1]} pixels: both must be even and at least 16"
            )
        if not 0 < fps <= 1000:
            raise RenderError(f"frames per second must lie above 0 and up to 1000, not {fps}")
        self.size, self.codec, self.fps, self.color = size, CODEC_NAMES[codec], fps, color
        self.bitrate = bitrate or int(BITS_PER_PIXEL * size[0] * size[1] * fps)
        self.library = self._choose(by)
        self._context = self._make_context()
        self._count = 0

    def encode(self, frame: Frame, *, key: bool = False) -> list[AccessUnit]:
        """The access units of one frame: exactly one from these encoders.

        `key` asks for a key picture now. RenderError when the frame's size is not the encoder's.
        """
        if frame.picture.size != self.size:
            width, height = frame.picture.size
            raise RenderError(
                f"the encoder was made for {self.size[0]} x {self.size[1]} pixels, "
                f"but this frame has {width} x {height}"
            )
        picture = encodable(frame.picture, self.color)
        if self._context.pix_fmt != picture.format.name:
            picture = picture.reformat(format=self._context.pix_fmt)
        picture.pts = self._count
        picture.time_base = self._context.time_base
        picture.pict_type = PictureType.I if key else PictureType.NONE
        self._count += 1
        try:
            packets = self._context.encode(picture)
        except FFmpegError as error:  # the hardware went away
            hardware.gave_up(self.library)
            raise RenderError(f"{self.library} failed: {error.strerror}") from None
        return [self._unit(packet, frame) for packet in packets]

    def _choose(self, by: By) -> str:
        if by != "software" and (found := hardware.working(self.codec, self.size)):
            return found
        if by == "hardware":
            raise RenderError(
                f"no hardware encodes {self.codec} of {self.size[0]} x {self.size[1]} pixels "
                "here; leave out encoder=hardware, or ask freelook doctor"
            )
        return LIBRARIES[self.codec]

    def _unit(self, packet: av.Packet[Any], frame: Frame) -> AccessUnit:
        info = StreamInfo(self.codec, *self.size, pixel_format="yuv420p")
        return AccessUnit(info, bytes(packet), packet.is_keyframe, frame.capture_ns, frame.media_ns)

    def _make_context(self) -> VideoCodecContext:
        context = av.CodecContext.create(self.library, "w")
        assert isinstance(context, VideoCodecContext)
        context.width, context.height = self.size
        context.pix_fmt = hardware.pixel_format(self.library)
        rate = Fraction(self.fps).limit_denominator(1001)
        context.framerate, context.time_base = rate, 1 / rate
        context.bit_rate = self.bitrate
        context.gop_size = max(1, round(KEY_INTERVAL_S * self.fps))
        context.thread_count = 1  # slices or frame threads would cost delay
        set_color(context, self.color)
        if self.library == LIBRARIES[self.codec]:
            context.options = low_delay_options(self.codec, context.gop_size, self.bitrate)
        else:
            context.options = hardware.options(self.library)
        return context


def encodable(picture: Picture, color: ColorSpace) -> av.VideoFrame:
    """The picture as 4:2:0 planes in this colour space, ready for an encoder.

    Planes that are there already must be in it (RenderError): relabelling them would shift
    every colour.
    """
    if picture.layout != "rgb24" and picture.color != color:
        raise RenderError(f"the encoder was made for {color}, but this frame is {picture.color}")
    frame = av_from_picture(picture)
    if picture.layout == "i420":
        return frame
    return frame.reformat(
        format="yuv420p",
        src_color_range=ColorRange.JPEG if picture.layout == "rgb24" else frame.color_range,
        dst_color_range=ColorRange.JPEG if color.full_range else ColorRange.MPEG,
        dst_colorspace=Colorspace.ITU601 if color.matrix == "bt601" else Colorspace.ITU709,
    )


def set_color(context: VideoCodecContext, color: ColorSpace) -> None:
    """State range, matrix, primaries and transfer, so that players need not guess."""
    bt601 = color.matrix == "bt601"
    context.color_range = ColorRange.JPEG if color.full_range else ColorRange.MPEG
    context.colorspace = Colorspace.SMPTE170M if bt601 else Colorspace.ITU709
    context.color_primaries = context.color_trc = PRIMARIES[color.matrix]


def low_delay_options(codec: str, key_interval: int, bitrate: int) -> dict[str, str]:
    """Options of libx264 or libx265 for live use, with a buffer of one third of a second."""
    kbits = max(1, bitrate // 1000)
    common = (
        f"annexb=1:repeat-headers=1:scenecut=0:keyint={key_interval}:min-keyint=1"
        f":vbv-maxrate={kbits}:vbv-bufsize={max(1, kbits // 3)}"
    )
    options = {"preset": "ultrafast", "tune": "zerolatency", "forced-idr": "1"}
    if codec == "h264":
        return options | {"x264-params": common + ":slices=1:sliced-threads=0"}
    return options | {"x265-params": common + ":bframes=0:log-level=error:pools=1:frame-threads=1"}
