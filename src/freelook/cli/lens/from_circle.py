"""A lens profile from the edge of the image circle: no board needed.

  freelook lens from-circle flight.mp4 --fov 188                    writes flight.lens.json
  freelook lens from-circle shots/*.jpg --fov 180 -o lens.json      several pictures of one camera
  freelook lens from-circle rtsp://camera/stream --fov 220 --model equisolid -o lens.json

A fisheye lens makes a round image. Where it ends in the picture is found: its centre is nearly
the optical axis, and its radius is where the field of view ends, which the lens's data sheet says
(--fov; not the "diagonal" one of a picture without black corners). The model is how the lens
spreads angles in between; few data sheets say, and equidistant is the usual aim.

Beside the profile a picture is written that shows what was found. Look at it: the line must run
along the edge of the image. A moving camera in daylight is best; one picture may do.
"""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import FreelookError
from ._report import print_json, rounded

if TYPE_CHECKING:
    from ...calibration.circle import ImageCircle
    from ...camera import Camera
    from .._circles import Looked

MODELS = ("equidistant", "equisolid", "stereographic", "orthographic", "perspective")
NO_FOV = (
    "how many degrees does the lens see across its image circle? The picture cannot tell; the "
    "lens's data sheet does: --fov DEG. Usual: 180 (if you do not know), 185 to 190 (fisheyes for "
    "security cameras and FPV), 220 to 250 (panorama lenses). 1 % wrong is 1 % wrong in every angle"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "inputs",
        nargs="+",
        metavar="VIDEO_OR_PICTURE",
        help="a recording, a live source, or pictures of one camera",
    )
    parser.add_argument(
        "--fov", type=float, metavar="DEG", help="field of view across the image circle"
    )
    parser.add_argument(
        "--model", default="equidistant", choices=MODELS, help="how the lens spreads angles"
    )
    parser.add_argument(
        "-o", "--output", metavar="FILE", help="the profile (default: INPUT.lens.json, here)"
    )
    parser.add_argument(
        "--draw", metavar="PICTURE", help="what was found (default: beside the profile, .png)"
    )
    parser.add_argument(
        "--frames",
        type=int,
        default=24,
        metavar="N",
        help="how many pictures of a recording or live source to look at (default: 24)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist")
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")


def run(args: argparse.Namespace) -> int:
    from ...calibration.circle import camera_from_circle, find_circle, unit_radius
    from ...media.pictures import is_picture
    from ...sinks import check_output_file
    from .._circles import look_at
    from ._circle_drawing import drawing, write_drawing

    if args.fov is None:
        raise FreelookError(NO_FOV)
    unit_radius(args.model, args.fov)  # says what is wrong before the work begins
    if args.frames < 1:
        raise FreelookError(f"--frames must be 1 or more, not {args.frames}")
    out = Path(args.output or f"{Path(args.inputs[0]).stem}.lens.json")
    drawn = Path(args.draw) if args.draw else out.with_suffix(".png")
    if not is_picture(str(drawn)):
        raise FreelookError(f"{drawn}: not the name of a picture that can be written; try .png")
    for path in (out, drawn):
        check_output_file(str(path), overwrite=args.overwrite)
    looked = look_at(args.inputs, args.frames, quiet=args.json)
    circle = find_circle(looked.brightness)
    camera = camera_from_circle(circle, args.fov, args.model)
    _write_profile(out, looked, circle, camera, args)
    write_drawing(drawn, drawing(looked.brightest, circle, camera))
    facts = _facts(looked, circle, camera, args) | {"profile": str(out), "drawing": str(drawn)}
    if args.json:
        print_json(rounded(facts))
    else:
        _print(facts)
    return 0


def _write_profile(
    out: Path, looked: Looked, circle: ImageCircle, camera: Camera, args: argparse.Namespace
) -> None:
    from ...formats import Profile
    from ...formats.freelook import write
    from .._circles import in_words

    profile = Profile(
        camera,
        f"From the image circle of {looked.what}",
        f"freelook lens from-circle: {in_words(looked, circle)}. That the lens is {args.model} "
        f"and sees {args.fov:g} degrees across the circle was said, not measured.",
    )
    try:
        out.write_text(write(profile), "utf-8")
    except OSError as error:
        raise FreelookError(f"{out}: {error.strerror}") from None


def _facts(
    looked: Looked, circle: ImageCircle, camera: Camera, args: argparse.Namespace
) -> dict[str, Any]:
    from ...lens import radius_slope

    slopes = radius_slope(camera.lens, np.array([0.0, 0.9999 * camera.theta_max]))
    return {
        "input": looked.what,
        "pictures": looked.count,
        "size": list(circle.size),
        "center": list(circle.center),
        "center_error_px": circle.center_error_px,
        "radius_px": circle.radius_px,
        "radius_error_px": circle.radius_error_px,
        "aspect": circle.aspect,
        "rim_px": circle.rim_px,
        "rival": circle.rival and list(circle.rival),
        "seen_deg": circle.seen_deg,
        "found_deg": circle.found_deg,
        "model": args.model,
        "fov_deg": args.fov,
        "pixels_per_degree": [float(slope * np.radians(1)) for slope in slopes],
    }


def _print(facts: dict[str, Any]) -> None:
    (x, y), (width, height) = facts["center"], facts["size"]
    many = "" if facts["pictures"] == 1 else "s"
    print(f"{facts['input']}: {facts['pictures']} picture{many}, {width} x {height}")
    print(f"  centre  {x:.1f}, {y:.1f}  ± {facts['center_error_px']:.1f} px")
    print(f"  radius  {facts['radius_px']:.1f}  ± {facts['radius_error_px']:.1f} px")
    if facts["aspect"] != 1:
        print(
            f"  the circle is an ellipse, {facts['aspect']:.4f} times as high as wide: taken for "
            "pixels that are not square"
        )
    print(
        f"  rim     {facts['seen_deg']:.0f} of 360 degrees are in the picture, edges along "
        f"{facts['found_deg']:.0f}; {facts['rim_px']:.0f} px soft"
    )
    if facts["rival"]:
        x, y, radius = facts["rival"]
        print(
            f"  or else centre {x:.1f}, {y:.1f}, radius {radius:.1f}: that fits nearly as well; "
            "decide by the drawing, or give more pictures"
        )
    axis, rim = facts["pixels_per_degree"]
    scale = f"{axis:.2f}" if abs(axis - rim) < 0.005 else f"{axis:.2f} (at the rim {rim:.2f})"
    print(f"  lens    {facts['model']}, {facts['fov_deg']:g} degrees: {scale} pixels per degree")
    print(f"wrote {facts['profile']}, and what was found: {facts['drawing']}")
    print(f"use it: freelook fly SOURCE --lens {shlex.quote(facts['profile'])}")
