"""Figs. 10 and 11: a sheet with numbered points moves away from the camera.

The text does not list the points. Point 1 does not move, so it lies where the axis meets the
sheet; point 6 keeps its y, so it lies beside point 1, level with it; the others move in both
directions, so they lie off both lines. These are such points, on the lines of 6 mm paper.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..fitting.curve import fit_curve, rank
from ..lens import Floats
from ..plots._style import COLORS, INK, new_figure, panel, style
from . import printed, rig
from .drawing import WIDTH_IN
from .exhibit import Exhibit, Section, Settings, Table
from .projections import FISHEYES

# (right, down) of each numbered point on the sheet, in squares of the graph paper.
SQUARES = {1: (0, 0), 2: (-6, -5), 3: (5, -8), 4: (-9, 4), 5: (7, 7), 6: (10, 0)}
STEP_MM = 10.0
POINT_COLORS = (INK, *COLORS[:5])


def distances_mm() -> Floats:
    first, last = printed.DISTANCES_MM
    return np.arange(first, last + 1, STEP_MM)


def rays() -> Floats:
    """(points, distances, 3) mm from the lens."""
    beside = printed.GRID_MM * np.array(list(SQUARES.values()), dtype=np.float64)
    away = distances_mm()
    shape = (len(beside), len(away))
    right, down = (np.broadcast_to(beside[:, i, None], shape) for i in (0, 1))
    return np.stack([right, down, np.broadcast_to(away, shape)], axis=-1)


def exact_tracks() -> Floats:
    """(points, distances, 2) pixels without any error."""
    return rig.camera().project(rays())


def off_line_px(track: Floats) -> Floats:
    """How far each pixel (n, 2) lies beside the best straight line through all of them."""
    middle = track - track.mean(axis=0)
    _, _, directions = np.linalg.svd(middle, full_matrices=False)
    return np.asarray(np.abs(middle @ directions[-1]))


def past_center_px(track: Floats) -> float:
    """How far the best line through a track passes the principal point."""
    middle = track.mean(axis=0)
    _, _, directions = np.linalg.svd(track - middle, full_matrices=False)
    return float(abs((np.array(rig.CENTER) - middle) @ directions[-1]))


def tracks(settings: Settings) -> Table:
    exact = exact_tracks()
    read = rig.read_off(exact, settings.rng("distances"))
    points, away = exact.shape[:2]
    lateral = np.linalg.norm(rays()[..., :2], axis=-1)
    return Table(
        {
            "point": np.repeat(list(SQUARES), away),
            "distance_mm": np.tile(distances_mm(), points),
            "theta_deg": np.degrees(np.arctan2(lateral, rays()[..., 2])).ravel(),
            "x_px": read[..., 0].ravel(),
            "y_px": read[..., 1].ravel(),
            "true_x_px": exact[..., 0].ravel(),
            "true_y_px": exact[..., 1].ravel(),
        }
    )


def of_point(table: Table, point: int, *names: str) -> list[Floats]:
    rows = table["point"] == point
    return [table[name][rows] for name in names]


def label_side(point: int) -> tuple[int, int]:
    """(right, up) of a point, -1 to 1: where its number is out of its track's way."""
    right, down = SQUARES[point]
    return (int(np.sign(right)), -int(np.sign(down))) if point != 1 else (-1, 1)


@style()
def draw_tracks(table: Table) -> Figure:
    figure = new_figure(WIDTH_IN, 4.35)
    axes = panel(figure.add_subplot(), "Fig. 10: tracks, 40 to 300 mm", "x, pixels", "y, pixels")
    for point, color in zip(SQUARES, POINT_COLORS, strict=True):
        x, y, true_x, true_y = of_point(table, point, "x_px", "y_px", "true_x_px", "true_y_px")
        axes.plot(true_x, true_y, color=color, linewidth=1, alpha=0.6)
        axes.plot(x, y, ".", color=color, markersize=4)
        right, up = label_side(point)
        axes.annotate(
            str(point),
            (true_x[0], true_y[0]),
            (8 * right, 8 * up),
            textcoords="offset points",
            ha="center",
            va="center",
        )
    width, height = printed.PICTURE_SIZE
    axes.set(xlim=(0, width), ylim=(height, 0), aspect=1 / rig.PIXEL_ASPECT)
    return figure


