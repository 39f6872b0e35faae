"""How much later the attitude's clock reads than the video's, from the motion both have seen.

    attitude time = video time + offset

Coarsely: body rates from the pictures and from the attitude on a common grid, their slow part
taken off, and the normalised cross-correlation over all lags at once (by FFT). Then exactly: the
turn that the attitude made over every single frame interval, at lags a millisecond apart round
the best; the mean squared difference is least at the offset, and a parabola through it finds it
between the lags. What a propeller or a wrong turn spoils is left out by its size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from ..attitude_track import AttitudeTrack
from ..clock import NS_PER_S
from ..errors import AttitudeError
from .image_turns import ImageTurn

Floats = NDArray[np.float64]

GRID_S = 0.01
SLOW_S = 1.0  # what changes more slowly than this says little about time, and is taken off
NOISE_RAD_S = float(np.radians(0.5))  # of rates from pictures, generously
SHORTEST_S = 2.0
LONGEST_S = 24 * 3600.0
SURE = 0.5
_APART = 0.5  # a second peak of half the height is none to worry about
_OVERLAP = 0.5  # of the video's motion, for a lag to be considered
_FINE_NS = 1_000_000
_REACH = 15  # fine lags to each side
_GOOD_NS = 10_000_000  # an uncertainty of this halves the confidence


@dataclass(frozen=True)
class TimeOffset:
    """attitude time = video time + `offset_ns`.

    `correlation` (-1 to 1) at the offset; `second`, the next highest peak's; `uncertainty_ns`,
    one standard deviation as the rates' scatter has it; `excitation_deg_s`, the rms rate of turn
    in the pictures. `confidence`, 0 to 1, is the product of the correlation, of how far it stands
    out from the second, and of how small the uncertainty is beside 10 ms. Above 0.5 is `sure`.
    """

    offset_ns: int
    correlation: float
    second: float
    uncertainty_ns: float
    excitation_deg_s: float

    @property
    def confidence(self) -> float:
        if self.correlation <= 0:
            return 0.0
        apart = (self.correlation - max(self.second, 0.0)) / (_APART * self.correlation)
        certain = 1.0 / (1.0 + (self.uncertainty_ns / _GOOD_NS) ** 2)
        return float(self.correlation * min(1.0, max(0.0, apart)) * certain)

    @property
    def sure(self) -> bool:
        return self.confidence > SURE

    @property
    def evidence(self) -> str:
        """What speaks for it, for people."""
        return (
            f"confidence {self.confidence:.2f} (correlation {self.correlation:.2f}, "
            f"next best {self.second:.2f}, ± {self.uncertainty_ns / 1e6:.1f} ms, "
            f"turning by {self.excitation_deg_s:.1f} degrees a second rms)"
        )


def find_offset(
    turns: Sequence[ImageTurn],
    track: AttitudeTrack,
    between_ns: tuple[int, int] | None = None,
) -> TimeOffset:
    """The offset at which the track turns as the pictures do.

    All lags are considered at which the two have half the video's motion in common, or those
    `between_ns`. AttitudeError for less than two seconds of turns and when no lag remains; whether
    the result means anything is `TimeOffset.sure`.
    """
    seen_s = sum(turn.end_ns - turn.start_ns for turn in turns) / NS_PER_S
    if seen_s < SHORTEST_S:
        raise AttitudeError(
            f"only {seen_s:.1f} s of the video show how the camera turned; "
            f"{SHORTEST_S:.0f} s are needed to find its time beside the attitude's"
        )
    video = _Video.of(turns)
    if between_ns is not None:
        first_ns, last_ns = int(video.starts_ns[0]), int(video.ends_ns[-1])
        track = track.part(first_ns + between_ns[0], last_ns + between_ns[1])
    if track.duration_s > LONGEST_S:
        raise AttitudeError(
            f"the log spans {track.duration_s / 3600:.1f} hours, too long to look for the video in "
            "it; say where it begins"
        )
    products = _correlations(video, track)
    lags_ns, correlation = products.lags_ns, np.trace(products.matrices, axis1=1, axis2=2)
    if between_ns is not None:
        inside = (lags_ns >= between_ns[0]) & (lags_ns <= between_ns[1])
        lags_ns, correlation = lags_ns[inside], correlation[inside]
    if not np.isfinite(correlation).any():
        raise AttitudeError(
            "video and attitude have too little time in common; is it the log of this flight?"
        )
    best, second = _peaks(correlation)
    exact_ns, uncertainty_ns = _refined(video, track, int(lags_ns[best]))
    excitation = float(np.degrees(np.sqrt(np.mean(np.sum(video.rates**2, axis=1)))))
    return TimeOffset(exact_ns, float(correlation[best]), second, uncertainty_ns, excitation)


@dataclass(frozen=True)
class TurnedAxes:
    """The turn between the axes in which video and attitude tell their rates that makes them most
    alike: `body_from_told`, from what the video's lens and mounting say is the body to the body of
    the attitude. `correlation` as in `TimeOffset`, with that turn."""

    body_from_told: Rotation
    correlation: float


def turned_axes(turns: Sequence[ImageTurn], track: AttitudeTrack) -> TurnedAxes | None:
    """Whether video and attitude would agree if the camera were mounted differently.

    At every lag the rotation is found that makes the correlation largest (Kabsch's, of the rates);
    the largest of all counts. It needs turning about two axes at least; None without common time.
    To be asked when `find_offset` is not sure: three more numbers to choose make chance
    correlations higher, so only a correlation of 0.8 or more says something.
    """
    products = _correlations(_Video.of(turns), track)
    usable = products.matrices[np.isfinite(products.matrices).all(axis=(1, 2))]
    if not len(usable):
        return None
    u, sizes, vt = np.linalg.svd(usable)
    sign = np.sign(np.linalg.det(u @ vt))
    sums = sizes[:, 0] + sizes[:, 1] + sign * sizes[:, 2]
    best = int(sums.argmax())
    turn = u[best] @ np.diag([1.0, 1.0, sign[best]]) @ vt[best]
    return TurnedAxes(Rotation.from_matrix(turn), float(sums[best]))


@dataclass(frozen=True)
class _Video:
    starts_ns: NDArray[np.int64]
    ends_ns: NDArray[np.int64]
    rates: Floats

    @classmethod
    def of(cls, turns: Sequence[ImageTurn]) -> _Video:
        starts = np.array([turn.start_ns for turn in turns], np.int64)
        ends = np.array([turn.end_ns for turn in turns], np.int64)
        return cls(starts, ends, np.array([turn.rate for turn in turns]))

    @property
    def frame_s(self) -> float:
        return float(np.median(self.ends_ns - self.starts_ns)) / NS_PER_S


@dataclass(frozen=True)
class _Products:
    """`matrices` (lags, 3, 3): sums of track rate times video rate, over `scale`, at each lag; NaN
    where the two have too little in common."""

    lags_ns: NDArray[np.int64]
    matrices: Floats


def _correlations(video: _Video, track: AttitudeTrack) -> _Products:
    """At lags a grid step apart."""
    from scipy.signal import correlate  # slow to import, and every command would wait for it

    grid_ns = round(GRID_S * NS_PER_S)
    count = int((video.ends_ns[-1] - video.starts_ns[0]) // grid_ns) + 1
    video_times = video.starts_ns[0] + grid_ns * np.arange(count)
    seen, video_rates = _on_grid(video, video_times)
    length = int((track.times_ns[-1] - track.times_ns[0]) // grid_ns) + 1
    track_times = track.times_ns[0] + grid_ns * np.arange(length)
    known, track_rates = _track_rates(track, track_times, video.frame_s)
    a, v = _quick_part(track_rates, known), _quick_part(video_rates, seen)
    common = correlate(known, seen * np.sum(v**2, axis=1), method="fft")
    noise = NOISE_RAD_S**2 * correlate(known, seen, method="fft")
    other = correlate(np.sum(a**2, axis=1), seen, method="fft")
    scale = np.sqrt(np.maximum(common + noise, 1e-12) * np.maximum(other + noise, 1e-12))
    enough = common > _OVERLAP * float(np.sum(seen * np.sum(v**2, axis=1)))
    scale = np.where(enough & (noise > 1e-12), scale, np.nan)
    axes = range(3)
    products = [[correlate(a[:, i], v[:, j], method="fft") / scale for j in axes] for i in axes]
    lags = np.arange(-(count - 1), length) * grid_ns + (track_times[0] - video_times[0])
    return _Products(lags, np.stack([np.stack(row, axis=-1) for row in products], axis=-2))


def _on_grid(video: _Video, times_ns: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """1 where a frame interval covers the time, and the rate (n, 3) there, else 0."""
    after = np.clip(np.searchsorted(video.starts_ns, times_ns, "right") - 1, 0, None)
    covered = (times_ns >= video.starts_ns[after]) & (times_ns < video.ends_ns[after])
    middles = 0.5 * (video.starts_ns + video.ends_ns)
    rates = np.stack([np.interp(times_ns, middles, r) for r in video.rates.T], axis=-1)
    seen = covered.astype(float)
    return seen, rates * seen[:, None]


def _track_rates(
    track: AttitudeTrack, times_ns: NDArray[np.int64], frame_s: float
) -> tuple[Floats, Floats]:
    """1 where the attitude is known, and its mean rate (n, 3) over a frame round each time."""
    half_ns = round(frame_s / 2 * NS_PER_S)
    before, after = times_ns - half_ns, times_ns + half_ns
    turns = (track.at(before).inv() * track.at(after)).as_rotvec()
    known = (track.known(before) & track.known(after)).astype(float)
    return known, turns / frame_s * known[:, None]


def _quick_part(rates: Floats, known: Floats) -> Floats:
    """The rates without their slow part, 0 where they are not known."""
    sigma = SLOW_S / GRID_S
    weight = gaussian_filter1d(known, sigma, mode="constant")
    slow = gaussian_filter1d(rates, sigma, axis=0, mode="constant")
    return (rates - slow / np.maximum(weight, 1e-9)[:, None]) * known[:, None]


def _peaks(correlation: Floats) -> tuple[int, float]:
    """Index of the highest value, and the highest one beyond the hill it stands on; 0 if none."""
    filled = np.where(np.isfinite(correlation), correlation, -1.0)
    best = int(filled.argmax())
    rising = np.diff(filled) > 0
    left = best
    while left > 0 and rising[left - 1]:
        left -= 1
    right = best
    while right < len(filled) - 1 and not rising[right]:
        right += 1
    others = np.concatenate([filled[:left], filled[right + 1 :]])
    return best, float(max(others.max(initial=0.0), 0.0))


def _refined(video: _Video, track: AttitudeTrack, lag_ns: int) -> tuple[int, float]:
    """The offset near a lag, and its standard deviation, in ns.

    The deviation is that of a least-squares fit whose residuals are as large as those found:
    variance = 2 s^2 / C'' where C(lag) is the sum of squares and s^2 the variance of one residual.
    """
    centre_ns = lag_ns
    for _ in range(3):  # a coarse peak may lie a little beside the reach
        lags = centre_ns + _FINE_NS * np.arange(-_REACH, _REACH + 1)
        costs, variance, used = _costs(video, track, lags)
        least = int(costs.argmin())
        if 3 <= least <= 2 * _REACH - 3:
            break
        centre_ns = int(lags[least])
    window = slice(max(0, least - 4), least + 5)
    x = (lags[window] - lags[least]) / _FINE_NS
    curve, slope, _ = np.polyfit(x, costs[window] * used, 2)
    if curve <= 1e-12:
        return int(lags[least]), float(_REACH * _FINE_NS)
    shift = float(np.clip(-slope / (2 * curve), -4, 4))
    deviation = float(np.sqrt(variance / curve)) * _FINE_NS
    return round(float(lags[least]) + shift * _FINE_NS), deviation


def _costs(
    video: _Video, track: AttitudeTrack, lags_ns: NDArray[np.int64]
) -> tuple[Floats, float, int]:
    """Mean squared difference at each lag, the variance of one component where it is least, and
    how many differences it is the mean of.

    Only intervals that the track knows at all the lags count, and not those that differ by more
    than three times the median at the middle lag or the best one.
    """
    starts = video.starts_ns[:, None] + lags_ns
    ends = video.ends_ns[:, None] + lags_ns
    shape = starts.shape
    turns = (track.at(starts.ravel()).inv() * track.at(ends.ravel())).as_rotvec()
    steps_s = ((video.ends_ns - video.starts_ns) / NS_PER_S)[:, None, None]
    apart = video.rates[:, None] - turns.reshape(*shape, 3) / steps_s
    squares = np.sum(apart**2, axis=2)
    known = (track.known(starts.ravel()) & track.known(ends.ravel())).reshape(shape).all(axis=1)
    if known.sum() < 3:
        return np.zeros(len(lags_ns)), 1.0, 0
    best = int(squares[known].sum(axis=0).argmin())
    typical = float(np.median(squares[known, best]))
    used = known & (squares[:, best] <= 9 * typical + 1e-12)
    costs = squares[used].mean(axis=0)
    return costs, float(costs.min() / 3), int(used.sum())
