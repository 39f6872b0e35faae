"""Figs. 8 and 9 from the printed equations 6 and 7, and what their digits leave of them."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..plots._style import FAINT, INK, style
from . import printed, rounding
from .drawing import ANGLE, LINE_COLOR, PAPER_COLOR, chart
from .exhibit import Exhibit, Section, Settings, Table

P_AXIS = "p, pixels"


def curves() -> Table:
    """Every degree to the rim; `band` is what the rounding of equation 7 can change at most."""
    degrees = np.arange(0.0, printed.HALF_FIELD_DEG + 1)
    return Table(
        {
            "theta_deg": degrees,
            "line_px": printed.line(degrees),
            "quintic_px": printed.quintic(degrees),
            "rounding_px": rounding.half_width_px(degrees),
        }
    )


def stems() -> Table:
    degrees = np.arange(0.0, 91.0, 5.0)
    return Table(
        {
            "theta_deg": degrees,
            "line_minus_quintic_px": printed.line(degrees) - printed.quintic(degrees),
        }
    )


def near_the_axis() -> Table:
    degrees = np.linspace(0, 20, 81)
    return Table(
        {
            "theta_deg": degrees,
            "quintic_px": printed.quintic(degrees),
            "rounding_px": rounding.half_width_px(degrees),
        }
    )


@style()
def draw_curves(table: Table) -> Figure:
    figure, axes = chart("Fig. 8 from the printed coefficients", ANGLE, P_AXIS)
    theta, quintic, off = table["theta_deg"], table["quintic_px"], table["rounding_px"]
    axes.fill_between(
        theta,
        quintic - off,
        quintic + off,
        color=FAINT,
        alpha=0.3,
        linewidth=0,
        label="what the rounding of (7) allows",
    )
    axes.plot(theta, table["line_px"], color=LINE_COLOR, label="equation 6, the line")
    axes.plot(theta, quintic, color=PAPER_COLOR, label="equation 7, the polynomial")
    axes.set(xlim=(0, printed.HALF_FIELD_DEG), ylim=(350, 850))
    axes.legend(loc="upper left")
    return figure


@style()
def draw_stems(table: Table) -> Figure:
    figure, axes = chart("Fig. 9: equation 6 minus equation 7", ANGLE, "pixels", height_in=3.0)
    theta, off = table["theta_deg"], table["line_minus_quintic_px"]
    axes.vlines(theta, 0, off, color=PAPER_COLOR, linewidth=1.5)
    axes.plot(theta, off, "o", color=PAPER_COLOR, markersize=5)
    axes.axhline(0, color=INK, linewidth=0.8)
    axes.set(xlim=(-2, 92))
    return figure


@style()
def draw_near_the_axis(table: Table) -> Figure:
    figure, axes = chart("Equation 7 near the axis", ANGLE, P_AXIS, height_in=3.0)
    theta, quintic, off = table["theta_deg"], table["quintic_px"], table["rounding_px"]
    axes.fill_between(theta, quintic - off, quintic + off, color=FAINT, alpha=0.4, linewidth=0)
    axes.plot(theta, quintic, color=PAPER_COLOR)
    lowest = int(np.argmin(quintic))
    axes.annotate(
        f"{quintic[lowest]:.0f} px at {theta[lowest]:.1f}°",
        (theta[lowest], quintic[lowest]),
        (theta[lowest], quintic[lowest] + 14),
        ha="center",
        arrowprops={"arrowstyle": "-", "color": FAINT},
    )
    axes.set(xlim=(0, 20), ylim=(440, 490))
    return figure


def section(settings: Settings) -> Section:
    lowest_deg, lowest_px = printed.lowest_point()
    table, differences = curves(), stems()
    off = dict(zip(table["theta_deg"], table["rounding_px"], strict=True))
    at = dict(zip(differences["theta_deg"], differences["line_minus_quintic_px"], strict=True))
    fall = printed.QUINTIC[0] - lowest_px
    fall_off = 2 * float(rounding.half_width_px(np.array(lowest_deg))) - 1.0 + 0.5
    return Section(
        name="printed-curve",
        title="The measured curve, as printed",
        places="Section 3, equations 6 and 7, Figs. 8 and 9",
        paper="The pixel distance p of a target on graph paper, 10 cm away, against the viewing "
        "angle: a straight line (6) for angles below 60 degrees, a polynomial of fifth degree (7) "
        "for more accuracy, and the difference of the two as a stem plot.",
        ours=(
            "Drawn from the printed coefficients. The line minus the polynomial is "
            f"{at[0.0]:+.1f} pixels at 0 degrees, {at[20.0]:+.1f} at 20, {at[40.0]:+.1f} at 40, "
            f"{at[60.0]:+.1f} at 60 and {at[85.0]:+.1f} at 85.",
            f"Equation 7 falls from {printed.QUINTIC[0]:.0f} pixels at 0 degrees to "
            f"{lowest_px:.1f} at {lowest_deg:.1f} degrees before it grows. The paper itself asks "
            "for coefficients that make it grow all the way from 0 (section 2.2.2). No rounding "
            f"excuses it: the slope on the axis is the second coefficient, "
            f"{printed.QUINTIC[1]:.4f} ± 0.00005 pixels per degree.",
            "Away from the axis the print has too few digits. Half a unit in the last place of "
            f"every coefficient adds up to ± {off[30.0]:.0f} pixels at 30 degrees, "
            f"± {off[60.0]:.0f} at 60 and ± {off[90.0]:.0f} at 90: the grey band. The "
            "measured curve cannot be rebuilt from equation 7 beyond some 40 degrees.",
            f"Nor is p what the text calls it, a distance from the centre of the frame: it is "
            f"{printed.LINE[0]:.0f} pixels, not 0, where the target is at the centre, and "
            f"{float(printed.line(np.array(90.0))):.0f} at 90 degrees in a picture "
            f"{printed.PICTURE_SIZE[0]} pixels wide. It looks like a position along a row, "
            "counted from an edge; any lens model fitted to it needs a free offset.",
        ),
        verdict="does not hold",
        because="the polynomial falls where it must grow, p is not a distance from the centre, "
        "and the digits printed do not carry the curve beyond some 40 degrees",
        basis="The paper's printed numbers.",
        exhibits=(
            Exhibit("fig08_printed", "Fig. 8 from the printed numbers.", table, draw_curves),
            Exhibit("fig09_printed", "Fig. 9 from the printed numbers.", differences, draw_stems),
            Exhibit(
                "eq7_near_axis",
                f"Equation 7 falls by {fall:.0f} pixels (± {fall_off:.1f} by rounding) before it "
                "grows.",
                near_the_axis(),
                draw_near_the_axis,
            ),
        ),
    )
