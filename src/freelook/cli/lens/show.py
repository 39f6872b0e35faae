"""Show one lens: parameters, field of view, plots, what a view costs.

freelook lens show cam.json --plot cam.png      look at it: four pictures in one file
freelook lens show cam.json                     the numbers, in the terminal
freelook lens show cam.json --view=-30,10,60,1920x1080
                                                what that view costs, beside the usual ones
"""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

from .._arguments import size
from .._cameras import LENS_HELP, add_format_arguments, lens_profile
from ._report import digits, percent, print_json, span, spark

if TYPE_CHECKING:
    from pathlib import Path

    from rich.table import Table

    from ...camera import Camera
    from ...formats import Profile
    from ._lens_facts import View

SPOTS = ("centre", "left", "right", "top", "bottom", "corners")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("profile", metavar="PROFILE", help=LENS_HELP)
    parser.add_argument(
        "--plot",
        metavar="FILE",
        help="draw into FILE (.png or .svg): r(theta) beside the classical lenses, pixels per "
        "degree by angle and over the picture, and where the views lie on it",
    )
    parser.add_argument(
        "--view",
        action="append",
        default=[],
        type=_view,
        metavar="YAW,PITCH,HFOV,WxH",
        help="a view to be told about, degrees and pixels (write --view=-30,0,90,1280x720 with "
        "a leading minus); again for more. Forward and 60 left are always there",
    )
    add_format_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")


def _view(text: str) -> tuple[float, float, float, tuple[int, int]]:
    try:
        yaw, pitch, hfov, pixels = text.split(",")
        return float(yaw), float(pitch), float(hfov), size(pixels)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not YAW,PITCH,HFOV,WxH, such as 30,-10,90,1280x720"
        ) from None


def run(args: argparse.Namespace) -> int:
    from ._lens_facts import USUAL_VIEWS, lens_facts

    plot = _checked(args.plot) if args.plot else None
    profile = lens_profile(args, args.profile)
    views = [*USUAL_VIEWS, *map(_named, args.view)]
    facts = lens_facts(args.profile, profile, views)
    if args.json:
        print_json(facts)
    else:
        _print(facts, profile.camera)
    if plot:
        _draw(profile, args.profile, views, plot)
        print(f"drawn: {plot}", file=sys.stderr if args.json else sys.stdout)
    return 0


def _named(given: tuple[float, float, float, tuple[int, int]]) -> View:
    from ...viewport import Viewport
    from ._lens_facts import View

    yaw, pitch, hfov, pixels = given
    return View(f"{yaw:g}, {pitch:g}", yaw, pitch, Viewport(pixels, hfov))


def _checked(path: str) -> Path:
    from ...plots._style import check_path

    return check_path(path)


def _draw(profile: Profile, given: str, views: list[View], path: Path) -> None:
    from pathlib import Path

    from ...plots._style import save
    from ...plots.lens import NamedView, lens_figure
    from ...rotations import body_from_view

    camera = profile.camera
    drawn = [
        NamedView(
            view.name,
            camera.camera_from_body * body_from_view(view.yaw_deg, view.pitch_deg),
            view.viewport,
        )
        for view in views
    ]
    save(lens_figure(camera, profile.name or Path(given).name, drawn), path)


def _print(facts: dict[str, Any], camera: Camera) -> None:
    from rich.console import Console

    console = Console()
    console.print(f"[bold]{facts['name'] or facts['profile']}[/bold]", highlight=False)
    if facts["source"]:
        console.print(facts["source"], highlight=False, markup=False)
    for note in facts["notes"]:
        console.print(f"note: {note}", style="yellow", highlight=False, markup=False)
    console.print(_lens_table(facts, camera, sparks=console.encoding.lower().startswith("utf")))
    console.print(_resolution_table(facts["pixels_per_degree"], facts["field_deg"]["corner"]))
    console.print(_view_table(facts["views"]))


def _lens_table(facts: dict[str, Any], camera: Camera, *, sparks: bool) -> Table:
    from rich.table import Table

    from ._lens_facts import along

    table = Table(show_header=False, box=None, pad_edge=False)
    table.add_column(style="dim", no_wrap=True)
    table.add_column()
    width, height = facts["size"]
    x, y = facts["center"]
    table.add_row("model", f"{facts['model']}: {facts['formula']}")
    table.add_row("parameters", _parameters(facts["parameters"]))
    table.add_row("picture", f"{width} x {height} pixels, axis at ({x:.6g}, {y:.6g})")
    if facts["stretch"] != [[1.0, 0.0], [0.0, 1.0]]:
        rows = "; ".join(" ".join(f"{v:.6g}" for v in row) for row in facts["stretch"])
        table.add_row("stretch", rows)
    if any(facts["mount_deg"].values()):
        mount = ", ".join(f"{name} {angle:g}" for name, angle in facts["mount_deg"].items())
        table.add_row("mounted at", f"{mount} degrees")
    table.add_row("field of view", _fields(facts["field_deg"]))
    table.add_row("r(theta) grows", _growth(facts["grows_to_deg"], facts["formula_ends_deg"]))
    table.add_row("table errs by", _residual(facts["residual_px"]))
    if sparks:
        radius, resolution = along(camera, 40)
        rim = f"{facts['field_deg']['circle'] / 2:.4g} degrees"
        table.add_row("r(theta)", f"{spark(radius.tolist())} {radius[-1]:.4g} px at {rim}")
        radial = resolution.radial.tolist()
        table.add_row("px per degree", f"{spark(radial)} away from the axis, {span_of(radial)}")
    return table


