from __future__ import annotations

import wave
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import av
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.clock import FakeClock, now_ns
from freelook.errors import SourceError
from freelook.media.annexb import ParameterSets, split_nals
from freelook.media.decoder import Decoder
from freelook.sources import open_source
from freelook.types import AccessUnit
from video_streams import GOP, RATE, transport_stream, video_file

PICTURES = 2 * GOP


def read(path: Path) -> list[AccessUnit]:
    return list(open_source(str(path), pace=False, clock=FakeClock(5)).units())


def sound_file(path: Path) -> Path:
    with wave.open(str(path), "wb") as sound:
        sound.setnchannels(1)
        sound.setsampwidth(2)
        sound.setframerate(8000)
        sound.writeframes(bytes(16000))
    return path


@pytest.mark.parametrize("codec", ["h264", "hevc"])
@pytest.mark.parametrize("name", ["flight.mp4", "flight.mkv"])
def test_all_pictures_as_annex_b_with_parameter_sets(tmp_path: Path, codec: str, name: str) -> None:
    units = read(video_file(tmp_path, name, codec=codec))
    decoder = Decoder()
    assert sum(len(decoder.decode(unit)) for unit in units) == PICTURES
    assert [i for i, unit in enumerate(units) if unit.key] == [0, GOP]
    assert (units[0].stream.width, units[0].stream.height) == (320, 240)
    for unit in units:
        assert unit.data.startswith(b"\0\0\0\1")
        if unit.key:
            assert len(ParameterSets(codec, split_nals(unit.data)).nals) >= 2


def test_other_codecs_come_as_they_are(tmp_path: Path) -> None:
    units = read(video_file(tmp_path, "camera.avi", codec="mjpeg", count=3))
    assert [unit.stream.codec for unit in units] == ["mjpeg"] * 3
    assert sum(len(Decoder().decode(unit)) for unit in units) == 3


def test_times_follow_the_recording(tmp_path: Path) -> None:
    units = read(video_file(tmp_path))
    for i, unit in enumerate(units):
        assert unit.media_ns == pytest.approx(i * 1e9 / RATE, abs=1e5)
        assert unit.capture_ns == pytest.approx(5 + i * 1e9 / RATE, abs=1e6)


def test_pace_is_kept(tmp_path: Path) -> None:
    begin_ns = now_ns()
    units = list(open_source(str(video_file(tmp_path)), pace=True).units())
    took_ns = now_ns() - begin_ns
    assert took_ns >= (PICTURES - 1) * 1e9 / RATE
    assert units[-1].capture_ns <= begin_ns + took_ns


def test_a_late_reader_gets_no_burst(tmp_path: Path) -> None:
    clock = FakeClock()
    source = open_source(str(video_file(tmp_path)), pace=True, clock=clock)
    units = source.units()
    next(units)
    clock.advance_ms(10_000)
    late = next(units)
    assert late.capture_ns == 10_000_000_000
    assert source.counters["late"] == 1
    clock.advance_ms(34)
    assert next(units).capture_ns == pytest.approx(10_000_000_000 + 1e9 / RATE, abs=1e6)


def test_looping_continues_the_time(tmp_path: Path) -> None:
    path = video_file(tmp_path)
    source = open_source(str(path), loop=True, pace=False, clock=FakeClock())
    units = source.units()
    taken = [next(units) for _ in range(3 * PICTURES)]
    source.close()
    steps = [b.capture_ns - a.capture_ns for a, b in pairwise(taken)]
    assert min(steps) > 0.9e9 / RATE
    assert max(steps) < 1.1e9 / RATE
    assert [u.media_ns for u in taken[:PICTURES]] == [
        u.media_ns for u in taken[PICTURES:][:PICTURES]
    ]
    assert taken[PICTURES].key
    assert source.counters["loops"] == 2


def test_reordered_pictures_come_in_decoding_order(tmp_path: Path) -> None:
    options = {"bf": "3", "x264-params": "b-adapt=0"}
    units = read(video_file(tmp_path, options=options))
    media = [unit.media_ns or 0 for unit in units]
    assert media != sorted(media)
    capture = [unit.capture_ns for unit in units]
    assert capture == sorted(capture)
    decoder = Decoder()
    frames = [f for unit in units for f in decoder.decode(unit)] + decoder.flush()
    assert [f.media_ns for f in frames] == sorted(media)


def text(path: Path) -> None:
    path.write_text("This is not a film.\n" * 50)


def empty(path: Path) -> None:
    path.write_bytes(b"")


