"""Live frames: on time, and after a stall the newest one."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from freelook.simulation.pacing import Pacer

MS = 1_000_000


def test_a_quick_machine_takes_every_frame() -> None:
    pacer = Pacer(50.0)
    due = [pacer.due_ns(i * 20 * MS + 3 * MS) for i in range(-1, 4)]
    assert due == [0, 20 * MS, 40 * MS, 60 * MS, 80 * MS]
    assert (pacer.taken, pacer.skipped) == (5, 0)


def test_a_slow_machine_skips_to_the_newest() -> None:
    pacer = Pacer(50.0)
    assert [pacer.due_ns(t * MS) for t in (0, 70, 150)] == [0, 60 * MS, 140 * MS]
    assert (pacer.taken, pacer.skipped) == (3, 5)


@given(st.lists(st.integers(0, 500), min_size=1, max_size=30), st.sampled_from([10.0, 30.0, 59.94]))
def test_never_old_never_twice(waits_ms: list[int], fps: float) -> None:
    pacer, now_ns, last_ns = Pacer(fps), 0, -1
    for wait_ms in waits_ms:
        now_ns = max(now_ns + wait_ms * MS, last_ns)
        due_ns = pacer.due_ns(now_ns)
        assert due_ns > last_ns
        assert due_ns > now_ns - 1.001e9 / fps
        assert due_ns <= max(now_ns, last_ns + 1.001e9 / fps)
        last_ns = due_ns
    assert round(last_ns * fps / 1e9) + 1 == pacer.taken + pacer.skipped
