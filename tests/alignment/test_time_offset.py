"""The offset between video and attitude, from turns as a camera would see them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from alignment_examples import seen_turns, tumbling
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freelook.alignment.image_turns import ImageTurn
from freelook.alignment.live_offset import LiveOffset
from freelook.alignment.time_offset import find_offset, turned_axes
from freelook.attitude_track import AttitudeTrack
from freelook.errors import AttitudeError
from freelook.rotations import angle_between_deg
from freelook.types import Attitude

MS = 1_000_000
# 300 frames, noise of 0.03 degrees a frame beside turns of 1 degree: 0.1 ms; ten times that
CLOSE_NS = 1 * MS


@settings(max_examples=10)
@given(seed=st.integers(0, 1000), delay_ms=st.floats(-2000, 2000), start_s=st.floats(3, 15))
def test_any_offset_is_found(seed: int, delay_ms: float, start_s: float) -> None:
    rng = np.random.default_rng(seed)
    track = tumbling(rng, 30)
    delay_ns = round(delay_ms * MS)
    found = find_offset(seen_turns(track, start_s, 10, delay_ns, rng), track)
    assert abs(found.offset_ns + delay_ns) < CLOSE_NS
    assert found.sure
    assert found.correlation > 0.95


def test_clocks_may_begin_anywhere(rng: np.random.Generator) -> None:
    track = tumbling(rng, 60)
    apart_ns = 7 * 10**15
    turns = seen_turns(track, 20, 12, apart_ns, rng)
    assert abs(find_offset(turns, track).offset_ns + apart_ns) < CLOSE_NS


def test_frames_without_a_turn_and_wrong_ones_do_little_harm(rng: np.random.Generator) -> None:
    track = tumbling(rng, 30)
    turns = seen_turns(track, 5, 15, 120 * MS, rng)
    for index in rng.permutation(len(turns))[:60]:
        wrong = Rotation.random(random_state=int(index)).as_rotvec() * 0.1
        turns[index] = dataclasses.replace(turns[index], turn=wrong)
    del turns[100:140], turns[200:203]
    found = find_offset(turns, track)
    assert abs(found.offset_ns + 120 * MS) < CLOSE_NS


def test_uncertainty_is_what_repeated_trials_scatter_by(rng: np.random.Generator) -> None:
    track = tumbling(rng, 20)
    found = [
        find_offset(seen_turns(track, 5, 6, 50 * MS, rng, noise_deg=0.3), track) for _ in range(20)
    ]
    scatter = float(np.std([f.offset_ns for f in found]))
    claimed = float(np.mean([f.uncertainty_ns for f in found]))
    # a standard deviation from 20 trials is good to 16 percent; two of these, and the model's
    assert claimed == pytest.approx(scatter, rel=0.45)


def test_a_vehicle_at_rest_tells_nothing(rng: np.random.Generator) -> None:
    moving = tumbling(rng, 20)
    still = AttitudeTrack(moving.times_ns, moving.world_from_body[np.zeros(2000, int)])
    found = find_offset(seen_turns(still, 3, 10, 0, rng), still)
    assert not found.sure
    assert found.confidence < 0.1


def test_the_log_of_another_flight_is_not_believed(rng: np.random.Generator) -> None:
    turns = seen_turns(tumbling(rng, 30), 5, 15, 0, rng)
    found = find_offset(turns, tumbling(rng, 30))
    assert not found.sure


def test_a_motion_that_repeats_itself_is_not_believed(rng: np.random.Generator) -> None:
    times_s = np.arange(0, 30, 0.01)
    angles = np.zeros((len(times_s), 3))
    angles[:, 2] = 0.3 * np.sin(2 * np.pi * times_s)
    swing = AttitudeTrack(
        np.round(times_s * 1e9).astype(np.int64), Rotation.from_euler("ZYX", angles)
    )
    turns = seen_turns(swing, 10, 10, 0, rng)
    assert not find_offset(turns, swing).sure
    # but one who knows it within half a period can say so
    narrow = find_offset(turns, swing, (-400 * MS, 400 * MS))
    assert abs(narrow.offset_ns) < CLOSE_NS


def test_too_little_is_refused_with_the_reason(rng: np.random.Generator) -> None:
    track = tumbling(rng, 20)
    with pytest.raises(AttitudeError, match=r"only 0\.9 s .* 2 s are needed"):
        find_offset(seen_turns(track, 3, 1, 0, rng)[:28], track)
    with pytest.raises(AttitudeError, match="too little time in common"):
        find_offset(seen_turns(track, 3, 5, 10**12, rng), track, (0, 10**9))


@pytest.mark.parametrize("wrong_deg", [(0, 0, 90), (30, -40, 10), (180, 0, 0)])
def test_a_camera_that_is_mounted_differently_is_recognised(
    rng: np.random.Generator, wrong_deg: tuple[float, float, float]
) -> None:
    """What the lens and --mount call the body is turned against the real one."""
    body_from_told = Rotation.from_euler("ZYX", wrong_deg, degrees=True)
    track = tumbling(rng, 25)
    turns = [
        dataclasses.replace(turn, turn=body_from_told.inv().apply(turn.turn))
        for turn in seen_turns(track, 5, 12, 120 * MS, rng)
    ]
    axes = turned_axes(turns, track)
    assert axes is not None
    assert axes.correlation > 0.95
    assert find_offset(turns, track).correlation < 0.8
    # rates on a grid of 10 ms, the best lag of which is up to 5 ms away
    assert angle_between_deg(axes.body_from_told, body_from_told) < 3


def test_another_flight_s_log_is_no_matter_of_mounting(rng: np.random.Generator) -> None:
    axes = turned_axes(seen_turns(tumbling(rng, 30), 5, 15, 0, rng), tumbling(rng, 30))
    assert axes is not None
    assert axes.correlation < 0.8


def test_logs_of_any_length_are_answered_or_refused(rng: np.random.Generator) -> None:
    track = tumbling(rng, 20)
    turns = seen_turns(track, 3, 10, 0, rng)
    late = np.append(track.times_ns, track.times_ns[-1] + 10**17)
    years = AttitudeTrack(late, Rotation.concatenate([track.world_from_body, turned(0)]))
    with pytest.raises(AttitudeError, match="too long to look"):
        find_offset(turns, years)
    found = find_offset(turns, years, (-(10**9), 10**9))
    assert abs(found.offset_ns) < CLOSE_NS
    moment = AttitudeTrack(np.array([0, 1]), Rotation.concatenate([turned(0), turned(1)]))
    with pytest.raises(AttitudeError, match="too little time in common"):
        find_offset(turns, moment)


def turned(yaw_deg: float) -> Rotation:
    return Rotation.from_euler("Z", yaw_deg, degrees=True)


def test_the_evidence_is_told_in_words(rng: np.random.Generator) -> None:
    track = tumbling(rng, 20)
    text = find_offset(seen_turns(track, 3, 10, 120 * MS, rng), track).evidence
    assert text.startswith(("confidence 0.9", "confidence 1.0"))
    assert "degrees a second" in text


def fed(
    live: LiveOffset, track: AttitudeTrack, turns: list[ImageTurn], until_s: int, from_s: int = 0
) -> None:
    """Everything up to a time, refined every two seconds."""
    rotations = track.world_from_body
    attitudes = [Attitude(t, rotations[i]) for i, t in enumerate(track.times_ns.tolist())]
    for second in range(from_s, until_s):
        start = track.start_ns + second * 10**9
        for attitude in attitudes[second * 100 : second * 100 + 100]:
            live.push_attitude(attitude)
        for turn in turns:
            if start <= turn.end_ns < start + 10**9:
                live.push_turn(turn)
        if second % 2:
            live.refine(start + 10**9)


def test_flying_it_is_found_and_refined(rng: np.random.Generator) -> None:
    track = tumbling(rng, 40)
    live = LiveOffset(window_s=10)
    assert live.state == "searching"
    assert live.offset_ns == 0
    fed(live, track, seen_turns(track, 0, 39, 120 * MS, rng, noise_deg=0.3), 12)
    assert live.state == "found"
    early = live.deviation_ns
    assert abs(live.offset_ns + 120 * MS) < 3 * MS  # ten times the noise of above
    assert live.latest is not None
    assert live.latest.sure
    assert 0 < early < 2 * MS


def test_flying_a_new_delay_is_followed_once_it_is_certain(rng: np.random.Generator) -> None:
    track = tumbling(rng, 36)
    turns = seen_turns(track, 0, 12, 120 * MS, rng) + seen_turns(track, 13, 22, 300 * MS, rng)
    live = LiveOffset(window_s=8)
    fed(live, track, turns, 12)
    assert abs(live.offset_ns + 120 * MS) < CLOSE_NS
    fed(live, track, turns, 34, from_s=12)
    assert abs(live.offset_ns + 300 * MS) < CLOSE_NS


def test_flying_what_the_user_set_stays(rng: np.random.Generator) -> None:
    track = tumbling(rng, 20)
    live = LiveOffset(window_s=10)
    live.set(-77 * MS)
    fed(live, track, seen_turns(track, 0, 19, 120 * MS, rng), 15)
    assert (live.offset_ns, live.state, live.deviation_ns) == (-77 * MS, "set by the user", 0)
    assert live.latest is not None
    assert abs(live.latest.offset_ns + 120 * MS) < CLOSE_NS  # shown beside it
    live.search()
    assert live.state == "searching"


def test_flying_without_motion_nothing_is_claimed(rng: np.random.Generator) -> None:
    live = LiveOffset(window_s=10)
    assert live.refine(0) is None
    moving = tumbling(rng, 10)
    still = AttitudeTrack(moving.times_ns, moving.world_from_body[np.zeros(1000, int)])
    fed(live, still, seen_turns(still, 0, 9, 0, rng), 9)
    assert live.state == "searching"
    assert np.isinf(live.deviation_ns)
