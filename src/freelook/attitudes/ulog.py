"""PX4's log: `flight.ulg`, the autopilot's own attitude, else its gyroscope integrated.

Topics `vehicle_attitude`, else `sensor_combined` or `vehicle_imu`. Times are those of the samples
where the log has them (`timestamp_sample`), else of the messages. Read with pyulog, PX4's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..clock import Clock
from ..errors import AttitudeError, MissingExtra
from ._log import LogSource, log_of_quaternions, log_of_rates, readable

KIND = "ulog"
OPTIONS: tuple[str, ...] = ()
ATTITUDE, SENSORS = "vehicle_attitude", "sensor_combined"


def recognises(argument: str) -> bool:
    return argument.lower().endswith((".ulg", ".ulog"))


def open(argument: str, *, options: Mapping[str, str], clock: Clock) -> LogSource:
    """Read the log now. AttitudeError says what is wrong with it."""
    path = readable(argument)
    try:
        from pyulog import ULog
    except ImportError:
        raise MissingExtra("pyulog", "telemetry") from None
    try:
        with path.open("rb") as file:
            log = ULog(file, message_name_filter_list=[ATTITUDE, SENSORS])
    except Exception as error:  # what its parser stumbles over in a file that is none is open-ended
        raise AttitudeError(f"{argument}: not a ULog that can be read ({error})") from None
    topics = {data.name: data.data for data in log.data_list if data.multi_id == 0}
    if ATTITUDE in topics:
        data = topics[ATTITUDE]
        return log_of_quaternions(argument, _times_ns(data), _columns(argument, data, "q", 4))
    if SENSORS in topics:
        data = topics[SENSORS]
        rates = _columns(argument, data, "gyro_rad", 3)
        felt = _columns(argument, data, "accelerometer_m_s2", 3)
        return log_of_rates(argument, _times_ns(data), rates, felt)
    raise AttitudeError(f"{argument}: neither {ATTITUDE} nor {SENSORS} was logged")


def _times_ns(data: dict[str, Any]) -> NDArray[np.int64]:
    microseconds = np.asarray(data["timestamp"]).astype(np.int64)
    sampled = np.asarray(data.get("timestamp_sample", microseconds)).astype(np.int64)
    return np.where(sampled > 0, sampled, microseconds) * 1000


def _columns(name: str, data: dict[str, Any], field: str, count: int) -> NDArray[np.float64]:
    try:
        return np.stack([data[f"{field}[{i}]"] for i in range(count)], axis=-1).astype(float)
    except KeyError as error:
        raise AttitudeError(f"{name}: the log's topic has no field {error}") from None
