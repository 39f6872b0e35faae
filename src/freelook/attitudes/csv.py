"""A CSV file: `log.csv` with a header; quaternions, angles, or a gyroscope's rates.

Time is `t_s` in seconds, or `timestamp_sample`, else `timestamp`, in microseconds (as PX4's
`ulog2csv` writes). Then one of

    qw,qx,qy,qz  or  q[0],q[1],q[2],q[3]        body (forward, right, down) to north, east, down
    roll_deg,pitch_deg,yaw_deg                  yaw about down, then pitch up, then roll right
    gx,gy,gz  or  gyro_rad[0],...               body rates, rad/s, to be integrated; with
    ax,ay,az  or  accelerometer_m_s2[0],...     what the accelerometer felt, m/s^2, if there is one

Other columns are not looked at, nor is what stands in round brackets behind a name. `freelook
simulate --truth` writes such a file. Lines that are not numbers are counted and left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S, Clock
from ..errors import AttitudeError
from ._log import LogSource, log_of_quaternions, log_of_rates, readable

KIND = "csv"
OPTIONS: tuple[str, ...] = ()

Floats = NDArray[np.float64]
TIMES = {"t_s": 1.0, "timestamp_sample": 1e-6, "timestamp": 1e-6}  # the first there is
QUATERNIONS = (("qw", "qx", "qy", "qz"), ("q[0]", "q[1]", "q[2]", "q[3]"))
ANGLES = (("roll_deg", "pitch_deg", "yaw_deg"),)
RATES = (("gx", "gy", "gz"), ("gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"))
FELT = (
    ("ax", "ay", "az"),
    ("accelerometer_m_s2[0]", "accelerometer_m_s2[1]", "accelerometer_m_s2[2]"),
)
LONGEST_S = 5e9  # seconds since 1970 until the year 2128, and what nanoseconds in 64 bits hold
LARGEST_DEG = 36_000.0


def recognises(argument: str) -> bool:
    return argument.lower().endswith(".csv")


def open(argument: str, *, options: Mapping[str, str], clock: Clock) -> LogSource:
    """Read the file now. AttitudeError says what is wrong with it."""
    try:
        text = readable(argument).read_text("utf-8-sig")
    except UnicodeDecodeError:
        raise AttitudeError(f"{argument}: not a text file") from None
    return parse(text, argument)


def parse(text: str, name: str) -> LogSource:
    """The log in a file's text; `name` is for messages."""
    header, *lines = [line for line in text.splitlines() if line.strip()] or [""]
    columns = [field.partition("(")[0].strip() for field in header.split(",")]
    time = next((column for column in TIMES if column in columns), None)
    if time is None:
        raise AttitudeError(f"{name}: no column t_s or timestamp; {_there_are(columns)}")
    rows, malformed = _numbers(lines, columns)
    seconds = rows[:, columns.index(time)] * TIMES[time]
    usable = np.abs(seconds) < LONGEST_S
    times_ns = np.round(seconds[usable] * NS_PER_S).astype(np.int64)
    log = _log(name, times_ns, rows[usable], columns)
    if malformed := malformed + int(np.sum(~usable)):
        log.counters.add("malformed", malformed)
    return log


def _log(name: str, times_ns: NDArray[np.int64], rows: Floats, columns: list[str]) -> LogSource:
    if (wxyz := _pick(rows, columns, QUATERNIONS)) is not None:
        return log_of_quaternions(name, times_ns, wxyz)
    if (angles := _pick(rows, columns, ANGLES)) is not None:
        return log_of_quaternions(name, times_ns, _quaternions(angles))
    if (rates := _pick(rows, columns, RATES)) is not None:
        return log_of_rates(name, times_ns, rates, _pick(rows, columns, FELT))
    raise AttitudeError(
        f"{name}: no columns {','.join(QUATERNIONS[0])}, {','.join(ANGLES[0])} "
        f"or {','.join(RATES[0])}; {_there_are(columns)}"
    )


def _numbers(lines: Sequence[str], columns: list[str]) -> tuple[Floats, int]:
    """All lines as numbers (n, columns), and how many were none. Empty fields are NaN."""
    rows, malformed = [], 0
    for line in lines:
        fields = line.split(",")
        try:
            row = [float(field) if field.strip() else np.nan for field in fields]
        except ValueError:
            malformed += 1
            continue
        if len(row) == len(columns):
            rows.append(row)
        else:
            malformed += 1
    return np.array(rows, float).reshape(-1, len(columns)), malformed


def _pick(rows: Floats, columns: list[str], sets: tuple[tuple[str, ...], ...]) -> Floats | None:
    for names in sets:
        if all(name in columns for name in names):
            return rows[:, [columns.index(name) for name in names]]
    return None


def _quaternions(angles: Floats) -> Floats:
    """(w, x, y, z) of roll, pitch, yaw in degrees; NaN where they are no angles."""
    fine = np.all(np.abs(angles) < LARGEST_DEG, axis=1, keepdims=True)
    xyzw = Rotation.from_euler("ZYX", np.where(fine, angles, 0.0)[:, ::-1], degrees=True).as_quat()
    return np.where(fine, xyzw[:, [3, 0, 1, 2]], np.nan)


def _there_are(columns: list[str]) -> str:
    return f"there are: {', '.join(columns)}" if columns != [""] else "the file is empty"
