"""One lens in four pictures: r(theta), pixels per degree by angle and over the picture, views."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..lens import MODELS, Floats, Lens, model_name, radius_slope
from ..resolution import (
    PictureMap,
    around_axis,
    fields_of_view,
    over_picture,
    places,
    resolution_towards,
)
from ..viewport import Viewport
from ._picture import color_bar, draw_rings, inside_view, outline
from ._style import (
    BLUE,
    COLORS,
    FAINT,
    ORANGE,
    VALUES,
    new_figure,
    panel,
    picture_panel,
    style,
)

CLASSICAL = ("perspective", "stereographic", "equidistant", "equisolid", "orthographic")
AROUND = 36  # directions over which a lens that is not round is looked at


@dataclass(frozen=True)
class NamedView:
    """A view to be drawn on the picture."""

    name: str
    camera_from_view: Rotation
    viewport: Viewport


@style()
def lens_figure(camera: Camera, title: str, views: Sequence[NamedView] = ()) -> Figure:
    """The four panels; `title` stands above them."""
    figure = new_figure(12, 9.6)
    figure.suptitle(title, x=0.01, ha="left")
    over = over_picture(camera)
    draw_curve(figure.add_subplot(2, 2, 1), camera)
    draw_by_angle(figure.add_subplot(2, 2, 2), camera)
    draw_over_picture(figure.add_subplot(2, 2, 3), camera, over)
    draw_views(figure.add_subplot(2, 2, 4), camera, over, views)
    return figure


def draw_curve(axes: Axes, camera: Camera) -> None:
    """r(theta), and thin behind it the five classical lenses of the same focal length."""
    panel(axes, "Radius by angle", "angle from the axis, degrees", "radius r, pixels")
    last = camera.theta_max
    theta = np.linspace(0, last, 400)
    radius = camera.lens.radius(theta)
    axes.set(xlim=(0, np.degrees(last) * 1.02), ylim=(0, radius[-1] * 1.12))
    focal = float(radius_slope(camera.lens, np.zeros(1))[0])
    for name in CLASSICAL:
        classical = MODELS[name](focal)  # type: ignore[call-arg]
        _draw_classical(axes, classical, camera.lens, theta, float(radius[-1]) * 1.12, name)
    own = model_name(camera.lens).replace("_", " ")
    axes.plot(np.degrees(theta), radius, color=BLUE, linewidth=2.6, label=own)
    axes.plot([], [], color=FAINT, linewidth=1, label=f"classical, f = {focal:.4g} px")
    axes.legend(loc="lower right")


def _draw_classical(
    axes: Axes, lens: Lens, own: Lens, theta: Floats, top: float, name: str
) -> None:
    """To where the formula, the field or the panel ends; its name stands there, on the side
    away from the own curve."""
    theta = theta[theta < lens.hard_limit - 1e-3]
    theta = theta[lens.radius(theta) <= top]
    radius = lens.radius(theta)
    axes.plot(np.degrees(theta), radius, color=FAINT, linewidth=1)
    through_top = radius[-1] > 0.97 * top
    above = radius[-1] >= own.radius(theta)[-1] and not through_top
    axes.annotate(
        name,
        (np.degrees(theta[-1]), radius[-1]),
        xytext=(-5, 3 if above else -3),
        textcoords="offset points",
        color="#707070",
        fontsize=8,
        ha="right",
        va="bottom" if above else "top",
        path_effects=[patheffects.withStroke(linewidth=2, foreground="white")],
    )


def draw_by_angle(axes: Axes, camera: Camera) -> None:
    """Pixels per degree away from the axis and around it; a band if it is not the same all
    around; where the picture ends to each side."""
    panel(axes, "Resolution by angle", "angle from the axis, degrees", "pixels per degree")
    theta = np.linspace(0, camera.theta_max, 200)
    there = resolution_towards(camera, theta[:, None], around_axis(AROUND))
    for values, color, name in (
        (there.tangential, ORANGE, "around the axis (tangential)"),
        (there.radial, BLUE, "away from it (radial)"),
    ):
        low, high, middle = values.min(axis=1), values.max(axis=1), values.mean(axis=1)
        if (high - low > 0.005 * middle).any():
            axes.fill_between(np.degrees(theta), low, high, color=color, alpha=0.2, linewidth=0)
        axes.plot(np.degrees(theta), middle, color=color, label=name)
    top = float(np.quantile(there.most, 0.98)) * 1.25
    axes.set(xlim=(0, np.degrees(camera.theta_max) * 1.02), ylim=(0, top))
    _draw_edges(axes, camera)
    axes.legend(loc="lower left")


def _draw_edges(axes: Axes, camera: Camera) -> None:
    """Thin lines where the picture ends, if it ends before the lens does."""
    fields = fields_of_view(camera)
    edges = {
        "sides": max(fields.left, fields.right),
        "top, bottom": max(fields.top, fields.bottom),
    }
    for name, angle in edges.items():
        if angle < np.degrees(camera.theta_max) - 0.5:
            axes.axvline(angle, color=FAINT, linewidth=1, linestyle=(0, (2, 3)))
            axes.annotate(
                f"picture ends: {name}",
                (angle, 0.98),
                xycoords=("data", "axes fraction"),
                xytext=(-2, 0),
                textcoords="offset points",
                rotation=90,
                fontsize=8,
                color="#707070",
                ha="right",
                va="top",
            )


def _extent(camera: Camera) -> tuple[float, float, float, float]:
    return -0.5, camera.size[0] - 0.5, camera.size[1] - 0.5, -0.5


def draw_over_picture(axes: Axes, camera: Camera, over: PictureMap) -> None:
    """Pixels per degree as colours over the picture, with rings at 30, 60 and 90 degrees."""
    picture_panel(axes, "Resolution over the picture", camera.size)
    values = over.resolution.mean
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    high = max(high, 1.05 * low)  # or an equisolid lens would show nothing but rounding
    shown = axes.imshow(values, cmap=VALUES, vmin=low, vmax=high, extent=_extent(camera))
    color_bar(axes, shown, "pixels per degree (root of the area)")
    draw_rings(axes, camera)


def draw_views(axes: Axes, camera: Camera, over: PictureMap, views: Sequence[NamedView]) -> None:
    """Where views lie on the picture: coloured, with the border of each."""
    picture_panel(axes, "Where the views lie", camera.size)
    lit = np.where(np.isfinite(over.theta), 0.88, 0.25)
    axes.imshow(lit, cmap="gray", vmin=0, vmax=1, extent=_extent(camera))
    ray = camera.ray(places(over.x_px, over.y_px))
    for number, view in enumerate(views):
        color = COLORS[number % len(COLORS)]
        inside = inside_view(ray, view.camera_from_view, view.viewport)
        if (np.nan_to_num(inside, nan=-1.0) > 0).any():
            level = np.nan_to_num(inside, nan=-1.0)
            axes.contourf(over.x_px, over.y_px, level, [0, 1e9], colors=[color], alpha=0.35)
        border = outline(camera, view.camera_from_view, view.viewport)
        axes.plot(*border.T, color=color, linewidth=2, label=view.name)
    draw_rings(axes, camera, color="#555555")
    if views:
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0), borderaxespad=4.5, ncols=3)
