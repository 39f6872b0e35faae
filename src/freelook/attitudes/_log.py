"""What all logs share: a track that is yielded, files that can be read, rates made attitude."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..attitude_track import AttitudeTrack, track_of
from ..clock import NS_PER_S
from ..errors import AttitudeError
from ..rate_integration import gyro_bias, integrated, levelled
from ..types import Attitude, Counters

Floats = NDArray[np.float64]
LONGEST_S = 2 * 86400.0  # of a record that is integrated
NOTE_RATES = "attitude integrated from the gyroscope: heading starts at 0 and drifts"


class LogSource:
    """A log that was read: all its attitudes, then the end.

    `notes` says what a reader has to know about it; `track` is the same as arrays.
    """

    def __init__(self, track: AttitudeTrack, counters: Counters, notes: tuple[str, ...]) -> None:
        self.track = track
        self.counters = counters
        self.notes = notes
        self._closed = threading.Event()

    @property
    def message(self) -> str:
        return "the log has ended"

    def attitudes(self) -> Iterator[Attitude]:
        rotations = self.track.world_from_body
        for index, t_ns in enumerate(self.track.times_ns.tolist()):
            if self._closed.is_set():
                return
            yield Attitude(t_ns, rotations[index])

    def close(self) -> None:
        self._closed.set()


def log_of_quaternions(
    name: str, times_ns: NDArray[np.int64], wxyz: Floats, notes: tuple[str, ...] = ()
) -> LogSource:
    """A log of world_from_body quaternions (n, 4), w first; AttitudeError names the log."""
    try:
        track = track_of(times_ns, wxyz[:, [1, 2, 3, 0]])
    except AttitudeError as error:
        raise AttitudeError(f"{name}: {error}") from None
    counters = Counters()
    if left_out := len(times_ns) - len(track.times_ns):
        counters.add("left out", left_out)
    return LogSource(track, counters, notes)


def log_of_rates(
    name: str,
    times_ns: NDArray[np.int64],
    rates: Floats,
    accelerations: Floats | None,
    notes: tuple[str, ...] = (),
) -> LogSource:
    """A log of body rates (n, 3) in rad/s and accelerations (n, 3) in m/s^2, integrated.

    Without accelerations the first attitude is taken to be level.
    """
    fine = np.isfinite(rates).all(axis=1) & (np.abs(np.nan_to_num(rates)).max(axis=1) < 1e3)
    newest = np.maximum.accumulate(times_ns)
    fine[1:] &= times_ns[1:] > newest[:-1]
    times_ns, rates = times_ns[fine], rates[fine]
    if len(times_ns) < 2:
        raise AttitudeError(f"{name}: fewer than two samples of a gyroscope in the order of time")
    times_s = (times_ns - times_ns[0]) / NS_PER_S
    if times_s[-1] > LONGEST_S:
        raise AttitudeError(
            f"{name}: its gyroscope's times span {times_s[-1] / 86400:.1f} days; are they right?"
        )
    felt = np.full_like(rates, np.nan)
    if accelerations is None:
        notes = (*notes, f"{NOTE_RATES}; no accelerometer, so the start is taken to be level")
    else:
        felt = np.where(np.abs(accelerations) < 1e4, accelerations, np.nan)[fine]
        notes = (*notes, NOTE_RATES)
    rates = rates - gyro_bias(times_s, rates, felt)
    attitude = levelled(times_s, integrated(times_s, rates), felt)
    counters = Counters()
    if left_out := len(fine) - len(times_ns):
        counters.add("left out", left_out)
    return LogSource(AttitudeTrack(times_ns, attitude), counters, notes)


def readable(argument: str) -> Path:
    """The path of a file that can be read, or AttitudeError."""
    path = Path(os.path.expanduser(argument))
    try:
        with path.open("rb"):
            return path
    except (OSError, ValueError) as error:
        raise AttitudeError(f"{argument}: {getattr(error, 'strerror', None) or error}") from None
