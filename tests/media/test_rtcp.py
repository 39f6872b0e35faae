"""What receivers of RTP ask for."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.media.rtcp import asks_for_key

REPORT = bytes.fromhex("80c9000100000001")  # an empty receiver report
PLI = bytes.fromhex("81ce00020000000100000002")
FIR = bytes.fromhex("84ce00040000000100000000000000020100 0000".replace(" ", ""))
OLD_FIR = bytes.fromhex("80c0000100000001")
OTHER_FEEDBACK = bytes.fromhex("8fce00020000000100000002")  # an application's own
LOST_PACKETS = bytes.fromhex("81cd0003000000010000000200050000")


@pytest.mark.parametrize("asking", [PLI, FIR, OLD_FIR])
def test_key_pictures_are_asked_for(asking: bytes) -> None:
    assert asks_for_key(asking)
    assert asks_for_key(REPORT + asking)


@pytest.mark.parametrize(
    "other", [b"", b"\x81", REPORT, OTHER_FEEDBACK, LOST_PACKETS, bytes([1]) + PLI[1:]]
)
def test_nothing_else_asks(other: bytes) -> None:
    assert not asks_for_key(other)


@given(st.binary(max_size=60))
def test_any_bytes_are_survived(data: bytes) -> None:
    assert asks_for_key(data) in (True, False)
