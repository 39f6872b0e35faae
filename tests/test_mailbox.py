from __future__ import annotations

import threading

from freelook.mailbox import Mailbox


def test_keeps_only_the_newest_and_counts_the_rest() -> None:
    box: Mailbox[int] = Mailbox()
    for value in range(5):
        box.put(value)
    assert box.take() == 4
    assert box.take() is None
    assert (box.received, box.dropped) == (5, 4)


def test_taken_values_are_not_dropped_ones() -> None:
    box: Mailbox[str] = Mailbox()
    for value in ("a", "b"):
        box.put(value)
        assert box.take() == value
    assert (box.received, box.dropped) == (2, 0)


def test_falsy_values_are_values() -> None:
    box: Mailbox[int] = Mailbox()
    box.put(0)
    box.put(0)
    assert box.dropped == 1
    assert box.take() == 0


def test_take_waits_for_a_value() -> None:
    box: Mailbox[int] = Mailbox()
    taken: list[int | None] = []
    reader = threading.Thread(target=lambda: taken.append(box.take(timeout_s=10)))
    reader.start()
    box.put(7)
    reader.join(10)
    assert taken == [7]


def test_close_wakes_the_reader_and_refuses_more() -> None:
    box: Mailbox[int] = Mailbox()
    taken: list[int | None] = []
    reader = threading.Thread(target=lambda: taken.append(box.take(timeout_s=60)))
    reader.start()
    box.close()
    reader.join(10)
    assert taken == [None]
    assert box.closed
    box.put(1)
    assert box.take() is None
    assert box.received == 0


def test_a_value_already_in_survives_close() -> None:
    box: Mailbox[int] = Mailbox()
    box.put(3)
    box.close()
    assert box.take(timeout_s=1) == 3


def test_many_writers_lose_nothing_in_the_count() -> None:
    box: Mailbox[int] = Mailbox()
    taken = 0

    def write() -> None:
        for value in range(500):
            box.put(value)

    writers = [threading.Thread(target=write) for _ in range(4)]
    for writer in writers:
        writer.start()
    while any(w.is_alive() for w in writers):
        taken += box.take(timeout_s=0.01) is not None
    taken += box.take() is not None
    assert box.received == 2000
    assert box.dropped + taken == 2000
