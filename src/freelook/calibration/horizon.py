"""The horizon in a wide picture: a great circle, whatever the lens makes of it.

1. Every great circle divides the picture's rays in two. The best one leaves two groups of colours
   that are each as uniform as can be: the likelihood of two Gaussians decides, as in Ettinger et
   al., "Vision-Guided Flight Stability and Control for Micro Air Vehicles" (IROS 2002), there for
   straight lines in narrow pictures.
2. Along the axis of colour that tells the two groups apart best (Fisher's), the steepest step near
   that circle is looked for in every direction: an edge point.
3. A circle is fitted to these, robustly, and 2 again closer by. Its height above the great circle
   is free: hills and haze lift what is seen, altitude lowers it.

Needs daylight and sky in the picture. What it finds is the skyline; mountains on one side tilt it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from ..camera import Camera
from ..errors import CalibrationError
from ..lens import Floats

Rgb = NDArray[np.uint8]

ACROSS = 72  # pixels of the small picture that the first search looks at
DIRECTIONS = 6000  # on the sphere: 2.6 degrees apart
NEAR_DEG = 45.0  # from what is expected
LEAST_SIDE = 0.04  # of the picture: sky and ground
# half width of the search around the circle, and blur of the steps, degrees
ROUNDS = ((9.0, 1.0), (4.0, 0.6), (2.5, 0.4))
EVERY_DEG = 0.5
LEAST_STEP = 0.2  # of the difference between sky and ground
LEAST_ARC_DEG = 30.0
LEAST_SHARE = 0.5  # of the circle inside the picture
HEIGHT_SIGMA_DEG = 1.0  # how far a skyline may lie off the great circle


@dataclass(frozen=True)
class Horizon:
    """The skyline of one picture.

    down_in_camera  unit vector
    height_deg      of the skyline above the great circle
    rays            (n, 3) unit rays in the camera frame to the edge points that count
    arc_deg         how much of the circle they cover
    share           of the circle inside the picture
    """

    down_in_camera: Floats
    height_deg: float
    rays: Floats
    arc_deg: float
    share: float


def find_horizon(
    picture: Rgb, camera: Camera, expected_down: Floats, near_deg: float = NEAR_DEG
) -> Horizon:
    """The horizon in a picture (rows, columns, 3) or (rows, columns), uint8, of `camera`.

    `expected_down` (3,), in the camera frame, may be `near_deg` wrong. CalibrationError when
    there is no skyline, saying what was missing.
    """
    if picture.shape[1::-1] != camera.size:
        raise CalibrationError(
            f"the picture is {picture.shape[1]} x {picture.shape[0]} pixels, the lens profile for "
            f"{camera.size[0]} x {camera.size[1]}"
        )
    colors = picture if picture.ndim == 3 else picture[..., None]
    down, axis = _coarse(colors, camera, expected_down, near_deg)
    feature = np.asarray(colors.astype(np.float32) @ axis.astype(np.float32))
    height, found = 0.0, np.zeros((0, 3))
    share = 0.0
    for reach, blur in ROUNDS:
        rays, inside = _edges(feature, camera, down, height, reach, blur)
        if len(rays) < LEAST_ARC_DEG / EVERY_DEG:
            raise CalibrationError(
                f"only {len(rays) * EVERY_DEG:.0f} degrees of skyline found; "
                f"at least {LEAST_ARC_DEG:.0f} are needed"
            )
        down, height, ok = _circle(rays, down, height)
        found, share = rays[ok], float(ok.sum() / max(inside, 1))
    arc = len(found) * EVERY_DEG
    if arc < LEAST_ARC_DEG or share < LEAST_SHARE:
        raise CalibrationError(
            f"only {share:.0%} of the horizon's circle shows an edge between sky and ground; is "
            f"the horizon free, and was the camera's mounting told within {near_deg:.0f} degrees?"
        )
    return Horizon(down, float(np.degrees(height)), found, arc, share)


def _coarse(
    colors: Rgb, camera: Camera, expected_down: Floats, near_deg: float
) -> tuple[Floats, Floats]:
    """(down in camera, axis of colour on which sky is 1 more than ground)."""
    size = (ACROSS, max(8, round(ACROSS * camera.size[1] / camera.size[0])))
    small = cv2.resize(colors, size, interpolation=cv2.INTER_AREA).reshape(-1, colors.shape[2])
    rays = camera.resized(size).ray(_pixels(size)).reshape(-1, 3)
    seen = np.isfinite(rays[:, 2])
    rays, values = rays[seen], small[seen].astype(np.float64)
    downs = _sphere(DIRECTIONS)
    downs = downs[downs @ expected_down > np.cos(np.radians(near_deg))]
    below = (rays.astype(np.float32) @ downs.T.astype(np.float32)) > 0
    score = _likelihood(values, below)
    if not np.isfinite(score).any():
        raise CalibrationError(
            "no horizon can be in the picture where it is expected; tell how the camera is mounted"
        )
    best = int(np.argmax(score))
    ground, sky = values[below[:, best]], values[~below[:, best]]
    return downs[best], _telling(sky, ground)


def _pixels(size: tuple[int, int]) -> Floats:
    return np.stack(np.meshgrid(np.arange(size[0]), np.arange(size[1])), axis=-1).astype(float)


def _sphere(count: int) -> Floats:
    """Unit vectors (n, 3), evenly over the sphere: a golden spiral."""
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, i * np.pi * (1 + 5**0.5)
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=-1)


def _likelihood(values: Floats, below: NDArray[np.bool_]) -> Floats:
    """Log-likelihood (m,) of colours (n, k) as two Gaussians, below (n, m) and not below."""
    n, k = values.shape
    products = (values[:, :, None] * values[:, None, :]).reshape(n, -1)
    moments = np.concatenate([np.ones((n, 1)), values, products], axis=1)
    lower = below.T.astype(np.float32) @ moments.astype(np.float32)
    total = np.zeros(below.shape[1])
    for part in (lower.astype(np.float64), moments.sum(axis=0) - lower):
        enough = part[:, 0] > LEAST_SIDE * n
        count = np.where(enough, part[:, 0], 1.0)
        mean = part[:, 1 : k + 1] / count[:, None]
        square = part[:, k + 1 :].reshape(-1, k, k) / count[:, None, None]
        spread = square - mean[:, :, None] * mean[:, None, :] + 25.0 * np.eye(k)
        logs = np.full(len(count), -np.inf)
        logs[enough] = -0.5 * count[enough] * np.linalg.slogdet(spread[enough])[1]
        total += logs
    return total


def _telling(sky: Floats, ground: Floats) -> Floats:
    """Fisher's axis, scaled so that the groups' means are 1 apart."""
    spread = np.atleast_2d(np.cov(sky.T)) + np.atleast_2d(np.cov(ground.T))
    apart = sky.mean(axis=0) - ground.mean(axis=0)
    axis = np.linalg.solve(spread + 25.0 * np.eye(len(apart)), apart)
    between = float(axis @ apart)
    if between < 1e-3:  # in standard deviations, squared
        raise CalibrationError("sky and ground have the same colour; take a picture by day")
    return np.asarray(axis / between)


def _frame(down: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors at right angles to `down` and to each other."""
    first = np.cross(down, np.eye(3)[np.argmin(np.abs(down))])
    first /= np.linalg.norm(first)
    return first, np.cross(down, first)


