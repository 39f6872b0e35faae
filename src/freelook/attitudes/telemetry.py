"""A camera's own telemetry: GoPro, DJI, Insta360, Sony and other videos, `.gcsv`, Betaflight's log.

The gyroscope is integrated, the accelerometer levels it. Read with telemetry-parser, Gyroflow's,
which also turns each camera's axes into one set: x up, y left, z backward. `orientation=XYZ` says
how the axes really lie where the file does not know (Gyroflow's notation: three letters, lower
case for the opposite direction). Times are from the start of the video, or of the log.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..clock import NS_PER_MS, Clock
from ..errors import AttitudeError, MissingExtra
from ._log import LogSource, log_of_rates, readable

KIND = "telemetry"
OPTIONS = ("orientation",)
VIDEOS = (".mp4", ".mov", ".mkv", ".insv", ".360", ".braw", ".r3d", ".mxf")
LOGS = (".gcsv", ".bbl", ".bfl")
LARGEST_MS = 5e12
# forward, right, down from x up, y left, z backward
FRD_FROM_IMU = np.array([[0.0, 0, -1], [0, -1, 0], [-1, 0, 0]])


def recognises(argument: str) -> bool:
    return argument.lower().endswith((*VIDEOS, *LOGS))


def open(argument: str, *, options: Mapping[str, str], clock: Clock) -> LogSource:
    """Read the telemetry now. AttitudeError says what is wrong with it."""
    orientation = _orientation(options.get("orientation"))
    path = str(readable(argument))
    try:
        from telemetry_parser import Parser
    except ImportError:
        raise MissingExtra("telemetry-parser", "telemetry") from None
    try:
        parser = Parser(path)
        rows = parser.normalized_imu(orientation)
    except Exception as error:  # the parser raises what its Rust code meets
        raise AttitudeError(f"{argument}: no telemetry that can be read ({error})") from None
    rows = [row for row in rows if _usable(row)]
    if len(rows) < 2:
        raise AttitudeError(f"{argument}: there is no gyroscope in its telemetry")
    times_ms = np.array([row["timestamp_ms"] for row in rows], float)
    rates = np.radians(np.array([row["gyro"] for row in rows], float)) @ FRD_FROM_IMU.T
    felt = _accelerations(rows)
    camera = " ".join(filter(None, (parser.camera, parser.model)))
    return log_of_rates(
        argument,
        np.round(times_ms * NS_PER_MS).astype(np.int64),
        rates,
        None if felt is None else felt @ FRD_FROM_IMU.T,
        (f"telemetry of {camera}",),
    )


def _usable(row: dict[str, Any]) -> bool:
    """Whether there are rates, at a time that nanoseconds in 64 bits hold (NaN is none)."""
    return row["gyro"] is not None and abs(row["timestamp_ms"]) < LARGEST_MS


def _accelerations(rows: list[dict[str, Any]]) -> np.ndarray[Any, np.dtype[np.float64]] | None:
    missing = (np.nan, np.nan, np.nan)
    felt = np.array([row["accl"] if row["accl"] is not None else missing for row in rows], float)
    return None if np.isnan(felt).all() else felt


def _orientation(text: str | None) -> str | None:
    if text is None:
        return None
    if not re.fullmatch("[XYZxyz]{3}", text) or len(set(text.lower())) != 3:
        raise AttitudeError(
            f"orientation={text}: write x, y and z in some order, "
            "lower case for the opposite direction, as in XzY"
        )
    return text
