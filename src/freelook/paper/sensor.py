"""Does the lens fit on the sensor? What the paper's own numbers say about one another."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from ..plots._style import FAINT, new_figure, panel, style
from . import printed, rig
from .drawing import MODEL_COLORS, WIDTH_IN
from .exhibit import Exhibit, Section, Settings, Table
from .printed_models import WHOLE, fits
from .projections import FISHEYES, unit_radius


def circle_mm(model: str, focal_mm: float) -> float:
    """Diameter of the image at the paper's rim; where a model ends before, at its end."""
    rim = np.radians(printed.HALF_FIELD_DEG)
    if model == "orthographic":
        rim = np.pi / 2
    return 2 * focal_mm * float(unit_radius(model, rim))


def circles() -> Table:
    """For each model: f from the printed curve, and the circle of both printed focal lengths."""
    focal_px = {fit.model: fit.lens.f for fit in fits(WHOLE, FISHEYES)}  # type: ignore[attr-defined]
    return Table(
        {
            "model": list(FISHEYES),
            "f of equation 7, mm": [focal_px[model] / rig.COLUMNS_PER_MM for model in FISHEYES],
            "circle of equation 7, rows": [
                circle_mm(model, focal_px[model]) * rig.PIXEL_ASPECT for model in FISHEYES
            ],
            "circle if f = 1.2 mm": [circle_mm(m, printed.FOCAL_TEXT_MM) for m in FISHEYES],
            "circle if f = 2.1 mm": [circle_mm(m, printed.FOCAL_PARTS_MM) for m in FISHEYES],
        }
    )


@style()
def draw(table: Table) -> Figure:
    figure = new_figure(WIDTH_IN, 4.2)
    for column, focal in enumerate(("1.2", "2.1")):
        axes = panel(figure.add_subplot(1, 2, column + 1), f"f = {focal} mm", "mm", "mm")
        width, height = rig.SENSOR_MM
        axes.add_patch(Rectangle((-width / 2, -height / 2), width, height, color=FAINT, alpha=0.3))
        for model, diameter in zip(
            table.words["model"], table[f"circle if f = {focal} mm"], strict=True
        ):
            color = MODEL_COLORS[model]
            axes.add_patch(Circle((0, 0), diameter / 2, fill=False, color=color, linewidth=1.8))
            axes.plot([], [], color=color, label=f"{model}, {diameter:.2f} mm")
        axes.set(xlim=(-4.7, 4.7), ylim=(-4.7, 4.7), aspect="equal")
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.24))
    return figure


def section(settings: Settings) -> Section:
    table = circles()
    high = rig.SENSOR_MM[1]
    short = dict(zip(FISHEYES, table["circle if f = 1.2 mm"], strict=True))
    focal = dict(zip(FISHEYES, table["f of equation 7, mm"], strict=True))
    tall = table["circle of equation 7, rows"]
    return Section(
        name="sensor",
        title="The lens on its sensor",
        places="Sections 2.2.1, 3 and 5, Table 1, Fig. 15",
        paper="A 1.2 mm lens in the text, f2.10 m in the parts list; a 1/3 inch sensor; the image "
        "of 188 degrees is smaller than the sensor and leaves its corners black.",
        ours=(
            f"Both focal lengths cannot be right. With 1.2 mm the image circle of an equisolid "
            f"lens is {short['equisolid']:.2f} mm and just fits into the {high} mm height of the "
            f"sensor; an equidistant one ({short['equidistant']:.2f} mm) is cut a little at the "
            "top and bottom. With 2.1 mm no model's circle fits.",
            f"The curve of section 3 makes the circle larger still. PAL's pixels are "
            f"{rig.PIXEL_ASPECT:.3f} times as wide as high; whichever model is fitted to equation "
            f"7, its 188 degrees are {tall.min():.0f} to {tall.max():.0f} rows high in a picture "
            f"of {printed.PICTURE_SIZE[1]}. Either the circle was cut above and below, or the "
            "pixels of section 3 are not those of the 720 × 576 picture.",
            "The focal lengths that the printed curve gives, in such pixels, lie between the two: "
            f"{focal['equidistant']:.2f} mm if equidistant, {focal['equisolid']:.2f} if "
            f"equisolid, {focal['orthographic']:.2f} if orthographic.",
        ),
        verdict="does not hold",
        because="two focal lengths, and a curve whose 188 degrees are higher than the picture",
        basis="The paper's printed numbers; 4.8 × 3.6 mm for “1/3 inch”; pixel aspect 12:11 for "
        "PAL (ITU-T H.264, table E-1).",
        exhibits=(
            Exhibit(
                "sensor_circles",
                "Image circles of 188 degrees on a 1/3 inch sensor (grey).",
                table,
                draw,
            ),
            Exhibit(
                "sensor_focal_lengths",
                "The same in numbers; circles in mm.",
                table,
                digits={"circle of equation 7, rows": 0},
            ),
        ),
    )
