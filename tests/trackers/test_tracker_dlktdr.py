from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.axes import AxisMap
from freelook.rotations import head_angles_deg
from freelook.trackers import open_tracker
from freelook.trackers.dlktdr import (
    ESCAPED,
    GREETING,
    HERE_EVERY_NS,
    ITEMS,
    LONGEST_FRAME,
    MOST_REPEATS,
    HeadTrackerDecoder,
    crc16_x25,
    frame,
)
from serial_device import SerialDevice


def board_says(text: str) -> bytes:
    """As the board does: the sum is not that of the text."""
    return b"\x02" + text.encode() + b"\x41\x42\x03\r\n"


def data_of(**items: object) -> bytes:
    return board_says(json.dumps({**items, "Cmd": "Data"}))


def pan_tilt_roll(pan: float, tilt: float, roll: float) -> bytes:
    return data_of(panoff=pan, tiltoff=tilt, rolloff=roll)


def angles(made: HeadTrackerDecoder, data: bytes) -> list[object]:
    return [pytest.approx(head_angles_deg(r), abs=1e-9) for r in made.feed(data, 0)]


def counted(made: HeadTrackerDecoder) -> dict[str, int]:
    return {name: n for name, n in made.counters.values.items() if n}


def test_checksum_is_x25() -> None:
    """The check value of CRC-16/IBM-SDLC (X.25) in the catalogue of parametrised CRC algorithms."""
    assert crc16_x25(b"123456789") == 0x906E


def test_commands_are_framed_json() -> None:
    made = frame("RD", panoff=True)
    assert made.startswith(b'\x02{"panoff":true,"Cmd":"RD"}')
    assert made.endswith(b"\x03\r\n")


@given(st.integers(0, 10**6))
def test_no_byte_of_a_checksum_looks_like_a_mark(number: int) -> None:
    made = frame("RD", n=number)
    assert made.count(b"\x02") == made.count(b"\x03") == 1
    assert not set(made[-5:-3]) & set(ESCAPED)


def test_angles_of_a_board() -> None:
    made = HeadTrackerDecoder(AxisMap())
    assert angles(made, pan_tilt_roll(30, 20, 10) + b"\x06\r\n") == [(30, 20, 10)]
    assert counted(made) == {}


def test_items_that_come_one_by_one() -> None:
    made = HeadTrackerDecoder(AxisMap())
    assert angles(made, data_of(panoff=30, tiltoff=20)) == []
    assert angles(made, data_of(rolloff=10.5)) == [(30, 20, 10.5)]
    assert angles(made, data_of(panoff=31, magx=3)) == [(31, 20, 10.5)]
    made.begin()
    assert angles(made, data_of(rolloff=10)) == []


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (board_says('{"Cmd":"FW","Vers":"2.2"}'), {"other": 1}),
        (data_of(magx=1), {"other": 1}),
        (board_says("{"), {"invalid": 1}),
        (board_says("[]"), {"invalid": 1}),
        (board_says("7"), {"invalid": 1}),
        (board_says('{"panoff":1}'), {"invalid": 1}),
        (board_says("[" * 3000), {"invalid": 1}),
        (data_of(panoff=float("nan"), tiltoff=0, rolloff=0), {"invalid": 1}),
        (data_of(panoff=float("inf"), tiltoff=0, rolloff=0), {"invalid": 1}),
        (data_of(panoff="1", tiltoff=0, rolloff=0), {"invalid": 1}),
        (data_of(panoff=True, tiltoff=0, rolloff=0), {"invalid": 1}),
        (data_of(panoff=10**400, tiltoff=0, rolloff=0), {"invalid": 1}),
        (b"\x02\x03", {"invalid": 1}),
        (b"\x02" + b"x" * (LONGEST_FRAME + 1), {"invalid": 1, "noise": LONGEST_FRAME + 1}),
        (b"HT: booting\r\n", {"noise": 11}),
        (b"\x15\r\n", {"refused": 1}),
    ],
)
def test_what_is_no_pose_is_counted(data: bytes, expected: dict[str, int]) -> None:
    made = HeadTrackerDecoder(AxisMap())
    assert made.feed(data, 0) == []
    assert counted(made) == expected


def test_a_frame_that_was_cut_off_by_the_next() -> None:
    made = HeadTrackerDecoder(AxisMap())
    assert angles(made, pan_tilt_roll(1, 2, 3)[:15] + pan_tilt_roll(4, 5, 6)) == [(4, 5, 6)]
    assert counted(made) == {"invalid": 1}


def test_it_says_that_it_is_here_every_8_seconds() -> None:
    made = HeadTrackerDecoder(AxisMap())
    assert made.begin() == GREETING
    said = [t_s for t_s in range(100, 130) if made.reply(t_s * 10**9) == frame("IH")]
    assert said == [108, 116, 124]
    assert HERE_EVERY_NS == 8 * 10**9


def test_what_was_refused_is_said_again_but_not_for_ever() -> None:
    made = HeadTrackerDecoder(AxisMap())
    made.begin()
    assert made.reply(0) == b""
    said = []
    for t_ns in range(20):
        made.feed(b"\x15", t_ns)
        said.append(made.reply(t_ns))
    assert said == [GREETING] * MOST_REPEATS + [b""] * (20 - MOST_REPEATS)


good = st.builds(pan_tilt_roll, *[st.floats(-180, 180)] * 3)
jsonish = st.dictionaries(st.sampled_from([*ITEMS, "Cmd"]), st.floats() | st.text() | st.none())
bad = jsonish.map(lambda d: board_says(json.dumps(d)))
marks = st.sampled_from([b"\x02", b"\x03", b"\x15", b"\x06", b"\x02{", b"\r\n"])


@given(st.lists(st.binary(max_size=40) | good | bad | marks, max_size=10), st.data())
def test_any_bytes_cut_anywhere(pieces: list[bytes], data: st.DataObject) -> None:
    everything = b"".join(pieces)
    cut = data.draw(st.integers(0, len(everything)))
    whole, parts = HeadTrackerDecoder(AxisMap()), HeadTrackerDecoder(AxisMap())
    expected = len(whole.feed(everything, 0))
    found = len(parts.feed(everything[:cut], 0)) + len(parts.feed(everything[cut:], 0))
    assert found == expected
    for name in ("invalid", "other", "refused"):
        assert parts.counters[name] == whole.counters[name]


def test_the_board_is_asked_when_the_port_opens(
    tmp_path: Path, wait_until: Callable[..., None]
) -> None:
    with SerialDevice(tmp_path) as device:
        device.repeat(pan_tilt_roll(30, 20, 10))
        tracker = open_tracker(f"dlktdr:{device.path}")
        try:
            pose = next(iter(tracker.poses()))
            wait_until(lambda: device.heard() == GREETING)
        finally:
            tracker.close()
    assert head_angles_deg(pose.body_from_view) == pytest.approx((30, 20, 10))
