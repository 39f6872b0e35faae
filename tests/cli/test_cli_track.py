"""freelook track and track send."""

from __future__ import annotations

import io
import re
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.axes import AxisMap
from freelook.cli import main
from freelook.cli._pose_meter import PoseMeter, Reading
from freelook.cli._track_table import bar, line, table
from freelook.cli.track_send import destination
from freelook.clock import NS_PER_MS, now_ns
from freelook.errors import TrackerError
from freelook.pose_script import read_script
from freelook.rotations import body_from_view, head_angles_deg
from freelook.trackers.opentrack import OpenTrack
from freelook.types import Pose

MS = NS_PER_MS
HEADER = "t_s,yaw_deg,pitch_deg,roll_deg\n"


@pytest.fixture
def script(tmp_path: Path) -> str:
    """Half a second of a head that turns to the right."""
    path = tmp_path / "script.csv"
    path.write_text(HEADER + "0,0,10,0\n0.5,50,10,0\n")
    return f"script:{path}?rate=200"


def meter_of(times_ms: list[float], yaw: Callable[[int], float] = lambda n: 0.0) -> PoseMeter:
    meter = PoseMeter()
    for n, t in enumerate(times_ms):
        meter.add(Pose(body_from_view(yaw(n), 20, -5), round(t * MS)))
    return meter


def test_no_pose_no_numbers() -> None:
    reading = PoseMeter().read(5)
    assert reading == Reading(poses=0, dropouts=0)


def test_a_steady_tracker() -> None:
    reading = meter_of([10.0 * n for n in range(301)]).read(3004 * MS)
    assert reading.poses == 301
    assert reading.angles_deg == pytest.approx((0, 20, -5))
    assert reading.rate_hz == pytest.approx(100)
    assert reading.interval_ms == pytest.approx(10)
    assert reading.jitter_ms == pytest.approx(0)
    assert reading.age_ms == pytest.approx(4)
    assert reading.dropouts == 0
    assert reading.spread_deg == pytest.approx((0, 0, 0), abs=1e-9)


def test_jitter_and_the_longest_gap() -> None:
    """Every other pose 2 ms late: intervals of 12 and 8 ms."""
    reading = meter_of([10.0 * n + 2 * (n % 2) for n in range(100)]).read(995 * MS)
    assert reading.jitter_ms == pytest.approx(2, abs=0.01)  # one interval more of one kind
    assert reading.longest_ms == pytest.approx(12)
    assert reading.dropouts == 0


def test_a_gap_is_a_dropout_once() -> None:
    times = [10.0 * n for n in range(50)] + [700 + 10.0 * n for n in range(50)]
    reading = meter_of(times).read(1200 * MS)
    assert reading.dropouts == 1
    assert reading.longest_ms == pytest.approx(210)


def test_a_slow_tracker_has_no_dropouts() -> None:
    assert meter_of([200.0 * n for n in range(20)]).read(4000 * MS).dropouts == 0


def test_spread_is_about_the_mean_and_knows_the_turn() -> None:
    reading = meter_of([10.0 * n for n in range(100)], lambda n: 179.0 + 2 * (n % 2)).read(995 * MS)
    assert reading.spread_deg is not None
    assert reading.spread_deg[0] == pytest.approx(1.0)


def test_a_silent_tracker_ages_and_has_no_rate() -> None:
    reading = meter_of([0.0, 10.0, 20.0]).read(5020 * MS)
    assert reading.age_ms == pytest.approx(5000)
    assert reading.rate_hz is None


@given(st.lists(st.integers(0, 10**12), max_size=30), st.integers(0, 10**12))
def test_any_times_are_measured(times: list[int], now: int) -> None:
    meter = PoseMeter()
    for t in sorted(times):
        meter.add(Pose(body_from_view(1, 2, 3), t))
    reading = meter.read(now)
    assert reading.poses == len(times)
    assert ("yaw +1.00" in line(reading, "", {})) == bool(times)


def test_bar() -> None:
    assert bar(None)[15] == bar(45)[15] == "|"
    assert bar(0)[15] == "█"
    assert (bar(90)[-1], bar(-400)[0]) == ("█", "█")


