"""Head poses written down beforehand: CSV with a header, one pose per line.

    t_s,yaw_deg,pitch_deg,roll_deg      or      t_s,qw,qx,qy,qz

Times are seconds from the start and grow from line to line. Angles are head angles, quaternions
`head_from_view` (identity is straight ahead; x right, y down, z forward). No other columns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .axes import AxisMap
from .clock import NS_PER_S
from .errors import TrackerError
from .rotations import FRD_FROM_RDF, from_wxyz, slerp

ANGLES = ("t_s", "yaw_deg", "pitch_deg", "roll_deg")
QUATERNIONS = ("t_s", "qw", "qx", "qy", "qz")
LONGEST_S = 1e6


@dataclass(frozen=True)
class PoseScript:
    """Poses at `times_ns` (n,), increasing from the script's own zero; `poses` are n rotations
    `body_from_view`."""

    times_ns: NDArray[np.int64]
    poses: Rotation

    @property
    def duration_ns(self) -> int:
        """The time of the last pose."""
        return int(self.times_ns[-1])

    def pose_at(self, t_ns: int) -> Rotation:
        """`body_from_view` at a time of the script: the short way between the poses around it;
        the first pose before the first, the last after the last."""
        after = int(np.searchsorted(self.times_ns, t_ns, side="right"))
        if after == 0 or after == len(self.times_ns):
            return self.poses[max(after - 1, 0)]
        start, end = int(self.times_ns[after - 1]), int(self.times_ns[after])
        fraction = (t_ns - start) / (end - start)
        return slerp(self.poses[after - 1], self.poses[after], fraction)


def read_script(path: str | Path, axes: AxisMap | None = None) -> PoseScript:
    """Read a script from a file. TrackerError when it cannot be read or is wrong; says where."""
    try:
        text = Path(path).read_text("utf-8-sig")
    except UnicodeDecodeError:
        raise TrackerError(f"pose script {path}: not a text file") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise TrackerError(f"pose script {path}: {reason}") from None
    try:
        return parse_script(text, axes)
    except TrackerError as error:
        raise TrackerError(f"pose script {path}: {error}") from None


def parse_script(text: str, axes: AxisMap | None = None) -> PoseScript:
    """A script from its text; blank lines are skipped. TrackerError names the line."""
    axes = AxisMap() if axes is None else axes
    lines = [(n, line) for n, line in enumerate(text.split("\n"), 1) if line.strip()]
    if not lines:
        raise TrackerError("it is empty; it must begin with " + _headers())
    columns = tuple(field.strip() for field in lines[0][1].split(","))
    if columns not in (ANGLES, QUATERNIONS):
        raise TrackerError(f"line {lines[0][0]}: the header must be {_headers()}")
    times: list[int] = []
    poses: list[Rotation] = []
    for number, line in lines[1:]:
        try:
            t_ns, pose = _parse_row(line, columns, axes)
            if times and t_ns <= times[-1]:
                raise ValueError(f"t_s = {t_ns / NS_PER_S:g} is not after the line before it")
        except ValueError as error:
            raise TrackerError(f"line {number}: {error}") from None
        times.append(t_ns)
        poses.append(pose)
    if not poses:
        raise TrackerError("there are no poses below the header")
    return PoseScript(np.array(times, dtype=np.int64), Rotation.concatenate(poses))


def _headers() -> str:
    return f"'{','.join(ANGLES)}' or '{','.join(QUATERNIONS)}'"


def _parse_row(line: str, columns: tuple[str, ...], axes: AxisMap) -> tuple[int, Rotation]:
    fields = line.split(",")
    if len(fields) != len(columns):
        raise ValueError(f"{len(fields)} values where {len(columns)} are needed: {line.strip()!r}")
    t_s, *values = (_number(f, name) for f, name in zip(fields, columns, strict=True))
    if not 0 <= t_s <= LONGEST_S:
        raise ValueError(f"t_s must be 0 to {LONGEST_S:.0f} seconds, not {t_s:g}")
    pose = axes.body_from_view(*values) if columns == ANGLES else _from_quaternion(values, axes)
    return round(t_s * NS_PER_S), pose


def _from_quaternion(wxyz: list[float], axes: AxisMap) -> Rotation:
    if not 0.9 < math.hypot(*wxyz) < 1.1:
        raise ValueError(f"the quaternion {wxyz} is not of unit length")
    # fifteen decimals: smaller numbers carry nothing and their squares underflow
    return axes.remap(FRD_FROM_RDF * from_wxyz([round(v, 15) for v in wxyz]))


def _number(text: str, name: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{name} must be a number, not {text.strip()!r}") from None
    if not math.isfinite(value):
        raise ValueError(f"{name} must be a finite number, not {text.strip()}")
    return value
