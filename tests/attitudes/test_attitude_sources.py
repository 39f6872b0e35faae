"""Every source of attitude, fed with what other programs write and with rubbish."""

from __future__ import annotations

import itertools
import threading
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import attitude_logs
from freelook import attitudes
from freelook.attitude_track import AttitudeTrack, collected
from freelook.attitudes import csv as csv_log
from freelook.attitudes import open_attitude
from freelook.attitudes._log import LogSource
from freelook.attitudes._pushed import PushedAttitudes
from freelook.errors import AttitudeError, FreelookError
from freelook.types import Attitude

TIMES_US = np.arange(50, dtype=np.int64) * 10_000 + 1_000_000
TURNS = Rotation.from_euler(
    "ZYX", np.stack([np.linspace(170, 200, 50), np.linspace(-20, 10, 50), np.zeros(50)], 1), True
)
WXYZ = attitude_logs.wxyz(TURNS)


def opened(path: Path, text: str | bytes, spec: str = "{}") -> LogSource:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    source = open_attitude(spec.format(path))
    assert isinstance(source, LogSource)
    return source


def largest_error_deg(source: LogSource, truth: Rotation = TURNS) -> float:
    found = collected(source.attitudes())
    assert found.times_ns.tolist() == (TIMES_US * 1000).tolist()
    return float(np.degrees((found.world_from_body.inv() * truth).magnitude().max()))


def csv_text(header: str, times: np.ndarray, values: np.ndarray) -> str:
    rows = [
        ",".join(map(repr, [t, *v])) for t, v in zip(times.tolist(), values.tolist(), strict=True)
    ]
    return "\n".join([header, *rows]) + "\n"


@pytest.mark.parametrize(
    ("header", "scale"),
    [
        ("t_s,qw,qx,qy,qz", 1e-6),
        ("t_s, qw, qx, qy, qz (FRD body -> NED)", 1e-6),
        ("timestamp,q[0],q[1],q[2],q[3]", 1),
        ("timestamp_sample,q[0],q[1],q[2],q[3]", 1),
    ],
)
def test_csv_with_quaternions(tmp_path: Path, header: str, scale: float) -> None:
    source = opened(tmp_path / "a.csv", csv_text(header, TIMES_US * scale, WXYZ))
    assert largest_error_deg(source) < 1e-6  # sixteen digits
    assert source.counters.values == {}


def test_csv_with_angles_and_other_columns_in_another_order(tmp_path: Path) -> None:
    yaw, pitch, roll = TURNS.as_euler("ZYX", degrees=True).T
    values = np.stack([yaw, np.full(50, 7.0), roll, pitch], axis=1)
    text = csv_text("t_s,yaw_deg,north_m,roll_deg,pitch_deg", TIMES_US * 1e-6, values)
    assert largest_error_deg(opened(tmp_path / "a.csv", text)) < 1e-6


def test_csv_lines_that_are_not_numbers_are_counted(tmp_path: Path) -> None:
    text = csv_text("t_s,qw,qx,qy,qz", TIMES_US * 1e-6, WXYZ)
    text += "9,oh,0,0,1\n9.5,1,0\n\n9.6,,0,0,1\n0.2,1,0,0,0\n"
    source = opened(tmp_path / "a.csv", text)
    assert largest_error_deg(source) < 1e-6
    assert source.counters.values == {"malformed": 2, "left out": 2}


def test_csv_lines_whose_time_is_no_time_are_counted_too(tmp_path: Path) -> None:
    text = csv_text("t_s,qw,qx,qy,qz", TIMES_US * 1e-6, WXYZ) + "nan,1,0,0,0\n1e300,1,0,0,0\n"
    source = opened(tmp_path / "a.csv", text)
    assert largest_error_deg(source) < 1e-6
    assert source.counters.values == {"malformed": 2}


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "empty"),
        ("qw,qx,qy,qz\n1,0,0,0\n", "t_s or timestamp"),
        ("t_s,a,b\n1,2,3\n", "there are: t_s, a, b"),
        ("t_s,qw,qx,qy,qz\n1,1,0,0,0\n", "at least two"),
        ("t_s,gx,gy,gz\n1,0,0,0\n", "fewer than two"),
        ("t_s,qw,qx,qy,qz\n", "at least two"),
        ("t_s,gx,gy,gz\n0,0,0,0\n1e9,0,0,0\n", "11574.1 days; are they right"),
        (b"\xff\xfe\x00", "not a text file"),
    ],
)
def test_csv_that_is_no_log_says_why(tmp_path: Path, text: str | bytes, complaint: str) -> None:
    with pytest.raises(AttitudeError, match=complaint):
        opened(tmp_path / "a.csv", text)