def test_table_shows_text_of_others_as_it_is() -> None:
    from rich.console import Console

    console = Console(file=io.StringIO(), width=100)
    reading = meter_of([0.0, 10.0, 20.0]).read(25 * MS)
    console.print(table("csv:[red]", reading, "waiting for [/x]", {"received": 3}))
    assert isinstance(console.file, io.StringIO)
    text = console.file.getvalue()
    assert "csv:[red]" in text
    assert "waiting for [/x]" in text
    assert "+20.00°" in text
    assert "100.0 Hz" in text


def test_lines_where_there_is_no_terminal(script: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["track", script]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert re.search(r"yaw \+\d+\.\d\d pitch \+10\.00 roll .0\.00 deg, [\d.]+ Hz, jitter ", last)
    assert "received " in last


def test_a_recording_plays_the_same_poses(script: str, tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    assert main(["track", script, "--record", str(out)]) == 0
    recorded = read_script(out)
    assert 0.2e9 < recorded.duration_ns < 2e9
    angles = head_angles_deg(recorded.poses[-1])
    assert angles == pytest.approx((50, 10, 0), abs=1e-4)
    assert main(["track", f"script:{out}", "--seconds", "0.05"]) == 0


def test_a_recording_is_not_overwritten_unasked(
    script: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.csv"
    out.write_text("precious")
    command = ["track", script, "--seconds", "0.1", "--record", str(out)]
    assert main(command) == 2
    assert "add --overwrite" in capsys.readouterr().err
    assert out.read_text() == "precious"
    assert main([*command, "--overwrite"]) == 0
    assert out.read_text().startswith(HEADER)


def test_no_pose_is_said_and_is_exit_status_1(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["track", "opentrack:127.0.0.1:0", "--seconds", "0.05"]) == 1
    assert "waiting for OpenTrack packets on UDP 127.0.0.1" in capsys.readouterr().out


def test_what_cannot_be_opened_is_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["track", "kinect"]) == 2
    assert "unknown tracker 'kinect'" in capsys.readouterr().err


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "x", "inf"])
def test_seconds_are_checked(seconds: str) -> None:
    with pytest.raises(SystemExit):
        main(["track", "wander", "--seconds", seconds])


def test_ours_is_a_source_for_ours(script: str, wait_until: Callable[..., None]) -> None:
    """Sent, and received with the axes of any OpenTrack source: the same head, nothing lost."""
    receiver = OpenTrack("127.0.0.1", 0, AxisMap(), now_ns)
    poses: list[Pose] = []
    reader = threading.Thread(target=lambda: poses.extend(receiver.poses()))
    reader.start()
    before = now_ns()
    try:
        to = f"opentrack://127.0.0.1:{receiver.address[1]}"
        assert main(["track", "send", script, "--to", to]) == 0
        wait_until(lambda: poses and head_angles_deg(poses[-1].body_from_view)[0] > 49.99)
    finally:
        receiver.close()
        reader.join(5)
    assert head_angles_deg(poses[-1].body_from_view) == pytest.approx((50, 10, 0), abs=1e-6)
    assert set(receiver.counters.values) <= {"received", "dropped"}
    times = [pose.t_ns for pose in poses]
    assert before < times[0]
    assert times == sorted(set(times))


@pytest.mark.parametrize(
    ("url", "expected"),
    [
        ("opentrack://127.0.0.1:4300", ("127.0.0.1", 4300)),
        ("opentrack://station.local/", ("station.local", 4242)),
        ("opentrack://[::1]:0", ("::1", 0)),
    ],
)
def test_destinations(url: str, expected: tuple[str, int]) -> None:
    assert destination(url) == expected


@pytest.mark.parametrize(
    "url",
    ["", "4242", "udp://h:1", "opentrack:4242", "opentrack://h:x", "opentrack://h/x", "o://["],
)
def test_no_destinations(url: str) -> None:
    with pytest.raises(TrackerError, match="is not a place poses can be sent to; for example"):
        destination(url)
