"""Pictures of flat targets through known cameras: every pixel is the mean over its area."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from freelook.calibration.views import Pose
from freelook.camera import Camera, make_camera
from freelook.lens import Equidistant, Floats

Gray = NDArray[np.uint8]
Shade = Callable[[Floats, Floats], Floats]  # reflectance 0 to 1 at points (x, y) of the target

FISHEYE = make_camera((960, 720), Equidistant(260.0), center=(487.3, 352.8), field_deg=200)
# Places in a pixel that are looked at: a Fibonacci lattice, shifted at random in every pixel, so
# that what is left of stairs along edges is noise and moves no corner.
STEPS = np.arange(34)
SAMPLES = (np.stack([STEPS, STEPS * 21 % 34], axis=-1) + 0.5) / 34


@dataclass(frozen=True)
class Light:
    """How reflectance becomes grey levels: black, white, blur and noise of the camera."""

    black: float = 30.0
    white: float = 220.0
    blur_px: float = 0.6
    noise: float = 0.0
    fall_off: float = 0.0  # towards the right edge: share of the light that is lost there


def chessboard(inner: tuple[int, int], square: float, margin: float = 1.0) -> Shade:
    """Inner corners at (0, 0) ... ((c - 1), (r - 1)) squares, dark beyond a light margin."""

    def shade(x: Floats, y: Floats) -> Floats:
        i, j = np.floor(x / square), np.floor(y / square)
        inside = (i >= -1) & (i < inner[0]) & (j >= -1) & (j < inner[1])
        light = ((i + j) % 2 == 1) | ~inside
        paper = (
            (x > -(1 + margin) * square)
            & (x < (inner[0] + margin) * square)
            & (y > -(1 + margin) * square)
            & (y < (inner[1] + margin) * square)
        )
        return np.where(paper, np.where(light, 1.0, 0.0), 0.35)

    return shade


def picture(texture: Gray, per_unit: float, origin: tuple[float, float] = (0.0, 0.0)) -> Shade:
    """A printed picture: target point (x, y) is its pixel ((x, y) - origin) * per_unit."""

    def shade(x: Floats, y: Floats) -> Floats:
        rows, columns = texture.shape
        u = np.floor((x - origin[0]) * per_unit).astype(int)
        v = np.floor((y - origin[1]) * per_unit).astype(int)
        there = (u >= 0) & (u < columns) & (v >= 0) & (v < rows)
        value = texture[np.clip(v, 0, rows - 1), np.clip(u, 0, columns - 1)] / 255.0
        return np.where(there, value, 0.35)

    return shade


def facing(
    toward_deg: tuple[float, float],
    distance: float,
    middle: tuple[float, float],
    tilt_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Pose:
    """A pose: the target's `middle` lies `distance` along the ray (right, down) degrees away.

    Untilted, the target faces the camera; `tilt_deg` turns it about its own x, y and z.
    """
    right, down = toward_deg
    look = Rotation.from_euler("YX", [right, -down], degrees=True)
    turn = look * Rotation.from_euler("xyz", tilt_deg, degrees=True)
    place = look.apply([0.0, 0.0, distance])
    return Pose(turn, place - turn.apply([middle[0], middle[1], 0.0]))


def seen(camera: Camera, pose: Pose, points: Floats) -> Floats:
    """Pixels (n, 2) of target points (n, 2 or 3)."""
    flat = points if points.shape[1] == 3 else np.column_stack([points, np.zeros(len(points))])
    return camera.project(pose.apply(flat))


def photograph(
    camera: Camera,
    pose: Pose,
    shade: Shade,
    light: Light | None = None,
    rng: np.random.Generator | None = None,
) -> Gray:
    """What the camera sees of the target, with mid grey around it and black outside the field."""
    light = light or Light()
    width, height = camera.size
    # target coordinates at the corners of pixels; between them they are linear to 1e-3 px
    x, y = np.meshgrid(np.arange(width + 1) - 0.5, np.arange(height + 1) - 0.5)
    rays = camera.ray(np.stack([x, y], axis=-1))
    lit = np.isfinite(rays[..., 2])
    rays = np.where(lit[..., None], rays, [0.0, 0.0, 1.0])
    turn = pose.camera_from_target.as_matrix()
    direction, origin = rays @ turn, -pose.translation @ turn
    depth = np.divide(
        -origin[2],
        direction[..., 2],
        out=np.full(lit.shape, -1.0),
        where=np.abs(direction[..., 2]) > 0.02,
    )
    at = origin[:2] + depth[..., None] * direction[..., :2]
    ahead = depth > 0
    total = np.zeros((height, width))
    shift_u, shift_v = np.random.default_rng(34).random((2, height, width, 1))
    for start_u, start_v in SAMPLES:
        u, v = (start_u + shift_u) % 1, (start_v + shift_v) % 1
        top = at[:-1, :-1] * (1 - u) + at[:-1, 1:] * u
        low = at[1:, :-1] * (1 - u) + at[1:, 1:] * u
        here = top * (1 - v) + low * v
        total += shade(here[..., 0], here[..., 1])
    whole = ahead[:-1, :-1] & ahead[:-1, 1:] & ahead[1:, :-1] & ahead[1:, 1:]
    value = np.where(whole, total / len(SAMPLES), 0.35)
    value = light.black + (light.white - light.black) * value
    value *= 1 - light.fall_off * np.arange(width) / width
    value = np.where(lit[:-1, :-1], value, 8.0)
    if light.blur_px:
        value = cv2.GaussianBlur(value, (0, 0), light.blur_px)
    if light.noise:
        assert rng is not None
        value = value + rng.normal(0, light.noise, value.shape)
    return np.asarray(np.clip(np.round(value), 0, 255), dtype=np.uint8)