def span_of(values: list[float]) -> str:
    return span((min(values), max(values)))


def _parameters(parameters: dict[str, Any]) -> str:
    """All numbers, but of long lists only how many."""
    words = []
    for name, value in parameters.items():
        if isinstance(value, (list, tuple)) and len(value) > 12:
            words.append(f"{name}: {len(value)} numbers")
        elif isinstance(value, (list, tuple)):
            words.append(f"{name} = [{', '.join(f'{each:.6g}' for each in value)}]")
        else:
            words.append(f"{name} = {value:.8g}")
    return ", ".join(words)


def _fields(fields: dict[str, float]) -> str:
    edges = ", ".join(f"{fields[n]:.1f} {n}" for n in ("horizontal", "vertical", "diagonal"))
    return f"{edges}; whole circle {fields['circle']:.1f} degrees"


def _growth(grows_to: float, formula_ends: float) -> str:
    if grows_to < formula_ends - 0.01:
        return f"to {grows_to:.2f} degrees from the axis"
    return f"all the way to {formula_ends:.4g} degrees, where the formula ends"


def _residual(residual: dict[str, float | None]) -> str:
    words = f"{residual['table']:.4f} pixels at most"
    if residual["grid"] is not None:
        words += f", the grid for what is not round by {residual['grid']:.4f}"
    return words


def _resolution_table(rows: list[dict[str, Any]], corner_deg: float) -> Table:
    from rich.table import Table

    table = Table(title="pixels per degree", title_justify="left")
    table.add_column("angle from the axis")
    for column in ("away from it", "around it", "over all directions"):
        table.add_column(column, justify="right")
    for row in rows:
        name = row["where"] if row["where"] in ("centre", "rim") else ""
        where = f"{row['angle_deg']:.4g} degrees" + (f", {name}" if name else "")
        if row["share_in_picture"] == 0:
            outside = row["angle_deg"] > corner_deg + 0.01
            where += " (outside the picture)" if outside else " (in a corner)"
        cells = [digits(row["radial"], ".2f"), digits(row["tangential"], ".2f")]
        table.add_row(where, *cells, span((row["least"], row["most"])))
    return table


def _view_table(views: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table(title="what a view costs", title_justify="left")
    table.add_column("degrees right, up", no_wrap=True)
    for view in views:
        table.add_column(view["name"], justify="right")

    def row(name: str, cells: list[str], *, last: bool = False) -> None:
        table.add_row(name, *cells, end_section=last)

    row("field of view, degrees", [f"{v['hfov_deg']:.4g} x {v['vfov_deg']:.1f}" for v in views])
    row("size", [_size(v["size"]) for v in views], last=True)
    row("source pixels under it", [f"{v['source_pixels']:,.0f}" for v in views])
    row("  of the picture's", [percent(v["share_of_picture"]) for v in views])
    row("  of the lens's image", [percent(v["share_of_image"]) for v in views])
    row("  for each view pixel", [digits(v["source_pixels"] / v["view_pixels"]) for v in views])
    row("sees nothing in", [percent(1 - v["seen"]) for v in views], last=True)
    row("view px/degree, centre", [digits(v["view_px_per_degree"]) for v in views])
    for key, words in (
        ("source_px_per_degree", "source px/degree"),
        ("source_px_per_view_px", "source px/view px"),
    ):
        for spot in SPOTS:
            name = f"{words}, {spot}" if spot == SPOTS[0] else f"  {spot}"
            row(name, [span(v[key][spot]) for v in views], last=spot == SPOTS[-1])
    row("enlarged, < 1 source px", [percent(v["enlarged"]) for v in views])
    row("shrunk in all directions", [percent(v["shrunk"]) for v in views])
    row("largest not enlarged", [_size(v["largest_size_not_enlarged"]) for v in views])
    return table


def _size(size: list[int]) -> str:
    return f"{size[0]} x {size[1]}" if size[0] else "-"
