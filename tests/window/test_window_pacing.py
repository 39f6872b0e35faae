"""When views are begun, on a scripted clock; and the figures at the end."""

from __future__ import annotations

from math import isnan

import numpy as np
import pytest

from freelook.window.ages import Ages, Figures
from freelook.window.pacing import LEAST_MARGIN, Pacer, period_ns

MS = 1_000_000
PERIOD = 16 * MS


class Screen:
    """Takes pictures every 16 ms; a view takes so long to draw."""

    def __init__(self, pacer: Pacer) -> None:
        self.pacer = pacer
        self.now_ns = 0

    def view(self, cost_ns: int) -> tuple[int, int]:
        """One turn of the loop: (when it began, when the screen took it)."""
        begun = self.pacer.begin_ns(self.now_ns)
        drawn = begun + cost_ns
        self.now_ns = swapped = -(-drawn // PERIOD) * PERIOD
        self.pacer.swapped(begun, drawn, swapped)
        return begun, swapped


def test_views_are_begun_as_late_as_their_cost_allows() -> None:
    screen = Screen(Pacer(PERIOD))
    screen.view(3 * MS)
    for _ in range(200):
        before_ns = screen.now_ns
        begun, swapped = screen.view(3 * MS)
        assert swapped == before_ns + PERIOD  # none is missed
        assert swapped - begun <= 3 * MS + LEAST_MARGIN * PERIOD + 1
    assert screen.pacer.missed == 0


def test_a_dearer_view_is_missed_once_and_then_allowed_for() -> None:
    screen = Screen(Pacer(PERIOD))
    for _ in range(10):
        screen.view(3 * MS)
    for _ in range(20):
        begun, swapped = screen.view(6 * MS)
    assert screen.pacer.missed == 1
    assert swapped - begun < 9 * MS
    for _ in range(800):
        begun, swapped = screen.view(3 * MS)
    assert swapped - begun < 5 * MS  # and forgotten when it is over
    assert screen.pacer.missed == 1


def test_views_that_take_longer_than_a_period_follow_each_other_at_once() -> None:
    screen = Screen(Pacer(PERIOD))
    screen.view(20 * MS)
    for _ in range(10):
        before_ns = screen.now_ns
        begun, _ = screen.view(20 * MS)
        assert begun == before_ns
    assert screen.pacer.begin_ns(screen.now_ns) == screen.now_ns


def test_after_a_pause_the_next_view_is_begun_at_once() -> None:
    screen = Screen(Pacer(PERIOD))
    screen.view(3 * MS)
    assert screen.pacer.begin_ns(screen.now_ns) > screen.now_ns
    screen.pacer.paused()
    assert screen.pacer.begin_ns(screen.now_ns) == screen.now_ns
    screen.now_ns += 100 * PERIOD
    screen.view(3 * MS)
    assert screen.pacer.missed == 0


@pytest.mark.parametrize(("refresh_hz", "period_ms"), [(50.0, 20.0), (0.0, 1000 / 60)])
def test_a_screen_that_does_not_say_has_60_hz(refresh_hz: float, period_ms: float) -> None:
    assert period_ns(refresh_hz) == pytest.approx(period_ms * MS, abs=1)


def test_ages_are_told_by_their_median_and_95th_percentile() -> None:
    ages = Ages()
    assert isnan(ages.percentile_ms(50))
    assert str(ages) == "none measured"
    for age_ms in range(1, 102):
        ages.add(age_ms * MS)
    assert str(ages) == "51.0 ms median, 96.0 ms at the 95th percentile"


def test_views_per_second() -> None:
    assert isnan(Figures().rate_hz)
    assert Figures(views=61, first_ns=5, last_ns=2_000_000_005).rate_hz == pytest.approx(30)
    assert np.isfinite(Figures(views=2, first_ns=1, last_ns=2).rate_hz)
