"""Which of FFmpeg's hardware encoders work here, found by encoding with them.

Most are compiled in everywhere and find no hardware. One is used only if it does what a live
stream needs: each picture comes out at once, the first and those asked for as key pictures with
their parameter sets in front.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import av
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType

from .annexb import nal_type, split_nals

# in the order of preference: the graphics card's, the processor's, the board's
FAMILIES = ("nvenc", "qsv", "amf", "vaapi", "v4l2m2m")
OPTIONS = {
    "nvenc": {"preset": "p2", "tune": "ull", "zerolatency": "1", "delay": "0", "rc": "cbr"}
    | {"forced-idr": "1", "bf": "0"},
    "qsv": {"preset": "veryfast", "async_depth": "1", "forced_idr": "1", "look_ahead": "0"}
    | {"bf": "0"},
    "amf": {"usage": "ultralowlatency", "forced_idr": "1", "bf": "0"},
    "vaapi": {"async_depth": "1", "bf": "0"},
    "v4l2m2m": {"bf": "0"},
}
PARAMETER_SETS = {"h264": {7, 8}, "hevc": {32, 33, 34}}  # types of NAL units
PROBED_KEY = 2  # which of the probe's pictures is asked to be a key picture
GREYS = (60, 100, 140, 180)  # the probe's pictures

_broken: set[str] = set()


def working(codec: str, size: tuple[int, int]) -> str | None:
    """FFmpeg's name of the first that encodes `codec` (h264, hevc) at this size; None if none."""
    names = (f"{codec}_{family}" for family in FAMILIES)
    return next((n for n in names if n not in _broken and not why_not(n, size)), None)


def gave_up(library: str) -> None:
    """It failed while encoding, and is not used again."""
    _broken.add(library)


def options(library: str) -> dict[str, str]:
    """For the least delay."""
    return dict(OPTIONS[library.rpartition("_")[2]])


def pixel_format(library: str) -> str:
    """Of what it takes from memory."""
    return "nv12" if library.endswith(("_qsv", "_amf")) else "yuv420p"


@cache
def why_not(library: str, size: tuple[int, int]) -> str:
    """Empty when it works; tried once, as that takes a moment."""
    try:
        context = _context(library, size)
        coded = [_encoded(context, index, size) for index in range(len(GREYS))]
    except (av.FFmpegError, ValueError, TypeError, RuntimeError) as error:
        return getattr(error, "strerror", None) or str(error)
    return judged(library.partition("_")[0], coded)


def judged(codec: str, coded: list[list[tuple[bytes, bool]]]) -> str:
    """What is wrong with the (data, key) packets that each of the probe's pictures gave."""
    if any(len(packets) != 1 for packets in coded):
        return "keeps pictures back"
    for index in (0, PROBED_KEY):
        data, key = coded[index][0]
        if not key:
            return "gives no key picture when asked"
        if not PARAMETER_SETS[codec] <= {nal_type(codec, nal) for nal in split_nals(data)}:
            return "gives key pictures without parameter sets"
    return ""


def _context(library: str, size: tuple[int, int]) -> VideoCodecContext:
    context = av.CodecContext.create(library, "w")
    assert isinstance(context, VideoCodecContext)
    context.width, context.height = size
    context.pix_fmt = pixel_format(library)
    context.framerate, context.time_base = Fraction(30), Fraction(1, 30)
    context.bit_rate, context.gop_size = 2_000_000, 30
    context.options = options(library)
    return context


def _encoded(
    context: VideoCodecContext, index: int, size: tuple[int, int]
) -> list[tuple[bytes, bool]]:
    frame = av.VideoFrame(*size, str(context.pix_fmt))
    for plane in frame.planes:
        plane.update(bytes([GREYS[index]]) * plane.buffer_size)
    frame.pts, frame.time_base = index, context.time_base
    frame.pict_type = PictureType.I if index == PROBED_KEY else PictureType.NONE
    return [(bytes(packet), packet.is_keyframe) for packet in context.encode(frame)]