numbers = st.one_of(
    st.floats(width=32), st.floats(-10, 10), st.sampled_from(["", "x", "1e999", "-nan", "1_0"])
).map(str)


@given(
    st.sampled_from(["qw,qx,qy,qz", "roll_deg,pitch_deg,yaw_deg", "gx,gy,gz,ax,ay,az", "gx,gy,gz"]),
    st.lists(st.lists(numbers, min_size=1, max_size=8), max_size=12),
)
def test_csv_survives_anything(columns: str, rows: list[list[str]]) -> None:
    text = "\n".join([f"t_s,{columns}", *(",".join(row) for row in rows)])
    try:
        source = csv_log.parse(text, "hostile")
    except AttitudeError:
        return
    found = list(source.attitudes())
    assert len(found) >= 2
    assert all(np.isfinite(a.world_from_body.as_quat()).all() for a in found)
    assert all(a.t_ns < b.t_ns for a, b in itertools.pairwise(found))


def test_ulog_with_the_autopilot_s_attitude(tmp_path: Path) -> None:
    pytest.importorskip("pyulog")
    log = attitude_logs.ulog("vehicle_attitude", "float[4] q", TIMES_US, WXYZ)
    # floats of 24 bits: 6e-8 of a quaternion are 7e-6 degrees
    assert largest_error_deg(opened(tmp_path / "a.ulg", log)) < 2e-5


def test_ulog_with_sensors_only_is_integrated(tmp_path: Path) -> None:
    pytest.importorskip("pyulog")
    values = np.zeros((50, 6))
    values[:, 2], values[:, 5] = 0.5, -9.81
    fields = "float[3] gyro_rad;float[3] accelerometer_m_s2"
    source = opened(
        tmp_path / "a.ulg", attitude_logs.ulog("sensor_combined", fields, TIMES_US, values)
    )
    truth = Rotation.from_euler("ZYX", [[t * 0.5e-6, 0, 0] for t in TIMES_US - TIMES_US[0]])
    assert largest_error_deg(source, truth) < 1e-4  # as above, summed up
    assert "gyroscope" in source.notes[0]


@pytest.mark.parametrize("kind", ["XKQ", "VSTB"])
def test_dataflash_with_quaternions(tmp_path: Path, kind: str) -> None:
    pytest.importorskip("pymavlink")
    rows = [(t, 0, *q) for t, q in zip(TIMES_US.tolist(), WXYZ.tolist(), strict=True)]
    second = [(t, 1, 1.0, 0.0, 0.0, 0.0) for t in TIMES_US.tolist()]
    both = [row for pair in zip(rows, second, strict=True) for row in pair]
    log = attitude_logs.dataflash(kind, "TimeUS,C,Q1,Q2,Q3,Q4", "QBffff", both)
    assert largest_error_deg(opened(tmp_path / "a.bin", log)) < 2e-5


def test_dataflash_with_angles(tmp_path: Path) -> None:
    pytest.importorskip("pymavlink")
    yaw, pitch, roll = TURNS.as_euler("ZYX", degrees=True).T
    rows = [
        (t, r * 100, p * 100, (y % 360) * 100)
        for t, r, p, y in zip(TIMES_US.tolist(), roll, pitch, yaw, strict=True)
    ]
    log = attitude_logs.dataflash("ATT", "TimeUS,Roll,Pitch,Yaw", "QccC", rows)
    # two angles rounded to hundredths
    assert largest_error_deg(opened(tmp_path / "a.bin", log)) < 0.008


def test_dataflash_takes_what_was_logged_most_often(tmp_path: Path) -> None:
    pytest.importorskip("pymavlink")
    yaw, pitch, roll = TURNS.as_euler("ZYX", degrees=True).T
    columns = (TIMES_US.tolist(), roll, pitch, yaw % 360)
    angles = [(t, r * 100, p * 100, y * 100) for t, r, p, y in zip(*columns, strict=True)]
    rare = [(t, 0, *q) for t, q in zip(TIMES_US.tolist()[::5], WXYZ.tolist()[::5], strict=True)]
    log = attitude_logs.dataflash("ATT", "TimeUS,Roll,Pitch,Yaw", "QccC", angles)
    log += attitude_logs.dataflash("XKQ", "TimeUS,C,Q1,Q2,Q3,Q4", "QBffff", rare, number=201)
    assert largest_error_deg(opened(tmp_path / "a.bin", log)) < 0.008


