from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.axes import parse_axes
from freelook.clock import NS_PER_S
from freelook.errors import TrackerError
from freelook.pose_script import parse_script, read_script
from freelook.rotations import (
    FRD_FROM_RDF,
    angle_between_deg,
    body_from_view,
    from_wxyz,
    head_angles_deg,
)

ANGLES = "t_s,yaw_deg,pitch_deg,roll_deg\n"
QUATERNIONS = "t_s,qw,qx,qy,qz\n"


def test_angles_are_met_at_their_times_and_turned_between() -> None:
    script = parse_script(ANGLES + "0,0,0,0\n1,40,0,0\n3,40,20,0\n")
    assert script.duration_ns == 3 * NS_PER_S
    for t_s, angles in [(0, (0, 0, 0)), (0.5, (20, 0, 0)), (1, (40, 0, 0)), (2, (40, 10, 0))]:
        pose = script.pose_at(int(t_s * NS_PER_S))
        assert head_angles_deg(pose) == pytest.approx(angles)


def test_ends_are_held() -> None:
    script = parse_script(ANGLES + "1,10,0,0\n2,20,0,0\n")
    assert head_angles_deg(script.pose_at(0))[0] == pytest.approx(10)
    assert head_angles_deg(script.pose_at(-5))[0] == pytest.approx(10)
    assert head_angles_deg(script.pose_at(2 * NS_PER_S))[0] == pytest.approx(20)
    assert head_angles_deg(script.pose_at(10**15))[0] == pytest.approx(20)


