"""Where a view looks so that the vehicle's turning is not seen in it.

    body_from_view = body_from_world(at capture) * world_from_base * look

    mode      world_from_base
    horizon   level, heading with the vehicle
    world     level, heading as it was at the first frame
    smooth    the vehicle's own attitude through a low-pass filter without delay

as `freelook.gimbal` has them. Where the attitude is not known, and, in `smooth`, where the view
would leave the lens, the view is drawn towards the unstabilised one, on the shortest way and
slowly: it is a `fraction` of the way from the one to the other.
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
from ..gimbal.headings import Heading
from ..gimbal.stabiliser import level
from ..rotations import slerp
from ..viewport import Viewport
from .containment import Containment, eased, widest_hfov_deg
from .smoothing import DEFAULT_HZ, smoothed

MODES = ("horizon", "world", "smooth")
EASE_S = 0.5  # to both sides, for which a fraction changes before and after what limits it
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


class StabilisedAim:
    """body_from_view for times of the recording; asked in the order of time.

    `unknown` is the share of the recording (0 to 1) for which there is no attitude, `limited` that
    in which the view is drawn back, for whichever reason.
    """

    def __init__(self, mode: str, flight: Flight, look: Look) -> None:
        """`look` is the view's direction relative to the steady base. AttitudeError for an
        unknown mode, and when no time of the recording has an attitude."""
        if mode not in MODES:
            raise AttitudeError(f"unknown stabilisation '{mode}'; known: {', '.join(MODES)}")
        self._mode = mode
        self._flight = flight
        self._look = look
        self._path = flight.track
        self._heading = Heading(1.0)
        self._fixed_deg: float | None = None
        self._steps = flight.steps()
        known = flight.track.known(self._steps + flight.zero_ns)
        if not known.any():
            raise AttitudeError(
                "the log has no attitude for any time of the video: it lasts "
                f"{flight.track.duration_s:.1f} s, the video begins "
                f"{(flight.zero_ns - flight.track.start_ns) / NS_PER_S:+.1f} s into it; "
                "give another --attitude-offset"
            )
        self._allowed = known.astype(float)
        self._fractions = self._eased()
        self.unknown = float(np.mean(~known))

    @property
    def limited(self) -> float:
        return float(np.mean(self._fractions < 0.999))

    def smooth(self, cutoff_hz: float = DEFAULT_HZ) -> None:
        """The path for the mode `smooth`."""
        self._path = smoothed(self._flight.track, cutoff_hz)

    def contain(self, camera: Camera, viewport: Viewport) -> None:
        """Keep the view on the picture wherever the unstabilised one is.

        AttitudeError when the unstabilised view never is; it says how wide a view would be.
        """
        raw = Rotation.concatenate([self._look(t) for t in self._steps.tolist()])
        containment = Containment(camera, viewport)
        if not containment.holds(raw).any():
            widest = widest_hfov_deg(camera, viewport, raw[0])
            advice = "look elsewhere" if widest is None else f"try --hfov {int(widest)}"
            raise AttitudeError(
                f"a view of {viewport.hfov_deg:g} degrees sees beyond the lens even when it is not "
                f"stabilised, which leaves no room to smooth it; {advice}"
            )
        body = self._flight.track.at(self._steps + self._flight.zero_ns)
        path = self._path.at(self._steps + self._flight.zero_ns)
        wanted = body.inv() * path * raw
        self._allowed = np.minimum(self._allowed, containment.largest_fractions(raw, wanted))
        self._fractions = self._eased()

    def __call__(self, t_ns: int) -> Rotation:
        raw = self._look(t_ns)
        place = t_ns / STEP_NS
        fraction = float(np.interp(place, np.arange(len(self._fractions)), self._fractions))
        when = np.array([t_ns + self._flight.zero_ns])
        body = self._flight.track.at(when)[0]
        base = self._base(t_ns, when, body)
        if fraction <= 0:
            return raw
        steady = body.inv() * base * raw
        return steady if fraction >= 1 else slerp(raw, steady, fraction)

    def _base(self, t_ns: int, when: Times, body: Rotation) -> Rotation:
        """world_from_base at a time."""
        if self._mode == "smooth":
            return self._path.at(when)[0]
        heading_deg = self._heading.at(t_ns, body)
        if self._mode == "horizon":
            return level(heading_deg)
        if self._fixed_deg is None:
            self._fixed_deg = heading_deg
        return level(self._fixed_deg)

    def _eased(self) -> Floats:
        return eased(self._allowed, round(EASE_S * NS_PER_S / STEP_NS))
