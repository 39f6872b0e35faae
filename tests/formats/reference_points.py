"""Where rays land by other programs' own functions, or by their published formulas."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

# Projections differ by rounding only: both sides compute in double precision, where pixel numbers
# of 1e3 have errors of 1e-13. 1e-6 px leaves room for other orders of summing.
SAME_PX = 1e-6

FISHEYE = [-0.0137, 0.0207, -0.0128, 0.0025]
PINHOLE = [-0.21, 0.04, 4e-3, -2e-3, -0.003]
# 14 of OpenCV's coefficients, of a lens that is wide, decentred and tilted; the first 8 and 12 of
# them are lenses too
RATIONAL = [0.46, -0.21, 4e-3, -2e-3, 0.013, 0.54, -0.19, 0.012, 1e-3, -2e-4, 3e-3, 1e-4]
RATIONAL += [0.01, -0.02]


def matrix(fx: float, fy: float, cx: float, cy: float, skew: float = 0.0) -> np.ndarray:
    return np.array([[fx, skew, cx], [0, fy, cy], [0, 0, 1.0]])


def rays(half_field_rad: float) -> np.ndarray:
    """(n, 3), up to a hair inside the field, all around."""
    theta = np.linspace(0, half_field_rad * (1 - 1e-12), 90)[:, None]
    phi = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return np.stack([x, y, np.broadcast_to(np.cos(theta), x.shape)], axis=-1).reshape(-1, 3)


def by_fisheye(points: np.ndarray, d: Any, k: np.ndarray) -> np.ndarray:
    """`cv2.fisheye`; below 90 degrees from the axis."""
    still, alpha = np.zeros(3), float(k[0, 1] / k[0, 0])
    found, _ = cv2.fisheye.projectPoints(
        points[:, None], still, still, k, np.array(d, dtype=float), alpha=alpha
    )
    return np.asarray(found.reshape(-1, 2))


def by_pinhole(points: np.ndarray, d: Any, k: np.ndarray) -> np.ndarray:
    """`cv2.projectPoints`; below 90 degrees from the axis."""
    found, _ = cv2.projectPoints(points[:, None], np.zeros(3), np.zeros(3), k, np.array(d))
    return np.asarray(found.reshape(-1, 2))


# `cv2.omnidir`, which takes rays from behind too, made in an environment of its own with
# opencv-contrib-python-headless 5.0.0.93:
#   t, p = np.radians(places).T
#   rays = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)
#   cv2.omnidir.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), OMNI_K, 1.25, OMNI_D)[0]
OMNI_XI, OMNI_K = 1.25, matrix(800, 790, 640.5, 479.25, skew=1.5)
OMNI_D = [-0.12, 0.03, 1e-3, -5e-4]
OMNI_PIXELS = {  # (theta, phi) in degrees: (x, y)
    (0, 0): (640.5, 479.25),
    (10, 30): (694.3507053917033, 509.9250251137939),
    (30, 100): (608.1995642538233, 662.007474796359),
    (50, 200): (341.6866845486146, 372.0764247726315),
    (70, 290): (794.6887088000515, 58.64576248683477),
    (85, 5): (1199.6886382941684, 528.0107973847709),
    (95, 50): (1050.3130371027223, 961.389126144202),
    (105, 130): (182.50739836055476, 1019.7526182633474),
    (110, 310): (1119.9051952269342, -85.86201918449865),
}


def omni_rays() -> np.ndarray:
    theta, phi = np.radians(list(OMNI_PIXELS)).T
    points = [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]
    return np.stack(points, axis=-1)


# Usenko, Demmel and Cremers, "The Double Sphere Camera Model", 3DV 2018, sections 2.2 to 2.5


def by_unified(points: np.ndarray, alpha: float, k: np.ndarray) -> np.ndarray:
    return by_extended_unified(points, alpha, 1.0, k)


def by_extended_unified(points: np.ndarray, alpha: float, beta: float, k: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    d = np.sqrt(beta * (x * x + y * y) + z * z)
    return _through(k, x, y, alpha * d + (1 - alpha) * z)


def by_double_sphere(points: np.ndarray, xi: float, alpha: float, k: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    shifted = xi * np.sqrt(x * x + y * y + z * z) + z
    d2 = np.sqrt(x * x + y * y + shifted * shifted)
    return _through(k, x, y, alpha * d2 + (1 - alpha) * shifted)


def by_field_of_view(points: np.ndarray, w: float, k: np.ndarray) -> np.ndarray:
    """Kalibr's and Basalt's: the radius on the plane z = 1 becomes atan(2 r tan(w/2)) / w."""
    x, y, z = points.T
    r = np.hypot(x, y) / z
    scale = np.divide(np.arctan(2 * r * np.tan(w / 2)) / w, r, out=np.zeros_like(r), where=r > 0)
    return _through(k, x * scale, y * scale, z)


def _through(k: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return np.stack([k[0, 0] * x / z + k[0, 2], k[1, 1] * y / z + k[1, 2]], axis=-1)
