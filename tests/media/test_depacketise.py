from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.media.annexb import ParameterSets, nal_type, split_nals
from freelook.media.depacketise import CodedPicture, Depacketiser, guess_codec
from freelook.media.rtp import RtpPacket, parse_packet
from freelook.types import Counters
from video_streams import GOP, rtp_datagrams

CODECS = ["h264", "hevc"]
PICTURES = 2 * GOP


def packets(codec: str, slices: int = 1) -> list[RtpPacket]:
    parsed = [parse_packet(d, i) for i, d in enumerate(rtp_datagrams(codec, slices))]
    return [p for p in parsed if p is not None]


def run(
    codec: str, stream: list[RtpPacket], sets: tuple[bytes, ...] = ()
) -> tuple[list[CodedPicture], Counters]:
    counters = Counters()
    depacketiser = Depacketiser(codec, ParameterSets(codec, sets), counters)
    out = [picture for packet in stream for picture in depacketiser.push(packet)]
    return out + depacketiser.flush(), counters


def make(
    payload: bytes, sequence: int = 0, *, timestamp: int = 1, marker: bool = False
) -> RtpPacket:
    return RtpPacket(sequence, timestamp, 1, 96, marker, payload, sequence)


@pytest.mark.parametrize("codec", CODECS)
def test_a_real_stream_comes_out_whole_on_the_marker(codec: str) -> None:
    stream = packets(codec)
    counters = Counters()
    depacketiser = Depacketiser(codec, ParameterSets(codec), counters)
    for packet in stream:
        assert len(depacketiser.push(packet)) == int(packet.marker)
    assert sum(p.marker for p in stream) == PICTURES
    assert len(stream) > 2 * PICTURES  # there were fragments to put together
    assert counters.values == {}


@pytest.mark.parametrize("codec", CODECS)
def test_key_pictures_are_known_and_carry_parameter_sets(codec: str) -> None:
    out, _ = run(codec, packets(codec))
    assert [i for i, picture in enumerate(out) if picture.key] == [0, GOP]
    wanted = {7, 8} if codec == "h264" else {32, 33, 34}
    for picture in out:
        kinds = {nal_type(codec, nal) for nal in split_nals(picture.data)}
        assert wanted <= kinds or not picture.key


@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize("slices", [1, 4])
def test_any_lost_packet_leaves_only_whole_nal_units(codec: str, slices: int) -> None:
    stream = packets(codec, slices)
    whole = {nal for picture in run(codec, stream)[0] for nal in split_nals(picture.data)}
    for lost in range(1, len(stream)):
        out, counters = run(codec, stream[:lost] + stream[lost + 1 :])
        assert {nal for picture in out for nal in split_nals(picture.data)} <= whole
        assert PICTURES - 1 <= len(out) <= PICTURES
        if stream[lost].timestamp != stream[-1].timestamp:  # else nothing comes that is damaged
            assert counters["damaged"] >= 1


def test_a_lost_slice_leaves_the_other_slices() -> None:
    stream = packets("h264", 4)
    inside = [i for i, p in enumerate(stream) if i and not p.marker and not stream[i - 1].marker]
    lost = next(i for i in inside if stream[i].payload[0] & 31 in (1, 28))
    out, _ = run("h264", stream[:lost] + stream[lost + 1 :])
    assert len(out) == PICTURES
    assert sum(picture.damaged for picture in out) == 1


def test_a_lost_marker_costs_no_picture() -> None:
    stream = packets("h264", 4)
    bare = [
        RtpPacket(p.sequence, p.timestamp, 1, 96, False, p.payload, p.arrival_ns) for p in stream
    ]
    out, counters = run("h264", bare)
    assert [p.data for p in out] == [p.data for p in run("h264", stream)[0]]
    assert counters["damaged"] == 0


def test_parameter_sets_from_sdp_go_in_front_of_bare_key_pictures() -> None:
    sps, pps = b"\x67\x42\0\x1e\xab", b"\x68\xce\x3c\x80"
    idr = make(b"\x65slice", marker=True)
    (picture,), _ = run("h264", [idr], (sps, pps))
    assert list(split_nals(picture.data)) == [sps, pps, b"\x65slice"]
    assert picture.key


