from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freelook.axes import AxisMap
from freelook.errors import TrackerError
from freelook.rotations import head_angles_deg
from freelook.trackers import open_tracker
from freelook.trackers.osc import messages, parse_packet
from freelook.types import Counters


def padded(text: str) -> bytes:
    data = text.encode() + b"\0"
    return data + bytes(-len(data) % 4)


def message(address: str, tags: str, *values: float) -> bytes:
    return padded(address) + padded("," + tags) + struct.pack(">" + tags, *values)


def bundle(*elements: bytes) -> bytes:
    sized = b"".join(struct.pack(">I", len(e)) + e for e in elements)
    return b"#bundle\0" + bytes(8) + sized


def opentracks_quaternion(yaw: float, pitch: float, roll: float) -> list[float]:
    """What Qt's fromEulerAngles(pitch, yaw, -roll) makes of OpenTrack's angles: about z first,
    then x, then y, all fixed; (w, x, y, z)."""
    turned = Rotation.from_euler("zxy", [-roll, pitch, yaw], degrees=True)
    x, y, z, w = turned.as_quat()
    return [w, x, y, z]


def parsed(datagram: bytes) -> tuple[object, dict[str, int]]:
    counters = Counters()
    rotation = parse_packet(datagram, "/bridge/quat", AxisMap(), counters)
    angles = None if rotation is None else pytest.approx(head_angles_deg(rotation), abs=1e-4)
    return angles, counters.values


# of the roll's sign: OpenTrack's + is left ear down
@pytest.mark.parametrize("angles", [(30, 20, -10), (0, 0, 0), (170, -80, 33)])
def test_opentracks_quaternion_is_the_head_it_came_from(angles: tuple[float, float, float]) -> None:
    yaw, pitch, roll = angles
    packet = message("/bridge/quat", "ffff", *opentracks_quaternion(yaw, pitch, roll))
    assert parsed(packet) == ((yaw, pitch, -roll), {})


def test_doubles_and_angles() -> None:
    assert parsed(message("/bridge/quat", "dddd", 1, 0, 0, 0)) == ((0, 0, 0), {})
    assert parsed(message("/bridge/quat", "fif", 30, 20, 10)) == ((30, 20, 10), {})


def test_a_bundle_holds_messages_and_bundles() -> None:
    inner = bundle(message("/bridge/quat", "fff", 1, 2, 3), message("/other", "s"[:0]))
    assert parsed(bundle(message("/other/too", "f", 5), inner)) == ((1, 2, 3), {"other": 2})


@pytest.mark.parametrize(
    ("datagram", "counted"),
    [
        (b"", "invalid"),
        (b"/bridge/quat", "invalid"),
        (padded("/bridge/quat"), "invalid"),
        (padded("/bridge/quat") + padded("ffff"), "invalid"),
        (message("/bridge/quat", "ffff", 1, 0, 0, 0)[:-1], "invalid"),
        (message("/bridge/quat", "ffff", 0, 0, 0, 0), "invalid"),
        (message("/bridge/quat", "ffff", math.nan, 0, 0, 1), "invalid"),
        (message("/bridge/quat", "ffff", 2, 0, 0, 0), "invalid"),
        (message("/bridge/quat", "ff", 1, 0), "invalid"),
        (message("/bridge/quat", "fff", math.inf, 0, 0), "invalid"),
        (padded("/bridge/quat") + padded(",sfff") + bytes(20), "invalid"),
        (message("/elsewhere", "ffff", 1, 0, 0, 0), "other"),
        (bundle() + struct.pack(">I", 0), "invalid"),
        (bundle() + struct.pack(">I", 2**31), "invalid"),
        (bundle(bundle(bundle(bundle(bundle())))), "invalid"),
        ("/ü\0\0,f\0\0abcd".encode(), "invalid"),
    ],
)
def test_what_is_no_pose_is_counted(datagram: bytes, counted: str) -> None:
    assert parsed(datagram) == (None, {counted: 1})


def test_a_pose_before_the_damage_counts() -> None:
    packet = bundle(message("/bridge/quat", "fff", 1, 2, 3)) + b"\0"
    assert parsed(packet) == ((1, 2, 3), {"invalid": 1})


numbers = st.lists(st.floats(width=32), min_size=3, max_size=4)
real = numbers.map(lambda n: message("/bridge/quat", "f" * len(n), *n))


@given(st.binary(max_size=64) | real | st.binary(max_size=40).map(lambda b: bundle() + b))
def test_any_datagram_is_a_pose_or_counted(datagram: bytes) -> None:
    angles, counted = parsed(datagram)
    assert angles is not None or counted or datagram == bundle()


def test_empty_bundle_is_silent() -> None:
    assert list(messages(bundle())) == []


def test_the_address_is_an_option() -> None:
    tracker = open_tracker("osc:0?address=/ypr")
    tracker.close()
    assert "OSC /ypr packets" in tracker.message
    with pytest.raises(TrackerError, match="address must begin with /, such as /bridge/quat"):
        open_tracker("osc:0?address=ypr")
