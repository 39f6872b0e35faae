"""One look for all figures, and how they are written.

    @style()
    def draw(...) -> Figure:
        figure = new_figure(10, 4)
        axes = panel(figure.add_subplot(1, 2, 1), "r(theta)", "angle from the axis, degrees", ...)
        ...
    save(draw(...), path)

Only matplotlib's objects are used, never pyplot: nothing here keeps a state or opens a window.
Colours: Okabe and Ito, "Color Universal Design" (2008), told apart by colour-blind people too;
the two colour maps grow in lightness, so they survive a grey printer.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..errors import SinkError

INK = "#222222"
FAINT = "#9a9a9a"  # what only helps to read the rest
GRID = "#e2e2e2"
BLUE, ORANGE, GREEN, PINK, AMBER, SKY = COLORS = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#cc79a7",
    "#e69f00",
    "#56b4e9",
)
VALUES = "viridis"  # a quantity over the picture: bright is much
ERRORS = "magma"  # a difference: dark is none

SUFFIXES = (".png", ".svg")
DPI = 130

_LOOK: Any = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],  # comes with matplotlib: the same letters everywhere
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 10,
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.prop_cycle": cycler(color=COLORS),
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "lines.linewidth": 1.8,
    "lines.solid_capstyle": "round",
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 9,
    "legend.frameon": False,
    "figure.facecolor": "white",
    "figure.titlesize": 13,
    "figure.titleweight": "bold",
    "figure.dpi": DPI,
    "savefig.dpi": DPI,
    "image.interpolation": "nearest",
    "svg.fonttype": "path",  # looks the same where the font is missing
    "svg.hashsalt": "freelook",  # names inside the file are the same every time
}


@contextmanager
def style() -> Iterator[None]:
    """The look, for a `with` block or, as `@style()`, for a whole function."""
    with matplotlib.rc_context(_LOOK):
        yield


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure whose parts make room for each other. Sizes in inches of 130 pixels."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


def panel(axes: Axes, title: str, x: str, y: str) -> Axes:
    """The axes with a title and what they show, with units: "angle from the axis, degrees"."""
    axes.set_title(title)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    return axes


def picture_panel(axes: Axes, title: str, size: tuple[int, int]) -> Axes:
    """Axes in the pixels of a picture of `size` (width, height), y downwards, nothing squeezed."""
    panel(axes, title, "x, pixels", "y, pixels")
    axes.set(xlim=(-0.5, size[0] - 0.5), ylim=(size[1] - 0.5, -0.5), aspect="equal")
    axes.grid(False)
    return axes


def check_path(path: str | Path) -> Path:
    """The path if `save` can write such a file; SinkError otherwise. For before long work."""
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise SinkError(f"cannot draw into {path}: its name must end in {' or '.join(SUFFIXES)}")
    if not path.parent.is_dir():
        raise SinkError(f"cannot draw into {path}: there is no folder {path.parent}")
    return path


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure as PNG or SVG, as the suffix says; an existing file is replaced.

    The same figure gives the same bytes every time. SinkError for any other suffix and for what
    the system refuses.
    """
    path = check_path(path)
    kind = path.suffix.lower()[1:]
    unsaid: dict[str, Any] = {"Date": None} if kind == "svg" else {"Software": None}
    with style():
        try:
            figure.savefig(path, format=kind, metadata=unsaid)
        except OSError as error:
            raise SinkError(f"cannot write {path}: {error.strerror or error}") from None