def _edges(
    feature: NDArray[np.float32],
    camera: Camera,
    down: Floats,
    height: float,
    reach_deg: float,
    blur_deg: float,
) -> tuple[Floats, int]:
    """Rays (n, 3) to the steepest step near the circle, and how many directions were inside."""
    step = blur_deg / 5
    up = height + np.radians(np.arange(-reach_deg, reach_deg + step / 2, step))
    azimuth = np.radians(np.arange(0, 360, EVERY_DEG))
    first, second = _frame(down)
    level = np.cos(azimuth)[:, None] * first + np.sin(azimuth)[:, None] * second
    rays = np.cos(up)[:, None] * level[:, None] - np.sin(up)[:, None] * down
    pixels = camera.project(rays)
    width, rows = camera.size
    with np.errstate(invalid="ignore"):
        inside = ((pixels > 0) & (pixels < (width - 1, rows - 1))).all(axis=(-1, -2))
    if not inside.any():
        return np.zeros((0, 3)), 0
    x, y = (np.ascontiguousarray(pixels[inside, :, i], np.float32) for i in range(2))
    profile = cv2.remap(feature, x, y, cv2.INTER_LINEAR).astype(np.float64)
    # a step of height 1, blurred, is at its steepest 0.4 / blur
    slope = 2.5 * 5 * gaussian_filter1d(profile, 5, axis=1, order=1, mode="nearest")
    place = np.argmax(slope[:, 1:-1], axis=1) + 1
    row = np.arange(len(place))
    before, here, after = slope[row, place - 1], slope[row, place], slope[row, place + 1]
    bend = np.minimum(before - 2 * here + after, -1e-12)
    summit = up[place] + np.radians(step) * np.clip((before - after) / (2 * bend), -1, 1)
    good = (here > LEAST_STEP) & (place > 5) & (place < len(up) - 6)
    at = np.cos(summit)[:, None] * level[inside] - np.sin(summit)[:, None] * down
    return at[good], int(inside.sum())


def _circle(rays: Floats, down: Floats, height: float) -> tuple[Floats, float, NDArray[np.bool_]]:
    """The circle that most rays (n, 3) lie on: (down, height in radians, which rays count).

    Gauss-Newton with Geman-McClure weights, at a scale that follows the residuals.
    """
    ok = np.ones(len(rays), bool)
    for _ in range(30):
        first, second = _frame(down)
        off = np.arcsin(np.clip(-rays @ down, -1, 1)) - height
        scale = 2.5 * max(float(np.median(np.abs(off))), np.radians(0.02))
        weight = (1 + (off / scale) ** 2) ** -2
        ok = np.abs(off) < 1.5 * scale
        slopes = np.stack([-rays @ first, -rays @ second, -np.ones(len(rays))], axis=-1)
        normal = (slopes * weight[:, None]).T @ slopes
        right = -(slopes * weight[:, None]).T @ off
        # a short arc leaves the height open: it is small
        sure = (scale / np.radians(HEIGHT_SIGMA_DEG)) ** 2
        normal[2, 2] += sure
        right[2] -= sure * height
        move = np.linalg.solve(normal + 1e-9 * np.eye(3), right)
        down = down + move[0] * first + move[1] * second
        down /= np.linalg.norm(down)
        height += float(move[2])
        if np.abs(move).max() < 1e-6:
            break
    return down, height, ok
