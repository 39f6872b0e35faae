"""Trackers that move by themselves: the wandering head and the written script."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from freelook.axes import AxisMap
from freelook.clock import NS_PER_S, FakeClock
from freelook.pose_script import parse_script
from freelook.rotations import angle_between_deg, head_angles_deg
from freelook.trackers import open_tracker
from freelook.trackers.script import Player
from freelook.trackers.wander import Wander, wander_deg

SCRIPT = "t_s,yaw_deg,pitch_deg,roll_deg\n0,0,0,0\n2,40,0,0\n"


def yaw_of(player: Player, t_s: float) -> float:
    pose = player.sample(round(t_s * NS_PER_S))
    assert pose is not None
    return head_angles_deg(pose)[0]


def test_a_script_starts_when_it_is_first_asked() -> None:
    player = Player(parse_script(SCRIPT), loop=False)
    assert yaw_of(player, 100) == pytest.approx(0)
    assert yaw_of(player, 101) == pytest.approx(20)
    assert yaw_of(player, 102.5) == pytest.approx(40)
    assert player.message == "the script has ended"
    with pytest.raises(StopIteration):
        player.sample(103 * NS_PER_S)


def test_a_looped_script_starts_over() -> None:
    player = Player(parse_script(SCRIPT), loop=True)
    assert [yaw_of(player, t) for t in (0, 1, 3, 5)] == pytest.approx([0, 20, 20, 20])


def test_a_script_played_to_its_end_ends_the_tracker(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("t_s,yaw_deg,pitch_deg,roll_deg\n0,0,0,0\n0.05,5,0,0\n")
    poses = list(open_tracker(f"script:{path}?rate=200").poses())
    yaws = [head_angles_deg(p.body_from_view)[0] for p in poses]
    assert yaws == sorted(yaws)
    assert yaws[-1] == pytest.approx(5)
    assert len(poses) >= 2


def test_a_standing_clock_does_not_stop_a_polled_tracker() -> None:
    poses = open_tracker("wander?rate=1000", clock=FakeClock(5)).poses()
    assert [next(poses).t_ns for _ in range(5)] == [5] * 5


def test_wandering_begins_straight_ahead_and_stays_gentle() -> None:
    assert wander_deg(0) == (0, 0, 0)
    times = np.arange(0, 300, 0.05)
    yaw, pitch, roll = np.abs([wander_deg(t) for t in times]).max(axis=0)
    assert 30 < yaw <= 50
    assert 8 < pitch <= 15
    assert 3 < roll <= 7
    wander = Wander(AxisMap())
    poses = [wander.sample(round(t * NS_PER_S)) for t in times[:1200]]
    fastest = max(angle_between_deg(a, b) for a, b in pairwise(poses)) / 0.05
    assert fastest < 40


def test_wandering_is_a_function_of_time_alone() -> None:
    a, b = Wander(AxisMap()), Wander(AxisMap())
    a.sample(0), b.sample(7 * NS_PER_S)
    a.sample(2 * NS_PER_S)
    assert angle_between_deg(a.sample(5 * NS_PER_S), b.sample(12 * NS_PER_S)) < 1e-9
