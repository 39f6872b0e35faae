"""The view kept inside the lens: a soft stop before the edge of the image circle.

A view looks theta away from the optical axis, towards some side. Seen in the view's own frame the
axis lies at k = (-sin(theta) e, cos(theta)), where e is the outward direction in the view. A corner
c = (x, y, 1) then is as far from the axis as

    cos(angle) = (cos(theta) - u sin(theta)) / |c|,      u = (x, y) . e

so it reaches the edge theta_max at theta = acos(cos(theta_max) |c| / sqrt(1 + u^2)) - atan(u).
Where the lens sees more than a half sphere, the middle of an edge of the view may leave it before
its corners: the great circle of that edge, with the normal n, then comes as near as
pi - theta_max to the direction straight behind, n . (-k) = sin(theta_max).

Views of other projections have no such straight edges; their border is taken point by point, each
as such a corner. A crop has no rays of its own: its middle may go as far as the edge.

The least of these is the limit for this field of view, this side and this roll of the view. The
last `KNEE` degrees before it are slowed down so that the limit is only reached in the limit:

    theta' = limit - knee exp(-(theta - (limit - knee)) / knee)
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..clock import NS_PER_S
from ..lens import Floats
from ..rotations import angle_between_deg
from ..viewport import Viewport
from .settings import RATE_DEG_S

LIMITS = ("soft", "black")
KNEE = math.radians(10.0)
PER_SIDE = 33  # places on a side of a view; between them it may stray by a hundredth of a degree


def half_sides(viewport: Viewport) -> tuple[float, float]:
    """How far the view's outer edges lie from its middle, on the plane z = 1."""
    width, height = viewport.size
    return width / 2 / viewport.focal_px, height / 2 / viewport.focal_px


def reach_of(outward: tuple[float, float], viewport: Viewport, theta_max: float) -> float:
    """As `reach`, for a view of any projection."""
    if viewport.kind.cut:
        return theta_max
    if viewport.projection == "perspective":
        return reach(outward, half_sides(viewport), theta_max)
    across, depth = _border(viewport)
    u = across @ np.array(outward)
    cosine = np.cos(theta_max) / np.maximum(np.hypot(u, depth), 1e-9)
    limits = np.arccos(np.clip(cosine, -1.0, 1.0)) - np.arctan2(u, depth)
    return max(0.0, float(limits.min()))


@lru_cache(maxsize=64)
def _border(viewport: Viewport) -> tuple[Floats, Floats]:
    """Unit rays round a view: their x and y (n, 2), and z (n,)."""
    rays = viewport.border(PER_SIDE)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    return rays[:, :2], rays[:, 2]


def reach(outward: tuple[float, float], sides: tuple[float, float], theta_max: float) -> float:
    """How far from the optical axis a view may look, radians, without seeing past the lens.

    outward  the unit direction away from the axis, in the view's x (right) and y (down)
    sides    `half_sides` of the view
    0 where the view is wider than the lens.
    """
    corners = min(_corner_limits(outward, sides, theta_max))
    edges = min(_edge_limits(outward, sides, theta_max), default=math.pi)
    return max(0.0, min(corners, edges))


def _corner_limits(
    outward: tuple[float, float], sides: tuple[float, float], theta_max: float
) -> Iterator[float]:
    for x in (-sides[0], sides[0]):
        for y in (-sides[1], sides[1]):
            u = x * outward[0] + y * outward[1]
            length = math.sqrt(1 + x * x + y * y)
            cosine = math.cos(theta_max) * length / math.hypot(1, u)
            yield math.acos(max(-1.0, min(1.0, cosine))) - math.atan(u)


def _edge_limits(
    outward: tuple[float, float], sides: tuple[float, float], theta_max: float
) -> Iterator[float]:
    """Of those edges whose middle part, not a corner, is what first leaves the lens."""
    if theta_max <= math.pi / 2:
        return
    for axis in (0, 1):
        for sign in (-1, 1):
            out, along = sign * outward[axis], outward[1 - axis]
            side, half = sides[axis], sides[1 - axis]
            sine = math.sin(theta_max) * math.hypot(1, side) / math.hypot(out, side)
            if sine > 1:
                continue
            theta = math.pi - math.asin(sine) - math.atan2(side, out)
            # the point of the great circle next to straight behind, which is -k
            depth = -math.cos(theta) + side * math.sin(theta_max) / math.hypot(1, side)
            if depth > 0 and abs(math.sin(theta) * along) <= half * depth:
                yield theta


def softened(theta: float, limit: float, knee: float = KNEE) -> float:
    """theta up to a knee before the limit, then ever slower towards it; never beyond."""
    knee = min(knee, limit / 2)
    start = limit - knee
    if theta <= start or knee <= 0:
        return min(theta, limit)
    return limit - knee * math.exp(-(theta - start) / knee)


def soft_stop(
    camera_from_view: Rotation, viewport: Viewport, theta_max: float, knee: float = KNEE
) -> Rotation:
    """The same view, drawn towards the optical axis as far as it must be to stay in the lens.

    It is turned along the great circle through the axis, and keeps its roll on that. With knee = 0
    it stops hard, at the limit itself. Straight behind, where all ways are equally far, it takes
    one of them.
    """
    x, y, z = (float(value) for value in camera_from_view.inv().apply([0.0, 0.0, 1.0]))
    away = math.hypot(x, y)
    outward = (-x / away, -y / away) if away > 1e-12 else (1.0, 0.0)
    theta = math.atan2(away, z)
    kept = softened(theta, reach_of(outward, viewport, theta_max), knee)
    if kept == theta:
        return camera_from_view
    # about the view's own axis across the outward direction
    turn = np.array([-outward[1], outward[0], 0.0]) * (kept - theta)
    return camera_from_view * Rotation.from_rotvec(turn)


class LensLimit:
    """The soft stop for a view that moves: never a jump of its own.

    Straight behind the lens the soft stop changes sides at once (no rule without a memory can
    avoid that); here the view goes over at `rate_deg_s`. Asked in the order of time.
    """

    def __init__(self, camera: Camera, *, rate_deg_s: float = RATE_DEG_S) -> None:
        self._camera = camera
        self._rate_deg_s = rate_deg_s
        self._last: tuple[int, Rotation, Rotation] | None = None

    def __call__(self, body_from_view: Rotation, viewport: Viewport, now_ns: int) -> Rotation:
        """`body_from_view`, limited for this viewport."""
        camera_from_body, theta_max = self._camera.camera_from_body, self._camera.theta_max
        wanted = camera_from_body * body_from_view
        limited = soft_stop(wanted, viewport, theta_max)
        if self._last is not None:
            limited = self._slewed(wanted, limited, now_ns)
            limited = soft_stop(limited, viewport, theta_max, knee=0.0)
        self._last = (now_ns, wanted, limited)
        return camera_from_body.inv() * limited

    def _slewed(self, wanted: Rotation, limited: Rotation, now_ns: int) -> Rotation:
        """Not farther from the last view than the view was turned, and the rate allows."""
        assert self._last is not None
        last_ns, last_wanted, last = self._last
        elapsed_s = max(0, now_ns - last_ns) / NS_PER_S
        most_deg = angle_between_deg(last_wanted, wanted) + self._rate_deg_s * elapsed_s
        apart = last.inv() * limited
        apart_deg = math.degrees(float(apart.magnitude()))
        if apart_deg <= most_deg:
            return limited
        return last * Rotation.from_rotvec(apart.as_rotvec() * (most_deg / apart_deg))
