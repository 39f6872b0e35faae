"""Views of a flat board through a known camera: corners where they would be, with noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..calibration.views import Pose, View
from ..camera import Camera
from ..lens import Floats

MOST_TILT_DEG = 50.0
NEAREST, FARTHEST = 1.2, 4.0  # times the board's half diagonal
EDGE_PX = 4.0  # nearer to the picture's edge no corner is found
TRIES = 1000  # for one view


@dataclass(frozen=True)
class Simulated:
    """Views, and what they were made from.

    poses  the board's, one for each view
    good   (n,) for each view: the points that are where they belong, but for noise
    """

    camera: Camera
    views: tuple[View, ...]
    poses: tuple[Pose, ...]
    good: tuple[NDArray[np.bool_], ...]


def board(columns: int, rows: int, square: float = 0.03) -> Floats:
    """Inner corners of a chessboard, (columns * rows, 3), row by row, metres."""
    x, y = np.meshgrid(np.arange(columns) * square, np.arange(rows) * square)
    return np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)


def simulate(
    camera: Camera,
    points: Floats,
    count: int,
    rng: np.random.Generator,
    *,
    noise_px: float = 0.2,
    outliers: float = 0.0,
    fewest: int = 20,
) -> Simulated:
    """`count` views of the board at random places of the picture, distances, tilts and turns.

    noise_px  standard deviation of each coordinate
    outliers  share of points that are elsewhere: half of them 3 to 40 px off, half anywhere
    fewest    points on the picture that a view needs; a rim may cut the others off

    ValueError for a camera in which the board cannot be placed so.
    """
    places = [_placed(camera, points, rng, fewest) for _ in range(count)]
    views, good = [], []
    for number, (_, pixels, seen) in enumerate(places):
        pixels = pixels[seen] + rng.normal(0, noise_px, (int(seen.sum()), 2))
        right = rng.random(len(pixels)) >= outliers
        pixels[~right] = _spoilt(pixels[~right], camera.size, rng)
        views.append(View(f"view {number + 1}", points[seen], pixels))
        good.append(right)
    return Simulated(camera, tuple(views), tuple(place[0] for place in places), tuple(good))


def noisy_again(made: Simulated, rng: np.random.Generator, noise_px: float) -> list[View]:
    """The same views with other noise, and without outliers."""
    again = []
    for view, pose in zip(made.views, made.poses, strict=True):
        exact = made.camera.project(pose.apply(view.points))
        again.append(View(view.name, view.points, exact + rng.normal(0, noise_px, exact.shape)))
    return again


def _placed(
    camera: Camera, points: Floats, rng: np.random.Generator, fewest: int
) -> tuple[Pose, Floats, NDArray[np.bool_]]:
    """A pose, the pixels of all points, and which of them are on the picture."""
    for _ in range(TRIES):
        ray = camera.ray(rng.uniform((0, 0), camera.size))
        if not np.isfinite(ray[2]):
            continue
        pose = _random_pose(ray, points, rng)
        at = pose.apply(points)
        if pose.camera_from_target.as_matrix()[:, 2] @ at[0] <= 0:  # its back
            continue
        pixels = camera.project(at)
        seen = np.isfinite(pixels[:, 0])
        seen[seen] = _inside(pixels[seen], camera.size)
        if seen.sum() >= fewest:
            return pose, pixels, seen
    raise ValueError(f"no place for a board of {len(points)} points, {fewest} of them seen")


def _random_pose(ray: Floats, points: Floats, rng: np.random.Generator) -> Pose:
    """The board's middle along a ray (3,), facing the camera but for a tilt of up to 50 degrees."""
    middle = points.mean(axis=0)
    distance = np.linalg.norm(points - middle, axis=1).max() * rng.uniform(NEAREST, FARTHEST)
    facing, _ = Rotation.align_vectors(ray[None], [[0, 0, 1]])
    turn = Rotation.from_rotvec([0, 0, rng.uniform(-np.pi, np.pi)])
    about = rng.uniform(-np.pi, np.pi)
    tilt = np.radians(rng.uniform(0, MOST_TILT_DEG)) * np.array([np.cos(about), np.sin(about), 0])
    rotation = facing * turn * Rotation.from_rotvec(tilt)
    return Pose(rotation, ray * distance - rotation.apply(middle))


def _inside(pixels: Floats, size: Sequence[int]) -> NDArray[np.bool_]:
    return np.asarray(((pixels > EDGE_PX) & (pixels < np.array(size) - 1 - EDGE_PX)).all(axis=1))


def _spoilt(pixels: Floats, size: tuple[int, int], rng: np.random.Generator) -> Floats:
    way = rng.uniform(-np.pi, np.pi, len(pixels))
    length = rng.uniform(3, 40, len(pixels))[:, None]
    near = pixels + length * np.stack([np.cos(way), np.sin(way)], axis=-1)
    anywhere = rng.uniform((0, 0), np.array(size) - 1, pixels.shape)
    chosen = np.where(rng.random((len(pixels), 1)) < 0.5, near, anywhere)
    return np.clip(chosen, 0, np.array(size) - 1)
