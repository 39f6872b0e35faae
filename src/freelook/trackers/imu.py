"""A bare motion sensor on a serial port: lines of gyroscope, accelerometer, magnetometer readings.

`imu:/dev/ttyACM0?columns=gx,gy,gz,ax,ay,az&gyro=dps&mount=flu`. Columns are gx gy gz (turning),
ax ay az (upwards at rest), perhaps mx my mz (magnetic field), perhaps t_s, t_ms or t_us (the
sensor's clock), and `-` for one to skip. `gyro` is dps, rads, or the degrees a second of one unit.
`mount` says where x, y and z of the sensor point on a level head. `hard_iron=x,y,z` is taken off
the magnetometer. `_orientation.py` makes a head of it; its yaw is north's, or begins at 0 without a
magnetometer.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from ..axes import AxisMap
from ..clock import Clock
from ..errors import TrackerError
from ..rotations import FRD_FROM_RDF
from ..types import Counters
from . import _serial
from ._frames import rdf_from_axes
from ._lines import LineBuffer, parse_columns, parse_line
from ._orientation import OrientationFilter, SampleTimes, Vector

KIND = "imu"
OPTIONS = (*_serial.OPTIONS, "columns", "gyro", "mount", "hard_iron")
AXES = AxisMap()
GYRO = ("gx", "gy", "gz")
ACCEL = ("ax", "ay", "az")
MAG = ("mx", "my", "mz")
CLOCKS = {"t_s": 1.0, "t_ms": 1e-3, "t_us": 1e-6}
UNITS = {"dps": 1.0, "rads": math.degrees(1.0)}
LARGEST_DPS = 10_000.0
LARGEST = 1e9  # of an acceleration or field, in whatever unit


def open(
    argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock
) -> _serial.SerialTracker:
    """Read lines from the port. TrackerError for columns that are no motion sensor."""
    import imufusion  # noqa: F401 - so that a missing library shows at once

    columns = parse_columns(
        options.get("columns", ",".join(GYRO + ACCEL)), (*GYRO, *ACCEL, *MAG, *CLOCKS)
    )
    named = set(columns)
    if not named >= {*GYRO, *ACCEL} or (named & set(MAG) and not named >= set(MAG)):
        raise TrackerError(
            f"columns={','.join(columns)}: {', '.join(GYRO + ACCEL)} are needed, "
            f"and {', '.join(MAG)} together or not at all"
        )
    if len(named & set(CLOCKS)) > 1:
        raise TrackerError(f"columns={','.join(columns)}: one time is enough")
    decoder = ImuDecoder(
        columns,
        dps=_gyro_unit(options.get("gyro", "dps")),
        frd_from_sensor=FRD_FROM_RDF * rdf_from_axes(options.get("mount", "flu"), "mount"),
        hard_iron=_three(options.get("hard_iron", "0,0,0")),
        axes=axes,
    )
    return _serial.open_port(KIND, argument, options, decoder, clock)


class ImuDecoder(_serial.QuietDecoder):
    """Lines to rotations, once a second of them has shown their rate."""

    def __init__(
        self,
        columns: tuple[str, ...],
        *,
        dps: float,
        frd_from_sensor: Rotation,
        hard_iron: Vector,
        axes: AxisMap,
    ) -> None:
        self.counters = Counters()
        self._columns = columns
        self._dps = dps
        self._frd_from_sensor = frd_from_sensor.as_matrix()
        self._hard_iron = hard_iron
        self._axes = axes
        self._lines = LineBuffer(self.counters)
        self.begin()

    @property
    def note(self) -> str:
        return "" if self._filter else "measuring the sensor's rate; keep the head still"

    def begin(self) -> bytes:
        self._lines.clear()
        self._times = SampleTimes()
        self._filter: OrientationFilter | None = None
        return b""

    def feed(self, data: bytes, now_ns: int) -> list[Rotation]:
        samples = [self.parse(line) for line in self._lines.feed(data)]
        good = [sample for sample in samples if sample is not None]
        if good:
            self._times.arrived(len(good), now_ns)
        if self._times.rate_hz is None:
            return []
        found = [self._step(sample) for sample in good]
        return [self._axes.remap(rotation) for rotation in found if rotation is not None]

    def parse(self, line: bytes) -> dict[str, float] | None:
        """One line's numbers by column, or None, counted as `invalid`."""
        values = parse_line(line, self._columns)
        if values is None or not self._sensible(values):
            self.counters.add("invalid")
            return None
        return values

    def _sensible(self, values: dict[str, float]) -> bool:
        largest = max(abs(values[name]) for name in (*ACCEL, *MAG) if name in values)
        turning = max(abs(values[name]) for name in GYRO)
        return largest <= LARGEST and turning * self._dps <= LARGEST_DPS

    def _step(self, sample: dict[str, float]) -> Rotation | None:
        if self._filter is None:
            assert self._times.rate_hz is not None
            self._filter = OrientationFilter(self._times.rate_hz)
        sensor_s = next((sample[c] * unit for c, unit in CLOCKS.items() if c in sample), None)
        mag = None
        if "mx" in sample:
            mag = self._frd_from_sensor @ (_vector(sample, MAG) - self._hard_iron)
        rotation = self._filter.update(
            self._frd_from_sensor @ (self._dps * _vector(sample, GYRO)),
            self._frd_from_sensor @ _vector(sample, ACCEL),
            mag,
            self._times.step_s(sensor_s),
        )
        if rotation is None:
            self.counters.add("restarts")
            self._filter = None
        return rotation


def _vector(sample: dict[str, float], names: tuple[str, ...]) -> Vector:
    return np.array([sample[name] for name in names])


def _gyro_unit(text: str) -> float:
    if text in UNITS:
        return UNITS[text]
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 1e-6 <= value <= 1e3:
        raise TrackerError(
            f"gyro must be {', '.join(UNITS)}, or the degrees a second of one unit "
            f"(0.000001 to 1000), not '{text}'"
        )
    return value


def _three(text: str) -> Vector:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3 or not all(abs(value) <= LARGEST for value in values):
        raise TrackerError(f"hard_iron must be three numbers, such as 12,-30,5, not '{text}'")
    return np.array(values)
