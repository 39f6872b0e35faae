"""Convert a profile to another format, to another lens model, or both; always says what it costs.

  freelook lens convert chain.yaml#cam1 cam.json             any format to our own
  freelook lens convert cam.json cameras.txt                 the name says COLMAP
  freelook lens convert cam.json cam.yml --to opencv         or say it
  freelook lens convert cam.json ds.yaml --to kalibr --model double_sphere
  freelook lens convert cam.json cam.yaml --to ros --field 120

A lens model that the new format can hold is kept, number for number. Otherwise the nearest lens
is found among the models that it has: rays are taken evenly over the picture, lens, centre and
stretch are fitted to where they land, and what remains is printed in pixels and degrees. A lens
that is off by more than the limit anywhere on the picture, or does not see all of it, is not
written: take another model or format, less of the field, or --force.

The limit is half a pixel in 1000 of the longer side: calibrations are seldom better than 0.3
pixels, and a straight edge bent by half a pixel still looks straight.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import FreelookError
from ...formats import FORMATS, Profile, load_profile
from ...lens import MODELS, model_name
from .._arguments import size
from .._cameras import LENS_HELP
from ._report import digits, print_json, rounded

if TYPE_CHECKING:
    from ...fitting.refit import Refit
    from ._conversion import Converted


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("input", metavar="IN", help=LENS_HELP)
    parser.add_argument("output", metavar="OUT", help="the file to write")
    formats = f"one of: {', '.join(FORMATS)}"
    parser.add_argument(
        "--to",
        choices=FORMATS,
        metavar="FORMAT",
        help=f"of OUT, where its name does not say it; {formats}",
    )
    parser.add_argument(
        "--from",
        dest="source",
        choices=FORMATS,
        metavar="FORMAT",
        help="of IN, if it is not recognised rightly",
    )
    parser.add_argument(
        "--lens-size",
        type=size,
        metavar="WxH",
        help="picture size, where IN does not say it itself",
    )
    parser.add_argument(
        "--model", choices=MODELS, metavar="MODEL", help=f"lens model: {', '.join(MODELS)}"
    )
    parser.add_argument(
        "--field", type=float, metavar="DEG", help="keep only so much of the field of view"
    )
    parser.add_argument(
        "--limit", type=float, metavar="PX", help="what may differ (0.5 in 1000 pixels)"
    )
    parser.add_argument("--force", action="store_true", help="write a lens beyond the limit too")
    parser.add_argument("--overwrite", action="store_true", help="replace OUT if it exists")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")


def run(args: argparse.Namespace) -> int:
    from .._bars import bar
    from ._conversion import convert, target_format

    out = Path(args.output)
    if out.exists() and not args.overwrite:
        raise FreelookError(f"{out} exists; replace it with --overwrite")
    if args.limit is not None and not args.limit >= 0:
        raise FreelookError(f"--limit is a distance in pixels, not {args.limit}")
    target = args.to or target_format(out)
    profile = load_profile(args.input, format=args.source, size=args.lens_size)

    def around(count: int) -> AbstractContextManager[Callable[[], None]]:
        return bar("nearest lens", count, "models", quiet=args.json or count == 1)

    found = convert(
        profile, target, model=args.model, field_deg=args.field, limit=args.limit, around=around
    )
    report = _facts(args, profile, target, found)
    if not (found.fit.holds or args.force):
        if args.json:
            print_json(report | {"written": False})
        else:
            _print(report)
        raise FreelookError(_refusal(report))
    report |= _written(out, target, found)
    if args.json:
        print_json(report)
    else:
        _print(report)
    return 0


def _facts(
    args: argparse.Namespace, profile: Profile, target: str, found: Converted
) -> dict[str, Any]:
    fit = found.fit
    return {
        "in": args.input,
        "out": args.output,
        "size": list(profile.camera.size),
        "model": model_name(profile.camera.lens),
        "format": target,
        "new_model": model_name(found.profile.camera.lens),
        "exact": found.exact,
        **rounded(_numbers(fit)),
        "holds_for_deg": rounded(fit.field_deg),
        "field_deg": rounded(float(np.degrees(2 * profile.camera.theta_max))),
        "asked_for_deg": args.field,
        "seen": rounded(fit.seen),
        "limit_px": rounded(fit.limit_px),
        "tried": {
            name: said if isinstance(said, str) else rounded(_numbers(said))
            for name, said in found.tried.items()
        },
        "notes": list(profile.notes),
    }


def _numbers(fit: Refit) -> dict[str, float]:
    names = "rms_px", "max_px", "rms_deg", "max_deg"
    return {name: float(getattr(fit, name)) for name in names}


def _written(out: Path, target: str, found: Converted) -> dict[str, Any]:
    """Write the file, read it back as any other, and see that it is the same lens."""
    from ...fitting.refit import measure
    from ._conversion import READ_BACK_PX, lost, read_back, same_field

    camera = found.profile.camera
    read_back(found.text, target, found.profile)  # before anything is replaced
    try:
        out.write_text(found.text, "utf-8")
    except OSError as error:
        raise FreelookError(f"cannot write {out}: {error.strerror or error}") from None
    read = load_profile(out, format=target, size=camera.size)
    off_px = measure(camera, same_field(read.camera, camera), READ_BACK_PX).max_px
    if off_px > READ_BACK_PX:
        raise FreelookError(
            f"{out} is read back as a lens that is off by {off_px:.3g} pixels; do not use it"
        )
    return {
        "written": True,
        "read_back_px": rounded(off_px),
        "lost": lost(found.profile, found.text, read, target),
    }


def _print(report: dict[str, Any]) -> None:
    width, height = report["size"]
    print(f"{report['in']}: {report['model']}, {width} x {height}")
    for note in report["notes"]:
        print(f"  note: {note}")
    how = "the same lens" if report["exact"] else "the nearest lens"
    print(f"{report['out']}: {report['format']}, {report['new_model']}, {how}")
    for name, said in report["tried"].items():
        if name != report["new_model"]:
            off = said if isinstance(said, str) else f"off by up to {digits(said['max_px'])} px"
            print(f"  not {name}: {off}")
    print(
        f"  differs by rms {_px(report['rms_px'])} and at most {_px(report['max_px'])} pixels, "
        f"rms {_px(report['rms_deg'])} and at most {_px(report['max_deg'])} degrees"
    )
    field = report["asked_for_deg"] or report["field_deg"]
    print(
        f"  within {digits(report['limit_px'])} px for {report['holds_for_deg']:.2f} of "
        f"{field:.2f} degrees" + ("" if report["seen"] >= 0.999 else f"; {_unseen(report)}")
    )
    if "read_back_px" in report:
        print(f"  read back: the same to {_px(max(report['read_back_px'], 1e-9))} pixels")
        for line in report["lost"]:
            print(f"  {line}")


def _px(value: float) -> str:
    """Three digits; differences that are rounding are 0."""
    return "0" if value < 1e-9 else f"{value:.3g}"


def _unseen(report: dict[str, Any]) -> str:
    return f"does not see {100 * (1 - report['seen']):.1f} % of the image"


def _refusal(report: dict[str, Any]) -> str:
    off = f"is off by up to {digits(report['max_px'])} pixels (limit {digits(report['limit_px'])})"
    if report["seen"] < 0.999:
        off += f" and {_unseen(report)}"
    less = report["holds_for_deg"]
    narrower = f"keep less of the field (--field {0.95 * less:.0f}), " if less > 20 else ""
    return (
        f"{report['out']} is not written: the nearest {report['new_model']} lens {off}; take "
        f"another --model or format, {narrower}or write it all the same with --force"
    )
