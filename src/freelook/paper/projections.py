"""Fig. 4: the five classical projections for f = 1."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..lens import MODELS, Floats
from ..plots._style import FAINT, style
from . import printed
from .drawing import ANGLE, MODEL_COLORS, chart
from .exhibit import Exhibit, Section, Settings, Table

FIVE = ("perspective", "stereographic", "equidistant", "equisolid", "orthographic")
FISHEYES = FIVE[1:]
LAST_DEG = 140
HIGHEST = 3.0  # tan(theta) has no bound


def unit_radius(model: str, theta: Floats) -> Floats:
    """r(theta) of a classical model with f = 1; NaN from where its formula ends."""
    lens = MODELS[model](1.0)  # type: ignore[call-arg]
    theta = np.asarray(theta, dtype=np.float64)
    # sin(90 degrees) is still a radius, tan(90 degrees) is none
    ends = theta > lens.hard_limit if model == "orthographic" else theta >= lens.hard_limit
    radius = lens.radius(np.where(ends, 0.0, theta))
    return np.asarray(np.where(ends, np.nan, radius))


def five_models() -> Table:
    degrees = np.arange(0.0, LAST_DEG + 1)
    radii = {model: unit_radius(model, np.radians(degrees)) for model in FIVE}
    return Table({"theta_deg": degrees, **radii})


@style()
def draw(table: Table) -> Figure:
    figure, axes = chart("Five projections, f = 1", ANGLE, "radius r, in focal lengths")
    for model in FIVE:
        axes.plot(table["theta_deg"], table[model], color=MODEL_COLORS[model], label=model)
    axes.axvspan(90, LAST_DEG, color=FAINT, alpha=0.12, linewidth=0)
    axes.axvline(printed.HALF_FIELD_DEG, color=FAINT, linewidth=1, linestyle="--")
    axes.text(printed.HALF_FIELD_DEG + 1.5, 0.08, "rim of the paper's\nlens, 94°", fontsize=8)
    axes.set(xlim=(0, LAST_DEG), ylim=(0, HIGHEST), xticks=range(0, LAST_DEG + 1, 20))
    axes.legend(loc="upper left")
    return figure


def section(settings: Settings) -> Section:
    return Section(
        name="projections",
        title="Five projections",
        places="Section 2.2.2, Fig. 4",
        paper="Radius against angle, to 90 degrees, of the perspective projection and the four "
        "classical fisheye projections for a focal length of 1.",
        ours=(
            "The same five curves from the lens models that all of freelook uses, and on beyond "
            "90 degrees (shaded), where this lens still sees: its rim is at 94. Two of the five "
            "end before: the perspective radius has no bound at 90 degrees, and the orthographic "
            "(the paper: orthogonal) stops growing there. A lens that images 94 degrees cannot "
            "be orthographic out to its rim, whatever it is nearer the middle.",
        ),
        verdict="holds",
        because="the five formulas are right; what they imply at 94 degrees is not said",
        basis="Formulas; nothing measured.",
        exhibits=(
            Exhibit(
                "fig04_projections",
                "Fig. 4 again, continued to 140 degrees.",
                five_models(),
                draw,
            ),
        ),
    )
