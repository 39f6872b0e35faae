"""Whole records of attitude agree with the buffer that answers while flying."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.attitude import AttitudeBuffer
from freelook.attitude_track import AttitudeTrack, collected, track_of
from freelook.errors import AttitudeError
from freelook.rotations import angle_between_deg
from freelook.types import Attitude


def wandering(rng: np.random.Generator, count: int) -> AttitudeTrack:
    times = np.cumsum(rng.integers(1, 700_000_000, count))
    turns = Rotation.from_rotvec(rng.uniform(-1.5, 1.5, (count, 3)))
    return AttitudeTrack(times, turns)


def test_a_track_answers_as_a_buffer_does(rng: np.random.Generator) -> None:
    track = wandering(rng, 30)
    buffer = AttitudeBuffer(span_s=math.inf, extrapolate_s=0.0)
    for t_ns, turn in zip(track.times_ns.tolist(), track.world_from_body, strict=True):
        buffer.push(Attitude(t_ns, turn))
    asked = rng.integers(track.start_ns - 10**8, track.times_ns[-1] + 10**8, 300)
    asked = np.concatenate([asked, track.times_ns])
    found, known = track.at(asked), track.known(asked)
    assert 0 < known.sum() < len(known)
    for index, t_ns in enumerate(asked.tolist()):
        single = buffer.at(t_ns)
        assert (single is not None) == known[index]
        if single is not None:
            assert angle_between_deg(single, found[index]) < 1e-6


def test_before_and_after_a_track_its_ends_are_held(rng: np.random.Generator) -> None:
    track = wandering(rng, 5)
    found = track.at(np.array([track.start_ns - 10**9, track.times_ns[-1] + 10**9]))
    assert angle_between_deg(found[0], track.world_from_body[0]) < 1e-6
    assert angle_between_deg(found[1], track.world_from_body[-1]) < 1e-6


def test_a_part_answers_for_its_time_as_the_whole_does(rng: np.random.Generator) -> None:
    track = wandering(rng, 30)
    for start, end in ((5, 12), (0, 29), (20, 20), (-3, 2), (28, 40)):
        low = int(track.start_ns + start * 3 * 10**8)
        high = int(track.start_ns + end * 3 * 10**8)
        asked = np.linspace(low, high, 50).astype(np.int64)
        part = track.part(low, high)
        assert np.array_equal(part.known(asked), track.known(asked))
        apart = (part.at(asked).inv() * track.at(asked)).magnitude()
        assert np.degrees(apart[track.known(asked)].max(initial=0.0)) < 1e-6
    assert len(track.part(0, 1).times_ns) == 2
    assert len(track.part(10**18, 10**18 + 1).times_ns) == 2


def test_rates_lead_from_each_attitude_to_the_next(rng: np.random.Generator) -> None:
    track = wandering(rng, 20)
    middles, rates = track.rates()
    steps_s = np.diff(track.times_ns) / 1e9
    led = track.world_from_body[:-1] * Rotation.from_rotvec(rates * steps_s[:, None])
    assert np.degrees((led.inv() * track.world_from_body[1:]).magnitude().max()) < 1e-6
    assert np.all((middles > track.times_ns[:-1]) & (middles < track.times_ns[1:]))


def test_what_is_no_attitude_is_left_out() -> None:
    times = np.array([5, 1, 6, 7, 7, 8, 9])
    xyzw = np.tile([0.0, 0.0, 0.0, 2.0], (7, 1))
    xyzw[2] = np.nan
    xyzw[5] = 0.0
    assert track_of(times, xyzw).times_ns.tolist() == [5, 7, 9]


@pytest.mark.parametrize("times", [[], [3], [3, 3], [3, 2]])
def test_fewer_than_two_attitudes_are_no_track(times: list[int]) -> None:
    with pytest.raises(AttitudeError, match=r"at least two.*usable here: [01]"):
        collected([Attitude(t_ns, Rotation.identity()) for t_ns in times])


def test_a_track_made_of_disorder_is_refused() -> None:
    turns = Rotation.from_rotvec(np.zeros((2, 3)))
    with pytest.raises(AttitudeError, match="in the order of time"):
        AttitudeTrack(np.array([2, 1]), turns)
