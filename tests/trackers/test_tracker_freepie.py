from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.axes import AxisMap
from freelook.errors import TrackerError
from freelook.rotations import head_angles_deg
from freelook.trackers import open_tracker
from freelook.trackers.freepie import parse_packet
from freelook.types import Counters

ANGLES = tuple(math.radians(a) for a in (30, -20, 10))
RAW = tuple(range(100, 109))


def parsed(datagram: bytes) -> tuple[object, dict[str, int]]:
    counters = Counters()
    rotation = parse_packet(datagram, AxisMap(), counters)
    angles = None if rotation is None else pytest.approx(head_angles_deg(rotation), abs=1e-4)
    return angles, counters.values


@pytest.mark.parametrize(
    "datagram",
    [
        struct.pack("<BB12f", 0, 2, *ANGLES, *RAW),
        struct.pack("<BB12f", 0, 3, *RAW, *ANGLES),
        struct.pack("<BB12f", 77, 0xFE, *ANGLES, *RAW),
        struct.pack("<BB3f", 0, 2, *ANGLES),
    ],
    ids=["orientation", "raw and orientation", "unknown flags", "nothing behind"],
)
def test_where_the_orientation_stands(datagram: bytes) -> None:
    assert parsed(datagram) == ((30, -20, 10), {})


@pytest.mark.parametrize(
    ("datagram", "counted"),
    [
        (b"", "short"),
        (b"\0", "short"),
        (struct.pack("<BB12f", 0, 2, *ANGLES, *RAW)[:13], "short"),
        (struct.pack("<BB12f", 0, 3, *RAW, *ANGLES)[:-1], "short"),
        (struct.pack("<BB12f", 0, 1, *RAW, *ANGLES), "raw"),
        (struct.pack("<BB12f", 0, 0, *RAW, *ANGLES), "invalid"),
        (struct.pack("<BB3f", 0, 2, math.nan, 0, 0), "invalid"),
        (struct.pack("<BB3f", 0, 2, 0, math.inf, 0), "invalid"),
        (struct.pack("<BB3f", 0, 2, 0, 0, 1e30), "invalid"),
    ],
)
def test_what_is_no_pose_is_counted(datagram: bytes, counted: str) -> None:
    assert parsed(datagram) == (None, {counted: 1})


@given(st.binary(max_size=60) | st.binary(min_size=48).map(lambda b: b"\0\2" + b))
def test_any_datagram_is_a_pose_or_counted(datagram: bytes) -> None:
    angles, counted = parsed(datagram)
    assert (angles is None) == (sum(counted.values()) == 1)


def test_bad_addresses_name_the_usual_port() -> None:
    with pytest.raises(TrackerError, match="for example 5555"):
        open_tracker("freepie:x")
