"""Refine a lens without a board: straight things must follow great circles. Less certain.

  freelook calibrate lines hall.jpg --fov 160 -o lens.json             from the image circle
  freelook calibrate lines flight.mp4 --lens start.json -o lens.json   from a profile
  freelook calibrate lines hall.jpg --lens start.json --lines clicked.csv -o lens.json

Long straight edges are found in the pictures, or told: a CSV with the columns name (of the
picture), line, x, y, one row for each clicked point, 5 or more points on a line. A column `along`
helps much: lines of one picture with the same word there are parallel in the world, those with
different words are at right angles (a room's edges: x, y, z).

Straightness alone leaves a scale open: a board is better wherever there is one. What was assumed
instead is printed and written into the profile.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FreelookError
from ._cameras import LENS_HELP, add_format_arguments, lens_profile

if TYPE_CHECKING:
    from ..calibration.lines import Line, LineFit
    from ..camera import Camera
    from ..types import Frame

GRADE = "from lines: less certain than a board"
SURE = 3.0  # standard deviations beyond which two fields contradict each other
SHARES = (0.25, 0.5, 0.75, 1.0)  # of half the field, where the uncertainty is told


@dataclass(frozen=True)
class Start:
    """The camera to begin with, and how far its image circle may be off."""

    camera: Camera
    what: str
    radius_error_px: float | None = None
    center_error_px: float = 0.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("inputs", nargs="*", metavar="PICTURE_OR_VIDEO", help="of one camera")
    begin = parser.add_mutually_exclusive_group(required=True)
    begin.add_argument("--lens", metavar="PROFILE", help=f"start from this {LENS_HELP}")
    begin.add_argument(
        "--fov",
        type=float,
        metavar="DEG",
        help="start from the image circle: the field of view across it",
    )
    add_format_arguments(parser)
    parser.add_argument(
        "--fov-error",
        type=float,
        default=1.0,
        metavar="DEG",
        help="how far off the field may be, as a standard deviation (default: 1)",
    )
    parser.add_argument("--lines", metavar="CSV", help="clicked points: name,line,x,y[,along]")
    parser.add_argument(
        "--find", action="store_true", help="with --lines: look for more in the pictures too"
    )
    parser.add_argument(
        "--terms",
        type=int,
        choices=(1, 2, 3, 4),
        default=4,
        help="how many of the terms k1 to k4 are sought (default: 4)",
    )
    parser.add_argument("--draw", metavar="PICTURE", help="draw the lines into the first picture")
    parser.add_argument("-o", "--output", metavar="FILE", help="write the lens profile here")
    parser.add_argument("--name", default="", help="for people: which lens it is")
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist")
    parser.add_argument("--json", action="store_true", help="print all figures as JSON")


def run(args: argparse.Namespace) -> int:
    from ..calibration.segments import refine_with_segments
    from ._bars import bar
    from ._circles import luma_of
    from ._line_inputs import differing, read_lines, read_pictures

    _check(args)
    told = read_lines(args.lines) if args.lines else []
    pictures = read_pictures(args.inputs)
    start = _start(args, pictures)
    lumas = [(name, luma_of(frame.picture)) for name, frame in pictures]
    searched = differing(lumas) if args.find or not args.lines else []
    if told:
        told = _with_pictures(told, pictures)
    with bar("looking for straight edges", len(searched), "pictures", quiet=args.json) as advance:
        fit = refine_with_segments(
            start.camera,
            searched,
            told,
            terms=args.terms,
            field_error_deg=args.fov_error,
            radius_error_px=start.radius_error_px,
            center_error_px=start.center_error_px,
            progress=advance,
        )
    if args.json:
        print(json.dumps(_figures(fit, start, args), indent=2))
    else:
        print("\n".join(sentences(fit, start, args.fov_error)))
    if args.draw:
        _draw(args.draw, pictures[0], fit)
    if args.output:
        _write(args, fit, start)
    return 0


def _check(args: argparse.Namespace) -> None:
    from ..sinks import check_output_file

    if not args.inputs and not args.lines:
        raise FreelookError("give pictures or a video with straight things in it, or --lines CSV")
    if not args.inputs and (args.fov is not None or args.draw or args.find):
        raise FreelookError("--fov, --find and --draw need a picture or a video: name one")
    if not 0 <= args.fov_error <= 90:
        raise FreelookError(f"--fov-error must be 0 to 90 degrees, not {args.fov_error:g}")
    for path in filter(None, (args.output, args.draw)):
        check_output_file(path, overwrite=args.overwrite)


def _start(args: argparse.Namespace, pictures: list[tuple[str, Frame]]) -> Start:
    from ..calibration.circle import Brightness, camera_from_circle, find_circle
    from ._circles import luma_of

    if args.lens:
        profile = lens_profile(args, args.lens)
        return Start(profile.camera, f"the edge of {profile.name or args.lens}")
    brightness = Brightness()
    for _, frame in pictures:
        brightness.add(luma_of(frame.picture))
    circle = find_circle(brightness)
    camera = camera_from_circle(circle, args.fov)
    errors = circle.radius_error_px, circle.center_error_px
    return Start(camera, "the image circle", *errors)


def _with_pictures(lines: list[Line], pictures: list[tuple[str, Frame]]) -> list[Line]:
    """Checks that clicked pictures are among those given, if any are."""
    known = {name.split(" #")[0] for name, _ in pictures}
    for line in lines:
        if known and line.picture and Path(line.picture).name not in known:
            raise FreelookError(
                f"points on a line in {line.picture}, which is none of: {', '.join(sorted(known))}"
            )
    return lines


def sentences(fit: LineFit, start: Start, field_error_deg: float) -> list[str]:
    """The result in words: what was found, what was assumed, what contradicts it."""
    camera = fit.camera
    pictures = len({line.picture for line in fit.lines})
    angles, sigma = _sigma(fit)
    shown = ", ".join(f"{s:.1f} px at {a:.0f}" for a, s in zip(angles, sigma, strict=True))
    kept = [line for line, k in zip(fit.lines, fit.kept, strict=True) if k]
    found = [
        GRADE,
        f"{len(kept)} of {len(fit.lines)} lines in {pictures} "
        f"picture{'s' if pictures > 1 else ''} are straight: RMS distance of their points from "
        f"great circles {fit.rms_px:.2f} px, before {fit.rms_before_px:.2f} px",
        f"assumed: {np.degrees(2 * fit.start.theta_max):.4g} ± {field_error_deg:g} degrees across "
        f"{start.what}, pixels' aspect {camera.stretch[1, 1]:.4g}, a lens much like the one at "
        "the start",
        f"found: {np.degrees(2 * camera.theta_max):.1f} degrees across, centre "
        f"{camera.center[0]:.1f}, {camera.center[1]:.1f}",
        f"radius uncertain (standard deviation) by {shown} degrees from the axis; the scale that "
        f"straightness leaves open by {100 * fit.scale_sigma:.0f} %",
    ]
    if not any(line.along for line in kept):
        found.append(
            "surer: a board (freelook calibrate); or lines known to be parallel and at right "
            "angles (--lines, column along)"
        )
    if field_doubtful(fit, field_error_deg):
        found.append(
            f"the field that was told contradicts the lines: they put the edge at "
            f"{fit.rim_deg:.0f} ± {fit.rim_sigma_deg:.0f} degrees across; check it"
        )
    return found


def field_doubtful(fit: LineFit, field_error_deg: float) -> bool:
    """Whether the lines alone say another field than was told, by more than chance."""
    told_deg = np.degrees(2 * fit.start.theta_max)
    sigma = np.hypot(fit.rim_sigma_deg, field_error_deg)
    return bool(abs(fit.rim_deg - told_deg) > SURE * sigma)


def _sigma(fit: LineFit) -> tuple[list[float], list[float]]:
    theta = np.array(SHARES) * fit.camera.theta_max
    return np.degrees(theta).tolist(), fit.radius_sigma_px(theta).tolist()


def _figures(fit: LineFit, start: Start, args: argparse.Namespace) -> dict[str, Any]:
    from ..lens import model_name, parameters

    angles, sigma = _sigma(fit)
    return {
        "grade": GRADE,
        "model": model_name(fit.camera.lens),
        "size": list(fit.camera.size),
        "parameters": parameters(fit.camera.lens),
        "center": list(fit.camera.center),
        "stretch": fit.camera.stretch.tolist(),
        "field_deg": float(np.degrees(2 * fit.camera.theta_max)),
        "assumed": {
            "field_deg": float(np.degrees(2 * fit.start.theta_max)),
            "field_error_deg": args.fov_error,
            "field_at": start.what,
        },
        "field_by_lines_deg": _known(fit.rim_deg),
        "field_by_lines_sigma_deg": _known(fit.rim_sigma_deg),
        "field_contradicts_lines": field_doubtful(fit, args.fov_error),
        "lines": len(fit.lines),
        "lines_kept": int(fit.kept.sum()),
        "lines_dropped": [
            line.name for line, kept in zip(fit.lines, fit.kept, strict=True) if not kept
        ],
        "rms_before_px": fit.rms_before_px,
        "rms_after_px": fit.rms_px,
        "scale_sigma": fit.scale_sigma,
        "radius_sigma_px": [
            {"angle_deg": a, "sigma_px": s} for a, s in zip(angles, sigma, strict=True)
        ],
    }


def _known(value: float) -> float | None:
    """None for NaN: JSON has none."""
    return value if np.isfinite(value) else None


def _draw(name: str, picture: tuple[str, Frame], fit: LineFit) -> None:
    """Kept lines green, dropped ones red, great circles amber."""
    import cv2

    from ..calibration.lines import great_circles
    from ..sinks.picture import rgb24

    canvas = np.ascontiguousarray(rgb24(picture[1].picture)[..., ::-1] // 2)
    several = len({line.picture for line in fit.lines}) > 1
    for line, kept, circle in zip(
        fit.lines, fit.kept, great_circles(fit.camera, fit.lines), strict=True
    ):
        if several and Path(line.picture).name != picture[0]:
            continue
        for pixels, color, width in (
            (line.pixels, (90, 220, 80) if kept else (80, 80, 235), 3),
            (circle, (60, 200, 255), 1),
        ):
            points = np.rint(pixels * 16).astype(np.int32)
            cv2.polylines(canvas, [points], False, color, width, cv2.LINE_AA, 4)
    try:
        done, data = cv2.imencode(Path(name).suffix or ".", canvas)
    except cv2.error:
        done = False
    if not done:
        raise FreelookError(f"{name}: not the name of a picture that can be written; try .png")
    Path(name).write_bytes(data.tobytes())


def _write(args: argparse.Namespace, fit: LineFit, start: Start) -> None:
    from ..formats import Profile, format_module

    source = (
        f"{GRADE}: {int(fit.kept.sum())} straight lines, {fit.rms_px:.2f} px RMS from great "
        f"circles, assuming {np.degrees(2 * fit.start.theta_max):.4g} ± {args.fov_error:g} degrees "
        f"across {start.what}"
    )
    text = format_module("freelook").write(Profile(fit.camera, args.name, source))
    try:
        Path(args.output).write_text(text, "utf-8")
    except OSError as error:
        raise FreelookError(f"{args.output}: {error.strerror}") from None
    print(f"written: {args.output}", file=sys.stderr if args.json else sys.stdout)
