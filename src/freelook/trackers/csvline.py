"""Lines of numbers from a serial port: angles or a quaternion, in the columns you name.

`csv:/dev/ttyACM0?columns=yaw,pitch,roll&baud=115200`. Separators are commas, semicolons, blanks or
tabs. Columns are yaw, pitch and roll (or some of them: the others are 0), in degrees or with
`unit=rad` in radians; or qw, qx, qy, qz; and `-` for one to skip. `frame` says how the quaternion's
axes lie on a level head, frd or flu for instance; it then is the rotation of the head in a world of
such axes. Lines that do not fit are counted as `invalid`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from scipy.spatial.transform import Rotation

from ..axes import AXES as ANGLES
from ..axes import LARGEST_DEG, AxisMap
from ..clock import Clock
from ..errors import TrackerError
from ..rotations import FRD_FROM_RDF, from_wxyz
from ..types import Counters
from . import _serial
from ._frames import rdf_from_axes
from ._lines import SKIP, LineBuffer, parse_columns, parse_line

KIND = "csv"
OPTIONS = (*_serial.OPTIONS, "columns", "unit", "frame")
AXES = AxisMap()
QUATERNION = ("qw", "qx", "qy", "qz")
UNITS = {"deg": 1.0, "rad": math.degrees(1.0)}


def open(
    argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock
) -> _serial.SerialTracker:
    """Read lines from the port. TrackerError for columns that make no head."""
    columns = parse_columns(options.get("columns", ",".join(ANGLES)), (*ANGLES, *QUATERNION))
    named = {name for name in columns if name != SKIP}
    if not (named == set(QUATERNION) or (named and named <= set(ANGLES))):
        raise TrackerError(
            f"columns={','.join(columns)}: give {', '.join(ANGLES)} or {', '.join(QUATERNION)}"
        )
    unit = options.get("unit", "deg")
    if unit not in UNITS:
        raise TrackerError(f"unit must be one of {', '.join(UNITS)}, not '{unit}'")
    rdf_from_sensor = rdf_from_axes(options.get("frame", "rdf"), "frame")
    decoder = LineDecoder(columns, UNITS[unit], rdf_from_sensor, axes)
    return _serial.open_port(KIND, argument, options, decoder, clock)


class LineDecoder(_serial.QuietDecoder):
    """Lines to rotations."""

    def __init__(
        self,
        columns: tuple[str, ...],
        degrees: float,
        rdf_from_sensor: Rotation,
        axes: AxisMap,
    ) -> None:
        self.counters = Counters()
        self._columns = columns
        self._degrees = degrees
        self._rdf_from_sensor = rdf_from_sensor
        self._axes = axes
        self._lines = LineBuffer(self.counters)

    def begin(self) -> bytes:
        self._lines.clear()
        return b""

    def feed(self, data: bytes, now_ns: int) -> list[Rotation]:
        found = [self.parse(line) for line in self._lines.feed(data)]
        return [rotation for rotation in found if rotation is not None]

    def parse(self, line: bytes) -> Rotation | None:
        """`body_from_view`, or None, counted as `invalid`."""
        values = parse_line(line, self._columns)
        rotation = None if values is None else self._rotation(values)
        if rotation is None:
            self.counters.add("invalid")
        return rotation

    def _rotation(self, values: dict[str, float]) -> Rotation | None:
        if "qw" in values:
            quaternion = [values[name] for name in QUATERNION]
            if not 0.9 < math.hypot(*quaternion) < 1.1:
                return None
            turn = from_wxyz([round(q, 15) for q in quaternion])  # no numbers whose squares vanish
            head = self._rdf_from_sensor * turn * self._rdf_from_sensor.inv()
            return self._axes.remap(FRD_FROM_RDF * head)
        angles = [self._degrees * values.get(name, 0.0) for name in ANGLES]
        if not all(abs(angle) <= LARGEST_DEG for angle in angles):
            return None
        return self._axes.body_from_view(*angles)