def test_between_two_poses_it_goes_the_short_way() -> None:
    script = parse_script(ANGLES + "0,170,0,0\n1,-170,0,0\n")
    assert abs(head_angles_deg(script.pose_at(NS_PER_S // 2))[0]) == pytest.approx(180)


def test_quaternions_of_either_sign() -> None:
    half = np.sqrt(0.5)
    script = parse_script(QUATERNIONS + f"0,1,0,0,0\n1,{-half},0,{-half},0\n")
    assert head_angles_deg(script.pose_at(0)) == pytest.approx((0, 0, 0))
    assert head_angles_deg(script.pose_at(NS_PER_S)) == pytest.approx((90, 0, 0))
    assert head_angles_deg(script.pose_at(NS_PER_S // 2)) == pytest.approx((45, 0, 0))


@pytest.mark.parametrize("line", ["0,10,20,30", "0,0.9515485,0.1893079,0.0381346,0.2392983"])
def test_axes_apply_to_both_kinds(line: str) -> None:
    header = ANGLES if line.count(",") == 3 else QUATERNIONS
    plain = head_angles_deg(parse_script(header + line).pose_at(0))
    script = parse_script(header + line, parse_axes({"yaw": "-yaw", "roll": "pitch"}))
    yaw, pitch, _ = plain
    assert head_angles_deg(script.pose_at(0)) == pytest.approx((-yaw, pitch, pitch))


def test_blank_lines_blanks_carriage_returns_and_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_bytes(b"\xef\xbb\xbft_s, yaw_deg, pitch_deg, roll_deg\r\n\r\n 0, 5, 0, 0\r\n1,6,0,0")
    script = read_script(path)
    assert len(script.times_ns) == 2
    assert head_angles_deg(script.pose_at(NS_PER_S))[0] == pytest.approx(6)


FAULTS = [
    ("", r"empty; it must begin with 't_s,yaw_deg,pitch_deg,roll_deg' or 't_s,qw,qx,qy,qz'"),
    ("0,1,2,3\n", r"line 1: the header must be"),
    ("t_s,yaw_deg,pitch_deg,roll_deg,extra\n0,1,2,3,4", r"line 1: the header must be"),
    ("t_s,yaw_deg,roll_deg,pitch_deg\n0,1,2,3", r"line 1: the header must be"),
    (ANGLES, r"no poses below the header"),
    (ANGLES + "0,1,2,3\n1,2,", r"line 3: 3 values where 4 are needed: '1,2,'"),
    (ANGLES + "0,1,2,3,4", r"line 2: 5 values where 4 are needed"),
    (ANGLES + "0,1,2,", r"line 2: roll_deg must be a number, not ''"),
    (ANGLES + "0,1,x,3", r"line 2: pitch_deg must be a number, not 'x'"),
    (ANGLES + "0,1,nan,3", r"line 2: pitch_deg must be a finite number, not nan"),
    (ANGLES + "inf,1,2,3", r"line 2: t_s must be a finite number"),
    (ANGLES + "0,1e9,2,3", r"line 2: yaw = 1000000000\.0 degrees is not an angle"),
    (ANGLES + "-1,1,2,3", r"line 2: t_s must be 0 to 1000000 seconds, not -1"),
    (ANGLES + "0,1,2,3\n2,1,2,3\n1.5,1,2,3", r"line 4: t_s = 1\.5 is not after the line before"),
    (ANGLES + "0,1,2,3\n\n0,1,2,3", r"line 4: t_s = 0 is not after the line before"),
    (QUATERNIONS + "0,1,1,0,0", r"line 2: the quaternion .* is not of unit length"),
    (QUATERNIONS + "0,0,0,0,0", r"line 2: the quaternion .* is not of unit length"),
]


@pytest.mark.parametrize(("text", "words"), FAULTS, ids=[words for _, words in FAULTS])
def test_faults_are_named_with_their_line(text: str, words: str) -> None:
    with pytest.raises(TrackerError, match=words):
        parse_script(text)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(TrackerError, match=r"nowhere\.csv: No such file"):
        read_script(tmp_path / "nowhere.csv")
    (tmp_path / "video.mp4").write_bytes(bytes(range(256)))
    with pytest.raises(TrackerError, match=r"video\.mp4: not a text file"):
        read_script(tmp_path / "video.mp4")
    (tmp_path / "bad.csv").write_text(ANGLES + "0,1,2\n")
    with pytest.raises(TrackerError, match=r"bad\.csv: line 2: 3 values"):
        read_script(tmp_path / "bad.csv")


@given(st.text(max_size=60) | st.text(alphabet="0123456789,.-+einfa\n\r \0", max_size=60))
def test_any_text_is_a_script_or_an_error(text: str) -> None:
    for whole in (text, ANGLES + text, QUATERNIONS + text):
        try:
            script = parse_script(whole)
        except TrackerError:
            continue
        assert np.isfinite(script.pose_at(script.duration_ns // 2).as_quat()).all()


@given(
    st.lists(
        st.tuples(st.floats(0, 1000), st.floats(-180, 180), st.floats(-90, 90), st.floats()),
        min_size=1,
        max_size=6,
    )
)
def test_any_numbers_are_a_script_or_an_error(rows: list[tuple[float, ...]]) -> None:
    text = ANGLES + "\n".join(",".join(map(repr, row)) for row in rows)
    try:
        script = parse_script(text)
    except TrackerError:
        return
    assert list(script.times_ns) == sorted(set(script.times_ns))


@pytest.mark.data
@pytest.mark.parametrize("user", ["user1", "user2"])
def test_real_head_motion_is_reproduced_and_smooth_between(shared_data: Path, user: str) -> None:
    lines = (shared_data / f"head_motion/{user}_quaternion.txt").read_text().splitlines()[1:]
    rows = [[float(v) for v in line.split()] for line in lines[:3000]]
    kept = [row for before, row in zip([[-1.0], *rows], rows, strict=False) if row[0] > before[0]]
    text = QUATERNIONS + "\n".join(f"{r[0]},{r[2]},{r[3]},{r[4]},{r[5]}" for r in kept)
    script = parse_script(text)
    for row in kept[::50]:
        expected = FRD_FROM_RDF * from_wxyz(row[2:])
        assert angle_between_deg(script.pose_at(round(row[0] * NS_PER_S)), expected) < 1e-4
    # q and -q are one pose: a script that took the long way round would spin between samples
    times = np.arange(0, script.duration_ns, 10_000_000)
    poses = [script.pose_at(int(t)) for t in times]
    steps = [angle_between_deg(a, b) for a, b in pairwise(poses)]
    assert max(steps) < 15, "no head turns at 1500 degrees a second"
    assert max(steps) > 0.5


def test_identity_quaternion_looks_straight_ahead() -> None:
    pose = parse_script(QUATERNIONS + "0,1,0,0,0").pose_at(0)
    assert angle_between_deg(pose, body_from_view(0, 0)) < 1e-9
