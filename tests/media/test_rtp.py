from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.media.rtp import ReorderBuffer, RtpPacket, parse_packet
from freelook.types import Counters

MS = 1_000_000


def packet(sequence: int, arrival_ns: int = 0) -> RtpPacket:
    return RtpPacket(sequence & 0xFFFF, 0, 1, 96, False, b"x", arrival_ns)


def sequences(packets: list[RtpPacket]) -> list[int]:
    return [p.sequence for p in packets]


def datagram(flags: int = 0x80, kind: int = 96, rest: bytes = b"payload") -> bytes:
    return bytes([flags, kind, 0, 7, 0, 0, 0, 9, 0, 0, 0, 1]) + rest


def test_header_fields() -> None:
    got = parse_packet(datagram(kind=0x80 | 96), 5)
    assert got == RtpPacket(7, 9, 1, 96, True, b"payload", 5)


def test_extension_contributors_and_padding_are_taken_off() -> None:
    extension = b"\xbe\xde\0\1abcd"
    rest = b"CSRC" + extension + b"payload" + b"\0\0\3"
    got = parse_packet(datagram(0x80 | 0x10 | 0x20 | 1, rest=rest), 0)
    assert got is not None
    assert got.payload == b"payload"


@pytest.mark.parametrize(
    "bad",
    [
        b"",
        datagram(rest=b""),
        datagram(flags=0x40),
        datagram(kind=0x80 | 72),  # RTCP sender report
        datagram(flags=0x90, rest=b"\0\0\xff\xff"),  # extension beyond the end
        datagram(flags=0x8F, rest=b"four"),  # contributors beyond the end
        datagram(flags=0xA0, rest=b"ab\0"),  # padding of 0
        datagram(flags=0xA0, rest=b"ab\xff"),  # padding beyond the start
    ],
)
def test_what_is_not_rtp_is_refused(bad: bytes) -> None:
    assert parse_packet(bad, 0) is None


def test_packets_in_order_pass_at_once() -> None:
    counters = Counters()
    order = ReorderBuffer(counters)
    for sequence in (65534, 65535, 0, 1):
        assert sequences(order.push(packet(sequence), 0)) == [sequence]
    assert order.deadline_ns is None
    assert counters.values == {}


def test_swapped_packets_are_put_right() -> None:
    counters = Counters()
    order = ReorderBuffer(counters)
    order.push(packet(10), 0)
    assert order.push(packet(12), 1) == []
    assert sequences(order.push(packet(11), 2)) == [11, 12]
    assert counters.values == {"reordered": 1}


def test_a_gap_is_given_up_after_the_wait() -> None:
    counters = Counters()
    order = ReorderBuffer(counters, wait_ns=10 * MS)
    order.push(packet(10), 0)
    order.push(packet(13), 5 * MS)
    assert order.deadline_ns == 15 * MS
    assert order.expire(14 * MS) == []
    assert sequences(order.expire(15 * MS)) == [13]
    assert counters.values == {"lost": 2}
    assert order.deadline_ns is None


def test_a_gap_is_given_up_when_enough_packets_wait() -> None:
    counters = Counters()
    order = ReorderBuffer(counters, depth=4)
    order.push(packet(1), 0)
    assert [order.push(packet(s), 0) for s in (3, 4, 5)] == [[], [], []]
    assert sequences(order.push(packet(6), 0)) == [3, 4, 5, 6]
    assert counters["lost"] == 1


def test_late_and_duplicate_packets_are_told_apart() -> None:
    counters = Counters()
    order = ReorderBuffer(counters, depth=2)
    for sequence in (1, 2, 4, 5):
        order.push(packet(sequence), 0)
    assert order.push(packet(3), 0) == []  # had been given up
    assert order.push(packet(2), 0) == []  # had been there
    assert order.push(packet(3), 0) == []  # both
    assert counters.values == {"lost": 1, "late": 1, "duplicate": 2}


def test_a_restarted_sender_is_followed_after_two_packets() -> None:
    counters = Counters()
    order = ReorderBuffer(counters)
    order.push(packet(100), 0)
    assert order.push(packet(30000), 0) == []
    assert sequences(order.push(packet(30001), 0)) == [30001]
    assert sequences(order.push(packet(30002), 0)) == [30002]
    assert counters["restarts"] == 1


@given(st.lists(st.integers(0, 7), min_size=1, max_size=80), st.integers(0, 0xFFFF))
def test_any_small_disorder_comes_out_in_order(delays: list[int], start: int) -> None:
    arrival = sorted(range(len(delays)), key=lambda i: (i + delays[i], i))
    first = arrival.index(0)
    arrival = [0, *arrival[:first], *arrival[first + 1 :]]
    order = ReorderBuffer(Counters(), depth=16)
    got = [p for i in arrival for p in order.push(packet(start + i), 0)]
    assert sequences(got) == [(start + i) & 0xFFFF for i in range(len(delays))]


@given(st.lists(st.tuples(st.integers(0, 0xFFFF), st.integers(0, 20 * MS)), max_size=200))
def test_whatever_comes_nothing_is_doubled_or_kept_for_long(
    arrivals: list[tuple[int, int]],
) -> None:
    counters = Counters()
    order = ReorderBuffer(counters, depth=8)
    now_ns = 0
    pushed = passed = 0
    for sequence, step_ns in arrivals:
        now_ns += step_ns
        passed += len(order.push(packet(sequence, now_ns), now_ns))
        pushed += 1
        passed += len(order.expire(now_ns))
        assert order.deadline_ns is None or order.deadline_ns > now_ns
    passed += len(order.expire(now_ns + 20 * MS))
    thrown_away = counters["duplicate"] + counters["late"] + counters["malformed"]
    # a restart forgets what was held
    assert passed + thrown_away <= pushed
    assert counters["restarts"] or passed + thrown_away == pushed
    assert min(counters.values.values(), default=0) >= 0
