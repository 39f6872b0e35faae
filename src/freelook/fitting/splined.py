"""The splined lens that is nearest to a camera: a linear problem, unlike all others."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from ..camera import Camera
from ..lens import Floats, SplinedStereographic, radius_slope
from ..resolution import ray_at
from ._camera_problem import STRETCHES
from ._cameras import fitted_camera

# Control points along each side. A fisheye's smooth difference from a stereographic lens is met
# to about 0.001 px; some MiB of equations.
SIDE = 30
ORDER = 3
POINTS_PER_CONTROL = 6
GOLDEN_RAD = np.pi * (3 - np.sqrt(5))


def refit_splined(camera: Camera, theta_max: float, which: str = "skew") -> Camera:
    """The camera with a 30 x 30 splined lens that covers all angles up to theta_max (radians).

    Fitted over the whole field, off the picture too, so that it folds nowhere. What `which` does
    not allow of the stretch goes into the surface.
    """
    theta, phi, u = _samples(theta_max)
    stretch = camera.stretch[0, 0] * np.eye(2)
    for entry in STRETCHES[which]:
        stretch[entry] = camera.stretch[entry]
    f = float(radius_slope(camera.lens, np.zeros(1))[0])
    point = (camera.project(ray_at(theta, phi)) - camera.center) @ np.linalg.inv(stretch).T
    fov_x_deg = min(float(np.ceil(np.degrees(2 * theta_max))), 355.0)  # mrcal takes whole ones
    spacing = 4 * np.tan(np.radians(fov_x_deg) / 4) / (SIDE - ORDER)
    control = _solved(_design(u, spacing), point / f - u)
    lens = SplinedStereographic(
        f, ORDER, SIDE, SIDE, fov_x_deg, tuple(float(value) for value in control.ravel())
    )
    return fitted_camera(camera, lens, camera.center, stretch, theta_max)


def _samples(theta_max: float) -> tuple[Floats, Floats, Floats]:
    """(theta, phi, u) evenly over the disc of u = 2 tan(theta/2): Vogel's spiral, and its rim."""
    count = POINTS_PER_CONTROL * SIDE**2
    k = np.arange(count) + 0.5
    rim = np.linspace(0, 2 * np.pi, 4 * SIDE, endpoint=False)
    share = np.concatenate([np.sqrt(k / count), np.full(len(rim), 1 - 1e-12)])
    phi = np.concatenate([np.mod(k * GOLDEN_RAD, 2 * np.pi), rim])
    theta = 2 * np.arctan(share * np.tan(theta_max / 2))
    length = 2 * np.tan(theta / 2)[:, None]
    return theta, phi, length * np.stack([np.cos(phi), np.sin(phi)], axis=-1)


def _design(u: Floats, spacing: float) -> Floats:
    """(n, SIDE * SIDE): how much each control point, row after row, says at u (n, 2)."""
    place = u / spacing + (SIDE - 1) / 2
    knots = np.arange(-2.0, SIDE + 2)  # control point i is the middle of its own spline
    across, down = (
        BSpline.design_matrix(np.clip(p, 1, SIDE - 2), knots, ORDER).toarray() for p in place.T
    )
    return np.asarray((down[:, :, None] * across[:, None, :]).reshape(len(u), -1))


def _solved(design: Floats, wanted: Floats) -> Floats:
    """Least squares; control points that nothing depends on stay near 0."""
    square = design.T @ design
    square += 1e-9 * np.trace(square) / len(square) * np.eye(len(square))
    control = np.zeros((design.shape[1], 2))
    for _ in range(3):  # takes back what the small ridge has pulled
        control += np.linalg.solve(square, design.T @ (wanted - design @ control))
    return control
