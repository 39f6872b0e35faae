"""`freelook calibrate --live SOURCE`: a page that watches the camera and takes views by itself."""

from __future__ import annotations

import argparse
import asyncio
import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import CalibrationError, FreelookError
from ._profile_text import profile_text
from ._progress import StatusLine
from .fly import add_serving_arguments, announce, never, opened_door, source_kinds

if TYPE_CHECKING:  # the web libraries are slow to load, and may be missing
    from ..calibration.targets import Target
    from ..web.calibration_plan import Result, Saved
    from ..web.calibration_station import CalibrationStation


def add_live_arguments(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("live")
    group.add_argument(
        "--live",
        metavar="SOURCE",
        help="open a page that shows the camera, says where to hold the board and takes views by "
        f"itself; a device, an address or KIND:ARGUMENT (kinds: {', '.join(source_kinds())})",
    )
    add_serving_arguments(group)


def run_live(args: argparse.Namespace, target: Target) -> int:
    """Serve the page until Ctrl-C."""
    from ..calibration.parameters import Freedom
    from ..ingest import Ingest
    from ..sources import open_source
    from ..web.calibration_plan import Plan
    from ..web.calibration_server import make_calibration_app
    from ..web.calibration_station import CalibrationStation
    from ..web.serving import serve

    _check(args)
    plan = Plan(
        args.live,
        target,
        lambda result: save(args, result),
        args.model,
        Freedom(aspect=not args.square_pixels, skew=args.skew),
        keep_pictures=bool(args.report),
    )
    station = CalibrationStation(Ingest(lambda: open_source(args.live)), plan)
    with contextlib.ExitStack() as opened, StatusLine() as line:
        door = opened.enter_context(opened_door(args))
        serving = serve(
            make_calibration_app(station, door.guard),
            door,
            ready=lambda: announce(door, not args.no_browser, webrtc=False),
            report=lambda: line.show(summary(station)),
            until=never,
        )
        asyncio.run(serving)
        line.show(summary(station))  # what came since the last report
    return 0


def _check(args: argparse.Namespace) -> None:
    """What would be found out only after the work is done."""
    if args.inputs:
        raise CalibrationError(
            f"--live takes its views from the camera: leave out {args.inputs[0]}, or --live"
        )
    if args.json:
        raise CalibrationError("--json goes with pictures; the live page shows its figures itself")
    for path in filter(None, (args.output, args.report)):
        if not Path(path).resolve().parent.is_dir():
            raise FreelookError(f"{path}: there is no folder to write it to")


def save(args: argparse.Namespace, result: Result) -> Saved:
    """Write the profile and the report, as far as they were asked for."""
    from ..web.calibration_plan import Saved

    profile = profile_text(args.name, result.calibration)
    if not args.output:
        return Saved(profile, "not saved here: no -o FILE was given", False)
    try:
        Path(args.output).write_text(profile, "utf-8")
        where = f"saved as {Path(args.output).resolve()}"
        if args.report:
            Path(args.report).write_text(_report(args.name, result), "utf-8")
            where += f", report: {Path(args.report).resolve()}"
    except OSError as error:
        return Saved(profile, f"not saved: {error.filename}: {error.strerror}", False)
    return Saved(profile, where, True)


def _report(name: str, result: Result) -> str:
    from ..report.calibration import calibration_page

    title = f"Calibration of {name}" if name else "Lens calibration"
    return calibration_page(result.calibration, result.pictures, title)


def summary(station: CalibrationStation) -> str:
    """The station's state in one line."""
    status = station.status()
    source, result = status["source"], station.result
    size = source["size"]
    parts = [" ".join(filter(None, (source["state"], size and f"{size[0]}x{size[1]}")))]
    parts.append(source["message"] or status["message"])
    parts.append(f"{status['views']} view{'' if status['views'] == 1 else 's'}")
    if status["phase"] == "finishing":
        parts.append(f"solving: {status['solving']}")
    if result is not None:
        parts.append(f"RMS {result['rms_px']:.3f} px; {result['model']}; {result['where']}")
    return "; ".join(filter(None, parts))
