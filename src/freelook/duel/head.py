"""The head that drives both sides: a recording, or a made-up one that says so."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, RotationSpline

from ..clock import NS_PER_S
from ..errors import TrackerError
from ..head_recording import body_from_view, columns_of, read_lines, sample_of
from ..pose_script import read_script
from ..rotations import FRD_FROM_RDF

Floats = NDArray[np.float64]
Times = NDArray[np.int64]

LEAST_STEP_NS = 1_000_000
SYNTHETIC_SECONDS = 60.0
TURNS = 12
TURN_DEG = 60.0


@dataclass(frozen=True)
class HeadMotion:
    """Where a head looked: `times_ns` (n,) growing from 0, n rotations `body_from_view`.

    Between the samples it moves smoothly (a cubic spline of rotations, so that speed and
    acceleration have no steps which no neck makes); before the first and after the last it rests.
    """

    name: str
    times_ns: Times
    poses: Rotation = field(repr=False)

    @property
    def duration_ns(self) -> int:
        return int(self.times_ns[-1])

    @cached_property
    def _spline(self) -> RotationSpline:
        with np.errstate(all="ignore"):  # squares of tiny angles underflow to the right answer
            return RotationSpline(self.times_ns / NS_PER_S, self.poses)

    def at(self, t_ns: Times) -> Rotation:
        """`body_from_view` at times (m,)."""
        inside = np.clip(t_ns, 0, self.duration_ns) / NS_PER_S
        if len(self.times_ns) == 1:
            return self.poses[np.zeros(len(inside), dtype=np.intp)]
        with np.errstate(all="ignore"):
            turned: Rotation = self._spline(inside)
        return turned

    def cut(self, start_ns: int, end_ns: int) -> HeadMotion:
        """The samples from `start_ns` to `end_ns`, counted from `start_ns`. TrackerError if there
        are fewer than two."""
        inside = (self.times_ns >= start_ns) & (self.times_ns <= end_ns)
        if inside.sum() < 2:
            raise TrackerError(
                f"{self.name}: nothing between {start_ns / NS_PER_S:g} and "
                f"{end_ns / NS_PER_S:g} s; it lasts {self.duration_ns / NS_PER_S:.1f} s"
            )
        times = self.times_ns[inside]
        return HeadMotion(self.name, times - times[0], self.poses[inside])

    def centred(self) -> HeadMotion:
        """Turned about the vertical so that the mean direction is straight ahead: a head's zero
        is where its tracker was reset, which has nothing to do with the vehicle."""
        north, east, _down = self.poses.apply([0.0, 0.0, 1.0]).mean(axis=0)
        turn = Rotation.from_rotvec([0.0, 0.0, -float(np.arctan2(east, north))])
        return HeadMotion(self.name, self.times_ns, turn * self.poses)


def read_head(path: str | Path) -> HeadMotion:
    """A recording (`freelook.head_recording`), or a pose script (`freelook.pose_script`).

    A sample that repeats the one before it is a pose that came late, not a head that stood still:
    it is left out. TrackerError where the file cannot be read or is wrong; says where.
    """
    path = Path(path)
    lines = read_lines(path)
    if lines and lines[0].startswith("t_s,"):
        script = read_script(path)
        return HeadMotion(path.stem, script.times_ns - script.times_ns[0], script.poses)
    times, quaternions = _rows(path, lines)
    return HeadMotion(path.stem, *_cleaned(path, times, quaternions))


def _rows(path: Path, lines: list[str]) -> tuple[Floats, Floats]:
    """Seconds (n,) and w, x, y, z (n, 4)."""
    try:
        columns = columns_of(path, lines[0] if lines else "")
    except TrackerError as error:
        raise TrackerError(f"{error}, or be that of a pose script") from None
    rows = []
    for number, line in enumerate(lines[1:], 2):
        if not line.strip():
            continue
        try:
            rows.append(sample_of(line, columns))
        except ValueError as error:
            raise TrackerError(f"{path}: line {number}: {error}") from None
    if not rows:
        raise TrackerError(f"{path}: there are no poses below the header")
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def _cleaned(path: Path, times_s: Floats, wxyz: Floats) -> tuple[Times, Rotation]:
    fresh = np.ones(len(times_s), dtype=np.bool_)
    before, after = wxyz[:-1], wxyz[1:]  # q and -q are one rotation
    fresh[1:] = (before != after).any(axis=1) & (before != -after).any(axis=1)
    times = np.rint((times_s[fresh] - times_s[0]) * NS_PER_S).astype(np.int64)
    steps = np.diff(times)
    if (steps < 0).any():
        raise TrackerError(f"{path}: the times run backward at {times_s[fresh][1:][steps < 0][0]}")
    apart = np.concatenate([[True], steps >= LEAST_STEP_NS])
    times = times[apart]
    return times - times[0], body_from_view(wxyz[fresh][apart])


def synthetic_head(seconds: float = SYNTHETIC_SECONDS, seed: int = 2011) -> HeadMotion:
    """A made-up head for where no recording is at hand: glances of minimum jerk to places within
    60 degrees, at up to 300 degrees/s, pauses between them, and a slow sway. Not a measurement."""
    rng = np.random.default_rng(seed)
    times = np.arange(0, round(seconds * 100) + 1) / 100.0
    angles = np.zeros((3, len(times)))
    now, place = 0.5, np.zeros(3)
    while now < seconds:
        goal = rng.uniform([-60, -25, -8], [60, 20, 8])
        size = float(np.abs(goal - place).max())
        duration = max(0.3, 1.875 * size / rng.uniform(120, 300))
        angles += np.outer(goal - place, minimum_jerk((times - now) / duration))
        now, place = now + duration + rng.uniform(0.2, 1.5), goal
    sway = np.array([[0.8], [0.5], [0.4]]) * np.sin(
        2 * np.pi * np.array([[0.31], [0.43], [0.23]]) * times
    )
    poses = body_from_angles(angles + sway)
    return HeadMotion("synthetic head", np.rint(times * NS_PER_S).astype(np.int64), poses)


def turns_head(count: int = TURNS, size_deg: float = TURN_DEG, turn_s: float = 0.4) -> HeadMotion:
    """Turns of the head to and fro about the vertical, one about every 1.6 s, so that they meet
    every clock at other phases. The profile is that of `minimum_jerk`."""
    times = np.arange(0, count * 160 + 200) / 100.0
    yaw = np.zeros(len(times))
    for number, start_s in enumerate(turn_starts_s(count)):
        step = size_deg if number % 2 == 0 else -size_deg
        yaw += step * minimum_jerk((times - start_s) / turn_s)
    poses = body_from_angles(np.stack([yaw, np.zeros_like(yaw), np.zeros_like(yaw)]))
    return HeadMotion("turns", np.rint(times * NS_PER_S).astype(np.int64), poses)


def turn_starts_s(count: int = TURNS) -> Floats:
    """When the turns of `turns_head` begin, in seconds: the golden ratio keeps them from falling
    into step with any clock."""
    number = np.arange(count)
    return np.asarray(1.0 + 1.6 * number + 0.1 * (number * 0.6180339887 % 1.0))


def minimum_jerk(fraction: Floats) -> Floats:
    """From 0 to 1 while `fraction` goes from 0 to 1: 10 x^3 - 15 x^4 + 6 x^5 (Flash and Hogan
    1985); its fastest is 1.875."""
    x = np.clip(fraction, 0.0, 1.0)
    return np.asarray(x * x * x * (10 + x * (6 * x - 15)))


def body_from_angles(angles_deg: Floats) -> Rotation:
    """`freelook.rotations.body_from_view` of yaw, pitch and roll (3, n), in degrees."""
    return FRD_FROM_RDF * Rotation.from_euler("YXZ", np.asarray(angles_deg).T, degrees=True)


def angles_of(body_from_view_rotations: Rotation) -> Floats:
    """Yaw, pitch, roll (3, n) in degrees of n rotations; yaw and roll without jumps by a turn."""
    matrices = body_from_view_rotations.as_matrix()[:, [1, 2, 0]]  # right, down, forward
    pitch = np.arcsin(np.clip(-matrices[:, 1, 2], -1.0, 1.0))
    yaw = np.unwrap(np.arctan2(matrices[:, 0, 2], matrices[:, 2, 2]))
    roll = np.unwrap(np.arctan2(matrices[:, 1, 0], matrices[:, 1, 1]))
    return np.degrees(np.stack([yaw, pitch, roll]))
