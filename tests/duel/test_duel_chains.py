"""Both chains against sums of delays, and what each setting does and does not do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.duel import measure
from freelook.duel.chains import Shown, freelook_chain, gimbal_chain, tracked
from freelook.duel.contest import fight, steps
from freelook.duel.figures import (
    GIMBALS,
    LINKS,
    DuelError,
    Settings,
    changed,
    figures,
    ideal,
    settings_of,
)
from freelook.duel.head import TURNS, HeadMotion, body_from_angles, synthetic_head
from freelook.duel.predictors import expected
from freelook.errors import TrackerError
from freelook.rotations import angle_between_deg
from freelook.types import Pose

HEAD = synthetic_head(16)
MOMENTS = measure.moments(HEAD)


def settings(gimbal: str = "hobby-servo", link: str = "analogue", **changes: float) -> Settings:
    return settings_of(changed(figures(gimbal, link), changes))


def steady(
    yaw_deg_s: float = 0.0, roll_deg: float = 0.0, pitch_deg: float = 0.0, seconds: float = 8
) -> HeadMotion:
    """A head that turns at one rate, never stopping."""
    times = np.arange(round(seconds * 100) + 1) * 10_000_000
    flat = np.ones(len(times))
    angles = np.stack([yaw_deg_s * times / 1e9, pitch_deg * flat, roll_deg * flat])
    return HeadMotion("steady", times, body_from_angles(angles))


TURNING = steady(yaw_deg_s=40, seconds=14)


def lag_of_turning(shown: Shown) -> float:
    return measure.lag_ms(TURNING, shown, measure.moments(TURNING))


class Knowing:
    """A predictor that knows."""

    def __init__(self, head: HeadMotion) -> None:
        self._head = head

    def push(self, pose: Pose) -> None:
        pass

    def at(self, t_ns: int) -> Rotation:
        return self._head.at(np.array([t_ns], dtype=np.int64))[0]


@pytest.mark.parametrize("link", LINKS)
def test_without_motors_the_lag_is_the_sum_of_the_delays(link: str) -> None:
    """For a head that never stops: every phase of every clock counts alike."""
    chosen = ideal(settings(link=link))
    shown, _ = gimbal_chain(TURNING, chosen)
    # 1 ms: a motor's 1 ms step, and phases of clocks that have not all met in 14 s
    assert lag_of_turning(shown) == pytest.approx(chosen.gimbal_lag_ms, abs=1.0)
    assert lag_of_turning(freelook_chain(TURNING, chosen)) == pytest.approx(
        chosen.freelook_lag_ms, abs=0.5
    )


def test_the_sums_are_what_one_adds_up_by_hand() -> None:
    chosen = settings()
    radio = 19.7
    gimbal = 6.67 / 2 + 3.5 + 22.5 / 2 + radio + 20 / 2 + 1.5 + 37
    assert chosen.gimbal_lag_ms == pytest.approx(gimbal)
    freelook = 6.67 / 2 + 3.5 + 3 + 1000 / 60 * 1.5 + 5
    assert chosen.freelook_lag_ms == pytest.approx(freelook)


def test_a_longer_pwm_frame_costs_half_of_what_it_is_longer() -> None:
    lags = []
    for period in (2.0, 42.0):
        shown, _ = gimbal_chain(TURNING, ideal(settings(command_period_ms=period)))
        lags.append(lag_of_turning(shown))
    assert lags[1] - lags[0] == pytest.approx(20, abs=1)


@pytest.mark.parametrize("link", LINKS)
def test_the_content_is_as_old_as_was_measured_glass_to_glass(link: str) -> None:
    chosen = settings(link=link)
    shown, _ = gimbal_chain(HEAD, chosen)
    age = shown.age_ms(MOMENTS).mean()
    assert age == pytest.approx(chosen.glass_to_glass_ms, abs=0.7)  # of phases, as above
    ours = freelook_chain(HEAD, chosen).age_ms(MOMENTS).mean()
    longer = chosen.digitiser_ms + chosen.refresh_ms * chosen.compositor_frames
    assert ours - age == pytest.approx(longer, abs=1.0)


def test_the_video_link_does_not_move_freelooks_direction() -> None:
    near, far = settings(), settings(glass_to_glass_ms=400, digitiser_ms=200)
    a, b = freelook_chain(HEAD, near), freelook_chain(HEAD, far)
    assert (a.body_from_shown.as_quat() == b.body_from_shown.as_quat()).all()
    assert (b.age_ms(MOMENTS) - a.age_ms(MOMENTS)).mean() == pytest.approx(480, abs=1)


def test_a_head_at_rest_is_shown_exactly() -> None:
    head = steady(pitch_deg=12)
    duel = fight(head, ideal(settings()))
    for side in (duel.freelook, duel.gimbal):
        assert side.direction.worst < 1e-6
        assert np.isnan(side.lag_ms)
    assert duel.numbers()["gimbal"]["lag_ms"] is None


def test_two_axes_do_not_roll_and_three_do() -> None:
    head = steady(roll_deg=15)
    for axes, left_over in ((2, 15.0), (3, 0.0)):
        shown, _ = gimbal_chain(head, ideal(settings(axes=axes)))
        t_ns = measure.moments(head)
        assert measure.direction_error_deg(head, shown, t_ns).max() < 1e-6
        turned = measure.turned_error_deg(head, shown, t_ns)
        assert turned == pytest.approx(np.full(len(t_ns), left_over), abs=1e-6)


def test_who_knows_the_future_errs_by_half_a_picture() -> None:
    """At w degrees/s a picture that is right in the middle of its 1/60 s is off by w/120 at its
    ends: on average half of that."""
    head = steady(yaw_deg_s=60)
    shown = freelook_chain(head, settings(), Knowing(head))
    error = measure.direction_error_deg(head, shown, measure.moments(head))
    inner = error[: len(error) - 500]
    assert inner.max() == pytest.approx(60 / 120, abs=0.01)
    assert inner.mean() == pytest.approx(60 / 240, abs=0.01)


def test_a_gimbal_that_knows_the_future_has_no_lag_but_its_motors() -> None:
    head = synthetic_head(20)
    shown, _ = gimbal_chain(head, ideal(settings("brushless", "digital")), Knowing(head))
    assert measure.lag_ms(head, shown, measure.moments(head)) == pytest.approx(0, abs=1.5)


def test_motors_that_are_too_slow_fall_behind_as_far_as_they_must() -> None:
    """300 degrees/s asked of motors of 200: 100 degrees more every second."""
    head = steady(yaw_deg_s=300, seconds=4)
    chosen = replace(ideal(settings()), slew_deg_s=200)
    _, motors = gimbal_chain(head, chosen)
    assert motors.angles_deg[0, -1] - motors.angles_deg[0, -1001] == pytest.approx(200, abs=1e-6)
    assert motors.angles_deg[0, -1] == pytest.approx(4 * 200, abs=200 * 0.1)


def test_the_trackers_noise_is_as_large_as_it_says_and_the_same_every_time() -> None:
    head = steady(seconds=60)
    noisy = settings(tracker_noise_deg=0.1)
    _, poses = tracked(head, noisy)
    angles = np.degrees((head.poses[0].inv() * poses).as_rotvec())
    assert angles.std(axis=0) == pytest.approx(np.full(3, 0.1), rel=0.03)  # of 9000
    assert (tracked(head, noisy)[1].as_quat() == poses.as_quat()).all()
    assert angle_between_deg(tracked(head, settings(tracker_noise_deg=0))[1][5], head.poses[0]) == 0


def test_predictors_get_what_is_there_and_are_asked_for_what_comes() -> None:
    calls: list[tuple[str, int]] = []

    class Notes:
        def push(self, pose: Pose) -> None:
            calls.append(("push", pose.t_ns))

        def at(self, t_ns: int) -> Rotation:
            calls.append(("at", t_ns))
            return Rotation.identity()

    taken = np.array([0, 10, 20, 30], dtype=np.int64)
    asked = np.array([5, 16, 17, 40], dtype=np.int64)
    ticked: list[int] = []

    def ticked_off() -> None:
        ticked.append(1)

    found = expected(
        Notes(),
        Rotation.identity(4),
        taken,
        taken + 5,
        asked,
        asked + 100,
        lambda: ticked.append(1),
    )
    assert calls == [
        *(("push", 0), ("at", 105)),
        *(("push", 10), ("at", 116), ("at", 117)),
        *(("push", 20), ("push", 30), ("at", 140)),
    ]
    assert len(found) == len(ticked) == 4


@pytest.mark.parametrize("delay_ms", [37.4, -20.0])
def test_lag_of_a_pure_delay_is_the_delay(delay_ms: float) -> None:
    t_ns = np.arange(0, HEAD.duration_ns, 1_000_000, dtype=np.int64)
    late = Shown(t_ns, HEAD.at(t_ns - round(delay_ms * 1e6)), t_ns)
    assert measure.lag_ms(HEAD, late, MOMENTS) == pytest.approx(delay_ms, abs=0.1)


def test_turns_are_late_by_the_delay_at_every_level() -> None:
    duel = fight(synthetic_head(4), settings())
    t_ns = np.arange(0, duel.turns.duration_ns, 1_000_000, dtype=np.int64)
    late = Shown(t_ns, duel.turns.at(t_ns - 80_000_000), t_ns)
    delays = measure.turn_delays_ms(duel.turns, late)
    assert delays.shape == (TURNS, 3)
    assert np.abs(delays - 80).max() <= 1.5  # the display's 1 ms and the watch's 0.5 ms
    still = Shown(t_ns[:1], duel.turns.at(t_ns[:1]), t_ns[:1])
    assert np.isinf(measure.turn_delays_ms(duel.turns, still)[::2]).all()
    chosen = duel.settings
    # nothing is predicted: the sum of the delays, and up to half a display frame of luck
    medians = [median for median, _ in duel.freelook.turn_ms.values()]
    assert medians == pytest.approx([chosen.freelook_lag_ms] * 3, abs=chosen.refresh_ms / 2)


def test_the_same_head_gives_the_same_numbers() -> None:
    head = synthetic_head(4)
    assert fight(head, settings()).numbers() == fight(head, settings()).numbers()


def test_progress_is_reported_as_often_as_promised() -> None:
    head, chosen = synthetic_head(4), settings()
    seen: list[int] = []
    fight(head, chosen, lambda: Knowing(head), lambda: Knowing(head), lambda: seen.append(1))
    assert len(seen) == pytest.approx(steps(head, chosen, True, True), abs=20)


def test_the_share_of_time_beyond_a_lens() -> None:
    head = steady(yaw_deg_s=20, seconds=9)  # 20 to 180 degrees in the moments that count
    duel = fight(head, settings())
    assert duel.beyond(188) == pytest.approx((180 - 94) / 160, abs=1e-3)
    assert duel.beyond(360) == 0


def test_a_head_that_is_too_short_is_refused() -> None:
    with pytest.raises(TrackerError, match=r"lasts 1\.5 s; a duel needs four seconds"):
        fight(synthetic_head(1.5), settings())


def test_spread_is_what_its_names_say() -> None:
    found = measure.spread(np.arange(101.0))
    assert (found.p50, found.p95, found.p99, found.worst) == (50, 95, 99, 100)
    assert found.rms == pytest.approx(np.sqrt(np.mean(np.arange(101.0) ** 2)))


@pytest.mark.parametrize("gimbal", GIMBALS)
@pytest.mark.parametrize("link", LINKS)
def test_every_preset_is_whole_and_says_where_it_is_from(gimbal: str, link: str) -> None:
    chosen = figures(gimbal, link)
    settings_of(chosen)
    for name, figure in chosen.items():
        assert len(figure.source) > 6, name


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"slew": 3}, "unknown setting 'slew'; known: tracker_period_ms, "),
        ({"slew_deg_s": 0}, "slew_deg_s = 0 is not within 0.1 and inf"),
        ({"camera_hz": float("nan")}, "camera_hz = nan is not within"),
        ({"axes": 1}, "2 or 3"),
        ({"compositor_frames": 0.5}, "whole number"),
        ({"glass_to_glass_ms": 10}, "less than what camera and display alone take, 23.3 ms"),
        ({"radio_latency_ms": 4}, "radio_latency_ms = 4 is less than half"),
    ],
)
def test_settings_that_cannot_be_are_refused(changes: dict[str, float], words: str) -> None:
    with pytest.raises(DuelError) as caught:
        settings_of(changed(figures("hobby-servo", "analogue"), changes))
    assert words in str(caught.value)


def test_unknown_presets_list_the_known() -> None:
    with pytest.raises(DuelError, match="unknown gimbal 'x'; known: hobby-servo, brushless"):
        figures("x", "analogue")
    with pytest.raises(DuelError, match="unknown link 'x'; known: analogue, digital"):
        figures("brushless", "x")
