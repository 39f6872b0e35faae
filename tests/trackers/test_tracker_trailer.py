"""Sequence and time behind OpenTrack's packets, and what a reader makes of them."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.clock import FakeClock
from freelook.rotations import head_angles_deg
from freelook.trackers import _trailer
from freelook.trackers._trailer import Order, SenderClock
from freelook.trackers.opentrack import AXES, OpenTrack, make_packet
from freelook.types import Counters

MS = 1_000_000


def order_of(*sequences: int) -> tuple[list[bool], dict[str, int]]:
    counters = Counters()
    order = Order(counters)
    return [order.accept(s) for s in sequences], counters.values


def test_packet_is_opentracks_and_16_bytes_more() -> None:
    packet = make_packet(10.0, -20.0, 30.0, 7, 123456789)
    assert struct.unpack("<6d4sIQ", packet) == (0, 0, 0, 10, -20, -30, b"flk1", 7, 123456789)
    assert len(packet) == 64


@given(st.integers(0, 2**40), st.integers(0, 2**63))
def test_trailer_round_trip(sequence: int, t_ns: int) -> None:
    assert _trailer.unpack(_trailer.pack(sequence, t_ns)) == (sequence % 2**32, t_ns)


@given(st.binary(max_size=30))
def test_other_trailers_are_not_ours(data: bytes) -> None:
    assert (_trailer.unpack(data) is None) == (len(data) != 16 or data[:4] != b"flk1")


def test_order_of_packets() -> None:
    assert order_of(5, 6, 7) == ([True] * 3, {})
    assert order_of(5, 9, 10) == ([True] * 3, {"lost": 3})
    assert order_of(5, 7, 6, 8) == ([True, True, False, True], {"lost": 1, "reordered": 1})
    assert order_of(5, 5, 6) == ([True, False, True], {"duplicate": 1})


def test_order_wraps_round() -> None:
    top = 2**32 - 1
    assert order_of(top - 1, top, 0, 1) == ([True] * 4, {})
    assert order_of(top, 1, 0) == ([True, True, False], {"lost": 1, "reordered": 1})


@pytest.mark.parametrize("sequence", [0, 3_000_000_000])
def test_a_sender_started_again_is_followed_at_once(sequence: int) -> None:
    first = 1_000_000_000
    assert order_of(first, sequence, sequence + 1) == ([True] * 3, {"restarted": 1})


def test_jitter_of_the_network_leaves_the_times() -> None:
    """Sent every 10 ms by a clock that began 1 s earlier, 3 ms or 5 ms under way."""
    clock = SenderClock()
    delays = [3, 5, 3, 5, 5, 3]
    heard = [clock.here((1000 + 10 * n) * MS, (10 * n + d) * MS) for n, d in enumerate(delays)]
    expected = [(10 * n + 3) * MS for n in range(6)]
    # two clocks may part by 200 ppm: 2 us in 10 ms, 8 us over the four packets in question
    assert heard == pytest.approx(expected, abs=8_000)


def test_a_clock_that_jumps_is_followed() -> None:
    clock = SenderClock()
    assert clock.here(5_000 * MS, 100 * MS) == 100 * MS
    assert clock.here(1 * MS, 110 * MS) == 110 * MS
    assert clock.here(11 * MS, 121 * MS) == pytest.approx(120 * MS, abs=4_000)


@given(st.lists(st.tuples(st.integers(0, 2**64 - 1), st.integers(0, 10**10)), max_size=20))
def test_no_pose_is_younger_than_its_arrival_or_much_older(stamps: list[tuple[int, int]]) -> None:
    clock, arrival_ns = SenderClock(), 0
    for sent_ns, wait_ns in stamps:
        arrival_ns += wait_ns
        assert arrival_ns - 1.1e9 < clock.here(sent_ns, arrival_ns) <= arrival_ns


@given(st.lists(st.binary(max_size=20), max_size=10))
def test_whatever_follows_the_48_bytes_is_a_pose_or_counted(trailers: list[bytes]) -> None:
    tracker = OpenTrack("127.0.0.1", 0, AXES, FakeClock(5))
    try:
        for n, trailer in enumerate(trailers):
            pose = tracker._pose(struct.pack("<6d", 0, 0, 0, 1, 2, 3) + trailer, 1000 * n)
            assert pose is None or pose.t_ns <= 1000 * n
    finally:
        tracker.close()


def test_what_was_sent_is_what_is_read() -> None:
    tracker = OpenTrack("127.0.0.1", 0, AXES, FakeClock(5))
    try:
        pose = tracker._pose(make_packet(30, 20, 10, 1, 7), 900)
        late = tracker._pose(make_packet(30, 20, 10, 0, 7), 950)
    finally:
        tracker.close()
    assert pose is not None
    assert pose.t_ns == 900
    assert head_angles_deg(pose.body_from_view) == pytest.approx((30, 20, 10))
    assert late is None
    assert tracker.counters.values == {"reordered": 1}
