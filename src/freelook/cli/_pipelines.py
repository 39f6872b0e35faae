"""`freelook bench pipeline`: whole reframes of one clip, as a table or JSON."""

from __future__ import annotations

import argparse
import json
import os
import tempfile
from collections.abc import Callable
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import FreelookError
from ..formats import load_camera
from ._arguments import size
from ._cameras import LENS_HELP

if TYPE_CHECKING:
    from ..bench.pipeline import Plan, Row
    from ..bench.pipeline_clip import Clip, Simulated

SECONDS = 6.0
ABOUT = """\
Reframe a whole recording, with x264 at the same settings: freelook render, ffmpeg's v360 filter
(whose angles are changed by commands), a loop with OpenCV. Every way is a program of its own and
measured with all it does; they take turns.

  freelook bench pipeline                          a simulated flight, made first
  freelook bench pipeline flight.mp4 --lens cam.json --seconds 10
  freelook bench pipeline --preset ultrafast,veryfast --repeat 5
  freelook bench pipeline flight.mp4 --lens cam.json --script head.csv

The simulated flight has the lens that ffmpeg's filter has a formula for, and its views are known
exactly: the table then says how near every way comes (PSNR of luma). Other lenses ffmpeg can only
approximate; how far it is off is told.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = ABOUT
    parser.add_argument(
        "clip", nargs="?", metavar="CLIP", help="a video file (default: a simulated flight)"
    )
    parser.add_argument("--lens", metavar="PROFILE", help=LENS_HELP + "; needed with CLIP")
    parser.add_argument(
        "--script",
        metavar="CSV",
        help="where to look, as for freelook render --poses (default: two courses of our own, "
        "one with yaw and pitch, one with yaw alone)",
    )
    parser.add_argument(
        "--size", type=size, default=(1280, 720), metavar="WxH", help="of the view (1280x720)"
    )
    parser.add_argument("--hfov", type=float, default=90.0, metavar="DEG", help="of the view (90)")
    parser.add_argument(
        "--seconds",
        type=float,
        metavar="S",
        help=f"as much from the beginning (default: all of CLIP, {SECONDS:g} simulated)",
    )
    parser.add_argument(
        "--source-size",
        type=size,
        metavar="WxH",
        help="of the simulated pictures (1440x1440)",
    )
    parser.add_argument("--repeat", type=int, default=3, metavar="N", help="runs of each way (3)")
    parser.add_argument(
        "--preset",
        default="veryfast",
        metavar="NAMES",
        help="x264's, one or several with commas (veryfast, which freelook render uses)",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.set_defaults(bench=run)


def run(args: argparse.Namespace) -> int:
    from ..bench import pipeline
    from ._bars import bar

    _check(args)
    with tempfile.TemporaryDirectory(prefix="freelook-bench-") as name:
        folder = Path(name)
        plan = _plan(args, folder)
        notes = _notes(plan)
        with bar("reframing", plan.steps, "runs", quiet=args.json) as advance:
            rows = list(pipeline.run(plan, folder, advance))
    if args.json:
        figures = [_figures(row, rows) for row in rows]
        print(json.dumps({**_about(plan), "notes": notes, "rows": figures}, indent=2))
    else:
        _print(plan, rows, notes)
    return 0


def _check(args: argparse.Namespace) -> None:
    from ..sinks.videofile import PRESETS

    for preset in args.preset.split(","):
        if preset not in PRESETS:
            raise FreelookError(f"unknown preset '{preset}'; known: {', '.join(PRESETS)}")
    if any(side % 2 for side in args.size):
        raise FreelookError(f"--size {args.size[0]}x{args.size[1]}: both must be even, for x264")
    if args.repeat < 1:
        raise FreelookError(f"--repeat {args.repeat}: at least 1")
    if args.seconds is not None and not 0 < args.seconds < 86_400:
        raise FreelookError(f"--seconds {args.seconds:g}: above 0, and less than a day")
    if args.clip is None and args.lens is not None:
        raise FreelookError("--lens is for a CLIP of yours; the simulated flight has its own")
    if args.clip is not None and args.lens is None:
        raise FreelookError(f"which lens is {args.clip} taken with? give --lens PROFILE")
    if args.clip is not None and args.source_size is not None:
        raise FreelookError("--source-size is for the simulated flight; a CLIP has its size")


def _plan(args: argparse.Namespace, folder: Path) -> Plan:
    from ..bench import pipeline, pipeline_clip
    from ..pose_script import read_script
    from ..viewport import Viewport

    viewport = Viewport(args.size, args.hfov)
    courses: tuple[pipeline.Course, ...] = pipeline.COURSES
    if args.script is not None:
        courses = pipeline.scripted(read_script(args.script))
    target = folder / "clip.mp4"
    simulated = None
    if args.clip is None:
        simulated, lens = _simulated(args, folder)
        clip = _recorded(args, simulated, target)
        camera = simulated.camera
    else:
        camera, lens = load_camera(args.lens), args.lens
        clip = pipeline_clip.cut(args.clip, target, args.seconds)
    presets = args.preset.split(",")
    return pipeline.Plan(
        clip, lens, camera, viewport, courses, presets, args.repeat, simulated=simulated
    )


def _simulated(args: argparse.Namespace, folder: Path) -> tuple[Simulated, str]:
    from ..bench import pipeline_clip
    from ..formats import Profile
    from ..formats.freelook import write

    camera = pipeline_clip.equidistant_camera(args.source_size or (1440, 1440))
    lens = folder / "lens.json"
    lens.write_text(write(Profile(camera)), "utf-8")
    return pipeline_clip.Simulated(camera, os.cpu_count() or 1), str(lens)


def _recorded(args: argparse.Namespace, simulated: Simulated, target: Path) -> Clip:
    from ..bench.pipeline_clip import FPS
    from ._bars import bar

    frames = max(1, round((args.seconds or SECONDS) * FPS))
    with bar("simulating", frames, "frames", quiet=args.json) as advance:
        return simulated.record(target, frames, advance)


def _notes(plan: Plan) -> list[str]:
    from ..bench.pipeline_ways import FIT_DEG, approximation_px

    notes = []
    off_px = approximation_px(plan.camera)
    if off_px > 0.05:
        notes.append(
            f"ffmpeg's filter takes the lens for an equidistant one: {off_px:.1f} pixels off at "
            f"most within {FIT_DEG:.0f} degrees of the axis, so its picture is another"
        )
    notes.append("ffmpeg's filter computes its map anew for every angle that a command changes")
    notes.append(
        "frames/s: of the whole command; without start: less what a clip of one frame takes;\n"
        "CPU ms: processor time of all threads for a frame, without the start"
    )
    return notes


def _about(plan: Plan) -> dict[str, Any]:
    clip = plan.clip
    return {
        "clip": {"frames": clip.frames, "frames_per_s": clip.fps, "size": list(clip.size)},
        "view": {"size": list(plan.viewport.size), "hfov_deg": plan.viewport.hfov_deg},
        "runs": plan.repeats,
    }


def _figures(row: Row, rows: list[Row]) -> dict[str, Any]:
    """For JSON, which has no NaN."""
    figures: dict[str, Any] = {"course": row.course, "preset": row.preset, "way": row.way}
    if row.skipped:
        return {**figures, "skipped": row.skipped}
    values: dict[str, Callable[[Row], float]] = {
        "frames_per_s": lambda r: r.frames_per_s,
        "running_frames_per_s": lambda r: r.running_frames_per_s,
        "cpu_ms": lambda r: r.cpu_ms,
        "psnr_db": lambda r: r.psnr_db,
        "ours_times": lambda r: _ratio(r, rows),
    }
    for key, value in values.items():
        found = value(row)
        figures[key] = found if isfinite(found) else None
    figures["frames"] = row.frames
    return {**figures, "wall_s": row.wall_s, "cpu_s": row.cpu_s, "start_s": row.start_s}


def _ratio(row: Row, rows: list[Row]) -> float:
    """How many times this way's frames per second freelook makes; NaN if it is unknown."""
    ours = next(r for r in rows if (r.course, r.preset) == (row.course, row.preset))
    return float("nan") if ours.skipped else ours.frames_per_s / row.frames_per_s


