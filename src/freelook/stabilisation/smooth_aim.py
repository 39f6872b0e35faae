"""Where a view looks in a recording so that the vehicle's quick motions are not seen in it.

    body_from_view = body_from_world(at capture) * world_from_base * look

with `world_from_base` the vehicle's own attitude through a low-pass filter without delay
(`smoothing`). Where the attitude is not known, and where the view would leave the lens, the view is
drawn towards the unstabilised one, on the shortest way and slowly: it goes a `fraction` of the way
from the one to the other, which is known beforehand for the whole recording.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..attitude_track import AttitudeTrack
from ..camera import Camera
from ..clock import NS_PER_S
from ..errors import AttitudeError
from ..rotations import slerp
from ..viewport import Viewport
from .containment import Containment, eased, widest_hfov_deg
from .smoothing import DEFAULT_HZ, LOWEST_HZ, smoothed

EASE_S = 0.5  # to both sides, for which a fraction changes before and after what limits it
HELD_S = 0.1  # for so long before and after the log its ends are held
STEP_NS = NS_PER_S // 30

Look = Callable[[int], Rotation]
Floats = NDArray[np.float64]
Times = NDArray[np.int64]


@dataclass(frozen=True)
class Flight:
    """A recording beside its attitude: frame times count from the first frame, at which the
    record's time is `zero_ns`; `duration_s` of it will be asked for."""

    track: AttitudeTrack
    zero_ns: int
    duration_s: float

    def steps(self) -> Times:
        """Times of the recording on a grid, its start and end included."""
        return np.arange(0, round(self.duration_s * NS_PER_S) + 2 * STEP_NS, STEP_NS)


class SmoothAim:
    """body_from_view for times of the recording.

    `unknown` is the share of the recording (0 to 1) for which there is no attitude, `limited` that
    in which the view is drawn back, for whichever reason.
    """

    def __init__(
        self,
        flight: Flight,
        look: Look,
        camera: Camera,
        viewport: Viewport,
        cutoff_hz: float = DEFAULT_HZ,
    ) -> None:
        """`look` is the view's direction relative to the smoothed vehicle. AttitudeError when no
        time of the recording has an attitude, and when the unstabilised view is never wholly on
        the picture; that one says how wide a view would be."""
        self._flight = flight
        self._look = look
        self._path = smoothed(_needed(flight, cutoff_hz), cutoff_hz)
        steps = flight.steps()
        known = _known(flight.track, steps + flight.zero_ns)
        if not known.any():
            raise AttitudeError(
                f"the log lasts from {_s(flight.track.times_ns[0])} to "
                f"{_s(flight.track.times_ns[-1])} s of its time, but the video begins at "
                f"{_s(flight.zero_ns)} s of it; give another --attitude-offset"
            )
        allowed = np.where(known, self._whole(steps, camera, viewport), 0.0)
        self._fractions = eased(allowed, round(EASE_S * NS_PER_S / STEP_NS))
        self.unknown = float(np.mean(~known))

    @property
    def limited(self) -> float:
        return float(np.mean(self._fractions < 0.999))

    def __call__(self, t_ns: int) -> Rotation:
        raw = self._look(t_ns)
        place = np.clip(t_ns / STEP_NS, 0, len(self._fractions) - 1)
        fraction = float(np.interp(place, np.arange(len(self._fractions)), self._fractions))
        if fraction <= 0:
            return raw
        steady = self._steady(np.array([t_ns]), Rotation.concatenate([raw]))[0]
        return steady if fraction >= 1 else slerp(raw, steady, fraction)

    def _steady(self, times_ns: Times, raw: Rotation) -> Rotation:
        """The wholly smoothed views at these times."""
        when = times_ns + self._flight.zero_ns
        return self._flight.track.at(when).inv() * self._path.at(when) * raw

    def _whole(self, steps: Times, camera: Camera, viewport: Viewport) -> Floats:
        """How far of the way to the smoothed view the lens allows, at every step."""
        raw = Rotation.concatenate([self._look(t) for t in steps.tolist()])
        containment = Containment(camera, viewport)
        if not containment.holds(raw).any():
            widest = widest_hfov_deg(camera, viewport, raw[0])
            advice = "look elsewhere" if widest is None else f"try --hfov {int(widest)}"
            raise AttitudeError(
                f"a view of {viewport.hfov_deg:g} degrees sees beyond the lens even when it is not "
                f"stabilised, which leaves no room to smooth it; {advice}"
            )
        return containment.largest_fractions(raw, self._steady(steps, raw))


def _needed(flight: Flight, cutoff_hz: float) -> AttitudeTrack:
    """What the filter sees of a log that may be much longer."""
    reach_ns = round(NS_PER_S / max(LOWEST_HZ, cutoff_hz))
    end_ns = flight.zero_ns + round(flight.duration_s * NS_PER_S)
    return flight.track.part(flight.zero_ns - reach_ns, end_ns + reach_ns)


def _known(track: AttitudeTrack, times_ns: Times) -> NDArray[np.bool_]:
    """Where there is an attitude; a log that ends with the last frame ends soon enough."""
    nearest = np.clip(times_ns, track.times_ns[0], track.times_ns[-1])
    near = np.abs(times_ns - nearest) <= HELD_S * NS_PER_S
    return track.known(nearest) & near


def _s(t_ns: int) -> str:
    return f"{t_ns / NS_PER_S:.3f}"
