"""The bare motion sensor: made-up heads with known truth, and an autopilot's own sensor."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from freelook.axes import AxisMap
from freelook.errors import TrackerError
from freelook.rotations import FRD_FROM_RDF, angle_between_deg, from_wxyz, head_angles_deg
from freelook.trackers import open_tracker
from freelook.trackers._frames import rdf_from_axes
from freelook.trackers._orientation import RestBias, SampleTimes
from freelook.trackers.imu import ACCEL, GYRO, MAG, ImuDecoder
from freelook.trackers.wander import AXES, wander_deg

COLUMNS = GYRO + ACCEL
RATE_HZ = 100
FIELD_NED = np.array([0.4, 0.0, 0.9])  # to the magnetic north and down


def decoder(
    columns: tuple[str, ...] = COLUMNS,
    mount: str = "frd",
    dps: float = 1.0,
    hard_iron: tuple[float, float, float] = (0, 0, 0),
) -> ImuDecoder:
    return ImuDecoder(
        columns,
        dps=dps,
        frd_from_sensor=FRD_FROM_RDF * rdf_from_axes(mount, "mount"),
        hard_iron=np.array(hard_iron),
        axes=AxisMap(),
    )


def ned_from_head(t_s: float) -> Rotation:
    """Still for three seconds, then the wandering head."""
    return AXES.body_from_view(*wander_deg(max(0.0, t_s - 3.0))) * FRD_FROM_RDF.inv()


def readings(t_s: float, sensor_from_frd: Rotation, bias_dps: np.ndarray) -> list[np.ndarray]:
    """What the three sensors say: turning, upwards, field."""
    before, now = ned_from_head(t_s - 1 / RATE_HZ), ned_from_head(t_s)
    gyro = np.degrees((before.inv() * now).as_rotvec()) * RATE_HZ
    up = now.inv().apply([0, 0, -9.81])
    field = now.inv().apply(FIELD_NED)
    gyro, up, field = (sensor_from_frd.apply(v) for v in (gyro, up, field))
    return [gyro + bias_dps, up, field]


def played(
    made: ImuDecoder, seconds: float, mount: str = "frd", hard_iron: float = 0.0
) -> tuple[list[Rotation], list[Rotation]]:
    """(estimates, truths) of a gyroscope that is off by about a degree a second, and noisy."""
    rng = np.random.default_rng(5)
    sensor_from_frd = (FRD_FROM_RDF * rdf_from_axes(mount, "mount")).inv()
    bias_dps = np.array([0.7, -1.1, 0.9])
    found, truths = [], []
    made.feed(b"\n", 0)
    for n in range(round(seconds * RATE_HZ)):
        gyro, up, field = readings(n / RATE_HZ, sensor_from_frd, bias_dps)
        gyro = gyro + rng.normal(0, 0.05, 3)
        values = [*gyro, *(up + rng.normal(0, 0.03, 3))]
        if "mx" in made._columns:
            values += [*(field + hard_iron + rng.normal(0, 0.002, 3))]
        line = ",".join(f"{value:.5f}" for value in values)
        for rotation in made.feed(f"{line}\n".encode(), round(n * 1e9 / RATE_HZ)):
            found.append(rotation)
            truths.append(ned_from_head(n / RATE_HZ) * FRD_FROM_RDF)
    return found, truths


@pytest.mark.parametrize("mount", ["frd", "flu", "rub"])
def test_the_bias_is_learned_at_rest_and_the_head_followed(mount: str) -> None:
    """Without learning, yaw would be wrong by 0.9 degrees more every second: 7 at the end."""
    found, truths = played(decoder(mount=mount), 9.0, mount)
    errors = [
        np.subtract(head_angles_deg(a), head_angles_deg(b))
        for a, b in zip(found, truths, strict=True)
    ]
    late = np.array(errors[-300:])
    assert np.abs(late[:, 1:]).max() < 0.3  # of a degree while the bias was unknown
    # yaw: turned by the bias for the second in which it was learned, and drifting no more
    assert np.ptp(late[:, 0]) < 0.3
    assert 0.5 < abs(late[-1, 0]) < 1.3


def test_a_magnetometer_keeps_north() -> None:
    made = decoder(GYRO + ACCEL + MAG, hard_iron=(0.3, 0.3, 0.3))
    found, truths = played(made, 9.0, hard_iron=0.3)
    late = zip(found[-200:], truths[-200:], strict=True)
    assert max(angle_between_deg(a, b) for a, b in late) < 0.5  # the yaw of the test above is gone


def fed(bias: RestBias, seconds: int, mean_dps: float, rms_dps: float = 0.05) -> None:
    rng = np.random.default_rng(1)
    for noise in rng.normal(0, rms_dps, (seconds * RATE_HZ, 3)):
        bias.update(noise + mean_dps)


def test_bias_is_learned_within_a_second_of_rest() -> None:
    bias = RestBias(RATE_HZ)
    fed(bias, 1, -3.0)
    assert bias.dps == pytest.approx([-3] * 3, abs=0.02)  # 0.05 / sqrt(100) is 0.005
    assert bias.update(np.full(3, -3.0)) == pytest.approx([0] * 3, abs=0.02)


@pytest.mark.parametrize(("mean_dps", "rms_dps"), [(0.0, 1.0), (50.0, 0.05)])
def test_a_moving_head_teaches_no_bias(mean_dps: float, rms_dps: float) -> None:
    bias = RestBias(RATE_HZ)
    fed(bias, 3, mean_dps, rms_dps)
    assert not bias.known
    assert bias.dps == pytest.approx([0] * 3)


def test_a_known_bias_creeps_but_slow_turning_does_not_change_it() -> None:
    bias = RestBias(RATE_HZ)
    fed(bias, 1, 1.0)
    fed(bias, 10, 2.0)
    assert bias.dps == pytest.approx([1] * 3, abs=0.02)
    fed(bias, 20, 1.2)
    assert bias.dps == pytest.approx([1.2 - 0.2 * 0.9**20] * 3, abs=0.02)


def test_no_pose_before_the_rate_is_known_and_it_is_said() -> None:
    made = decoder()
    assert "measuring the sensor's rate" in made.note
    found, _ = played(made, 3.0)
    assert len(found) == pytest.approx(2.0 * RATE_HZ, abs=3)
    assert made.note == ""
    made.begin()
    assert made.note


def test_tilt_is_right_from_the_first_pose() -> None:
    made = decoder()
    up = Rotation.from_euler("ZYX", [0, 25, -40], degrees=True).inv().apply([0, 0, -1])
    line = f"0,0,0,{','.join(map(str, np.round(up, 6)))}\n".encode()
    found = [r for n in range(150) for r in made.feed(line, n * 10_000_000)]
    assert head_angles_deg(found[0]) == pytest.approx((0, 25, -40), abs=0.1)


@pytest.mark.data
def test_an_autopilots_sensor_gives_the_autopilots_tilt(shared_data: Path) -> None:
    """25 s of PX4's sensor_combined through the filter, against its own estimate of attitude."""
    lines = (shared_data / "px4_log" / "sensor_combined.csv").read_text().splitlines()[1:6200]
    truth = np.loadtxt(shared_data / "px4_log" / "vehicle_attitude.csv", delimiter=",", skiprows=1)
    made = decoder(("t_s", *COLUMNS), dps=math.degrees(1))
    made.feed(b"\n", 0)
    errors = []
    for line in lines:
        t_s = float(line.split(",")[0])
        for rotation in made.feed(f"{line}\n".encode(), round(t_s * 1e9)):
            ned_from_body = from_wxyz(list(truth[np.searchsorted(truth[:, 0], t_s), 1:5]))
            down = [
                turn.inv().apply([0.0, 0.0, 1.0])
                for turn in (rotation * FRD_FROM_RDF.inv(), ned_from_body)
            ]
            errors.append(math.degrees(math.acos(min(1.0, float(down[0] @ down[1])))))
    # measured 0.15 rms over the whole log; two estimators of one noisy truth
    assert float(np.sqrt(np.mean(np.square(errors)))) < 0.3
    assert made.counters["invalid"] == 0


