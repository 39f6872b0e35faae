"""Equation 1: the focal length from a small object near the axis, f / h = D / H."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..lens import Floats
from ..plots._style import FAINT, style
from . import printed, rig
from .drawing import MODEL_COLORS, chart
from .exhibit import Exhibit, Section, Settings, Table
from .projections import FIVE, unit_radius

DISTANCE_MM = printed.TARGET_DISTANCE_MM
SIZES_MM: Floats = printed.GRID_MM * np.arange(1.0, 21.0)


def bias(model: str, sizes_mm: Floats) -> Floats:
    """Relative error of equation 1 for an object centred on the axis; 0 for a perfect pinhole.

    Found over true focal length: h is twice the radius of half the object.
    """
    half_angle = np.arctan(sizes_mm / 2 / DISTANCE_MM)
    image = 2 * unit_radius(model, half_angle)
    return np.asarray(image * DISTANCE_MM / sizes_mm - 1)


def reading(sizes_mm: Floats, focal_px: float) -> Floats:
    """Relative error, 1 sigma, from reading off both ends of the object's image."""
    return np.asarray(np.sqrt(2) * rig.read_sigma_px() * DISTANCE_MM / sizes_mm / focal_px)


def columns_focal_px() -> float:
    """The simulated camera's focal length in columns: the object lies along a row."""
    return rig.FOCAL_PX / rig.PIXEL_ASPECT


def measured(settings: Settings) -> Floats:
    """One reading of every object through the simulated camera: f found, in columns."""
    half_mm = SIZES_MM / 2
    ends = np.stack([np.array([-half_mm, half_mm])] * 3, axis=-1)
    ends[..., 1], ends[..., 2] = 0.0, DISTANCE_MM
    pixels = rig.read_off(rig.camera().project(ends), settings.rng("focal"))
    return np.asarray((pixels[1, :, 0] - pixels[0, :, 0]) * DISTANCE_MM / SIZES_MM)


def errors(settings: Settings) -> Table:
    focal_px = columns_focal_px()
    return Table(
        {
            "object_mm": SIZES_MM,
            "half_angle_deg": np.degrees(np.arctan(SIZES_MM / 2 / DISTANCE_MM)),
            **{f"{model}_percent": 100 * bias(model, SIZES_MM) for model in FIVE},
            "reading_percent": 100 * reading(SIZES_MM, focal_px),
            "simulated_percent": 100 * (measured(settings) / focal_px - 1),
        }
    )


@style()
def draw(table: Table) -> Figure:
    figure, axes = chart(
        "Error of equation 1, object at 10 cm",
        "object's size H, mm",
        "error of f, percent",
        height_in=4.2,
    )
    size, noise = table["object_mm"], table["reading_percent"]
    truth = table["equisolid_percent"]
    axes.fill_between(
        size, truth - noise, truth + noise, color=FAINT, alpha=0.35, linewidth=0, label="1 σ"
    )
    for model in FIVE:
        axes.plot(size, table[f"{model}_percent"], color=MODEL_COLORS[model], label=model)
    axes.plot(size, table["simulated_percent"], "k.", markersize=4, label="simulated")
    axes.set(xlim=(0, size[-1]), ylim=(-12, 10))
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=4)
    return figure


def section(settings: Settings) -> Section:
    table = errors(settings)
    both = np.hypot(table["equisolid_percent"], table["reading_percent"])
    best = int(np.argmin(both))
    one_percent = SIZES_MM[np.abs(table["equisolid_percent"]) < 1][-1]
    return Section(
        name="focal",
        title="Focal length from a small object",
        places="Section 2.2.1, equation 1, Fig. 3",
        paper="f / h = D / H: the focal length f from the image size h of a small object of size "
        "H at distance D near the axis, where a fisheye distorts least.",
        ours=(
            "How small is small? An object on the axis at 10 cm, seen through each of the five "
            f"models: for an equisolid lens equation 1 is wrong by less than 1 % up to "
            f"{one_percent:.0f} mm. But a small object is small in the picture too, and reading "
            f"off its ends costs {table['reading_percent'][0]:.0f} % of one grid square "
            f"({SIZES_MM[0]:.0f} mm). Both errors together are smallest, {both[best]:.1f} %, with "
            f"an object of {SIZES_MM[best]:.0f} mm.",
        ),
        verdict="holds",
        because="it works; but the smallest object does not give the smallest error",
        basis=f"Simulation: one reading of each object, {rig.NOISE_WORDS}; the grey band is that "
        "error's standard deviation about the equisolid curve.",
        exhibits=(
            Exhibit("eq1_focal_length", "Equation 1 against the object's size.", table, draw),
        ),
    )
