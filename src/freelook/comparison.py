"""How far apart two descriptions of one camera are, with and without a turn between them.

Two calibrations of the same lens can differ by where they think "forward" is: a principal point
that is off by a pixel and a camera that is turned by a tenth of a degree look nearly alike. So
each difference is told twice, as it is, and after the turn that fits best. The idea is mrcal's
"implied rotation" (https://mrcal.secretsauce.net/differencing.html).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from .camera import Camera
from .errors import ProfileError
from .lens import Floats
from .resolution import around_axis, inside_picture, places, ray_at, sample_places

AROUND = 180  # directions on a ring


@dataclass(frozen=True)
class Numbers:
    """Root mean square and largest value, in pixels of A's picture and in degrees."""

    rms_px: float
    max_px: float
    rms_deg: float
    max_deg: float


@dataclass(frozen=True)
class Difference:
    """Between A and B at places of A's picture; NaN where not both of them see.

    shift_px   (..., 2): where B puts what A puts here, minus here
    angle_deg  (...): the angle between what A and what B see here
    """

    shift_px: Floats
    angle_deg: Floats

    @property
    def distance_px(self) -> Floats:
        return np.hypot(self.shift_px[..., 0], self.shift_px[..., 1])

    @property
    def common(self) -> np.ndarray:
        """Where both see."""
        return np.isfinite(self.distance_px) & np.isfinite(self.angle_deg)

    @property
    def mean_shift_px(self) -> Floats:
        """(x, y): how far B's picture is moved as a whole."""
        return np.asarray(self.shift_px[self.common].mean(axis=0))

    @property
    def rms_px_unmoved(self) -> float:
        """What is left of the root mean square without that."""
        left = self.shift_px[self.common] - self.mean_shift_px
        return _rms(np.hypot(left[:, 0], left[:, 1]))

    @property
    def numbers(self) -> Numbers | None:
        """None where there is nothing in common."""
        if not self.common.any():
            return None
        px, deg = self.distance_px[self.common], self.angle_deg[self.common]
        return Numbers(_rms(px), float(px.max()), _rms(deg), float(deg.max()))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


@dataclass(frozen=True)
class Ring:
    """The difference at one angle from A's axis; None where nothing in A's picture is common."""

    theta: float
    as_is: Numbers | None
    turned: Numbers | None


@dataclass(frozen=True)
class Comparison:
    """A against B over A's picture, sampled at `x_px` (columns,) and `y_px` (rows,).

    as_is, turned         without and with the turn `a_from_b`, which makes the angles least in
                          the sense of least squares
    both, only_a, only_b  shares of the picture, 0 to 1
    """

    x_px: Floats
    y_px: Floats
    as_is: Difference
    turned: Difference
    a_from_b: Rotation
    both: float
    only_a: float
    only_b: float


def compare(a: Camera, b: Camera, *, columns: int = 120) -> Comparison:
    """Compare two cameras whose pictures have one size; how they are mounted does not count.

    ProfileError if the sizes differ or if no pixel is seen by both.
    """
    if a.size != b.size:
        raise ProfileError(f"pictures of {a.size} and {b.size} pixels cannot be compared")
    x, y = sample_places(a.size, columns)
    place = places(x, y)
    ray_a, ray_b = a.ray(place), b.ray(place)
    sees_a, sees_b = (np.isfinite(ray[..., 0]) for ray in (ray_a, ray_b))
    as_is = difference(a, b, Rotation.identity(), place)
    both = as_is.common
    if both.sum() < 3:
        raise ProfileError("no part of the picture is seen by both lenses")
    a_from_b, _ = Rotation.align_vectors(ray_a[both], ray_b[both])
    return Comparison(
        x,
        y,
        as_is,
        difference(a, b, a_from_b, place),
        a_from_b,
        float((sees_a & sees_b).mean()),
        float((sees_a & ~sees_b).mean()),
        float((sees_b & ~sees_a).mean()),
    )


def difference(a: Camera, b: Camera, a_from_b: Rotation, place: Floats) -> Difference:
    """At places (..., 2) of A's picture, with B's rays turned by `a_from_b`."""
    ray_a = a.ray(place)
    shift = b.project(_turned(a_from_b.inv(), ray_a)) - place
    apart = np.linalg.norm(_turned(a_from_b, b.ray(place)) - ray_a, axis=-1)
    # a chord of the unit sphere; unlike an arc cosine it keeps its digits near 0
    return Difference(shift, np.degrees(2 * np.arcsin(np.minimum(apart / 2, 1.0))))


def _turned(turn: Rotation, ray: Floats) -> Floats:
    return np.asarray(turn.apply(ray.reshape(-1, 3))).reshape(ray.shape)


def ring(a: Camera, b: Camera, a_from_b: Rotation, theta: float) -> Ring:
    """The difference all around A's axis at `theta` (radians), as it is and turned."""
    # on the rim itself it would be a matter of rounding whether a ray is seen
    if abs(theta - a.theta_max) < 1e-9:
        theta = a.theta_max - 1e-9
    place = a.project(ray_at(np.array(theta), around_axis(AROUND)))
    place = np.where(inside_picture(place, a.size)[:, None], place, np.nan)
    turns = (Rotation.identity(), a_from_b)
    return Ring(theta, *(difference(a, b, turn, place).numbers for turn in turns))
