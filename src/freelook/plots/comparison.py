"""Two lenses against each other: where on the picture they differ, and at which angle how much."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..camera import Camera
from ..comparison import Comparison, Difference, Numbers, ring
from ..lens import Floats
from ._picture import color_bar, draw_rings
from ._style import BLUE, ERRORS, INK, ORANGE, new_figure, panel, picture_panel, style

ARROWS = 17  # along the longer side
NOT_COMMON = "#d0d0d0"


@style()
def comparison_figure(a: Camera, b: Camera, found: Comparison, title: str) -> Figure:
    """Maps of the difference, as it is and after the turn; both again by angle."""
    figure = new_figure(12, 9.6)
    figure.suptitle(title, x=0.01, ha="left")
    turn_deg = float(np.degrees(found.a_from_b.magnitude()))
    draw_map(figure.add_subplot(2, 2, 1), a, found, found.as_is, "Difference as it is")
    after = f"After a turn of {turn_deg:.3g}°"
    draw_map(figure.add_subplot(2, 2, 2), a, found, found.turned, after)
    theta = np.linspace(0, a.theta_max, 60)
    rings = [ring(a, b, found.a_from_b, float(angle)) for angle in theta]
    pairs = [(each.as_is, each.turned) for each in rings]
    degrees = np.degrees(theta)
    draw_by_angle(figure.add_subplot(2, 2, 3), degrees, pairs, "pixels", _pixels)
    draw_by_angle(figure.add_subplot(2, 2, 4), degrees, pairs, "degrees", _degrees)
    return figure


def draw_map(
    axes: Axes, camera: Camera, found: Comparison, difference: Difference, title: str
) -> None:
    """The distance as colours, its direction as arrows; gray where not both see."""
    picture_panel(axes, title, camera.size)
    axes.set_facecolor(NOT_COMMON)
    width, height = camera.size
    distance = np.where(difference.common, difference.distance_px, np.nan)
    top = max(float(np.nanquantile(distance, 0.995)), 1e-6)
    shown = axes.imshow(
        distance, cmap=ERRORS, vmin=0, vmax=top, extent=(-0.5, width - 0.5, height - 0.5, -0.5)
    )
    color_bar(axes, shown, "distance, pixels", extend="max")
    draw_rings(axes, camera)
    _draw_arrows(axes, found, difference)


def _draw_arrows(axes: Axes, found: Comparison, difference: Difference) -> None:
    """From where A puts a ray towards where B does; as long as the longest of them allows."""
    step = max(1, max(len(found.x_px), len(found.y_px)) // ARROWS)
    places = slice(step // 2, None, step)
    x, y = np.meshgrid(found.x_px[places], found.y_px[places])
    shift = difference.shift_px[places, places]
    known = difference.common[places, places]
    if not known.any():
        return
    longest = max(float(difference.distance_px[places, places][known].max()), 1e-9)
    u, v = np.moveaxis(shift[known] / longest * (found.x_px[1] - found.x_px[0]) * step, -1, 0)
    axes.quiver(
        x[known], y[known], u, v,
        angles="xy", scale_units="xy", scale=1, width=0.0035, color="white",
        path_effects=[patheffects.withStroke(linewidth=1.2, foreground=INK, alpha=0.6)],
    )  # fmt: skip


def _pixels(numbers: Numbers) -> tuple[float, float]:
    return numbers.rms_px, numbers.max_px


def _degrees(numbers: Numbers) -> tuple[float, float]:
    return numbers.rms_deg, numbers.max_deg


def draw_by_angle(
    axes: Axes,
    theta_deg: Floats,
    pairs: list[tuple[Numbers | None, Numbers | None]],
    unit: str,
    of: Callable[[Numbers], tuple[float, float]],
) -> None:
    """Root mean square around the axis as a line, the largest as the upper end of a band."""
    panel(axes, f"Difference by angle, {unit}", "angle from A's axis, degrees", unit)
    names = ("as it is", "after the turn")
    for which, (name, color) in enumerate(zip(names, (ORANGE, BLUE), strict=True)):
        numbers = [pair[which] for pair in pairs]
        rms, largest = np.array([of(n) if n else (np.nan, np.nan) for n in numbers]).T
        axes.fill_between(theta_deg, rms, largest, color=color, alpha=0.2, linewidth=0)
        axes.plot(theta_deg, rms, color=color, label=f"{name}: rms, and up to the largest")
    axes.set(xlim=(0, theta_deg[-1] * 1.02))
    axes.set_ylim(0, 1.2 * axes.get_ylim()[1])  # room for the legend
    axes.legend(loc="upper left")
