"""Head angles, frames and rotations.

Frames (docs/conventions.md): camera and view are x right, y down, z forward; the body is
x forward, y right, z down. Head angles are yaw + right, pitch + up, roll + right ear down,
applied in that order:

    frd_from_rdf   maps view axes of a head that looks straight ahead to body axes
    body_from_view = frd_from_rdf * R_y(yaw) * R_x(pitch) * R_z(roll)

Rotations are SciPy `Rotation`; quaternions are written down as (w, x, y, z).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

FRD_FROM_RDF: Rotation = Rotation.from_matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
RDF_FROM_FRD: Rotation = FRD_FROM_RDF.inv()


def body_from_view(yaw_deg: float, pitch_deg: float, roll_deg: float = 0.0) -> Rotation:
    """Where a head at these angles looks, relative to the vehicle."""
    turn = Rotation.from_euler("YXZ", [yaw_deg, pitch_deg, roll_deg], degrees=True)
    return FRD_FROM_RDF * turn


def head_angles_deg(body_from_view_rotation: Rotation) -> tuple[float, float, float]:
    """(yaw, pitch, roll) in degrees: yaw and roll in (-180, 180], pitch in [-90, 90].

    Looking straight up or down, where yaw and roll turn about the same axis, roll is
    reported as 0 and yaw carries both.
    """
    (xx, _xy, xz), (yx, yy, yz), (zx, _zy, zz) = (
        RDF_FROM_FRD * body_from_view_rotation
    ).as_matrix()
    pitch = float(np.degrees(np.arcsin(np.clip(-yz, -1.0, 1.0))))
    if abs(yz) > 1 - 1e-12:
        return float(np.degrees(np.arctan2(-zx, xx))), pitch, 0.0
    yaw = float(np.degrees(np.arctan2(xz, zz)))
    roll = float(np.degrees(np.arctan2(yx, yy)))
    return yaw, pitch, roll


def from_wxyz(quaternion: Sequence[float]) -> Rotation:
    """A rotation from (w, x, y, z) of any length but zero (ValueError)."""
    w, x, y, z = quaternion
    return Rotation.from_quat([x, y, z, w])


def to_wxyz(rotation: Rotation) -> list[float]:
    """(w, x, y, z), of unit length, w >= 0."""
    x, y, z, w = rotation.as_quat(canonical=True)
    return [float(w), float(x), float(y), float(z)]


def slerp(a: Rotation, b: Rotation, fraction: float) -> Rotation:
    """The rotation `fraction` of the short way from `a` (0) to `b` (1)."""
    return a * Rotation.from_rotvec(fraction * (a.inv() * b).as_rotvec())


def angle_between_deg(a: Rotation, b: Rotation) -> float:
    """The angle of the rotation that leads from `a` to `b`, in degrees, 0 to 180."""
    return float(np.degrees((a.inv() * b).magnitude()))
