"""What comes out: errors, lag, and how a turn of the head is followed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_MS, NS_PER_S
from .chains import Shown
from .head import TURN_DEG, HeadMotion, turn_starts_s
from .stages import Times

Floats = NDArray[np.float64]

WARM_UP_NS = NS_PER_S  # until every stage has something
LONGEST_LAG_MS = 800
EARLIEST_LAG_MS = -100
LEVELS = (0.1, 0.5, 0.9)
TURN_NS, TURN_STEP_NS = 1_500_000_000, 500_000  # watched for so long, so finely


@dataclass(frozen=True)
class Spread:
    """Half are below `p50`, 95 of 100 below `p95`, 99 below `p99`."""

    p50: float
    p95: float
    p99: float
    worst: float
    rms: float


def spread(values: Floats) -> Spread:
    p50, p95, p99 = np.percentile(values, [50, 95, 99])
    rms = float(np.sqrt(np.mean(values**2)))
    return Spread(float(p50), float(p95), float(p99), float(values.max()), rms)


def moments(head: HeadMotion) -> Times:
    """Every millisecond that counts, the first second left out."""
    return np.arange(WARM_UP_NS, head.duration_ns + 1, NS_PER_MS, dtype=np.int64)


def direction_of(rotations: Rotation) -> Floats:
    """Where a view looks: unit vectors (n, 3) in the body frame."""
    return np.asarray(rotations.as_matrix()[:, :, 2])


def angle_deg(a: Floats, b: Floats) -> Floats:
    """Between unit vectors (n, 3); exact for small angles too."""
    cross = np.linalg.norm(np.cross(a, b), axis=1)
    return np.asarray(np.degrees(np.arctan2(cross, np.einsum("ij,ij->i", a, b))))


def direction_error_deg(head: HeadMotion, shown: Shown, t_ns: Times) -> Floats:
    """Between where the head looks and what is shown to it, at times (m,), in degrees."""
    return angle_deg(direction_of(head.at(t_ns)), direction_of(shown.at(t_ns)))


def turned_error_deg(head: HeadMotion, shown: Shown, t_ns: Times) -> Floats:
    """The same with roll: the angle of the rotation between head and view, in degrees."""
    a, b = head.at(t_ns).as_quat(), shown.at(t_ns).as_quat()
    b *= np.where(np.einsum("ij,ij->i", a, b) < 0, -1.0, 1.0)[:, None]
    half = 2 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    return np.asarray(np.degrees(2 * half))


def lag_ms(head: HeadMotion, shown: Shown, t_ns: Times) -> float:
    """By how much the shown direction is late: the shift at which it fits the head's best.

    The fit is the mean cosine of the angle between them, the cross-correlation of the two
    directions; a parabola through the best three shifts gives fractions of a millisecond. NaN
    where the head stands still. `t_ns` must be milliseconds without gaps.
    """
    margin = LONGEST_LAG_MS
    if len(t_ns) < 3 * margin:
        margin = len(t_ns) // 3
    looks, sees = direction_of(head.at(t_ns)), direction_of(shown.at(t_ns))
    if np.ptp(looks, axis=0).max() < 1e-4:
        return float("nan")
    inner = sees[margin : len(sees) - margin]

    def fit(shift: int) -> float:
        return float(np.vdot(inner, looks[margin - shift : len(looks) - margin - shift]))

    coarse = range(max(EARLIEST_LAG_MS, -margin), margin + 1, 5)
    around = max(coarse, key=fit)
    fine = range(max(around - 5, coarse[0] + 1), min(around + 5, margin - 1) + 1)
    best = max(fine, key=fit)
    before, there, after = fit(best - 1), fit(best), fit(best + 1)
    bend = before - 2 * there + after
    return best + (0.5 * (before - after) / bend if bend < 0 else 0.0)


def turn_delays_ms(head: HeadMotion, shown: Shown, size_deg: float = TURN_DEG) -> Floats:
    """(turns, 3): how much later than the head the view has 10, 50 and 90 % of each turn of
    `freelook.duel.head.turns_head`; infinite where it has not before the next turn."""
    starts = np.rint(turn_starts_s() * NS_PER_S).astype(np.int64)
    starts = starts[starts + TURN_NS <= head.duration_ns]
    t_ns = np.arange(0, head.duration_ns, TURN_STEP_NS, dtype=np.int64)
    yaws = [yaw_deg(rotations) for rotations in (head.at(t_ns), shown.at(t_ns))]
    delays = np.empty((len(starts), len(LEVELS)))
    for number, start in enumerate(starts.tolist()):
        window = slice(start // TURN_STEP_NS, (start + TURN_NS) // TURN_STEP_NS)
        there = [yaw if number % 2 == 0 else size_deg - yaw for yaw in (y[window] for y in yaws)]
        for column, level in enumerate(LEVELS):
            head_there, shown_there = (_first(yaw >= level * size_deg) for yaw in there)
            delays[number, column] = (shown_there - head_there) * TURN_STEP_NS / NS_PER_MS
    return delays


def yaw_deg(rotations: Rotation) -> Floats:
    """The azimuth of where views look, in degrees, right of straight ahead."""
    forward, right, _down = direction_of(rotations).T
    return np.asarray(np.degrees(np.arctan2(right, forward)))


def _first(there: NDArray[np.bool_]) -> float:
    return float(np.argmax(there)) if there.any() else float("inf")
