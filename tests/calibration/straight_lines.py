"""Points along straight lines as a known camera sees them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from freelook.calibration.lines import Line
from freelook.camera import Camera

Floats = NDArray[np.float64]


def arc(camera: Camera, normal: Floats, first: float, last: float) -> Floats:
    """Pixels (n, 2) densely along a great circle, between two angles on it; only what is seen."""
    u, v = np.linalg.svd(np.asarray(normal, float)[None])[2][1:]
    turn = np.linspace(first, last, 600)[:, None]
    pixels = camera.project(np.cos(turn) * u + np.sin(turn) * v)
    middle = pixels - camera.center
    rim = camera.lens.radius(np.array([camera.theta_max]))[0]
    with np.errstate(invalid="ignore"):
        seen = np.hypot(middle[:, 0], middle[:, 1]) < 0.96 * rim
    return np.asarray(pixels[seen])


def clicked(pixels: Floats, noise_px: float, random: np.random.Generator) -> Floats:
    """Points (n, 2) every 10 pixels along a dense curve, with noise."""
    step = np.hypot(*np.diff(pixels, axis=0).T)
    along = np.concatenate([[0], np.cumsum(step)])
    places = np.arange(0, along[-1], 10.0)
    exact = np.stack([np.interp(places, along, pixels[:, axis]) for axis in (0, 1)], axis=-1)
    return np.asarray(exact + noise_px * random.normal(size=exact.shape))


def random_lines(camera: Camera, count: int, noise_px: float = 0.3, seed: int = 1) -> list[Line]:
    """In all directions, 40 to 110 degrees long, without those that leave the field between."""
    random = np.random.default_rng(seed)
    lines: list[Line] = []
    while len(lines) < count:
        first, length = random.uniform(0, 2 * np.pi), np.radians(random.uniform(40, 110))
        pixels = arc(camera, random.normal(size=3), first, first + length)
        if len(pixels) < 50 or np.hypot(*np.diff(pixels, axis=0).T).max() > 20:
            continue
        points = clicked(pixels, noise_px, random)
        if len(points) > 10:
            lines.append(Line(str(len(lines)), points))
    return lines


def room_lines(camera: Camera, count: int, noise_px: float = 0.3, seed: int = 1) -> list[Line]:
    """Edges of a room that is turned against the camera; each knows which way it runs."""
    random = np.random.default_rng(seed)
    axes = np.linalg.svd(random.normal(size=(3, 3)))[0]
    lines: list[Line] = []
    while len(lines) < count:
        axis = len(lines) % 3
        normal = np.cross(axes[axis], random.normal(size=3))
        first, length = random.uniform(0, 2 * np.pi), np.radians(random.uniform(40, 110))
        pixels = arc(camera, normal, first, first + length)
        if len(pixels) < 50 or np.hypot(*np.diff(pixels, axis=0).T).max() > 20:
            continue
        points = clicked(pixels, noise_px, random)
        if len(points) > 10:
            lines.append(Line(str(len(lines)), points, "room", "xyz"[axis]))
    return lines
