"""Where a target was held, roughly, and how much that differs from where it was before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..camera import Camera
from ..lens import Equidistant, Floats, growth_limit
from .initial import pose_of
from .live_coverage import Sectors
from .views import View

# A view is new if it differs from each one before by one of these.
NEW_PLACE = 0.13  # of the angle from the axis to the edge
NEW_TILT = np.radians(16.0)
NEW_DISTANCE = 1.4  # times nearer or farther
GUESSED_EDGE = np.radians(85.0)  # angle at the edge while nothing is known
TILTED = np.radians(22.0)
WIDEST = np.radians(140.0)


@dataclass(frozen=True)
class Placing:
    """Where a board was: unit rays to its middle and along its normal (towards the camera, camera
    frame), and its distance in the target's unit."""

    ray: Floats
    normal: Floats
    distance: float

    @property
    def tilt(self) -> Floats:
        """(2,) how far the normal leans from the line of sight, radians: right, down."""
        leaning = frame_along(self.ray).T @ self.normal
        across = float(np.hypot(leaning[0], leaning[1]))
        angle = np.arctan2(across, -leaning[2])
        return np.asarray(leaning[:2] * (angle / across if across > 1e-9 else 0.0))

    def nearer_side(self) -> str | None:
        """Which side of the board is nearer, if it is clearly tilted."""
        right, down = self.tilt
        if max(abs(right), abs(down)) < TILTED:
            return None
        if abs(right) > abs(down):  # a normal leaning right: its left side comes nearer
            return "left" if right > 0 else "right"
        return "top" if down > 0 else "bottom"


def frame_along(ray: Floats) -> Floats:
    """(3, 3) columns right, down and along a unit ray: the camera's axes, turned there shortest."""
    x, y, z = ray
    if z < -0.9999:
        return np.diag([1.0, -1.0, -1.0])
    k = 1 / (1 + z)
    return np.array([[1 - k * x * x, -k * x * y, x], [-k * x * y, 1 - k * y * y, y], [-x, -y, z]])


def rough_camera(size: tuple[int, int], sectors: Sectors, known: Camera | None) -> Camera:
    """An equidistant lens that sees everywhere: for hints, where only the rough place matters."""
    if known is None:
        f = float(np.max(sectors.reach)) / GUESSED_EDGE
    else:
        f = float(known.lens.radius(np.array([known.theta_max]))[0] / known.theta_max)
    return Camera(size, Equidistant(f), sectors.center, 0.999 * np.pi)


def wide(known: Camera) -> Camera:
    """The camera with all the field its lens may have: for points farther out than any before."""
    return replace(known, theta_max=min(growth_limit(known.lens), WIDEST))


def placing(view: View, rough: Camera, known: Camera | None) -> Placing | None:
    """Where the board of a view is; by the known camera, if it sees all of it. None: no idea."""
    camera = rough
    if known is not None and np.isfinite(known.ray(view.pixels)).all():
        camera = known
    pose = pose_of(camera, view)
    if pose is None:
        return None
    middle = pose.apply((view.points.max(axis=0) + view.points.min(axis=0))[None] / 2)[0]
    distance = float(np.linalg.norm(middle))
    if not np.isfinite(distance) or distance <= 0:
        return None
    normal = pose.camera_from_target.as_matrix()[:, 2]
    normal = -normal if normal @ middle > 0 else normal
    return Placing(middle / distance, normal, distance)


def newness(one: Placing, others: Sequence[Placing], edge: float) -> float:
    """How new a placing is against all others; 1 or more is new. `edge` is the angle to the edge.

    The largest of the shares of NEW_..., of the other that is most like it.
    """
    shares = [
        max(
            _between(one.ray, other.ray) / (NEW_PLACE * edge),
            float(np.hypot(*(one.tilt - other.tilt))) / NEW_TILT,
            abs(np.log(one.distance / other.distance)) / np.log(NEW_DISTANCE),
        )
        for other in others
    ]
    return min(shares, default=float("inf"))


def _between(a: Floats, b: Floats) -> float:
    return float(np.arccos(np.clip(a @ b, -1, 1)))


def edge_angle(rough: Camera, sectors: Sectors) -> float:
    """The angle from the axis at the farthest edge, radians."""
    f = float(rough.lens.radius(np.ones(1))[0])
    return float(np.clip(np.max(sectors.reach) / f, np.radians(15), np.radians(110)))
