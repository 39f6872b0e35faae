from __future__ import annotations

from fractions import Fraction
from typing import Any

import av
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.media.annexb import ParameterSets, is_key, split_nals
from freelook.media.passthrough import why_transcode
from freelook.media.sps import SpsInfo, parse_sps, stream_info
from freelook.types import AccessUnit, StreamInfo
from video_streams import elementary_stream, pictures


def encode(codec: str, pixel_format: str, size: tuple[int, int], **options: str) -> list[bytes]:
    """Packets of a few pictures, made by x264 or x265 with these options."""
    context: Any = av.CodecContext.create({"h264": "libx264", "hevc": "libx265"}[codec], "w")
    context.width, context.height = size
    context.pix_fmt = pixel_format
    context.framerate = 30
    context.time_base = Fraction(1, 30)
    context.options = {"x265-params": "log-level=none:pools=1", **options}
    if codec == "h264":
        context.options = options
    frames = [frame.reformat(format=pixel_format) for frame in pictures(8, size)]
    packets = [bytes(p) for frame in [*frames, None] for p in context.encode(frame)]
    return packets


def units(codec: str, packets: list[bytes]) -> list[AccessUnit]:
    stream = StreamInfo(codec)
    return [AccessUnit(stream, p, is_key(codec, list(split_nals(p))), 0) for p in packets]


def sps_of(codec: str, packet: bytes) -> bytes:
    sps = ParameterSets(codec, split_nals(packet)).sps
    assert sps is not None
    return sps


@pytest.mark.parametrize("codec", ["h264", "hevc"])
@pytest.mark.parametrize("size", [(320, 240), (322, 182), (128, 1080)])
@pytest.mark.parametrize(
    ("pixel_format", "chroma", "depth"),
    [("yuv420p", "4:2:0", 8), ("yuv422p", "4:2:2", 8), ("yuv420p10le", "4:2:0", 10)],
)
def test_size_and_format_as_the_encoder_was_told(
    codec: str, size: tuple[int, int], pixel_format: str, chroma: str, depth: int
) -> None:
    info = parse_sps(codec, sps_of(codec, encode(codec, pixel_format, size, preset="ultrafast")[0]))
    assert info is not None
    assert (info.width, info.height) == size
    assert (info.chroma, info.bit_depth) == (chroma, depth)
    assert info.pixel_format == (pixel_format if depth == 8 else None)


def test_full_range_and_reordering_are_read_from_the_usability_information() -> None:
    packets = encode("h264", "yuvj420p", (320, 240), bf="2", **{"x264-params": "fullrange=on"})
    info = parse_sps("h264", sps_of("h264", packets[0]))
    assert info is not None
    assert info.reorder_frames
    assert info == SpsInfo(320, 240, full_range=True, reorder_frames=info.reorder_frames)
    assert info.pixel_format == "yuvj420p"


def test_scaling_lists_are_skipped_right() -> None:
    packets = encode("h264", "yuv420p", (320, 240), **{"x264-params": "cqm=jvt"})
    info = parse_sps("h264", sps_of("h264", packets[0]))
    assert info is not None
    assert (info.width, info.height) == (320, 240)


@pytest.mark.parametrize("codec", ["h264", "hevc"])
@given(data=st.data())
def test_a_damaged_sps_is_read_or_refused(codec: str, data: st.DataObject) -> None:
    sps = bytearray(sps_of(codec, elementary_stream(codec)))
    for _ in range(data.draw(st.integers(0, 6))):
        sps[data.draw(st.integers(0, len(sps) - 1))] = data.draw(st.integers(0, 255))
    damaged = bytes(sps[: data.draw(st.integers(0, len(sps)))])
    info = parse_sps(codec, damaged)
    assert info is None or 0 < info.width <= 16384
    assert stream_info(codec, damaged).codec == codec


def answers(packets: list[bytes]) -> set[str | None]:
    return {why_transcode(unit) for unit in units("h264", packets)}


def test_what_a_camera_sends_live_goes_untouched() -> None:
    for options in ({"tune": "zerolatency"}, {"profile": "baseline"}, {"bf": "0"}):
        assert answers(encode("h264", "yuv420p", (320, 240), **options)) == {None}


@pytest.mark.parametrize(
    ("pixel_format", "options", "says"),
    [
        ("yuv420p", {"bf": "2"}, "B-frames"),
        ("yuv422p", {"tune": "zerolatency"}, "4:2:2"),
        ("yuv420p10le", {"tune": "zerolatency"}, "10 bits"),
        ("yuv420p", {"x264-params": "interlaced=1:bframes=0"}, "interlaced"),
    ],
)
def test_what_a_browser_cannot_take_is_said(
    pixel_format: str, options: dict[str, str], says: str
) -> None:
    packets = encode("h264", pixel_format, (320, 240), **options)
    first = why_transcode(units("h264", packets)[0])
    assert first is not None
    assert says in first


def test_b_slices_are_found_where_nothing_announces_them() -> None:
    packets = encode("h264", "yuv420p", (320, 240), bf="2", **{"x264-params": "b-adapt=0"})
    bare = [[n for n in split_nals(p) if n[0] & 31 in (1, 5)] for p in packets]
    assert any(
        "B-frames" in (why_transcode(u) or "")
        for u in units("h264", [b"\0\0\1" + b"\0\0\1".join(nals) for nals in bare])
    )


@pytest.mark.parametrize(
    ("codec", "name"),
    [("hevc", "H.265"), ("mjpeg", "Motion JPEG"), ("rawvideo", "raw"), ("vp9", "vp9")],
)
def test_other_codecs_are_named(codec: str, name: str) -> None:
    answer = why_transcode(StreamInfo(codec))
    assert answer is not None
    assert name in answer


def test_a_stream_is_judged_by_its_parameter_sets() -> None:
    packet = encode("h264", "yuv422p", (320, 240))[0]
    assert "4:2:2" in (why_transcode(StreamInfo("h264", extradata=packet)) or "")
    assert why_transcode(StreamInfo("h264")) is None
