"""How far predictions of the head are off, on recorded head motion.

How the error is defined, for every sample from `WARM_UP` on and every horizon h:

    predicted  what the predictor says for t + h, having seen all samples up to the one at t
    true       the recording at t + h, between samples by slerp
    error      the angle of the rotation between the two

The first samples are left out because nothing can be known yet, the last where t + h lies beyond
the recording. Times are those of the file: neither smoothed nor made regular.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from .. import head_recording
from ..clock import NS_PER_MS, NS_PER_S
from ..errors import TrackerError
from ..head_recording import columns_of, read_lines, sample_of
from ..lens import Floats
from ..prediction import Predictor, make_predictor
from ..rotations import angle_between_deg, body_from_view
from ..types import Pose

HORIZONS_MS = (20.0, 50.0, 100.0)
WARM_UP = 30
PERCENTS = (50, 95, 99)

STILL_SECONDS = 11.0
STILL_RATE_HZ = 60.0
STILL_NOISE_DEG = 0.02  # per axis, rms: a good inertial tracker at rest
STEADY_SECONDS = 2.0
SPEEDS_DEG_S = (1.0, 2.0, 5.0, 10.0, 20.0, 100.0)


@dataclass(frozen=True)
class Recording:
    """Head motion: times in nanoseconds (n,), strictly rising, and body_from_view for each."""

    name: str
    t_ns: np.ndarray[tuple[int], np.dtype[np.int64]]
    body_from_view: Rotation


@dataclass(frozen=True)
class Row:
    """One predictor on one recording: errors in degrees by percentile, for each horizon."""

    recording: str
    predictor: str
    horizon_ms: float
    errors_deg: dict[int, float]
    samples: int


def read_recording(path: Path) -> Recording:
    """A recorded head (`freelook.head_recording`).

    Lines whose time does not advance, or that have anything but finite numbers, are left out.
    TrackerError for a file that cannot be read, has other columns, or fewer than 100 such lines.
    """
    lines = read_lines(path)
    columns = columns_of(path, lines[0] if lines else "")
    rows = [row for line in lines[1:] if (row := _numbers(line, columns))]
    if len(rows) < 100:
        raise TrackerError(f"{path}: {len(rows)} usable samples; at least 100 are needed")
    table = np.array(rows)
    newer = np.concatenate([[True], table[1:, 0] > np.maximum.accumulate(table[:, 0])[:-1]])
    table = table[newer]
    t_ns = np.round((table[:, 0] - table[0, 0]) * NS_PER_S).astype(np.int64)
    return Recording(path.name, t_ns, head_recording.body_from_view(table[:, 1:]))


def _numbers(line: str, columns: list[int]) -> list[float] | None:
    try:
        return sample_of(line, columns)
    except ValueError:
        return None


def errors_deg(
    recording: Recording,
    predictor: Predictor,
    horizons_ms: tuple[float, ...] = HORIZONS_MS,
    advance: Callable[[], None] = lambda: None,
) -> list[Floats]:
    """For each horizon the errors of the samples that have one; see above. `advance` is called
    once for every sample."""
    predicted: list[list[Rotation]] = [[] for _ in horizons_ms]
    asked_ns: list[list[int]] = [[] for _ in horizons_ms]
    ahead_ns = [round(horizon * NS_PER_MS) for horizon in horizons_ms]
    for index, t_ns in enumerate(recording.t_ns.tolist()):
        predictor.push(Pose(recording.body_from_view[index], t_ns))
        advance()
        for number, ahead in enumerate(ahead_ns):
            if index >= WARM_UP and t_ns + ahead <= recording.t_ns[-1]:
                predicted[number].append(predictor.at(t_ns + ahead))
                asked_ns[number].append(t_ns + ahead)
    truth = Slerp(recording.t_ns / NS_PER_S, recording.body_from_view)
    return [
        np.degrees((Rotation.concatenate(turns).inv() * truth(np.array(at) / NS_PER_S)).magnitude())
        for turns, at in zip(predicted, asked_ns, strict=True)
    ]


def rows(
    recording: Recording, name: str, advance: Callable[[], None] = lambda: None
) -> Iterator[Row]:
    """The figures of one predictor, one row for each of `HORIZONS_MS`."""
    errors = errors_deg(recording, make_predictor(name), HORIZONS_MS, advance)
    for horizon_ms, error in zip(HORIZONS_MS, errors, strict=True):
        shares = {percent: float(np.percentile(error, percent)) for percent in PERCENTS}
        yield Row(recording.name, name, horizon_ms, shares, len(error))


def jitter_at_rest_deg(name: str, seed: int = 2011) -> dict[float, float]:
    """RMS angle by which predictions shake about their mean while the head does not move.

    For each of `HORIZONS_MS`. The tracker's noise is white, `STILL_NOISE_DEG` about each axis, at
    `STILL_RATE_HZ`; the first second is left out.
    """
    rng = np.random.default_rng(seed)
    count = round(STILL_SECONDS * STILL_RATE_HZ)
    noise = np.radians(STILL_NOISE_DEG) * rng.standard_normal((count, 3))
    poses = body_from_view(100.0, -20.0, 5.0) * Rotation.from_rotvec(noise)
    predictor = make_predictor(name)
    said: dict[float, list[Rotation]] = {ahead_ms: [] for ahead_ms in HORIZONS_MS}
    for index in range(count):
        t_ns = round(index * NS_PER_S / STILL_RATE_HZ)
        predictor.push(Pose(poses[index], t_ns))
        for ahead_ms, turns in said.items():
            turns.append(predictor.at(t_ns + round(ahead_ms * NS_PER_MS)))
    first = round(STILL_RATE_HZ)
    return {ahead: _shaking_deg(Rotation.concatenate(said[ahead][first:])) for ahead in said}


def _shaking_deg(turns: Rotation) -> float:
    return float(np.degrees(np.sqrt(np.mean((turns.mean().inv() * turns).magnitude() ** 2))))


def smoothing_lag_ms(name: str, speed_deg_s: float) -> float:
    """By how much time a predictor is late for the present, on a head that turns steadily."""
    predictor = make_predictor(name)
    for index in range(round(STEADY_SECONDS * STILL_RATE_HZ)):
        t_ns = round(index * NS_PER_S / STILL_RATE_HZ)
        now = body_from_view(speed_deg_s * t_ns / NS_PER_S, 0.0)
        predictor.push(Pose(now, t_ns))
    return 1000.0 * angle_between_deg(predictor.at(t_ns), now) / speed_deg_s
