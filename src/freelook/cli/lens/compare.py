"""How far apart two lenses are, in pixels and in degrees.

  freelook lens compare old.yaml new.json --plot difference.png
  freelook lens compare cam.json mine.json

Told twice: as they are, and after the turn of B that brings the two closest. What a turn, or a
moved picture, takes away is not the lens.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import ProfileError
from .._cameras import LENS_HELP, add_format_arguments, lens_profile
from ._report import digits, percent, print_json, rounded

if TYPE_CHECKING:
    from rich.table import Table

    from ...camera import Camera
    from ...comparison import Comparison, Numbers

WORDS = {
    "centre": ", centre",
    "rim": ", rim of the narrower",
    "edge": ", edge of the picture",
}
NUMBERS = ("rms_px", "max_px", "rms_deg", "max_deg")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("a", metavar="A", help=LENS_HELP)
    parser.add_argument(
        "b", metavar="B", help="the same; scaled to A's picture if it has its shape"
    )
    parser.add_argument(
        "--plot",
        metavar="FILE",
        help="draw into FILE (.png or .svg): the difference over A's picture and by angle, "
        "without and with the turn",
    )
    add_format_arguments(parser)
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")


def run(args: argparse.Namespace) -> int:
    from ...comparison import compare

    if args.plot:
        from ...plots._style import check_path

        check_path(args.plot)
    a = lens_profile(args, args.a).camera
    b = _scaled(lens_profile(args, args.b).camera, a, args)
    found = compare(a, b)
    facts = _facts(args, a, b, found)
    if args.json:
        print_json(facts)
    else:
        _print(facts)
    if args.plot:
        from ...plots._style import save
        from ...plots.comparison import comparison_figure

        title = f"{Path(args.a).name} (A) and {Path(args.b).name} (B)"
        save(comparison_figure(a, b, found, title), args.plot)
        print(f"drawn: {args.plot}", file=sys.stderr if args.json else sys.stdout)
    return 0


def _scaled(b: Camera, a: Camera, args: argparse.Namespace) -> Camera:
    from ...session import same_shape

    if not same_shape(a.size, b.size):
        sizes = " and ".join(f"{width} x {height}" for width, height in (a.size, b.size))
        raise ProfileError(
            f"{args.a} and {args.b} are for pictures of different shapes, {sizes} pixels; only "
            "profiles of the same shape can be compared"
        )
    return b if b.size == a.size else b.resized(a.size)


def _facts(args: argparse.Namespace, a: Camera, b: Camera, found: Comparison) -> dict[str, Any]:
    from ...comparison import ring
    from ...rotations import FRD_FROM_RDF, head_angles_deg

    # both describe one picture: where in A's terms that lies which B calls forward
    angles = head_angles_deg(FRD_FROM_RDF * found.a_from_b)
    pair = {"a": a, "b": b}
    rings = [(where, ring(a, b, found.a_from_b, theta)) for where, theta in _places(a, b)]
    return rounded(
        {
            "a": args.a,
            "b": args.b,
            "size": list(a.size),
            "half_field_deg": {n: float(np.degrees(c.theta_max)) for n, c in pair.items()},
            "seen": {"both": found.both, "only_a": found.only_a, "only_b": found.only_b},
            "as_is": _numbers(found.as_is.numbers),
            "turned": _numbers(found.turned.numbers),
            "mean_shift_px": found.as_is.mean_shift_px.tolist(),
            "rms_px_without_mean_shift": found.as_is.rms_px_unmoved,
            "turn_deg": {
                "angle": float(np.degrees(found.a_from_b.magnitude())),
                "yaw": angles[0] + 0.0,
                "pitch": angles[1] + 0.0,
                "roll": angles[2] + 0.0,
            },
            "by_angle": [
                {
                    "where": where,
                    "angle_deg": float(np.degrees(each.theta)),
                    "as_is": _numbers(each.as_is),
                    "turned": _numbers(each.turned),
                }
                for where, each in rings
            ],
        }
    )


def _places(a: Camera, b: Camera) -> list[tuple[str, float]]:
    """(what it is, angle in radians): the centre, 45 and 90 degrees, and where it ends.

    That is the rim of the narrower lens, or the farthest edge of A's picture if that comes first.
    """
    from ...resolution import fields_of_view

    rim = min(a.theta_max, b.theta_max)
    fields = fields_of_view(a)
    # a little inside: the edge itself is a matter of rounding
    edge = 0.999 * np.radians(max(fields.left, fields.right, fields.top, fields.bottom))
    last = ("rim", rim) if rim <= edge / 0.999 else ("edge", float(edge))
    places = [("centre", 0.0), ("45", np.radians(45)), ("90", np.radians(90))]
    return sorted([each for each in places if each[1] < rim] + [last], key=lambda each: each[1])


def _numbers(numbers: Numbers | None) -> dict[str, float] | None:
    return None if numbers is None else {name: getattr(numbers, name) for name in NUMBERS}


def _print(facts: dict[str, Any]) -> None:
    from rich.console import Console

    console = Console()
    for name in "ab":
        console.print(f"{name.upper()} is {facts[name]}", highlight=False, markup=False)
    width, height = facts["size"]
    console.print(_table(facts, "as_is", f"as they are, in pixels of {width} x {height}"))
    console.print(_table(facts, "turned", "after the turn that fits best"))
    for line in _sentences(facts):
        console.print(line, highlight=False)


def _table(facts: dict[str, Any], which: str, title: str) -> Table:
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    table.add_column("angle from A's axis, degrees")
    for column in ("rms px", "max px", "rms degrees", "max degrees"):
        table.add_column(column, justify="right")
    table.add_row("all that both see", *_cells(facts[which]), end_section=True)
    for row in facts["by_angle"]:
        name = f"{row['angle_deg']:.4g}{WORDS.get(row['where'], '')}"
        table.add_row(name, *_cells(row[which]))
    return table


def _cells(numbers: dict[str, float] | None) -> list[str]:
    if numbers is None:
        return ["-"] * len(NUMBERS)
    return ["0.000" if numbers[n] < 5e-4 else digits(numbers[n]) for n in NUMBERS]


def _sentences(facts: dict[str, Any]) -> list[str]:
    seen, turn, field = facts["seen"], facts["turn_deg"], facts["half_field_deg"]
    x, y = facts["mean_shift_px"]
    return [
        f"Both see {percent(seen['both'])} of the picture; only A {percent(seen['only_a'])}, only "
        f"B {percent(seen['only_b'])} (A to {field['a']:.4g} degrees, B to {field['b']:.4g}).",
        f"B's forward is A's turned by {_small(turn['angle'])} degrees: {_small(turn['yaw'])} "
        f"right, {_small(turn['pitch'])} up, {_small(turn['roll'])} right side down.",
        f"B's picture is A's moved by {_small(x)} pixels right, {_small(y)} down.",
        _verdict(facts),
    ]


def _small(number: float) -> str:
    return f"{round(number, 3) + 0.0:g}"


def _verdict(facts: dict[str, Any]) -> str:
    """What explains the difference. Below 0.05 pixels no calibration can tell lenses apart."""
    before = facts["as_is"]["rms_px"]
    left, how = min(
        (facts["turned"]["rms_px"], "a turn of the camera"),
        (facts["rms_px_without_mean_shift"], "a picture moved on the sensor"),
    )
    rest = f"of {before:.3g} pixels rms {left:.3g} are left."
    if before < 0.05:
        return "They are the same within 0.05 pixels."
    if left < 0.05:
        return f"They are the same lens but for {how}: {rest}"
    if left < before / 2:
        return f"Most of it is {how}: {rest}"
    return f"Another lens: neither a turn nor a moved picture explains it; {rest}"
