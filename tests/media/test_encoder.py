"""The live encoder: nothing held back, colours stated and kept, stamps readable."""

from __future__ import annotations

import av
import numpy as np
import pytest
from av.video.codeccontext import VideoCodecContext

from freelook.color import i420_from_rgb, rgb24_from_rgb, rgb_from_picture
from freelook.errors import RenderError
from freelook.latency import draw_stamp, read_stamp
from freelook.media.annexb import nal_type, split_nals
from freelook.media.encoder import Encoder
from freelook.media.planes import picture_from_av
from freelook.types import ColorSpace, Frame, Picture

SIZE = (320, 192)
SPACES = [ColorSpace(), ColorSpace("bt601", full_range=True)]
PARAMETER_SETS = {"h264": {7, 8}, "hevc": {32, 33, 34}}


def scene(shift: float = 0.0) -> np.ndarray:
    y, x = np.mgrid[0 : SIZE[1], 0 : SIZE[0]]
    waves = (np.sin((x + shift) / 29), np.sin(y / 23), np.sin((x + y) / 41))
    return 0.5 + 0.4 * np.stack(waves, axis=-1)


def new_decoder(codec: str) -> VideoCodecContext:
    decoder = av.CodecContext.create(codec, "r")
    assert isinstance(decoder, VideoCodecContext)
    return decoder


def decode(codec: str, data: bytes) -> Picture:
    decoder = new_decoder(codec)
    packet = av.Packet(data)
    frames = [*decoder.decode(packet), *decoder.decode(None)]
    assert len(frames) == 1
    return picture_from_av(frames[0])


@pytest.mark.parametrize("codec", ["h264", "hevc"])
@pytest.mark.parametrize("color", SPACES)
def test_colours_survive_and_are_stated(codec: str, color: ColorSpace) -> None:
    picture = i420_from_rgb(scene(), color)
    (unit,) = Encoder(SIZE, codec=codec, bitrate=8_000_000, color=color).encode(Frame(picture, 5))
    decoded = decode(codec, unit.data)
    assert decoded.color == color
    error = rgb_from_picture(decoded) - rgb_from_picture(picture)
    assert 10 * np.log10(1 / np.mean(error**2)) > 35


@pytest.mark.parametrize("codec", ["h264", "hevc"])
def test_each_frame_comes_out_at_once_with_its_times(codec: str) -> None:
    encoder = Encoder(SIZE, codec=codec, fps=10)
    keys = []
    for index in range(25):
        frame = Frame(i420_from_rgb(scene(index), ColorSpace()), 1000 + index, 7 * index)
        (unit,) = encoder.encode(frame, key=index == 13)
        assert (unit.capture_ns, unit.media_ns) == (1000 + index, 7 * index)
        assert (unit.stream.codec, unit.stream.width, unit.stream.height) == (codec, *SIZE)
        kinds = {nal_type(codec, nal) for nal in split_nals(unit.data)}
        assert (kinds >= PARAMETER_SETS[codec]) == unit.key
        if unit.key:
            keys.append(index)
    assert keys == [0, 10, 13, 23]  # one a second, and where asked for


@pytest.mark.parametrize("codec", ["h264", "h265"])
def test_the_stamp_is_read_through_the_codec(codec: str) -> None:
    encoder = Encoder(SIZE, codec=codec, bitrate=300_000)
    decoder = new_decoder("h264" if codec == "h264" else "hevc")
    seen = []
    for index in range(12):
        picture = i420_from_rgb(scene(9 * index), ColorSpace())
        draw_stamp(picture.planes[0], index * 33_333_000)
        (unit,) = encoder.encode(Frame(picture, 0))
        for frame in decoder.decode(av.Packet(unit.data)):
            seen.append(read_stamp(picture_from_av(frame).planes[0]))
    assert len(seen) >= 9
    assert seen == [index * 33_333_000 for index in range(len(seen))]


def test_other_layouts_become_the_same_colours() -> None:
    rgb = np.full((SIZE[1], SIZE[0], 3), (0.7, 0.2, 0.4))
    for color in SPACES:
        i420 = i420_from_rgb(rgb, color)
        nv12 = Picture("nv12", (i420.planes[0], np.stack(i420.planes[1:], axis=-1)), color)
        for picture in (i420, nv12, rgb24_from_rgb(rgb)):
            (unit,) = Encoder(SIZE, color=color, bitrate=8_000_000).encode(Frame(picture, 0))
            decoded = rgb_from_picture(decode("h264", unit.data))
            assert decoded.mean(axis=(0, 1)) == pytest.approx((0.7, 0.2, 0.4), abs=0.02)


def test_what_cannot_be_encoded_is_refused() -> None:
    for size in ((321, 192), (320, 191), (8, 8)):
        with pytest.raises(RenderError, match="even"):
            Encoder(size)
    with pytest.raises(RenderError, match="known: h264, h265"):
        Encoder(SIZE, codec="vp8")
    with pytest.raises(RenderError, match="frames per second"):
        Encoder(SIZE, fps=0)
    small = Frame(i420_from_rgb(np.zeros((16, 16, 3)), ColorSpace()), 0)
    with pytest.raises(RenderError, match="320 x 192"):
        Encoder(SIZE).encode(small)
    other = Frame(i420_from_rgb(scene(), ColorSpace("bt601")), 0)
    with pytest.raises(RenderError, match="bt601"):
        Encoder(SIZE).encode(other)
