from __future__ import annotations

import io

import av
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.errors import SourceError
from freelook.media.annexb import is_key, split_nals
from freelook.media.decoder import Decoder
from freelook.types import AccessUnit, StreamInfo
from video_streams import GOP, elementary_stream, pictures, write

CODECS = ["h264", "hevc"]
PICTURES = 2 * GOP


def packets(codec: str, data: bytes) -> list[bytes]:
    """The pictures that FFmpeg's parser finds in a byte stream."""
    with av.open(io.BytesIO(data), "r", format=codec) as container:
        return [bytes(p) for p in container.demux(video=0) if p.size]


def units(codec: str) -> list[AccessUnit]:
    """Real pictures, stamped 1000, 2000, ..."""
    stream = StreamInfo(codec)
    return [
        AccessUnit(stream, p, is_key(codec, list(split_nals(p))), 1000 * (i + 1), i)
        for i, p in enumerate(packets(codec, elementary_stream(codec)))
    ]


@pytest.mark.parametrize("codec", CODECS)
def test_each_unit_gives_its_own_frame_at_once(codec: str) -> None:
    decoder = Decoder()
    for unit in units(codec):
        (frame,) = decoder.decode(unit)
        assert (frame.capture_ns, frame.media_ns) == (unit.capture_ns, unit.media_ns)
        assert frame.picture.size == (320, 240)
    assert decoder.flush() == []
    assert decoder.counters.values == {"decoded": PICTURES}


@pytest.mark.parametrize("codec", CODECS)
def test_the_pictures_are_the_ones_that_were_encoded(codec: str) -> None:
    decoder = Decoder()
    decoded = [frame for unit in units(codec) for frame in decoder.decode(unit)]
    for frame, sent in zip(decoded, pictures(PICTURES, (320, 240)), strict=True):
        truth = sent.to_ndarray()[:240].astype(float)
        error = frame.picture.planes[0].astype(float) - truth
        assert np.sqrt(np.mean(error**2)) < 25  # a neighbour in time differs by more than 60


def test_frame_threads_give_the_same_pictures_later() -> None:
    live, offline = Decoder(), Decoder(low_delay=False)
    first = [f.media_ns for u in units("h264") for f in live.decode(u)]
    second = [f.media_ns for u in units("h264") for f in offline.decode(u)]
    second += [f.media_ns for f in offline.flush()]
    assert first == second


@pytest.mark.parametrize("codec", CODECS)
def test_joining_in_the_middle_waits_for_a_key(codec: str) -> None:
    decoder = Decoder()
    frames = [f for unit in units(codec)[3:] for f in decoder.decode(unit)]
    assert frames[0].media_ns == GOP
    missed = decoder.counters["waiting_for_key"] + decoder.counters["undecodable"]
    assert missed == GOP - 3


def test_capture_times_never_run_backward() -> None:
    decoder = Decoder()
    stream = StreamInfo("h264")
    times = [50, 40, 60, 60, 10]
    stamped = [
        AccessUnit(stream, u.data, u.key, t) for u, t in zip(units("h264"), times, strict=False)
    ]
    got = [f.capture_ns for unit in stamped for f in decoder.decode(unit)]
    assert got == [50, 50, 60, 60, 60]


@pytest.mark.parametrize("codec", CODECS)
def test_truncated_units_are_counted_and_decoding_goes_on(codec: str) -> None:
    decoder = Decoder()
    whole = units(codec)
    for i, unit in enumerate(whole[:GOP]):
        cut = unit.data[: len(unit.data) * i // GOP]
        decoder.decode(AccessUnit(unit.stream, cut, unit.key, unit.capture_ns))
    assert decoder.counters["undecodable"] > 0
    frames = [f for unit in whole[GOP:] for f in decoder.decode(unit)]
    assert len(frames) >= GOP


@pytest.mark.parametrize("codec", [*CODECS, "mjpeg"])
@given(st.binary(max_size=400))
def test_garbage_never_raises(codec: str, data: bytes) -> None:
    decoder = Decoder()
    for garbage in (data, b"\0\0\1" + data, b"\0\0\0\1\x67" + data, b"\0\0\0\1\x42\1" + data):
        decoder.decode(AccessUnit(StreamInfo(codec), garbage, True, 0))
    decoder.flush()


@pytest.mark.parametrize("codec", CODECS)
@given(data=st.data())
def test_flipped_bytes_never_raise(codec: str, data: st.DataObject) -> None:
    decoder = Decoder()
    for unit in units(codec)[:4]:
        broken = bytearray(unit.data)
        for _ in range(data.draw(st.integers(0, 6))):
            broken[data.draw(st.integers(0, len(broken) - 1))] ^= data.draw(st.integers(1, 255))
        decoder.decode(AccessUnit(unit.stream, bytes(broken), unit.key, unit.capture_ns))
    decoder.flush()


def test_a_change_of_codec_or_size_is_followed() -> None:
    decoder = Decoder()
    target = io.BytesIO()
    write(target, "h264", codec="h264", size=(160, 120), count=3)
    small = packets("h264", target.getvalue())
    sizes = []
    for codec, some in (("h264", units("h264")[:3]), ("hevc", units("hevc")[:3])):
        sizes += [f.picture.size for u in some for f in decoder.decode(u)]
        assert codec == some[0].stream.codec
    for data in small:
        unit = AccessUnit(StreamInfo("h264"), data, True, 0)
        sizes += [f.picture.size for f in decoder.decode(unit)]
    assert sizes == [(320, 240)] * 6 + [(160, 120)] * 3


def test_raw_video_needs_the_size_of_its_stream() -> None:
    raw = StreamInfo("rawvideo", 4, 2, "gray")
    (frame,) = Decoder().decode(AccessUnit(raw, bytes(range(8)), True, 7))
    assert frame.picture.planes[0].tolist() == [[0, 1, 2, 3], [4, 5, 6, 7]]
    decoder = Decoder()
    assert decoder.decode(AccessUnit(raw, b"short", True, 7)) == []
    assert decoder.counters["undecodable"] == 1


def test_a_codec_nobody_knows() -> None:
    with pytest.raises(SourceError, match="no decoder for 'nonsense'"):
        Decoder().decode(AccessUnit(StreamInfo("nonsense"), b"x", True, 0))