def test_dataflash_without_attitude_says_so(tmp_path: Path) -> None:
    pytest.importorskip("pymavlink")
    rows = [(t, 1.0) for t in TIMES_US.tolist()]
    log = attitude_logs.dataflash("BARO", "TimeUS,Alt", "Qf", rows)
    with pytest.raises(AttitudeError, match="none of ATT, VSTB"):
        opened(tmp_path / "a.bin", log)


@pytest.mark.parametrize("name", ["a.ulg", "a.bin", "a.log", "a.gcsv", "a.mp4"])
@pytest.mark.parametrize(
    "content", [b"", b"rubbish" * 100, bytes(4000), b"\xa3\x95\x80" + b"rubbish" * 100]
)
def test_files_that_are_no_logs_are_refused(tmp_path: Path, name: str, content: bytes) -> None:
    with pytest.raises(AttitudeError, match=name):
        opened(tmp_path / name, content)


def test_gcsv_axes_end_up_forward_right_down(tmp_path: Path) -> None:
    """A turn to the right, then one with the nose up, in an IMU that lies as `XYZ` says."""
    pytest.importorskip("telemetry_parser")
    times_ms = np.arange(0, 400, 10.0)
    rates, felt = np.zeros((40, 3)), np.zeros((40, 3))
    rates[:20, 0] = -1.0  # x up, so minus is to the right
    rates[20:, 1] = -1.0  # y left, so minus is nose up
    nose_up = np.maximum(times_ms - 195, 0) / 1000
    felt[:, 0], felt[:, 2] = np.cos(nose_up), -np.sin(nose_up)  # gravity's reaction
    source = opened(tmp_path / "a.gcsv", attitude_logs.gcsv(times_ms, rates, felt, "XYZ"))
    turns = source.track.world_from_body
    yaw, pitch, roll = turns.as_euler("ZYX", degrees=True).T
    # numbers are rounded to 1e-4, and half a sample is lost where the axis changes
    assert yaw[19] == pytest.approx(np.degrees(0.19), abs=0.1)
    assert yaw[-1] == pytest.approx(np.degrees(0.195), abs=0.1)
    assert pitch[19] == pytest.approx(0, abs=0.1)
    assert pitch[-1] == pytest.approx(np.degrees(0.195), abs=0.1)
    assert np.abs(roll).max() < 0.1
    assert source.notes[0] == "telemetry of gcsv test"


def test_gcsv_orientation_can_be_given(tmp_path: Path) -> None:
    pytest.importorskip("telemetry_parser")
    times_ms = np.arange(0, 400, 10.0)
    rates, felt = np.zeros((40, 3)), np.zeros((40, 3))
    felt[:, 1], rates[:, 1] = 1.0, -1.0
    text = attitude_logs.gcsv(times_ms, rates, felt, "XYZ")
    source = opened(tmp_path / "a.gcsv", text, "{}?orientation=YxZ")
    yaw = source.track.world_from_body[-1].as_euler("ZYX", degrees=True)[0]
    assert yaw == pytest.approx(np.degrees(0.39), abs=0.1)


def test_gcsv_lines_whose_time_is_no_time_are_left_out(tmp_path: Path) -> None:
    pytest.importorskip("telemetry_parser")
    times_ms = np.arange(0, 100, 10.0)
    text = attitude_logs.gcsv(times_ms, np.zeros((10, 3)), np.zeros((10, 3)), "XYZ")
    source = opened(tmp_path / "a.gcsv", text + "nan,0,0,0,0,0,0\n1e300,0,0,0,0,0,0\n")
    assert len(source.track.times_ns) == 10


