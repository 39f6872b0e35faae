"""Bounded queues of coded pictures, and RTP time stamps."""

from __future__ import annotations

import asyncio
import threading
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
from whep_peer import run

from freelook.types import AccessUnit, Counters, StreamInfo
from freelook.web.track import RtpClock, UnitTrack, last_rtp_timestamp
from freelook.web.units import Hub, Replay, UnitQueue

STREAM = StreamInfo("h264", 320, 320)
MS = 1_000_000


def unit(number: int, *, key: bool = False, size: int = 10) -> AccessUnit:
    data = b"\0\0\0\1" + bytes([0x65 if key else 0x41]) + bytes(size - 5)
    return AccessUnit(STREAM, data, key, number * 33 * MS)


def drain(queue: UnitQueue) -> list[int]:
    return [u.capture_ns // (33 * MS) for u in iter(queue.take, None)]


def test_a_queue_starts_at_a_key_picture() -> None:
    queue = UnitQueue()
    for number in range(5):
        queue.put(unit(number, key=number == 2))
    assert drain(queue) == [2, 3, 4]
    assert queue.counters["dropped"] == 2


def test_overflow_drops_everything_up_to_the_next_key_picture() -> None:
    queue = UnitQueue(limit=3)
    for number in range(8):
        queue.put(unit(number, key=number in (0, 6)))
    assert drain(queue) == [6, 7]
    assert queue.counters["overflows"] == 1
    assert queue.counters["dropped"] == 6


@given(
    st.lists(st.tuples(st.booleans(), st.booleans()), max_size=200),
    st.integers(min_value=1, max_value=5),
)
def test_what_comes_out_can_always_be_decoded(steps: list[tuple[bool, bool]], limit: int) -> None:
    """Every picture out is a key picture or follows the one before it without a gap."""
    queue = UnitQueue(limit)
    out = []
    for number, (key, read) in enumerate(steps):
        queue.put(unit(number, key=key))
        if read and (taken := queue.take()) is not None:
            out.append((taken.capture_ns // (33 * MS), taken.key))
    for before, (number, key) in zip([(-2, False), *out], out, strict=False):
        assert key or number == before[0] + 1


def test_replay_holds_what_follows_the_last_key_picture() -> None:
    replay = Replay()
    for number in range(10):
        replay.put(unit(number, key=number in (2, 6)))
    assert [u.capture_ns // (33 * MS) for u in replay.units()] == [6, 7, 8, 9]


def test_replay_gives_up_rather_than_grow() -> None:
    by_count, by_bytes = Replay(limit=3), Replay(limit_bytes=100)
    for number in range(20):
        by_count.put(unit(number, key=number == 0))
        by_bytes.put(unit(number, key=number == 0, size=40))
    assert by_count.units() == by_bytes.units() == []


@given(st.lists(st.integers(min_value=-(10**15), max_value=10**15), min_size=2, max_size=50))
def test_time_stamps_always_increase(times_ns: list[int]) -> None:
    clock = RtpClock()
    stamps = [clock.stamp(t) for t in times_ns]
    assert all(a < b for a, b in pairwise(stamps))


def test_time_stamps_are_capture_times_in_90_khz() -> None:
    clock = RtpClock()
    first = clock.stamp(5 * MS)
    assert clock.stamp(1005 * MS) - first == 90_000


def test_a_clock_that_was_set_back_goes_on_at_its_pace() -> None:
    clock = RtpClock()
    last = clock.stamp(3_600_000 * MS)
    again = clock.stamp(7 * MS)
    assert again - last == 3000
    assert clock.stamp(1007 * MS) - again == 90_000


def test_replayed_pictures_are_stamped_just_before_the_newest() -> None:
    clock = RtpClock()
    stamps = [clock.stamp_replayed(1000 * MS, left) for left in (3, 2, 1, 0)]
    assert stamps == [89_997, 89_998, 89_999, 90_000]
    assert clock.stamp(1033 * MS) == 92_970


def test_every_thread_may_offer_and_listeners_hear_in_order() -> None:
    async def test() -> None:
        hub = Hub(asyncio.get_running_loop())
        heard: list[int] = []
        unsubscribe = hub.subscribe(lambda u: heard.append(u.capture_ns // (33 * MS)))

        def offer() -> None:
            for number in range(20):
                hub.offer(unit(number, key=number == 0))

        thread = threading.Thread(target=offer)
        thread.start()
        await asyncio.to_thread(thread.join)
        await asyncio.sleep(0)
        assert heard == list(range(20))
        unsubscribe()
        hub.offer(unit(20))
        await asyncio.sleep(0)
        assert heard == list(range(20))

    run(test())


def test_a_loop_that_stands_still_costs_pictures_not_memory() -> None:
    async def test() -> None:
        hub = Hub(asyncio.get_running_loop())
        heard: list[AccessUnit] = []
        hub.subscribe(heard.append)
        for number in range(1020):  # the loop gets no turn in here
            hub.offer(unit(number, key=number % 100 == 0))
        await asyncio.sleep(0)
        assert len(heard) <= 30
        assert heard[0].key
        assert hub.counters["dropped"] + len(heard) == 1020

    run(test())


def test_a_slow_viewer_resumes_at_a_key_picture() -> None:
    async def test() -> None:
        hub = Hub(asyncio.get_running_loop())
        counters = Counters()
        track = UnitTrack(hub, counters, lambda rtp, capture_ns: None)

        def offer(numbers: range, keys: tuple[int, ...] = ()) -> None:
            for number in numbers:
                hub.offer(unit(number, key=number in keys))

        offer(range(3), keys=(0,))
        await asyncio.sleep(0)
        first = [await track.recv() for _ in range(3)]
        assert [len(bytes(p)) for p in first] == [10, 10, 10]
        for start in (3, 20, 40):  # nobody reads
            offer(range(start, start + 20), keys=(43,))
            await asyncio.sleep(0)
        packet = await track.recv()
        assert packet.pts is not None
        assert packet.pts - (first[2].pts or 0) == 41 * 33 * 90
        assert counters["overflows"] == 1
        track.stop()

    run(test())


def test_without_aiortcs_private_fields_there_is_no_time_stamp() -> None:
    class Sender:
        _RTCRtpSender__packet_count = 1

    assert last_rtp_timestamp(object()) is None
    assert last_rtp_timestamp(Sender()) is None
