"""The two ways from a head to an eye: what is shown from when on, and when it was filmed.

freelook:  tracker -> station -> page draws at the display's rate -> display
gimbal:    tracker -> trainer port -> radio -> command -> motors -> camera -> link -> display

freelook's picture comes the second way too, without the gimbal: its direction is the newest
head's, its content is as old as the video.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_MS
from .figures import Settings
from .head import HeadMotion, angles_of, body_from_angles
from .predictors import Predictor, expected
from .servo import Motor, angle_at, drive
from .stages import Times, later, newest, ticks

Floats = NDArray[np.float64]

# No two clocks run in step. As little as this makes every phase between them happen within
# seconds, as it would within hours.
DETUNED = {
    "tracker": 1.0011,
    "trainer": 0.9973,
    "radio": 1.0037,
    "command": 0.9949,
    "camera": 1.0053,
    "display": 1.0,
}

SEED = 2011

Advance = Callable[[], None]


def nothing() -> None:
    """For who does not watch."""


@dataclass(frozen=True)
class Shown:
    """What the eye gets: from `times_ns` (n,) on, the direction `body_from_shown` (n), filmed at
    `capture_ns` (n,). Before the first time, the first."""

    times_ns: Times
    body_from_shown: Rotation
    capture_ns: Times

    def at(self, t_ns: Times) -> Rotation:
        return self.body_from_shown[newest(self.times_ns, t_ns)]

    def age_ms(self, t_ns: Times) -> Floats:
        """How old the content is at times (m,), in milliseconds."""
        return (t_ns - self.capture_ns[newest(self.times_ns, t_ns)]) / NS_PER_MS


@dataclass(frozen=True)
class MotorTrace:
    """Angles of the gimbal's axes (3, n) at every millisecond: pan, tilt, roll, in degrees."""

    angles_deg: Floats

    def at(self, t_ns: Times) -> Rotation:
        return body_from_angles(np.stack([angle_at(axis, t_ns) for axis in self.angles_deg]))


def tracked(head: HeadMotion, settings: Settings) -> tuple[Times, Rotation]:
    """What the head tracker says, the same to both sides: times (n,) and poses (n)."""
    taken = ticks(head.duration_ns, settings.tracker_period_ms * DETUNED["tracker"])
    poses = head.at(taken)
    if settings.tracker_noise_deg:
        noise = np.random.default_rng(SEED).standard_normal((len(taken), 3))
        noise *= np.radians(settings.tracker_noise_deg)
        poses = poses * Rotation.from_rotvec(noise)
    return taken, poses


def freelook_chain(
    head: HeadMotion,
    settings: Settings,
    predictor: Predictor | None = None,
    advance: Advance = nothing,
) -> Shown:
    """freelook's way. With a predictor the page draws for the middle of the time it is seen."""
    end_ns = head.duration_ns
    taken, poses = tracked(head, settings)
    there = later(taken, settings.tracker_delay_ms + settings.station_delay_ms)
    drawn = ticks(end_ns, settings.refresh_ms)
    frame_ms = settings.refresh_ms * settings.compositor_frames
    seen = later(drawn, frame_ms + settings.display_ms)
    if predictor is None:
        directions = poses[newest(there, drawn)]
    else:
        middle = later(seen, settings.refresh_ms / 2)
        directions = expected(predictor, poses, taken, there, drawn, middle, advance)
    filmed = _filmed(settings, end_ns)
    arrived = later(filmed, settings.transport_ms + settings.digitiser_ms)
    return Shown(seen, directions, filmed[newest(arrived, drawn)])


def gimbal_chain(
    head: HeadMotion,
    settings: Settings,
    predictor: Predictor | None = None,
    advance: Advance = nothing,
) -> tuple[Shown, MotorTrace]:
    """The gimbal's way. With a predictor it is sent where the head is expected when it is seen,
    as far as that is known beforehand: all delays but the motors' own."""
    end_ns = head.duration_ns
    taken, poses = tracked(head, settings)
    there = later(taken, settings.tracker_delay_ms)
    handed = ticks(end_ns, settings.trainer_period_ms * DETUNED["trainer"])
    if predictor is None:
        sent = poses[newest(there, handed)]
    else:
        seen = later(handed, settings.gimbal_wait_ms)
        sent = expected(predictor, poses, taken, there, handed, seen, advance)
    command_ns, commands = _commands(settings, end_ns, handed, angles_of(sent))
    motor = Motor(settings.slew_deg_s, settings.accel_deg_s2, settings.dead_band_deg)
    axes = commands[: int(settings.axes)]
    trace = np.zeros((3, end_ns // NS_PER_MS + 1))
    for number, axis in enumerate(axes):
        trace[number] = drive(motor, command_ns, axis, end_ns)
    motors = MotorTrace(trace)
    filmed = _filmed(settings, end_ns)
    arrived = later(filmed, settings.transport_ms)
    refreshed = ticks(end_ns, settings.refresh_ms)
    captured = filmed[newest(arrived, refreshed)]
    return Shown(later(refreshed, settings.display_ms), motors.at(captured), captured), motors


def _filmed(settings: Settings, end_ns: int) -> Times:
    return ticks(end_ns, settings.camera_ms * DETUNED["camera"])


def _commands(
    settings: Settings, end_ns: int, handed: Times, angles_deg: Floats
) -> tuple[Times, Floats]:
    """When the motors know what: times (n,) and angles (3, n)."""
    radio = ticks(end_ns, settings.radio_period_ms * DETUNED["radio"])
    on_air = newest(handed, radio)
    received = later(radio, settings.radio_delay_ms)
    frames = ticks(end_ns, settings.command_period_ms * DETUNED["command"])
    return later(frames, settings.command_delay_ms), angles_deg[:, on_air[newest(received, frames)]]