def _print(plan: Plan, rows: list[Row], notes: list[str]) -> None:
    from rich.console import Console
    from rich.table import Table

    clip, view = plan.clip, plan.viewport
    console = Console()
    title = (
        f"{clip.frames} frames of {clip.size[0]}x{clip.size[1]} to {view.size[0]}x{view.size[1]}, "
        f"{view.hfov_deg:g} degrees; medians of {plan.repeats} runs"
    )
    for course, preset in dict.fromkeys((row.course, row.preset) for row in rows):
        table = Table(title=f"{course}; x264 {preset}\n{title}")
        table.add_column("way", no_wrap=True)
        for column in ("frames/s", "freelook is", "without start", "CPU ms", "PSNR"):
            table.add_column(column, justify="right")
        here = [row for row in rows if (row.course, row.preset) == (course, preset)]
        for row in here:
            table.add_row(*_cells(row, rows, clip.frames))
        console.print(table)
        for row in here:
            if row.skipped:
                print(f"{row.way}: skipped: {row.skipped}")
    for note in notes:
        print(note)


def _cells(row: Row, rows: list[Row], frames: int) -> list[str]:
    if row.skipped:
        return [row.way, "skipped"]
    written = "" if row.frames == frames else f"\n  wrote {row.frames} frames"
    return [
        row.way + written,
        _figure(row.frames_per_s),
        _figure(_ratio(row, rows), ".2f", " x"),
        _figure(row.running_frames_per_s),
        _figure(row.cpu_ms),
        _figure(row.psnr_db),
    ]


def _figure(value: float, form: str = ".1f", unit: str = "") -> str:
    return f"{value:{form}}{unit}" if isfinite(value) else ""
