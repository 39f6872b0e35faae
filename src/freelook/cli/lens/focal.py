"""Focal length from one small object near the axis: f / h = D / H, the 2011 paper's equation 1.

  freelook lens focal --distance 100 --height 12 --image-height 38
  freelook lens focal --distance 2.5 --height 0.3 --image-height 52 --pixel-size 2.9
  freelook lens focal --distance 100 --height 12 --image-height 0.21mm --pixel-size 5.6

Put an object of height H in the middle of the picture, square to the axis, at the distance D from
the lens, and measure how high its image h is. D and H are in any one unit; h is in pixels, or in
millimetres on the sensor (0.21mm).

Every lens model is alike near the axis, r = f theta, so f is the f of any of them there. The
larger the object, the more the models differ: how wrong f is then, model by model, is printed.
"""

from __future__ import annotations

import argparse
import math
import re
from typing import Any

from ...errors import FreelookError
from ._report import print_json, rounded

MODELS = ("perspective", "stereographic", "equidistant", "equisolid", "orthographic")
TOO_WRONG = 0.01


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--distance", type=float, required=True, metavar="D", help="from lens to object"
    )
    parser.add_argument(
        "--height", type=float, required=True, metavar="H", help="of the object, same unit as D"
    )
    parser.add_argument(
        "--image-height",
        type=_length,
        required=True,
        metavar="h",
        help="of its image, in pixels, or with its unit: 38px, 0.21mm",
    )
    parser.add_argument(
        "--pixel-size", type=float, metavar="UM", help="of the sensor's pixels, micrometres"
    )
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")


def _length(text: str) -> tuple[float, str]:
    match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*(px|mm)?\s*", text)
    if not match:
        raise argparse.ArgumentTypeError(f"{text!r} is no length, such as 38 (pixels) or 0.21mm")
    return float(match[1]), match[2] or "px"


def run(args: argparse.Namespace) -> int:
    facts = _facts(args)
    if args.json:
        print_json(rounded(facts))
    else:
        _print(facts)
    return 0


def _facts(args: argparse.Namespace) -> dict[str, Any]:
    image, unit = args.image_height
    given = {"--distance": args.distance, "--height": args.height, "--image-height": image}
    if args.pixel_size is not None:
        given["--pixel-size"] = args.pixel_size
    for name, value in given.items():
        if not (math.isfinite(value) and value > 0):
            raise FreelookError(f"{name} must be a number above 0, such as 38, not {value:g}")
    f = image * args.distance / args.height
    half = math.atan(args.height / args.distance / 2)
    return {
        **_focal(f, unit, args.pixel_size),
        "half_angle_deg": math.degrees(half),
        "models": [
            {
                "model": model,
                "f_found_over_true": 1 + bias(model, half),
                **_focal(f / (1 + bias(model, half)), unit, args.pixel_size),
                "good_to_1_percent_deg": good_to(model),
            }
            for model in MODELS
        ],
    }


def _focal(f: float, unit: str, pixel_size_um: float | None) -> dict[str, float | None]:
    if unit == "mm":
        return {"f_mm": f, "f_px": f * 1000 / pixel_size_um if pixel_size_um else None}
    return {"f_px": f, "f_mm": f * pixel_size_um / 1000 if pixel_size_um else None}


def bias(model: str, half_angle: float) -> float:
    """By how much of itself f comes out too large, for an object centred on the axis.

    half_angle, in radians, is that of the object as seen from the lens: r(a) / (f tan a) - 1.
    """
    from ...lens import MODELS as LENSES

    lens = LENSES[model](1.0)  # type: ignore[call-arg]
    return float(lens.radius(half_angle)) / math.tan(half_angle) - 1  # type: ignore[arg-type]


def good_to(model: str) -> float | None:
    """The largest half angle, degrees, at which f is less than 1 % wrong; None: at any."""
    if model == "perspective":
        return None
    low, high = 1e-3, math.radians(80)
    for _ in range(60):  # the bias grows with the angle
        middle = (low + high) / 2
        low, high = (middle, high) if abs(bias(model, middle)) < TOO_WRONG else (low, middle)
    return math.degrees(low)


def _print(facts: dict[str, Any]) -> None:
    print(f"f = {_said(facts)}")
    print(
        "  on the axis, r = f theta: the f of the models perspective to orthographic and "
        "kannala_brandt, and the a of polynomial"
    )
    if facts["f_px"] is None:
        print("  in pixels with --pixel-size, which a lens profile needs")
    half = facts["half_angle_deg"]
    wrong = [row for row in facts["models"] if abs(row["f_found_over_true"] - 1) >= TOO_WRONG]
    if not wrong:
        print(f"  the object is small, {half:.2f} degrees to each side: good to 1 % for any lens")
        return
    print(f"  careful: at {half:.1f} degrees to each side of the axis the models differ:")
    for row in facts["models"]:
        off = 100 * (row["f_found_over_true"] - 1)
        limit = row["good_to_1_percent_deg"]
        good = "" if limit is None else f" (1 % off at {limit:.1f} degrees)"
        print(f"    {row['model']:13} lens: {off:+.1f} %{good}, so f = {_said(row)}")


def _said(row: dict[str, Any]) -> str:
    named = (("f_px", "pixels"), ("f_mm", "mm"))
    return ", ".join(f"{row[key]:.4g} {unit}" for key, unit in named if row[key] is not None)
