from __future__ import annotations

import math
import socket
import struct
import threading
from collections.abc import Callable, Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.axes import AxisMap
from freelook.clock import FakeClock, now_ns
from freelook.errors import TrackerError
from freelook.head import Head
from freelook.rotations import head_angles_deg
from freelook.trackers import open_tracker
from freelook.trackers.opentrack import AXES, OpenTrack, parse_address, parse_packet
from freelook.types import Counters, Pose

WaitUntil = Callable[..., None]


def packet(yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0, x: float = 0.0) -> bytes:
    return struct.pack("<6d", x, 2.0, 3.0, yaw, pitch, roll)


@pytest.fixture
def tracker() -> Iterator[OpenTrack]:
    made = OpenTrack("127.0.0.1", 0, AxisMap(), FakeClock(77))
    yield made
    made.close()


@pytest.fixture
def send(tracker: OpenTrack) -> Iterator[Callable[[bytes], None]]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:

        def to_the_tracker(datagram: bytes) -> None:
            out.sendto(datagram, tracker.address)

        yield to_the_tracker


def test_packet_is_six_little_endian_doubles() -> None:
    assert parse_packet(packet(10, -20, 30), Counters()) == (10, -20, 30)


def test_a_trailer_is_tolerated() -> None:
    assert parse_packet(packet(10) + b"sequence number", Counters()) == (10, 0, 0)


@pytest.mark.parametrize("length", [0, 1, 47])
def test_short_packets_are_counted(length: int) -> None:
    counters = Counters()
    assert parse_packet(packet(10)[:length], counters) is None
    assert counters.values == {"short": 1}


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("where", ["x", "yaw", "pitch", "roll"])
def test_numbers_that_are_none_are_counted(bad: float, where: str) -> None:
    counters = Counters()
    assert parse_packet(packet(**{where: bad}), counters) is None
    assert counters.values == {"invalid": 1}


def test_absurd_angles_are_counted() -> None:
    counters = Counters()
    assert parse_packet(packet(1e30), counters) is None
    assert counters.values == {"invalid": 1}


@given(st.binary(max_size=100) | st.binary(min_size=48, max_size=48))
def test_any_datagram_is_a_pose_or_counted(datagram: bytes) -> None:
    counters = Counters()
    angles = parse_packet(datagram, counters)
    if angles is None:
        assert counters["short"] + counters["invalid"] == 1
    else:
        AXES.body_from_view(*angles)


@pytest.mark.parametrize(
    ("argument", "expected"),
    [
        ("", ("127.0.0.1", 4242)),
        ("5000", ("127.0.0.1", 5000)),
        ("0.0.0.0:4242", ("0.0.0.0", 4242)),
        (":4242", ("127.0.0.1", 4242)),
        ("[::1]:4242", ("::1", 4242)),
        ("0.0.0.0:", ("0.0.0.0", 4242)),
    ],
)
def test_addresses(argument: str, expected: tuple[str, int]) -> None:
    assert parse_address(argument) == expected


@pytest.mark.parametrize("argument", ["x", "1e3", "-1", "65536", "9" * 40, "٤٢", "0.0.0.0"])
def test_bad_addresses(argument: str) -> None:
    with pytest.raises(TrackerError, match="is not a port or host:port; for example 4242"):
        parse_address(argument)


def test_only_this_machine_is_listened_to_by_default() -> None:
    tracker = open_tracker("opentrack:0")
    assert tracker.address[0] == "127.0.0.1"  # type: ignore[attr-defined]
    tracker.close()


def test_a_port_in_use_is_explained(tracker: OpenTrack) -> None:
    with pytest.raises(TrackerError, match=r"cannot listen on UDP 127\.0\.0\.1 port .*in use"):
        open_tracker(f"opentrack:{tracker.address[1]}")


def test_of_a_burst_only_the_newest_survives(
    tracker: OpenTrack, send: Callable[[bytes], None]
) -> None:
    for yaw in range(50):
        send(packet(yaw))
    pose = next(tracker.poses())
    assert head_angles_deg(pose.body_from_view)[0] == pytest.approx(49)
    assert pose.t_ns == 77
    assert tracker.counters.values == {"received": 50, "dropped": 49}


def test_garbage_at_the_end_of_a_burst_does_not_hide_the_newest_good_one(
    tracker: OpenTrack, send: Callable[[bytes], None]
) -> None:
    for datagram in (packet(1), packet(2), packet(math.nan), b"", b"\xff" * 500):
        send(datagram)
    pose = next(tracker.poses())
    assert head_angles_deg(pose.body_from_view)[0] == pytest.approx(2)
    counted = {"received": 5, "dropped": 1, "invalid": 2, "short": 1}
    assert tracker.counters.values == counted


def test_garbage_alone_gives_no_pose_and_harms_nothing(
    tracker: OpenTrack, send: Callable[[bytes], None], wait_until: WaitUntil
) -> None:
    poses: list[Pose] = []
    reader = threading.Thread(target=lambda: poses.extend(tracker.poses()))
    reader.start()
    for i in range(20):
        send(bytes([i]) * i)
    wait_until(lambda: tracker.counters["short"] == 20)
    send(packet(5))
    wait_until(lambda: len(poses) == 1)
    tracker.close()
    reader.join(5)
    assert not reader.is_alive()


def test_signs_are_opentracks_right_up_and_left_ear_down() -> None:
    assert AXES(10, 20, 30) == (10, 20, -30)


def test_a_stream_of_packets_turns_the_head(wait_until: WaitUntil) -> None:
    tracker = open_tracker("opentrack:0")
    head = Head("goggles", tracker)
    head.start()
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:

            def turned() -> bool:
                out.sendto(packet(40, 10), tracker.address)  # type: ignore[attr-defined]
                aim = head.aim(now_ns())
                return head_angles_deg(aim.body_from_view) == pytest.approx((40, 10, 0), abs=0.01)

            wait_until(turned)
            status = head.status(now_ns())
        assert status.state == "tracking"
        assert status.rate_hz > 50
    finally:
        head.close()
