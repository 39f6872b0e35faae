from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.axes import AxisMap
from freelook.errors import TrackerError
from freelook.rotations import head_angles_deg
from freelook.trackers import open_tracker
from freelook.trackers.elrs import ORDERS, SET_PTR, MspDecoder, crc8_dvb_s2


def msp(function: int, payload: bytes, direction: bytes = b"<") -> bytes:
    body = struct.pack("<BHH", 0, function, len(payload)) + payload
    return b"$X" + direction + body + bytes([crc8_dvb_s2(body)])


def ptr(*channels: int) -> bytes:
    return msp(SET_PTR, struct.pack(f"<{len(channels)}H", *channels))


def decoder(order: str = "pan-tilt-roll", span_deg: float = 80.0) -> MspDecoder:
    return MspDecoder(AxisMap(), ORDERS[order], span_deg)


def angles(made: MspDecoder, data: bytes) -> list[object]:
    return [pytest.approx(head_angles_deg(r), abs=1e-9) for r in made.feed(data, 0)]


def test_checksum_is_dvb_s2() -> None:
    """The check value of CRC-8/DVB-S2 in the catalogue of parametrised CRC algorithms."""
    assert crc8_dvb_s2(b"123456789") == 0xBC


def test_a_frame_by_hand() -> None:
    """No flags, function 0x0383, six bytes, all channels at 992."""
    frame = bytes.fromhex("24583c0083030600e003e003e003")
    assert ptr(992, 992, 992)[:-1] == frame
    assert angles(decoder(), ptr(992, 992, 992)) == [(0, 0, 0)]


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        ("pan-tilt-roll", (30, 20, 10)),
        ("pan-roll-tilt", (30, 10, 20)),
        ("roll-tilt-pan", (10, 20, 30)),
    ],
)
def test_order_of_the_channels(order: str, expected: tuple[float, ...]) -> None:
    assert angles(decoder(order), ptr(1292, 1192, 1092)) == [expected]


def test_full_scale_is_the_span() -> None:
    assert angles(decoder(span_deg=45), ptr(1792, 192, 992)) == [(45, -45, 0)]


def test_skipped_channels_keep_their_value() -> None:
    made = decoder()
    data = ptr(1292, 1192, 1092) + ptr(0xFFFF, 992, 0xFFFF)
    assert angles(made, data) == [(30, 20, 10), (30, 0, 10)]
    made.begin()
    assert angles(made, ptr(0xFFFF, 1092, 0xFFFF)) == [(0, 10, 0)]


def test_more_than_three_channels() -> None:
    assert angles(decoder(), ptr(1292, 1192, 1092, 1, 2, 3)) == [(30, 20, 10)]


@pytest.mark.parametrize(
    ("data", "counted"),
    [
        (msp(0x030D, b"\1"), {"other": 1}),
        (msp(SET_PTR, bytes(5)), {"invalid": 1}),
        (msp(SET_PTR, bytes(7)), {"invalid": 1}),
        (ptr(992, 2048, 992), {"invalid": 1}),
        (ptr(992, 992, 992)[:-1] + b"\0", {"checksum": 1, "noise": 15}),
        (b"boot\r\n", {"noise": 6}),
        (b"$X<\0\x83\x03\xff\xff", {"noise": 8}),
    ],
)
def test_what_is_no_pose_is_counted(data: bytes, counted: dict[str, int]) -> None:
    made = decoder()
    assert made.feed(data, 0) == []
    assert {name: n for name, n in made.counters.values.items() if n} == counted


def test_it_finds_the_frames_in_noise() -> None:
    data = b"$$X" + ptr(1292, 992, 992) + b"$X<\0\x83\x03\x06" + ptr(992, 1192, 992)
    assert angles(decoder(), data + bytes(60)) == [(30, 0, 0), (0, 20, 0)]
    answer = msp(SET_PTR, struct.pack("<3H", 992, 992, 1092), b">")
    assert angles(decoder(), answer) == [(0, 0, 10)]


channel = st.integers(0, 65535)
frames = st.builds(ptr, channel, channel, channel)
damaged = st.sampled_from([b"$", b"$X", b"$X<\0\x83\x03\x06\0", b"$X<\0\0\0\x41\0"])


@given(st.lists(st.binary(max_size=40) | frames | damaged, max_size=10), st.data())
def test_any_bytes_cut_anywhere(pieces: list[bytes], data: st.DataObject) -> None:
    everything = b"".join(pieces)
    cut = data.draw(st.integers(0, len(everything)))
    whole, parts = decoder(), decoder()
    expected = len(whole.feed(everything, 0))
    found = len(parts.feed(everything[:cut], 0)) + len(parts.feed(everything[cut:], 0))
    assert found == expected
    nonzero = [{k: v for k, v in m.counters.values.items() if v} for m in (whole, parts)]
    assert nonzero[0] == nonzero[1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("order=pan-tilt", "order must be one of pan-tilt-roll, pan-roll-tilt, .* not 'pan-tilt'"),
        ("span=0", "span must be a number from 1 to 360"),
    ],
)
def test_options_are_checked(options: str, words: str) -> None:
    with pytest.raises(TrackerError, match=words):
        open_tracker(f"elrs:/dev/ttyUSB0?{options}")


def test_the_backpacks_own_baud_rate_is_the_default() -> None:
    tracker = open_tracker("elrs:/dev/ttyUSB0")
    tracker.close()
    assert tracker._baud == 460800  # type: ignore[attr-defined]