@style()
def draw_coordinates(table: Table) -> Figure:
    figure = new_figure(WIDTH_IN, 5.2)
    for row, coordinate in enumerate("xy"):
        axes = panel(
            figure.add_subplot(2, 1, row + 1),
            f"Fig. 11: {coordinate} against distance",
            "distance of the sheet, mm",
            f"{coordinate}, pixels",
        )
        for point, color in zip(SQUARES, POINT_COLORS, strict=True):
            away, read, true = of_point(
                table, point, "distance_mm", f"{coordinate}_px", f"true_{coordinate}_px"
            )
            axes.plot(away, true, color=color, linewidth=1, alpha=0.6)
            axes.plot(away, read, ".", color=color, markersize=4, label=str(point))
        axes.set(xlim=printed.DISTANCES_MM)
        if coordinate == "x":
            axes.legend(loc="upper right", ncols=6)
            axes.set(ylim=(60, 690))
    return figure


def straightness(table: Table) -> Table:
    """One row for each point: does it move, in which direction, how straight, past the centre."""
    rows = []
    for point in SQUARES:
        x, y, true_x, true_y = of_point(table, point, "x_px", "y_px", "true_x_px", "true_y_px")
        read = np.stack([x, y], axis=-1)
        exact = np.stack([true_x, true_y], axis=-1)
        moves = point != 1
        rows.append(
            (
                float(point),
                float(np.ptp(true_x)),
                float(np.ptp(true_y)),
                float(off_line_px(exact).max()) if moves else np.nan,
                float(np.sqrt(np.mean(off_line_px(read) ** 2))) if moves else np.nan,
                past_center_px(read) if moves else np.nan,
            )
        )
    names = ("point", "moves in x, px", "moves in y, px")
    measures = ("off its line, exact", "off its line, read (rms)", "line past centre, read")
    return Table(dict(zip(names + measures, zip(*rows, strict=True), strict=True)))


def radii(table: Table) -> tuple[Floats, Floats]:
    """(angles in radians, radii in rows) of all readings but those of point 1."""
    moving = table["point"] != 1
    right = (table["x_px"][moving] - rig.CENTER[0]) * rig.PIXEL_ASPECT
    down = table["y_px"][moving] - rig.CENTER[1]
    return np.radians(table["theta_deg"][moving]), np.hypot(right, down)


def section(settings: Settings) -> Section:
    table = tracks(settings)
    lines = straightness(table)
    theta, radius = radii(table)
    fits = rank([fit_curve(model, theta, radius, loss="linear") for model in FISHEYES])
    rms = {fit.model: fit.rms_px for fit in fits}
    exact_off = float(np.nanmax(lines["off its line, exact"]))
    return Section(
        name="distances",
        title="The distance experiment, simulated",
        places="Section 3, Figs. 10 and 11",
        paper="Numbered points on graph paper while its distance grows from 40 to 300 mm: they "
        "move toward the centre; point 1 stays, point 6 keeps its y. The elevations in Fig. 11 are "
        "said to show that the distortion is close to linear.",
        ours=(
            "The points are not listed in the paper; ours are of the described kind. Their images "
            f"move on straight lines into the principal point, to {exact_off:.0e} pixels without "
            "reading error: whatever the lens, as long as it is round, a point that recedes "
            "parallel to the axis keeps its direction about it. So straight tracks say nothing "
            "about r(θ), only where the centre is. Point 1 does not move, point 6 keeps its y.",
            "What tells about r(θ) is how fast they move along the lines. The curves of Fig. 11 "
            "bend with 1 / distance in any lens; against the angle, which here runs from "
            f"{np.degrees(theta.min()):.0f} to {np.degrees(theta.max()):.0f} degrees, an "
            f"equidistant (linear) lens misses the readings by {rms['equidistant']:.1f} pixels "
            f"RMS, the true equisolid one by {rms['equisolid']:.1f}, an orthographic one by "
            f"{rms['orthographic']:.1f}. Best by AICc: {fits[0].model}.",
        ),
        verdict="holds in part",
        because="the motion is as described; straight tracks say nothing about linearity",
        basis=f"Simulation: {rig.NOISE_WORDS}; distances every {STEP_MM:.0f} mm, counted from the "
        "lens's entrance pupil, which is taken to be one point.",
        exhibits=(
            Exhibit("fig10_tracks", "Fig. 10, simulated: dots are readings.", table, draw_tracks),
            Exhibit(
                "fig11_coordinates",
                "Fig. 11, simulated: dots are readings.",
                table,
                draw_coordinates,
            ),
            Exhibit(
                "distance_lines",
                "Each point's way, and its distance from the best straight line.",
                lines,
                digits={
                    "point": 0,
                    "moves in x, px": 1,
                    "moves in y, px": 1,
                    "off its line, exact": 12,
                },
            ),
        ),
    )
