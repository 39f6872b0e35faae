"""What the figures of the report share: one width, one colour per lens model."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..plots._style import AMBER, BLUE, FAINT, GREEN, INK, ORANGE, PINK, new_figure, panel

WIDTH_IN = 5.6  # its letters can still be read when a phone shows it across the screen
ANGLE = "angle from the axis, degrees"
MODEL_COLORS = {
    "perspective": FAINT,
    "stereographic": AMBER,
    "equidistant": BLUE,
    "equisolid": GREEN,
    "orthographic": ORANGE,
}
PAPER_COLOR, OUR_COLOR, LINE_COLOR = INK, GREEN, PINK


def chart(title: str, x: str, y: str, *, height_in: float = 3.6) -> tuple[Figure, Axes]:
    """A figure with one panel."""
    figure = new_figure(WIDTH_IN, height_in)
    return figure, panel(figure.add_subplot(), title, x, y)


def charts(titles: list[str], x: str, y: str, *, each_in: float = 2.6) -> tuple[Figure, list[Axes]]:
    """A figure with panels below each other that share what they show."""
    figure = new_figure(WIDTH_IN, each_in * len(titles))
    axes = [
        panel(figure.add_subplot(len(titles), 1, row + 1), title, x, y)
        for row, title in enumerate(titles)
    ]
    return figure, axes
