from __future__ import annotations

import subprocess
import sys

from freelook.clock import NS_PER_MS, NS_PER_S, FakeClock, now_ns


def test_now_never_runs_backwards() -> None:
    times = [now_ns() for _ in range(1000)]
    assert times == sorted(times)
    assert all(isinstance(t, int) for t in times)


def test_now_is_the_same_clock_in_another_process() -> None:
    before = now_ns()
    script = "from freelook.clock import now_ns; print(now_ns())"
    other = int(subprocess.run([sys.executable, "-c", script], capture_output=True).stdout)
    assert before < other < now_ns()


def test_fake_clock_stands_still_until_told() -> None:
    clock = FakeClock(5)
    assert (clock(), clock()) == (5, 5)
    assert clock.advance_ms(1.5) == 5 + 1_500_000 == clock()


def test_units() -> None:
    assert (NS_PER_S, NS_PER_MS) == (10**9, 10**6)
