from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.media.decoder import Decoder
from freelook.media.mpegts import PACKET_BYTES, TransportStream, crc32
from freelook.types import AccessUnit, Counters
from video_streams import GOP, transport_stream

CODECS = ["h264", "hevc"]
PICTURES = 2 * GOP
DATAGRAM = 7 * PACKET_BYTES


def datagrams(data: bytes, size: int = DATAGRAM) -> list[bytes]:
    return [data[i : i + size] for i in range(0, len(data), size)]


def receive(pieces: list[bytes]) -> tuple[list[AccessUnit], Counters]:
    counters = Counters()
    stream = TransportStream(counters)
    return [unit for i, piece in enumerate(pieces) for unit in stream.push(piece, i)], counters


def frames(units: list[AccessUnit]) -> int:
    decoder = Decoder()
    return sum(len(decoder.decode(unit)) for unit in units) + len(decoder.flush())


@pytest.mark.parametrize("codec", CODECS)
def test_every_picture_comes_out_with_its_own_last_packet(codec: str) -> None:
    units, counters = receive(datagrams(transport_stream(codec)))
    # not one is kept back for the next to begin, but for one in 184 that needs no stuffing
    assert PICTURES - 1 <= len(units) <= PICTURES
    assert frames(units) == len(units)
    assert [i for i, u in enumerate(units) if u.key] == [0, GOP]
    assert (units[0].stream.codec, units[0].stream.width, units[0].stream.height) == (
        codec,
        320,
        240,
    )
    assert set(counters.values) == {"packets"}


@pytest.mark.parametrize("size", [1, 100, 187, 189, 4096])
def test_pieces_of_any_size_give_the_same_units(size: int) -> None:
    data = transport_stream("h264")
    whole, _ = receive([data])
    pieces, _ = receive(datagrams(data, size))
    assert [u.data for u in pieces] == [u.data for u in whole]


def test_it_finds_its_feet_in_the_middle_of_a_packet() -> None:
    units, counters = receive([b"noise" + transport_stream("h264")])
    assert len(units) >= PICTURES - 1
    assert counters["malformed"] >= 1


@pytest.mark.parametrize("codec", CODECS)
def test_a_lost_datagram_costs_the_pictures_in_it_and_no_more(codec: str) -> None:
    pieces = datagrams(transport_stream(codec))
    whole = {u.data for u in receive(pieces)[0]}
    for lost in range(1, len(pieces) - 1):
        units, counters = receive(pieces[:lost] + pieces[lost + 1 :])
        assert {u.data for u in units} <= whole
        assert counters["lost"] > 0


def test_a_sender_that_stuffs_anywhere_is_understood_after_one_picture() -> None:
    data = transport_stream("h264")
    packets = [data[i : i + PACKET_BYTES] for i in range(0, len(data), PACKET_BYTES)]
    stuffed = b"".join(split_with_stuffing(packets))
    units, counters = receive(datagrams(stuffed))
    whole = [u.data for u in receive([data])[0]]
    assert counters["damaged"] == 1
    assert set(whole[1:-1]) <= {u.data for u in units}


def split_with_stuffing(packets: list[bytes]) -> list[bytes]:
    """The same stream with each plain video packet sent as two that are half stuffing."""
    out: list[bytes] = []
    count = 0
    for packet in packets:
        pid = int.from_bytes(packet[1:3], "big") & 0x1FFF
        if pid != 256 or not packet[3] & 0x10:
            out.append(packet)
            continue
        parts = [packet]
        if not packet[3] & 0x20:  # no adaptation field yet
            body = packet[4:]
            parts = [
                packet[:1] + bytes([packet[1] & 0xBF | (packet[1] & 0x40 if first else 0)])
                + packet[2:3] + bytes([0x30, 91, 0]) + b"\xff" * 90 + half
                for first, half in ((True, body[:92]), (False, body[92:]))
            ]  # fmt: skip
        for part in parts:
            out.append(part[:3] + bytes([part[3] & 0xF0 | count]) + part[4:])
            count = (count + 1) & 15
    assert all(len(part) == PACKET_BYTES for part in out)
    return out


def test_a_stream_without_video_says_so() -> None:
    section = bytes([0, 0xB0, 13, 0, 1, 0xC1, 0, 0, 0, 1, 0xE1, 0])
    programs = table(0, section)
    audio = bytes([2, 0xB0, 18, 0, 1, 0xC1, 0, 0, 0xE1, 1, 0xF0, 0, 0x0F, 0xE1, 1, 0xF0, 0])
    counters = Counters()
    stream = TransportStream(counters)
    assert stream.push(programs + table(0x100, audio), 0) == []
    assert stream.problem is not None
    assert "0x0f" in stream.problem


def test_damaged_tables_are_refused() -> None:
    section = bytes([0, 0xB0, 13, 0, 1, 0xC1, 0, 0, 0, 1, 0xE1, 0])
    good = table(0, section)
    for at in range(6, 17):
        broken = good[:at] + bytes([good[at] ^ 1]) + good[at + 1 :]
        counters = Counters()
        TransportStream(counters).push(broken, 0)
        assert counters["malformed"] == 1


def table(pid: int, section: bytes) -> bytes:
    section += crc32(section).to_bytes(4, "big")
    assert crc32(section) == 0
    packet = bytes([0x47, 0x40 | pid >> 8, pid & 255, 0x10, 0]) + section
    return packet.ljust(PACKET_BYTES, b"\xff")


@given(st.lists(st.binary(max_size=400), max_size=20))
def test_random_bytes_never_raise(pieces: list[bytes]) -> None:
    receive(pieces)
    receive([b"\x47" + piece.ljust(187, b"\0")[:187] for piece in pieces])


@pytest.mark.parametrize("codec", CODECS)
@given(data=st.data())
def test_mutated_streams_never_raise(codec: str, data: st.DataObject) -> None:
    broken = bytearray(transport_stream(codec)[: 40 * PACKET_BYTES])
    for _ in range(data.draw(st.integers(1, 20))):
        packet = data.draw(st.integers(0, 39)) * PACKET_BYTES
        broken[packet + data.draw(st.integers(0, 30))] = data.draw(st.integers(0, 255))
    units, _ = receive(datagrams(bytes(broken)))
    decoder = Decoder()
    for unit in units:
        decoder.decode(unit)
