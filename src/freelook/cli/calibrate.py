"""Calibrate a camera from pictures of a target, beyond 90 degrees too.

  freelook calibrate shots/*.jpg -o lens.json                  a chessboard, size found by itself
  freelook calibrate shots/*.jpg --board 6x8 --square 0.0325 -o lens.json --report report.html
  freelook calibrate shots/*.jpg --target charuco:10x7:0.024:0.018 -o lens.json
  freelook calibrate board.mp4 --model auto -o lens.json                    from a video
  freelook calibrate corners.vnl --board 10x10 --square 0.05 --size 1920x1080    known corners
  freelook calibrate --live /dev/video0 -o lens.json                        with a page that guides

Hold the board close, so that it fills much of the picture, in 10 to 20 places: the middle, all
around the rim, straight and tilted. Nothing has to be guessed beforehand.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CalibrationError, FreelookError
from ..lens import MODELS
from ._arguments import size
from ._calibrate_live import add_live_arguments, run_live
from ._profile_text import profile_text
from ._targets import add_target_arguments, chosen_target

if TYPE_CHECKING:
    from ..calibration.calibrate import Calibration
    from ..calibration.targets import Target
    from ._target_views import Found


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("inputs", nargs="*", metavar="INPUT", help="pictures, videos, corner files")
    parser.add_argument(
        "--model",
        default="auto",
        choices=("auto", *MODELS),
        metavar="NAME",
        help="lens model, or auto: the one that predicts unseen views best",
    )
    parser.add_argument(
        "--control",
        type=size,
        metavar="NxM",
        help="control points of --model splined_stereographic, such as 16x12, instead of as many "
        "as the corners can carry",
    )
    parser.add_argument(
        "--size", type=size, metavar="WxH", help="of the pictures, for corner files that lack it"
    )
    parser.add_argument("--skew", action="store_true", help="solve for skewed pixels too")
    parser.add_argument("--square-pixels", action="store_true", help="take pixels as square")
    parser.add_argument(
        "--keep-all", action="store_true", help="let every corner count, however far off"
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="write the lens profile here")
    parser.add_argument("--name", default="", help="for people: which camera and lens it is")
    parser.add_argument("--report", metavar="HTML", help="write a page with pictures of it all")
    parser.add_argument("--json", action="store_true", help="print all figures as JSON")
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist")
    add_target_arguments(parser)
    add_live_arguments(parser)


def run(args: argparse.Namespace) -> int:
    for path in (args.output, args.report):
        if path and Path(path).exists() and not args.overwrite:
            raise FreelookError(f"{path} exists; --overwrite replaces it")
    if args.control and args.model != "splined_stereographic":
        raise CalibrationError("--control goes with --model splined_stereographic")
    if args.control and args.live:
        raise CalibrationError("--control goes with pictures, not with --live")
    target = chosen_target(args)
    return run_live(args, target) if args.live else _run(args, target)


def _run(args: argparse.Namespace, target: Target) -> int:
    from ..calibration.calibrate import calibrate
    from ..calibration.mistakes import check_different, other_size, with_turned_told
    from ..calibration.parameters import Freedom
    from ..calibration.words import figures
    from ._target_views import find_views

    if not args.inputs:
        raise CalibrationError("give pictures, videos or corner files, or --live SOURCE")
    found = find_views(args.inputs, target, size=args.size, quiet=args.json)
    if not found.views:
        raise CalibrationError(_nothing_found(found, target))
    assert found.size is not None
    check_different(found.views, found.size)
    freedom = Freedom(aspect=not args.square_pixels, skew=args.skew)
    say = (
        (lambda _: None) if args.json else (lambda what: print(f"solving: {what}", file=sys.stderr))
    )
    calibration = calibrate(
        found.views,
        found.size,
        args.model,
        freedom,
        drop=not args.keep_all,
        control=args.control,
        progress=say,
    )
    calibration = with_turned_told(calibration, found.views)
    wrong_size = other_size(target, found.views, found.pictures)
    if args.json:
        said = {"target": target.text, "target_doubt": wrong_size, "blurred": found.blurred}
        print(json.dumps(figures(calibration, found.without) | said, indent=2))
    else:
        _print(calibration, found)
        if wrong_size:
            print(wrong_size)
    if args.output:
        _write(args, calibration)
    if args.report:
        from ..report.calibration import calibration_page

        title = f"Calibration of {args.name}" if args.name else "Lens calibration"
        page = calibration_page(calibration, found.pictures, title)
        Path(args.report).write_text(page, "utf-8")
    return 0


def _nothing_found(found: Found, target: Target) -> str:
    from ..calibration.mistakes import why_not_by_markers

    shown = ", ".join(found.without[:5]) + (" ..." if len(found.without) > 5 else "")
    why = "is it wholly or mostly in the picture, sharp, flat, evenly lit, with a light margin?"
    if found.blurred:  # and without, as all of them are
        why = f"{len(found.blurred)} of them are blurred: focus, hold the board still, more light"
    elif target.named:
        why = why_not_by_markers(target, found.missed) or why
    return (
        f"the target ({target.text}) was found in none of {len(found.without)} inputs ({shown}); "
        f"{why}"
    )


def _print(calibration: Calibration, found: Found) -> None:
    from rich.console import Console
    from rich.table import Table

    from ..calibration.bundle import rms
    from ..calibration.words import sentences

    for name in found.without:
        blurred = "; the picture is blurred" if name in found.blurred else ""
        print(f"{name}: target not found{blurred}", file=sys.stderr)
    for name in sorted({*found.blurred} - {*found.without}):
        print(f"{name} is blurred; its corners may be off: better leave it out", file=sys.stderr)
    console = Console()
    solution = calibration.solution
    views = Table(title="views")
    for column in ("picture", "points", "dropped", "RMS px"):
        views.add_column(column, justify="left" if column == "picture" else "right")
    rows = zip(calibration.views, solution.residuals, solution.inliers, strict=True)
    for view, residuals, ok in rows:
        views.add_row(view.name, str(len(ok)), str(int((~ok).sum())), f"{rms(residuals[ok]):.3f}")
    console.print(views)
    if len(calibration.candidates) > 1:
        console.print(_models(calibration))
    values = Table(title="result")
    for column in ("parameter", "value", "standard deviation"):
        values.add_column(column, justify="left" if column == "parameter" else "right")
    sigma = np.sqrt(np.diag(solution.covariance))
    from ..calibration.parameters import Parameters

    found_values = Parameters(solution.camera, calibration.freedom).values
    if not calibration.control:  # hundreds of them, and they say nothing by themselves
        for name, value, spread in zip(solution.names, found_values, sigma, strict=True):
            values.add_row(name, f"{value:.6g}", f"{spread:.2g}")
        console.print(values)
    for line in sentences(calibration):
        print(line)


def _models(calibration: Calibration):  # type: ignore[no-untyped-def]
    from rich.table import Table

    table = Table(title="models")
    for column in ("model", "RMS px", "on views left out, px", ""):
        table.add_column(column, justify="left" if column in ("model", "") else "right")
    for candidate in calibration.candidates:
        if candidate.solution is None:
            table.add_row(candidate.model, "", "", candidate.why_not)
            continue
        chosen = "chosen" if candidate.model == calibration.model else candidate.remark
        predicted = candidate.cross_validated_px
        figures = f"{candidate.rms_px:.3f}", f"{predicted:.3f}" if np.isfinite(predicted) else ""
        table.add_row(candidate.model, *figures, chosen)
    return table


def _write(args: argparse.Namespace, calibration: Calibration) -> None:
    Path(args.output).write_text(profile_text(args.name, calibration), "utf-8")
    if not args.json:
        print(f"written: {args.output}")
