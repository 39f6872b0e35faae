"""Heads that drive a duel: the right way round, smooth, and honest about what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.duel.head import (
    HeadMotion,
    angles_of,
    body_from_angles,
    minimum_jerk,
    read_head,
    synthetic_head,
    turn_starts_s,
    turns_head,
)
from freelook.errors import TrackerError
from freelook.rotations import angle_between_deg, body_from_view

COS, SIN = np.cos(np.radians(15)), np.sin(np.radians(15))  # of half of 30 degrees


def recording(tmp_path: Path, *rows: str) -> Path:
    path = tmp_path / "head.txt"
    path.write_text("\n".join(["timestamp viewpoint w x y z", *rows]) + "\n")
    return path


@pytest.mark.parametrize(
    ("quaternion", "angles"),
    [
        ((1, 0, 0, 0), (0, 0, 0)),
        ((COS, 0, 0, SIN), (-30, 0, 0)),  # about up, anticlockwise from above: to the left
        ((COS, 0, -SIN, 0), (0, 30, 0)),  # about left, nose from forward to up
        ((COS, SIN, 0, 0), (0, 0, 30)),  # about forward, left ear up: right ear down
    ],
)
def test_a_recording_turns_the_right_way(
    tmp_path: Path, quaternion: tuple[float, ...], angles: tuple[float, ...]
) -> None:
    row = " ".join(str(value) for value in quaternion)
    head = read_head(recording(tmp_path, f"0 0 {row}", f"1 0 {row}", "2 0 1 0 0 0"))
    expected = body_from_view(*angles)
    assert angle_between_deg(head.poses[0], expected) < 1e-9


def test_poses_that_repeat_are_left_out_also_with_the_other_sign(tmp_path: Path) -> None:
    rows = ["0.5 0 1 0 0 0", "0.6 0 1 0 0 0", "0.7 1 -1 0 0 0", "0.8 1 0.8 0 0 0.6", "1 1 1 0 0 0"]
    head = read_head(recording(tmp_path, *rows))
    assert head.times_ns.tolist() == [0, 300_000_000, 500_000_000]
    assert head.name == "head"


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([], "no poses"),
        (["0 0 1 0 0"], "line 2: numbers for timestamp w x y z"),
        (["0 0 1 0 0 0", "1 0 one 0 0 0"], "line 3"),
        (["0 0 1 0 0 nan"], "line 2"),
        (["0 0 2 0 0 0"], "unit length"),
        (["0 0 1 0 0 0", "1e300 0 1 0 0 0"], "line 3: a time of 1e\\+300 s is none"),
        (["1 0 1 0 0 0", "0.5 0 0.8 0 0 0.6"], "backward at 0.5"),
    ],
)
def test_wrong_recordings_say_where(tmp_path: Path, rows: list[str], words: str) -> None:
    with pytest.raises(TrackerError, match=words):
        read_head(recording(tmp_path, *rows))


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(TrackerError, match="No such file"):
        read_head(tmp_path / "absent.txt")
    (tmp_path / "bytes").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(TrackerError, match="not a text file"):
        read_head(tmp_path / "bytes")
    (tmp_path / "other.csv").write_text("a,b,c\n")
    with pytest.raises(TrackerError, match="must name the columns timestamp w x y z"):
        read_head(tmp_path / "other.csv")


def test_columns_are_found_by_their_names(tmp_path: Path) -> None:
    path = tmp_path / "other.csv"
    path.write_text("x,y,z,w,timestamp\n0,0,0,1,3\n0,0,0.6,0.8,4\n")
    head = read_head(path)
    assert head.duration_ns == 1_000_000_000
    yaw = -2 * np.degrees(np.arctan2(0.6, 0.8))
    assert angle_between_deg(head.poses[1], body_from_view(yaw, 0)) < 1e-9


def test_a_pose_script_is_a_head_too(tmp_path: Path) -> None:
    path = tmp_path / "script.csv"
    path.write_text("t_s,yaw_deg,pitch_deg,roll_deg\n1,0,0,0\n2,40,10,0\n3,40,10,5\n")
    head = read_head(path)
    assert head.duration_ns == 2_000_000_000
    assert angle_between_deg(head.poses[1], body_from_view(40, 10)) < 1e-9


def test_between_samples_it_moves_smoothly_and_through_them() -> None:
    head = synthetic_head(10)
    assert angle_between_deg(head.at(head.times_ns[500:501])[0], head.poses[500]) < 1e-6
    t_ns = np.arange(0, head.duration_ns, 1_000_000, dtype=np.int64)
    yaw, pitch, _roll = angles_of(head.at(t_ns))
    acceleration = np.diff(yaw, 2) * 1e6
    # the fastest glance: 5.77 D / T^2 with D / T = 300 / 1.875 and T = 0.3 s; and some of it
    # more where two axes turn at once
    assert np.abs(acceleration).max() < 5000
    assert np.ptp(yaw) > 40
    assert np.ptp(pitch) > 10


def test_it_rests_before_and_after() -> None:
    head = synthetic_head(3)
    outside = head.at(np.array([-5_000_000_000, 99_000_000_000], dtype=np.int64))
    assert angle_between_deg(outside[0], head.poses[0]) < 1e-6
    assert angle_between_deg(outside[1], head.poses[-1]) < 1e-6


def test_a_cut_counts_from_its_own_start_and_must_hold_something() -> None:
    head = synthetic_head(5)
    cut = head.cut(1_000_000_000, 3_000_000_000)
    assert cut.duration_ns == 2_000_000_000
    assert angle_between_deg(cut.poses[0], head.poses[100]) < 1e-9
    with pytest.raises(TrackerError, match=r"nothing between 9 and 12 s; it lasts 5\.0 s"):
        head.cut(9_000_000_000, 12_000_000_000)


def test_centred_means_ahead_on_average() -> None:
    yaw = np.array([150.0, 170.0, -170.0, -150.0])  # to both sides of straight behind
    poses = body_from_angles(np.stack([yaw, np.full(4, 10.0), np.zeros(4)]))
    head = HeadMotion("behind", np.arange(4) * 10**9, poses).centred()
    angles = (angles_of(head.poses)[0] + 180) % 360 - 180
    assert angles == pytest.approx([-30, -10, 10, 30], abs=1e-9)
    assert angles_of(head.poses)[1] == pytest.approx(np.full(4, 10.0))  # pitch stays


def test_angles_have_no_jumps_by_a_turn() -> None:
    yaw = np.linspace(0, 800, 90)
    poses = body_from_angles(np.stack([yaw, np.full(90, -20.0), np.full(90, 7.0)]))
    found = angles_of(poses)
    assert found[0] == pytest.approx(yaw)
    assert found[1:] == pytest.approx(np.tile([[-20.0], [7.0]], 90))


def test_turns_are_as_large_and_as_quick_as_they_say() -> None:
    head = turns_head()
    starts = np.rint(turn_starts_s() * 1e9).astype(np.int64)
    bend = 2e-3  # degrees: a spline through a profile sampled every 10 ms
    right = angles_of(head.at(starts[0] + np.array([0, 200, 400, 1000]) * 1_000_000))[0]
    assert right == pytest.approx([0, 30, 60, 60], abs=bend)
    back = angles_of(head.at(starts[1] + np.array([0, 200, 400]) * 1_000_000))[0]
    assert back == pytest.approx([60, 30, 0], abs=bend)
    assert minimum_jerk(np.array([-1.0, 0.0, 0.5, 1.0, 2.0])).tolist() == [0, 0, 0.5, 1, 1]


def test_the_made_up_head_is_the_same_every_time() -> None:
    a, b = synthetic_head(4), synthetic_head(4)
    assert (a.poses.as_quat() == b.poses.as_quat()).all()
    assert a.name == "synthetic head"
    assert isinstance(a.poses, Rotation)