def test_times_of_a_sensor_without_a_clock() -> None:
    """Four samples a read, reads 20 ms apart; a pause is not counted."""
    times = SampleTimes()
    for n in range(100):
        times.arrived(4, (n * 20 + 5000 * (n > 50)) * 1_000_000)
    assert times.rate_hz == pytest.approx(200, rel=0.02)
    assert times.step_s(None) == pytest.approx(0.005, rel=0.02)


def test_times_of_a_sensor_with_a_clock() -> None:
    """A clock that wraps round or jumps counts as one usual step."""
    times = SampleTimes()
    for n in range(200):
        times.arrived(1, n * 10_000_000)
    steps = [times.step_s(t) for t in (10.0, 10.011, 0.002, 0.010, 900.0)]
    usual = 1 / (times.rate_hz or 0)
    assert steps == pytest.approx([usual, 0.011, usual, 0.008, usual])


number = st.floats() | st.floats(-1, 1) | st.integers(-(10**12), 10**12)
line_of = st.lists(number, min_size=9, max_size=9).map(lambda v: (",".join(map(str, v))).encode())


@settings(max_examples=25)
@given(st.lists(line_of | st.binary(max_size=60), min_size=30, max_size=40))
def test_any_lines_are_a_head_or_counted(lines: list[bytes]) -> None:
    made = decoder(GYRO + ACCEL + MAG)
    for n, line in enumerate(lines):
        for rotation in made.feed(line + b"\n", n * 100_000_000):
            assert np.isfinite(rotation.as_quat()).all()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("columns=gx,gy,gz", "gx, gy, gz, ax, ay, az are needed"),
        ("columns=gx,gy,gz,ax,ay,az,mx", "mx, my, mz together or not at all"),
        ("columns=t_s,t_ms,gx,gy,gz,ax,ay,az", "one time is enough"),
        ("gyro=fast", "gyro must be dps, rads, or the degrees a second of one unit"),
        ("gyro=0", "gyro must be"),
        ("mount=xyz", "mount=xyz is not three of"),
        ("hard_iron=1,2", "hard_iron must be three numbers"),
        ("hard_iron=1,2,nan", "hard_iron must be three numbers"),
    ],
)
def test_options_are_checked(options: str, words: str) -> None:
    with pytest.raises(TrackerError, match=words):
        open_tracker(f"imu:/dev/ttyACM0?{options}")