def folder(path: Path) -> None:
    path.mkdir()


def headless(path: Path) -> None:
    """The first half of a recording whose index comes last."""
    whole = video_file(path.parent, "whole.mp4").read_bytes()
    path.write_bytes(whole[: len(whole) // 2])


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (text, "not a video file"),
        (empty, "the file is empty"),
        (folder, "a folder"),
        (headless, "cut off before its index"),
        (lambda path: sound_file(path.with_suffix(".wav")).rename(path), "only audio"),
        (lambda path: None, "No such file"),
    ],
)
def test_what_is_no_video_is_refused_with_its_reason(
    tmp_path: Path, make: object, says: str
) -> None:
    path = tmp_path / "flight.mp4"
    assert callable(make)
    make(path)
    with pytest.raises(SourceError, match=says) as caught:
        open_source(str(path))
    assert not caught.value.retry
    assert "flight.mp4" in str(caught.value)


def test_a_text_file_is_no_picture(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    text(path)
    with pytest.raises(SourceError, match="no video"):
        open_source(str(path))


@pytest.mark.parametrize("name", ["flight.mkv", "flight.ts"])
def test_a_recording_cut_short_plays_as_far_as_it_goes(tmp_path: Path, name: str) -> None:
    whole = transport_stream("h264") if name == "flight.ts" else None
    path = tmp_path / name
    data = whole or video_file(tmp_path, name).read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])
    units = read(path)
    assert 4 < len(units) < PICTURES
    decoder = Decoder()
    assert sum(len(decoder.decode(unit)) for unit in units) >= len(units) - 1


@pytest.fixture(scope="module")
def streamable(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A recording whose index comes first."""
    folder = tmp_path_factory.mktemp("whole")
    return video_file(folder, container_options={"movflags": "faststart"}).read_bytes()


def test_one_damaged_picture_is_left_out(tmp_path: Path, streamable: bytes) -> None:
    path = tmp_path / "flight.mp4"
    path.write_bytes(streamable)
    with av.open(str(path)) as container:
        positions = [packet.pos for packet in container.demux(video=0) if packet.size]
    broken = bytearray(streamable)
    broken[positions[5] or 0] = 0x7F  # the length of its first NAL unit
    path.write_bytes(broken)
    source = open_source(str(path), pace=False)
    assert len(list(source.units())) == PICTURES - 1
    assert source.counters["damaged"] == 1


def test_a_recording_of_nothing_does_not_loop_for_ever(tmp_path: Path, streamable: bytes) -> None:
    path = tmp_path / "flight.mp4"
    path.write_bytes(streamable[: streamable.index(b"mdat") + 20])
    with pytest.raises(SourceError, match="not one picture"):
        list(open_source(str(path), loop=True, pace=False).units())


@given(data=st.data())
def test_a_damaged_recording_ends_or_says_so(
    tmp_path_factory: pytest.TempPathFactory, streamable: bytes, data: st.DataObject
) -> None:
    path = tmp_path_factory.mktemp("damaged") / "flight.mp4"
    broken = bytearray(streamable)
    for _ in range(data.draw(st.integers(1, 10))):
        broken[data.draw(st.integers(0, len(broken) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(bytes(broken[: data.draw(st.integers(len(broken) // 2, len(broken)))]))
    decoder = Decoder()
    with suppress(SourceError):
        for unit in read(path):
            decoder.decode(unit)
    decoder.flush()


@pytest.mark.data
def test_the_real_fisheye_recording(shared_data: Path) -> None:
    """Its first stream is sound, its rate varies, and time stamps repeat and run backward."""
    units = read(shared_data / "lilyth_video" / "cam2.mp4")
    assert len(units) == 269
    assert (units[0].stream.codec, units[0].stream.width) == ("h264", 1440)
    times = [unit.capture_ns for unit in units]
    assert times == sorted(times)
    assert times[-1] - times[0] == pytest.approx(18e9, rel=0.05)
    assert len({unit.media_ns for unit in units}) > 200
    assert units[0].key
    decoder = Decoder()
    frames = [frame for unit in units for frame in decoder.decode(unit)]
    assert len(frames) == 269
    assert frames[0].picture.color.full_range


@pytest.mark.data
def test_the_real_recording_with_four_other_streams(shared_data: Path) -> None:
    units = read(shared_data / "gopro_karma" / "karma.mp4")
    assert len(units) == 362
    assert units[-1].capture_ns - units[0].capture_ns == pytest.approx(12e9, rel=0.05)
