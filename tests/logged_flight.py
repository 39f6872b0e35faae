"""A simulated flight that turns as a record of attitudes says, seen through a small fisheye."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from freelook.attitude_track import AttitudeTrack
from freelook.attitudes import open_attitude
from freelook.attitudes._log import LogSource
from freelook.camera import Camera, make_camera
from freelook.lens import Equidistant
from freelook.simulation.camera import SimulatedCamera, pixel_deg
from freelook.simulation.flight import State
from freelook.simulation.world import World

SIZE = (240, 240)
FIELD_DEG = 200.0
FRAME_NS = 33_000_000


@dataclass(frozen=True)
class LoggedFlight:
    """Turns as the track, and drifts north at a few metres a second, so that there is parallax."""

    track: AttitudeTrack
    speed_m_s: float = 5.0
    height_m: float = 60.0

    def at(self, t_ns: int) -> State:
        north = self.speed_m_s * (t_ns - self.track.start_ns) / 1e9 - 100.0
        position = np.array([north, 10.0, -self.height_m])
        return State(position, self.track.at(np.array([t_ns]))[0])


@cache
def px4_attitude(shared_data: Path) -> AttitudeTrack:
    """The real autopilot's attitude; in its first nine seconds it is turned about by hand."""
    source = open_attitude(str(shared_data / "px4_log" / "vehicle_attitude.csv"))
    assert isinstance(source, LogSource)
    return source.track


def small_fisheye() -> Camera:
    focal = SIZE[0] / 2 / np.radians(FIELD_DEG / 2)
    return make_camera(SIZE, Equidistant(focal), field_deg=FIELD_DEG)


def simulated(track: AttitudeTrack) -> SimulatedCamera:
    camera = small_fisheye()
    return SimulatedCamera(camera, World(pixel_deg(camera)), LoggedFlight(track))