def test_newer_parameter_sets_replace_older_ones() -> None:
    old, new, pps = b"\x67old", b"\x67new", b"\x68pps"
    stream = [make(new, 0), make(b"\x65one", 1, marker=True), make(b"\x65two", 2, marker=True)]
    out, _ = run("h264", stream, (old, pps))
    assert [list(split_nals(p.data)) for p in out] == [
        [pps, new, b"\x65one"],
        [new, pps, b"\x65two"],
    ]


def test_single_time_aggregation_packet() -> None:
    parts = [b"\x67sps", b"\x68pps", b"\x65slice"]
    body = b"".join(len(p).to_bytes(2, "big") + p for p in parts)
    (picture,), _ = run("h264", [make(b"\x78" + body, marker=True)])
    assert list(split_nals(picture.data)) == parts


def test_h265_aggregation_packet() -> None:
    parts = [b"\x40\1vps", b"\x42\1sps", b"\x44\1pps", b"\x26\1slice"]
    body = b"".join(len(p).to_bytes(2, "big") + p for p in parts)
    (picture,), _ = run("hevc", [make(b"\x60\1" + body, marker=True)])
    assert list(split_nals(picture.data)) == parts
    assert picture.key


@pytest.mark.parametrize(
    "payload",
    [
        b"\x78\0\7short",  # aggregate longer than the packet
        b"\x78\0\0",
        b"\x7c",  # fragment without its header
        b"\x00zero",
        b"\x7d\x80decoding order numbers",  # FU-B belongs to interleaved mode
        b"\xe5forbidden bit",
    ],
)
def test_payloads_that_make_no_sense_are_counted(payload: bytes) -> None:
    out, counters = run("h264", [make(payload, marker=True)])
    assert out == []
    assert counters.values == {"malformed": 1}


def test_a_recovery_point_is_a_key_picture() -> None:
    stream = [make(b"\x06\x05\x01x\x06\x01\x84\x80", 0), make(b"\x41slice", 1, marker=True)]
    (picture,), _ = run("h264", stream)
    assert picture.key


def test_an_endless_picture_is_thrown_away() -> None:
    chunk = b"\x41" + bytes(60000)
    stream = [make(chunk, i) for i in range(150)]
    out, counters = run("h264", [*stream, make(b"\x41next", 150, timestamp=2, marker=True)])
    assert [list(split_nals(p.data)) for p in out] == [[b"\x41next"]]
    assert counters.values == {"oversized": 1, "damaged": 1}


def test_marker_on_a_parameter_set_does_not_end_the_picture() -> None:
    stream = [make(b"\x67sps", 0, marker=True), make(b"\x65slice", 1, marker=True)]
    (picture,), _ = run("h264", stream)
    assert list(split_nals(picture.data)) == [b"\x67sps", b"\x65slice"]


@pytest.mark.parametrize("codec", CODECS)
def test_the_codec_is_guessed_right_or_not_at_all(codec: str) -> None:
    guesses = {guess_codec(p.payload) for p in packets(codec)}
    assert guesses - {None} == {codec}


@pytest.mark.parametrize("codec", CODECS)
@given(data=st.data())
def test_damaged_streams_never_raise(codec: str, data: st.DataObject) -> None:
    stream = packets(codec)[:40]
    for _ in range(data.draw(st.integers(1, 10))):
        at = data.draw(st.integers(0, len(stream) - 1))
        payload = bytearray(stream[at].payload)
        payload[data.draw(st.integers(0, min(len(payload) - 1, 3)))] = data.draw(
            st.integers(0, 255)
        )
        cut = data.draw(st.integers(1, len(payload)))
        stream[at] = make(
            bytes(payload[:cut]), data.draw(st.integers(0, 70)), marker=data.draw(st.booleans())
        )
    out, _ = run(codec, stream)
    assert all(list(split_nals(picture.data)) for picture in out)
