"""Fit lens models to measured points, and say which of them the measurements support.

  freelook lens fit angles.csv                               all models, ranked
  freelook lens fit angles.csv --model equidistant --model kannala_brandt
  freelook lens fit angles.csv --free-offset                 where the axis was is not known
  freelook lens fit angles.csv --plot fit.png                curve, residuals, confidence band
  freelook lens fit points.csv --size 1440x1440 -o lens.json

POINTS is a CSV file with a header. Either

  angle_deg,radius_px     angles from the axis and distances in the picture, as measured by
                          turning the camera, or with marks on a wall; sigma_px may follow
  x,y,z,u,v               3-D points in the camera frame (x right, y down, z forward, any unit)
                          and the pixels where they are seen

Models are ranked by AICc (best first; below a difference of 2 they cannot be told apart), with
the rms of the residuals, of cross-validation (points predicted by a fit without them), and the
parameters with their standard deviations. Outliers hardly pull (loss soft_l1), and are named.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...errors import FitError, FreelookError
from ...lens import MODELS
from .._arguments import size
from ._fit_words import fit_facts, print_fits
from ._report import print_json

if TYPE_CHECKING:
    from ...camera import Camera
    from ...fitting import CurveFit, PointFit
    from ._points_table import Table

    Fit = CurveFit | PointFit

LOSSES = ("soft_l1", "cauchy", "linear")
STRETCHES = ("none", "aspect", "skew", "free")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("points", metavar="POINTS", help="a CSV file")
    parser.add_argument(
        "--model",
        action="append",
        choices=("all", *MODELS),
        metavar="NAME",
        help=f"again for more; all (what is done without it) or: {', '.join(MODELS)}",
    )
    parser.add_argument(
        "--free-offset",
        action="store_true",
        help="radius_px are positions on a scale whose zero is not the axis: seek the axis too",
    )
    parser.add_argument("--size", type=size, metavar="WxH", help="of the picture")
    parser.add_argument(
        "--center",
        type=_pair,
        metavar="X,Y",
        help="of the axis in the picture, for -o from angles (the middle)",
    )
    parser.add_argument(
        "--stretch",
        choices=STRETCHES,
        default="aspect",
        help="of x,y,z,u,v: none for square pixels, aspect for unequal fx and fy (aspect)",
    )
    parser.add_argument(
        "--loss", choices=LOSSES, default="soft_l1", help="linear: plain least squares (soft_l1)"
    )
    parser.add_argument("-o", "--output", metavar="FILE", help="write the best as a profile")
    parser.add_argument("--overwrite", action="store_true", help="replace FILE if it exists")
    parser.add_argument("--plot", metavar="FILE", help="draw the fit into a .png or .svg file")
    parser.add_argument("--json", action="store_true", help="print everything as JSON")


def _pair(text: str) -> tuple[float, float]:
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not X,Y, such as 719.5,721") from None
    return x, y


def run(args: argparse.Namespace) -> int:
    from ._points_table import read_table

    table = read_table(args.points)
    _check(args, table)
    plot = _checked_plot(args.plot) if args.plot else None
    fits, refused = _all_fits(args, table)
    best = _best(fits)
    facts = fit_facts(args.points, table, fits, refused, best)
    camera = _camera(args, best) if args.output else None
    if args.json:
        print_json(facts)
    else:
        print_fits(facts)
    told = sys.stderr if args.json else sys.stdout
    if camera is not None:
        _write(args, camera, best)
        print(f"written: {args.output}, {best.model}", file=told)
    if plot:
        _draw(args, [best, *(fit for fit in fits if fit is not best)], plot)
        print(f"drawn: {args.plot}", file=told)
    return 0


def _check(args: argparse.Namespace, table: Table) -> None:
    """FreelookError for options that do not go with the table, before long work."""
    if not table.is_curve and args.size is None:
        raise FreelookError(
            "pixels alone do not say how large the picture is: give --size, such as 1440x1440"
        )
    if not table.is_curve and args.free_offset:
        raise FreelookError("--free-offset is for angle_deg,radius_px; here the centre is sought")
    if not table.is_curve and args.center:
        raise FreelookError("--center is for angle_deg,radius_px; here the centre is found")
    if args.output and args.size is None:
        raise FreelookError(
            "a profile says for which picture it is: give --size, such as 1440x1440"
        )
    if args.output and not args.output.endswith(".json"):
        raise FreelookError(
            f"-o writes our own profile, NAME.json, not {args.output}; "
            "'freelook lens convert' makes any other format of it"
        )
    if args.output and Path(args.output).exists() and not args.overwrite:
        raise FreelookError(f"{args.output} exists; replace it with --overwrite")


def _checked_plot(path: str) -> Path:
    from ...plots._style import check_path

    return check_path(path)


def _all_fits(args: argparse.Namespace, table: Table) -> tuple[list[Fit], dict[str, str]]:
    """Ranked, and the models that cannot be fitted with the reasons."""
    from ...fitting import curve_models, point_models, rank
    from .._bars import bar

    known = curve_models() if table.is_curve else point_models()
    asked = args.model or ["all"]
    names = known if "all" in asked else list(dict.fromkeys(asked))
    fits: list[Fit] = []
    refused = {}
    with bar("models", len(names), "models", quiet=args.json or len(names) == 1) as advance:
        for name in names:
            try:
                found: Fit = _fit(args, table, name)
                found.cv_residuals_px  # noqa: B018 - the long part, while the bar shows it
                fits.append(found)
            except FitError as error:
                refused[name] = str(error)
            advance()
    if not fits:
        reasons = "".join(f"\n  {name}: {why}" for name, why in refused.items())
        raise FitError(f"no model fits these points:{reasons}")
    return rank(fits), refused


def _fit(args: argparse.Namespace, table: Table, name: str) -> Fit:
    from ...fitting import fit_curve, fit_points

    if table.is_curve:
        return fit_curve(
            name,
            np.radians(table.columns["angle_deg"]),
            table.columns["radius_px"],
            sigma_px=table.columns.get("sigma_px"),
            free_offset=args.free_offset,
            loss=args.loss,
        )
    return fit_points(
        name,
        table.stack("x", "y", "z"),
        table.stack("u", "v"),
        args.size,
        stretch=args.stretch,
        loss=args.loss,
    )


def _best(fits: Sequence[Fit]) -> Fit:
    """The first that is neither overfit nor forced; if all are, the first."""
    return next((fit for fit in fits if not fit.overfit and not fit.forced), fits[0])


def _camera(args: argparse.Namespace, best: Fit) -> Camera:
    """What -o writes: its field ends where the measurements do."""
    from ...camera import make_camera
    from ...fitting import CurveFit

    if not isinstance(best, CurveFit):
        return best.camera
    field_deg = float(np.degrees(2 * best.theta_max)) * (1 - 1e-9)
    return make_camera(args.size, best.lens, center=args.center, field_deg=field_deg)


def _write(args: argparse.Namespace, camera: Camera, best: Fit) -> None:
    from ...formats import Profile, format_module

    count = len(best.residuals_px)
    source = f"fitted to {count} points of {Path(args.points).name}, rms {best.rms_px:.3g} px"
    text = format_module("freelook").write(Profile(camera, Path(args.output).stem, source))
    try:
        Path(args.output).write_text(text, "utf-8")
    except OSError as error:
        raise FreelookError(f"cannot write {args.output}: {error.strerror or error}") from None


def _draw(args: argparse.Namespace, fits: Sequence[Fit], path: Path) -> None:
    from ...plots._style import save
    from ...plots.fits import fit_figure

    save(fit_figure(fits, Path(args.points).name), path)
