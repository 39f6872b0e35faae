"""What is drawn over a map of a picture: its rim, rings of one angle, the outline of a view."""

from __future__ import annotations

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..lens import Floats
from ..resolution import ray_at
from ..viewport import Viewport
from ._style import INK

RINGS_DEG = (30, 60, 90)


def color_bar(axes: Axes, shown: AxesImage, label: str, extend: str = "neither") -> None:
    """As high as the picture, beside it."""
    figure = axes.get_figure()
    assert figure is not None
    beside = axes.inset_axes((1.03, 0, 0.04, 1))
    figure.colorbar(shown, cax=beside, label=label, extend=extend)


def draw_rings(axes: Axes, camera: Camera, color: str = "white") -> None:
    """Rings of 30, 60 and 90 degrees from the axis, each with its number; dashed, the rim."""
    edge = _dark_edge(color)
    for angle in RINGS_DEG:
        if np.radians(angle) < camera.theta_max - 0.02:
            ring = _ring(camera, np.radians(angle))
            axes.plot(*ring.T, color=color, linewidth=0.9, path_effects=edge)
            _number(axes, ring, camera, f"{angle}°", color)
    rim = _ring(camera, camera.theta_max * (1 - 1e-9))
    axes.plot(*rim.T, color=color, linewidth=1.2, linestyle=(0, (4, 3)), path_effects=edge)
    axes.plot(*camera.center, "+", color=color, markersize=8, path_effects=edge)


def _dark_edge(color: str) -> list[patheffects.AbstractPathEffect]:
    """White lines are seen on every colour if they have a dark edge; dark ones need none."""
    if color != "white":
        return []
    return [patheffects.withStroke(linewidth=2.5, foreground=INK, alpha=0.5)]


def _ring(camera: Camera, theta: float) -> Floats:
    return camera.project(ray_at(np.array(theta), np.linspace(0, 2 * np.pi, 361)))


def _number(axes: Axes, ring: Floats, camera: Camera, text: str, color: str) -> None:
    """At the first place of the ring inside the picture, looking from lower right onwards."""
    margin = 0.02 * max(camera.size)
    x, y = ring.T
    width, height = camera.size
    inside = (x > margin) & (x < width - margin) & (y > margin) & (y < height - margin)
    order = np.roll(np.arange(len(ring)), -45)
    there = order[inside[order]]
    if len(there):
        edge = _dark_edge(color)
        x, y = ring[there[0]]
        axes.annotate(
            text, (x, y), color=color, fontsize=8, ha="center", va="center", path_effects=edge
        )


def outline(camera: Camera, camera_from_view: Rotation, viewport: Viewport) -> Floats:
    """The border of a view on the picture, (n, 2) pixels; NaN where it sees nothing."""
    width, height = (np.array(viewport.size) / 2) / viewport.focal_px
    t = np.linspace(-1, 1, 200)
    top = np.stack([t * width, np.full_like(t, -height)], axis=-1)
    right = np.stack([np.full_like(t, width), t * height], axis=-1)
    xy = np.concatenate([top, right, -top, -right])
    rays = np.concatenate([xy, np.ones((len(xy), 1))], axis=1)
    return camera.project(camera_from_view.apply(rays))


def inside_view(ray: Floats, camera_from_view: Rotation, viewport: Viewport) -> Floats:
    """How far inside a view camera rays (..., 3) are: 0 on its border, negative outside.

    In units of the view's focal length; NaN stays NaN.
    """
    x, y, z = np.moveaxis(camera_from_view.inv().apply(ray.reshape(-1, 3)), -1, 0)
    width, height = (np.array(viewport.size) / 2) / viewport.focal_px
    ahead = np.maximum(z, 1e-3)  # NaN stays
    inside = np.minimum(width - np.abs(x) / ahead, height - np.abs(y) / ahead)
    return np.where(z > 1e-3, inside, np.where(np.isnan(z), np.nan, -1.0)).reshape(ray.shape[:-1])
