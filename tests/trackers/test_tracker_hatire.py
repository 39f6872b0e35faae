from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.errors import TrackerError
from freelook.rotations import head_angles_deg
from freelook.trackers import open_tracker
from freelook.trackers.hatire import AXES, HatireDecoder


def frame(yaw: float, roll: float, pitch: float, code: int = 7, endian: str = "<") -> bytes:
    floats = (yaw, roll, pitch, 1.0, 2.0, 3.0)
    return struct.pack(f"{endian}HH6fH", 0xAAAA, code, *floats, 0x5555)


def angles(made: HatireDecoder, data: bytes) -> list[object]:
    found = made.feed(data, 0)
    return [pytest.approx(head_angles_deg(rotation), abs=1e-4) for rotation in found]


def test_a_frame_has_30_bytes_and_yaw_roll_pitch() -> None:
    """Roll is OpenTrack's: + left ear down."""
    assert len(frame(0, 0, 0)) == 30
    assert angles(HatireDecoder(AXES), frame(30, -10, 20)) == [(30, 20, 10)]


def test_big_endian() -> None:
    assert angles(HatireDecoder(AXES, ">"), frame(30, -10, 20, endian=">")) == [(30, 20, 10)]


@pytest.mark.parametrize(
    ("code", "counted"),
    [(0, None), (1000, None), (1001, "info"), (2000, "info"), (8999, "info"), (9000, "errors")],
)
def test_codes(code: int, counted: str | None) -> None:
    made = HatireDecoder(AXES)
    assert len(made.feed(frame(1, 2, 3, code), 0)) == (counted is None)
    assert counted is None or made.counters[counted] == 1


def test_it_finds_the_frames_in_noise() -> None:
    made = HatireDecoder(AXES)
    data = b"\xaa" + frame(1, 0, 0) + b"Hello\xaa\xaa\xaa" + frame(2, 0, 0)[:20] + frame(3, 0, 0)
    assert angles(made, data) == [(1, 0, 0), (3, 0, 0)]
    assert made.counters["noise"] == 1 + 5 + 3 + 20


@pytest.mark.parametrize("bad", [math.nan, math.inf, 1e20])
def test_angles_that_are_none_are_counted(bad: float) -> None:
    made = HatireDecoder(AXES)
    assert made.feed(frame(0, bad, 0), 0) == []
    assert made.counters["invalid"] == 1


def test_half_a_frame_is_forgotten_when_the_port_was_opened_again() -> None:
    made = HatireDecoder(AXES, start=b"S")
    made.feed(frame(1, 0, 0)[:20], 0)
    assert made.begin() == b"S"
    assert made.feed(frame(1, 0, 0)[20:], 0) == []


floats = st.floats(width=32)
frames = st.builds(frame, floats, floats, floats, st.integers(0, 65535))
damaged = st.sampled_from([b"\xaa", b"\xaa\xaa", b"\x55\x55", b"\xaa" * 31])


@given(st.lists(st.binary(max_size=40) | frames | damaged, max_size=10), st.data())
def test_any_bytes_cut_anywhere(pieces: list[bytes], data: st.DataObject) -> None:
    everything = b"".join(pieces)
    cut = data.draw(st.integers(0, len(everything)))
    whole, parts = HatireDecoder(AXES), HatireDecoder(AXES)
    expected = len(whole.feed(everything, 0))
    found = len(parts.feed(everything[:cut], 0)) + len(parts.feed(everything[cut:], 0))
    assert found == expected
    assert parts.counters == whole.counters
    used = whole.counters["noise"] + 30 * (
        expected + sum(whole.counters[name] for name in ("info", "errors", "invalid"))
    )
    assert len(everything) - used in range(30)  # what is kept is less than a frame


@pytest.mark.parametrize(
    ("options", "words"),
    [("endian=middle", "one of little, big"), ("start=ü", "start must be plain ASCII")],
)
def test_options_are_checked(options: str, words: str) -> None:
    with pytest.raises(TrackerError, match=words):
        open_tracker(f"hatire:/dev/ttyUSB0?{options}")
