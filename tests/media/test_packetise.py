"""Packets go through our own depacketiser and come out as the same access units."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.media.annexb import ParameterSets, join_nals, split_nals
from freelook.media.depacketise import Depacketiser
from freelook.media.packetise import PAYLOAD_BYTES, Packetiser, describe
from freelook.media.rtp import HEADER, parse_packet
from freelook.media.sdp import parse_sdp
from freelook.types import Counters

HEADERS = {"h264": [b"\x67", b"\x68", b"\x65"], "hevc": [b"\x40\x01", b"\x42\x01", b"\x26\x01"]}
# sizes round those where a unit no longer fits one packet, or fills several to the last byte
SIZES = st.one_of(st.integers(1, 5000), st.sampled_from([1197, 1198, 1199, 1200, 1201, 2394, 2396]))


@pytest.mark.parametrize("codec", ["h264", "hevc"])
@given(sizes=st.lists(SIZES, min_size=1, max_size=6), sequence=st.integers(0, 0xFFFF))
def test_units_come_back_whole(codec: str, sizes: list[int], sequence: int) -> None:
    nals = [HEADERS[codec][-1] + b"\x91" * size for size in sizes]
    packets = Packetiser(codec, 77, sequence).packets(join_nals(nals), 0x1_0000_0005)
    depacketiser = Depacketiser(codec, ParameterSets(codec), Counters())
    out = []
    for number, datagram in enumerate(packets):
        packet = parse_packet(datagram, 0)
        assert packet is not None
        assert len(datagram) <= PAYLOAD_BYTES + HEADER.size
        assert (packet.sequence, packet.ssrc) == ((sequence + number) & 0xFFFF, 77)
        assert packet.marker == (number == len(packets) - 1)
        out += depacketiser.push(packet)
    (unit,) = out
    assert list(split_nals(unit.data)) == nals
    assert (unit.damaged, unit.timestamp) == (False, 5)


@pytest.mark.parametrize("codec", ["h264", "hevc"])
@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_the_description_is_understood(codec: str, host: str) -> None:
    found = parse_sdp(describe(codec, host, 5004))
    assert (found.codec, found.payload_type, found.port) == (codec, 96, 5004)
    assert found.address == host