@pytest.mark.data
def test_px4_integrated_agrees_with_the_autopilot(shared_data: Path) -> None:
    autopilot = _track(shared_data / "px4_log/vehicle_attitude.csv")
    ours = _track(shared_data / "px4_log/sensor_combined.csv")
    times = np.arange(autopilot.start_ns + 10**8, autopilot.times_ns[-1] - 10**8, 10**7)
    tilts = [t.at(times).inv().apply([0.0, 0.0, -1.0]) for t in (autopilot, ours)]
    apart_deg = np.degrees(np.arccos(np.clip(np.sum(tilts[0] * tilts[1], axis=1), -1, 1)))
    # measured: 0.12 rms and 1.01 at most, while it is shaken by hand; the autopilot's own filter
    # is not exact either
    assert np.sqrt(np.mean(apart_deg**2)) < 0.2
    assert apart_deg.max() < 1.5
    # at rest for a minute, where the gyroscope's bias is seen: measured 0.3; with it, 11
    headings = [np.unwrap(t.at(times).as_euler("ZYX")[:, 0]) for t in (autopilot, ours)]
    drifted = np.degrees(np.ptp((headings[1] - headings[0])[[0, -1]]))
    assert drifted < 1.0


@pytest.mark.data
def test_gopro_telemetry_is_read_and_upright(shared_data: Path) -> None:
    pytest.importorskip("telemetry_parser")
    track = _track(shared_data / "gopro_karma/karma.mp4")
    assert track.duration_s == pytest.approx(12.06, abs=0.05)
    _, pitch, roll = track.world_from_body.as_euler("ZYX", degrees=True).T
    # a camera on a gimbal, by an accelerometer in a drone that speeds up and brakes
    assert np.abs(pitch).max() < 10
    assert np.abs(roll).max() < 10


def _track(path: Path) -> AttitudeTrack:
    source = open_attitude(str(path))
    assert isinstance(source, LogSource)
    return source.track


def test_a_file_may_be_opened_as_another_kind(tmp_path: Path) -> None:
    path = tmp_path / "attitude.txt"
    path.write_text(csv_text("t_s,qw,qx,qy,qz", TIMES_US * 1e-6, WXYZ))
    source = open_attitude(f"csv:{path}")
    assert isinstance(source, LogSource)
    assert largest_error_deg(source) < 1e-6
    with pytest.raises(AttitudeError, match=r"KIND is one of: csv, dataflash"):
        open_attitude(str(path))


@pytest.mark.parametrize(
    ("spec", "complaint"),
    [
        ("a.csv?rate=3", "unknown option 'rate'; known: none"),
        ("a.gcsv?orientation=XX", "orientation=XX: write"),
        ("a.gcsv?orientation", "not an option"),
        ("a.gcsv?orientation=XYZ&orientation=XYZ", "given twice"),
        ("a.csv", "No such file"),
        ("", "known by its name"),
        ("nonsense:7", "KIND is one of"),
    ],
)
def test_a_spec_that_is_not_understood_says_why(spec: str, complaint: str) -> None:
    with pytest.raises(FreelookError, match=complaint):
        open_attitude(spec)


def test_every_kind_says_what_it_is() -> None:
    kinds = attitudes.known_attitudes()
    assert set(kinds) == {"csv", "dataflash", "telemetry", "ulog"}
    for module in kinds.values():
        assert (module.__doc__ or "").splitlines()[0].endswith(".")
        assert isinstance(module.OPTIONS, tuple)
        assert not module.recognises("udp:14550")


def test_a_log_ends_early_when_it_is_closed(tmp_path: Path) -> None:
    source = opened(tmp_path / "a.csv", csv_text("t_s,qw,qx,qy,qz", TIMES_US * 1e-6, WXYZ))
    reading = source.attitudes()
    next(reading)
    source.close()
    assert list(reading) == []
    assert source.message


def test_pushed_attitudes_are_the_newest_and_end_with_close() -> None:
    source = PushedAttitudes("waiting for MAVLink")
    for t_ns in (1, 2, 3):
        source.push(Attitude(t_ns, Rotation.identity()))
    reading = source.attitudes()
    assert next(reading).t_ns == 3
    assert source.counters.values == {"received": 3, "overrun": 2}
    source.push(Attitude(4, Rotation.identity()))
    source.close()
    source.push(Attitude(5, Rotation.identity()))
    assert [a.t_ns for a in reading] == [4]
    assert source.message == "waiting for MAVLink"


def test_close_wakes_whoever_waits_for_pushed_attitudes() -> None:
    source = PushedAttitudes("waiting")
    seen: list[Attitude] = []
    reader = threading.Thread(target=lambda: seen.extend(source.attitudes()), daemon=True)
    reader.start()
    source.close()
    reader.join(10)
    assert not reader.is_alive()
    assert seen == []
