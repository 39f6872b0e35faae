from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.media.decoder import Decoder
from freelook.media.rtp_video import RtpVideo
from freelook.types import AccessUnit, Counters
from video_streams import GOP, rtp_datagrams, with_sequence, with_ssrc

MS = 1_000_000
CODECS = ["h264", "hevc"]
PICTURES = 2 * GOP


def receive(
    datagrams: list[bytes], video: RtpVideo, *, start_ns: int = 0, step_ns: int = MS
) -> list[AccessUnit]:
    units = []
    for i, datagram in enumerate(datagrams):
        units += video.push(datagram, start_ns + i * step_ns)
    return units


def frames(units: list[AccessUnit]) -> int:
    decoder = Decoder()
    return sum(len(decoder.decode(unit)) for unit in units) + len(decoder.flush())


@pytest.mark.parametrize("codec", CODECS)
def test_a_real_stream_decodes_without_being_told_anything(codec: str) -> None:
    counters = Counters()
    units = receive(list(rtp_datagrams(codec)), RtpVideo(counters))
    assert len(units) == frames(units) == PICTURES
    assert units[0].key
    assert (units[-1].stream.codec, units[-1].stream.width, units[-1].stream.height) == (
        codec,
        160,
        120,
    )
    assert counters["packets"] == len(rtp_datagrams(codec))


@pytest.mark.parametrize("codec", CODECS)
def test_a_unit_is_stamped_with_its_first_packet(codec: str) -> None:
    datagrams = rtp_datagrams(codec)
    units = receive(list(datagrams), RtpVideo(Counters()))
    begins = [0] + [i + 1 for i, d in enumerate(datagrams) if d[1] & 0x80]
    assert [unit.capture_ns for unit in units] == [i * MS for i in begins[:-1]]


@pytest.mark.parametrize("codec", CODECS)
def test_disorder_and_repetition_change_nothing(codec: str) -> None:
    datagrams = list(rtp_datagrams(codec))
    chance = random.Random(5)
    order = sorted(range(1, len(datagrams)), key=lambda i: i + chance.random() * 4)
    disordered = [datagrams[0]]
    for i in order:
        disordered += [datagrams[i]] * (2 if i % 7 == 0 else 1)
    counters = Counters()
    units = receive(disordered, RtpVideo(counters), step_ns=MS // 10)
    assert [u.data for u in units] == [u.data for u in receive(datagrams, RtpVideo(Counters()))]
    assert counters["reordered"] > 0
    assert counters["duplicate"] == sum(1 for i in order if i % 7 == 0)
    assert counters["lost"] == 0


@pytest.mark.parametrize("codec", CODECS)
@pytest.mark.parametrize("percent", [1, 5, 20])
def test_loss_is_counted_and_the_picture_comes_back(codec: str, percent: int) -> None:
    datagrams = list(rtp_datagrams(codec))
    ends = [i for i, d in enumerate(datagrams) if d[1] & 0x80]
    second_group = ends[GOP - 1] + 1
    chance = random.Random(percent)
    kept = [d for d in datagrams[1:second_group] if chance.random() * 100 >= percent]
    kept = [datagrams[0], *kept, *datagrams[second_group:]]
    counters = Counters()
    units = receive(kept, RtpVideo(counters))
    assert counters["lost"] == len(datagrams) - len(kept) > 0
    assert GOP <= len(units) <= PICTURES
    assert frames(units) >= GOP


def _units_of(datagrams: list[bytes], codec: str) -> list[AccessUnit]:
    return receive(datagrams, RtpVideo(Counters(), codec=codec))


def test_a_restarted_sender_is_followed_after_a_silence() -> None:
    first = list(rtp_datagrams("h264"))
    again = [with_ssrc(with_sequence(d, 777 + i), 0xABCD) for i, d in enumerate(first)]
    counters = Counters()
    video = RtpVideo(counters)
    units = receive(first, video) + receive(again, video, start_ns=10**10)
    assert len(units) == 2 * PICTURES
    assert counters["restarts"] == 1
    assert counters["lost"] == counters["foreign"] == 0


def test_a_restarted_sender_may_have_changed_its_codec() -> None:
    video = RtpVideo(Counters())
    units = receive(list(rtp_datagrams("h264")), video)
    later = [with_ssrc(d, 0xABCD) for d in rtp_datagrams("hevc")]
    units += receive(later, video, start_ns=10**10)
    assert [u.stream.codec for u in units] == ["h264"] * PICTURES + ["hevc"] * PICTURES
    assert frames(units) == 2 * PICTURES


def test_two_senders_do_not_mix() -> None:
    mine = list(rtp_datagrams("h264"))
    other = [with_ssrc(d, 0xABCD) for d in mine]
    mixed = [d for pair in zip(mine, other, strict=True) for d in pair]
    counters = Counters()
    units = receive(mixed, RtpVideo(counters))
    assert [u.data for u in units] == [u.data for u in _units_of(mine, "h264")]
    assert counters["foreign"] == len(other)


def test_other_payload_types_are_counted_not_mixed_in() -> None:
    datagrams = list(rtp_datagrams("h264"))
    audio = [d[:1] + bytes([d[1] & 0x80 | 97]) + d[2:] for d in datagrams]
    counters = Counters()
    video = RtpVideo(counters, codec="h264", payload_type=96)
    assert receive(audio, video) == []
    assert len(receive(datagrams, video)) == PICTURES
    assert counters["foreign"] == len(audio)


@given(st.lists(st.binary(max_size=80), max_size=50))
def test_random_datagrams_never_raise(datagrams: list[bytes]) -> None:
    video = RtpVideo(Counters())
    decoder = Decoder()
    for unit in receive(datagrams, video):
        decoder.decode(unit)
    video.expire(10**12)


@pytest.mark.parametrize("codec", CODECS)
@given(data=st.data())
def test_mutated_streams_never_raise_and_decode_or_count(codec: str, data: st.DataObject) -> None:
    datagrams = list(rtp_datagrams(codec))
    for _ in range(data.draw(st.integers(1, 12))):
        at = data.draw(st.integers(0, len(datagrams) - 1))
        broken = bytearray(datagrams[at])
        for _ in range(data.draw(st.integers(1, 8))):
            broken[data.draw(st.integers(0, len(broken) - 1))] = data.draw(st.integers(0, 255))
        datagrams[at] = bytes(broken[: data.draw(st.integers(1, len(broken)))])
    counters = Counters()
    video = RtpVideo(counters)
    decoder = Decoder()
    for unit in receive(datagrams, video) + video.expire(10**12):
        decoder.decode(unit)
    decoder.flush()
    assert counters["packets"] + counters["malformed"] >= len(datagrams)
