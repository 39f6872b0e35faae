"""Rays and the pixels where they are seen, and the least squares over a whole camera."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..lens import BentLens, Floats, Lens, vector
from ._minimum import CLOSE, Minimum, minimise
from ._models import Bools, free_names, lens_with, no_slack, radius_of, slope_slack

# Which entries of the stretch are sought; xx stays as it is, for the lens has its own scale.
STRETCHES: dict[str, tuple[tuple[int, int], ...]] = {
    "free": ((0, 1), (1, 0), (1, 1)),
    "skew": ((0, 1), (1, 1)),
    "aspect": ((1, 1),),
    "none": (),
}
_NAMES = {(0, 1): "stretch_xy", (1, 0): "stretch_yx", (1, 1): "stretch_yy"}
POSE = ("turn_x_rad", "turn_y_rad", "turn_z_rad", "move_x", "move_y", "move_z")


@dataclass(frozen=True)
class CameraProblem:
    """Points, and the kind of camera that is to see them: pixel = center + stretch @ image point.

    points   (n, 3) in the camera frame, or in another one if the pose is sought
    pixel    (n, 2) where they are seen
    like     the lens whose parameters are sought
    free     which entries of its vector those are; the others stay as they are
    stretch  where that starts from; `which` says what of it is sought (`STRETCHES`)
    pose     seek the pose too, from this rotation and translation on; None: camera frame
    """

    points: Floats
    pixel: Floats
    like: Lens
    free: Bools
    stretch: Floats
    which: str = "skew"
    pose: tuple[Rotation, Floats] | None = None

    @property
    def names(self) -> tuple[str, ...]:
        entries = [_NAMES[entry] for entry in self._entries]
        pose = POSE if self.pose else ()
        lens = [name for name, free in zip(free_names(self.like), self.free, strict=True) if free]
        return (*lens, "center_x", "center_y", *entries, *pose)

    @property
    def _entries(self) -> tuple[tuple[int, int], ...]:
        return STRETCHES[self.which]

    @property
    def size_px(self) -> float:
        return float(np.ptp(self.pixel, axis=0).max())

    def start(self, center: Floats) -> Floats:
        entries = [self.stretch[entry] for entry in self._entries]
        pose = np.zeros(6 if self.pose else 0)
        return np.concatenate([vector(self.like)[self.free], center, entries, pose])

    def lens(self, x: Floats) -> Lens | None:
        whole = vector(self.like)
        whole[self.free] = x[: self._lens_size]
        return lens_with(self.like, whole)

    def center(self, x: Floats) -> tuple[float, float]:
        at = self._lens_size
        return float(x[at]), float(x[at + 1])

    def stretch_of(self, x: Floats) -> Floats:
        """2 x 2; what is not sought is that of square pixels, upright and not mirrored anew."""
        (xx, _), (_, yy) = self.stretch.tolist()
        stretch = np.diag([xx, math.copysign(xx, yy)])
        at = self._lens_size + 2
        for place, entry in enumerate(self._entries):
            stretch[entry] = x[at + place]
        return stretch

    def pose_of(self, x: Floats) -> tuple[Rotation, Floats]:
        """camera_from_points: rotation and translation."""
        if self.pose is None:
            return Rotation.identity(), np.zeros(3)
        turn, move = self.pose
        return Rotation.from_rotvec(x[-6:-3]) * turn, move + x[-3:]

    def angles(self, x: Floats) -> tuple[Floats, Floats]:
        """(theta, phi) of the points in the camera frame."""
        turn, move = self.pose_of(x)
        px, py, pz = (turn.apply(self.points) + move).T
        return np.arctan2(np.hypot(px, py), pz), np.arctan2(py, px)

    def project(self, x: Floats) -> Floats:
        """(n, 2) pixels; NaN where there is no such lens."""
        lens = self.lens(x)
        return np.full_like(self.pixel, np.nan) if lens is None else self._through(lens, x)

    def _through(self, lens: Lens, x: Floats) -> Floats:
        theta, phi = self.angles(x)
        with np.errstate(all="ignore"):
            radius = radius_of(lens, theta)
            point = np.stack([radius * np.cos(phi), radius * np.sin(phi)], axis=-1)
            if isinstance(lens, BentLens):
                inside = np.minimum(theta, lens.hard_limit * (1 - 1e-9))
                point = point + lens.offset(inside, phi)
        return np.asarray(self.center(x) + point @ self.stretch_of(x).T)

    def residuals_px(self, x: Floats) -> Floats:
        """(n, 2) measured minus projected."""
        return self.pixel - self.project(x)

    def fit(
        self,
        start: Floats,
        theta_max: float,
        *,
        loss: str,
        scale: float | None = None,
        least_slope: float | None = None,
        effort: tuple[float, int] = CLOSE,
    ) -> Minimum:
        """The minimum from a start on.

        With a least slope, as a share of the mean, among lenses that grow so to theta_max
        (radians).
        """

        def rows(x: Floats) -> tuple[Floats, Floats]:
            lens = self.lens(x)
            if lens is None:
                return np.full(self.pixel.size, np.nan), no_slack(least_slope)
            slack = slope_slack(lens, theta_max, least_slope)
            return (self.pixel - self._through(lens, x)).ravel(), slack

        return minimise(rows, start, size=self.size_px, loss=loss, scale=scale, effort=effort)

    @property
    def _lens_size(self) -> int:
        return int(self.free.sum())
