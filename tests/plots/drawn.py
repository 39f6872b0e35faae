"""What stands in a figure."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage


def panels(figure: Figure) -> list[Axes]:
    """Its axes without the bars of colours."""
    return [axes for axes in figure.axes if axes.get_title(loc="left")]


def image_of(axes: Axes) -> tuple[np.ndarray, list[float]]:
    """(values, NaN where nothing is shown; the extent) of its only map."""
    (image,) = [each for each in axes.get_children() if isinstance(each, AxesImage)]
    return np.ma.filled(np.ma.asarray(image.get_array()), np.nan), list(image.get_extent())
