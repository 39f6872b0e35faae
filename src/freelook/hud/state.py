"""The numbers that a HUD shows. What is not known is None, and is not drawn."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..lens import Floats
from ..rotations import FRD_FROM_RDF


@dataclass(frozen=True)
class Dial:
    """Of the last moments, in milliseconds."""

    median_ms: float | None = None
    p95_ms: float | None = None


@dataclass(frozen=True)
class Warned:
    """What the pilot must be told now; `level` is alert, warn or info."""

    level: str
    text: str


@dataclass(frozen=True)
class Link:
    """Of the video: `state` as in `freelook.ingest`, `lost` packets so far."""

    state: str
    lost: int = 0


@dataclass(frozen=True)
class TrackerState:
    """Who is in command, and the state of its aim."""

    name: str
    state: str


@dataclass(frozen=True)
class Recording:
    """`shown` pictures written so far."""

    state: str
    shown: int


@dataclass(frozen=True)
class LensField:
    """How far the lens sees, radians, and how it is mounted: from the axes of a head that looks
    straight ahead (x right, y down, z forward) to the camera's."""

    theta_max: float
    camera_from_head: Floats

    @classmethod
    def of(cls, camera: Camera) -> LensField:
        turn = camera.camera_from_body * FRD_FROM_RDF
        return cls(float(camera.theta_max), np.asarray(turn.as_matrix()))


@dataclass(frozen=True)
class HudState:
    """`body_from_view` is where the view looks; `world_from_body` the vehicle's attitude (north,
    east, down) when the picture was taken, None where it is not known."""

    body_from_view: Rotation
    hfov_deg: float
    projection: str = "perspective"
    world_from_body: Rotation | None = None
    lens: LensField | None = None
    link: Link | None = None
    tracker: TrackerState | None = None
    mode: str = "body"
    recording: Recording | None = None
    warnings: tuple[Warned, ...] = ()
    dials: dict[str, Dial] = field(default_factory=dict)
