"""Measure this machine: the cost of a view, head to picture, calibration beside others.

Everything is measured side by side in one run with what you might use instead; what is not
installed is named as skipped.

  freelook bench render                  the two standard cases on all cores
  freelook bench render --threads 1      on one core
  freelook bench pipeline                whole reframes, beside ffmpeg and OpenCV
  freelook bench latency                 needs a browser; takes about a minute
  freelook bench streams                 what ffmpeg, GStreamer, VLC and Chromium receive
  freelook bench soak --minutes 10       memory, with receivers that stall and vanish
  freelook bench calibrate --data FOLDER beside OpenCV and mrcal; mrcal takes minutes
  freelook bench calibrate --trials 200  random lenses instead: does it ever fail?
  freelook bench predict FILE ...        where heads are predicted to look, on recorded motion
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING, Any

from ..errors import FreelookError
from . import _calibrations, _pipelines, _predictions, _stream_benches

if TYPE_CHECKING:
    from ..bench.figures import Figure
    from ..bench.render import Timing


def add_arguments(parser: argparse.ArgumentParser) -> None:
    what = parser.add_subparsers(dest="what", metavar="WHAT", required=True)
    render = what.add_parser("render", help="what a moving view costs, beside OpenCV and ffmpeg")
    render.add_argument("--rounds", type=int, default=100, metavar="N", help="views per way")
    render.add_argument(
        "--threads", type=int, default=os.cpu_count() or 1, metavar="N", help="cores to use"
    )
    render.add_argument("--large", action="store_true", help="a 4K view out of an 8K picture too")
    render.add_argument("--json", action="store_true", help="print the figures as JSON")
    render.set_defaults(bench=_render)
    pipeline = what.add_parser("pipeline", help="whole recordings, beside ffmpeg and OpenCV")
    _pipelines.add_arguments(pipeline)
    latency = what.add_parser("latency", help="stamp to picture, head to changed picture")
    latency.add_argument("--seconds", type=float, default=10.0, metavar="S", help="for each part")
    latency.add_argument("--json", action="store_true", help="print the figures as JSON")
    latency.set_defaults(bench=_latency)
    streams = what.add_parser("streams", help="what other programs receive, how soon, how late")
    _stream_benches.add_streams_arguments(streams)
    soak = what.add_parser("soak", help="a flight's memory, with receivers that stall and vanish")
    _stream_benches.add_soak_arguments(soak)
    calibrate = what.add_parser("calibrate", help="lenses from corners, beside OpenCV and mrcal")
    calibrate.add_argument(
        "--data", metavar="FOLDER", help="with the real sets fish_1 and ov_plane, if you have them"
    )
    calibrate.add_argument(
        "--quick",
        action="store_true",
        help="without cross-validation: five solutions less",
    )
    calibrate.add_argument(
        "--trials",
        type=int,
        metavar="N",
        help="instead: N random lenses of every round model, each measured by what is stated "
        "about its uncertainty; about a second for each",
    )
    calibrate.add_argument("--json", action="store_true", help="print the figures as JSON")
    calibrate.set_defaults(bench=_calibrate)
    predict = what.add_parser("predict", help="how far predictions of recorded heads are off")
    _predictions.add_arguments(predict)


def run(args: argparse.Namespace) -> int:
    return int(args.bench(args))


def _render(args: argparse.Namespace) -> int:
    from rich.console import Console

    from ..bench.render import CASES, LARGE, run, turns
    from ._bars import bar

    figures = {}
    for case in (*CASES, LARGE) if args.large else CASES:
        with bar(case.name, turns(args.rounds) + 1, "turns", quiet=args.json) as advance:
            timings = run(case, args.rounds, args.threads, advance)
        if not args.json:
            Console().print(_table(case.name, args.threads, timings))
        figures[case.name] = [_figures(timing, timings[0]) for timing in timings]
    if args.json:
        print(json.dumps({"threads": args.threads, "cases": figures}, indent=2))
    return 0


def _table(title: str, threads: int, timings: list[Timing]) -> Any:
    from rich.table import Table

    table = Table(title=f"{title}, {threads} thread{'s' if threads > 1 else ''}")
    table.add_column("way")
    for column in ("median ms", "p95 ms", "times freelook"):
        table.add_column(column, justify="right")
    for timing in timings:
        row = _figures(timing, timings[0])
        if timing.skipped:
            table.add_row(timing.way, f"skipped: {timing.skipped}", "", "")
        else:
            cells = [f"{row[key]:.2f}" for key in ("median_ms", "p95_ms", "times_ours")]
            table.add_row(timing.way, *cells)
    return table


def _figures(timing: Timing, ours: Timing) -> dict[str, Any]:
    if timing.skipped:
        return {"way": timing.way, "skipped": timing.skipped}
    median = timing.percentile_ms(50)
    return {
        "way": timing.way,
        "median_ms": median,
        "p95_ms": timing.percentile_ms(95),
        "times_ours": median / ours.percentile_ms(50),
    }


def _calibrate(args: argparse.Namespace) -> int:
    return _trials(args) if args.trials is not None else _calibrations.run(args)


def _trials(args: argparse.Namespace) -> int:
    """Exit status 1 if any failed."""
    from ..bench.calibration_trials import MOST_SIGMAS, Summary, run
    from ._bars import bar

    if args.trials < 1:
        raise FreelookError(f"--trials {args.trials}: at least 1")
    with bar("calibrations", args.trials, "lenses", quiet=args.json) as advance:
        trials = list(run(args.trials, progress=advance))
    found = Summary.of(trials)
    if args.json:
        each = [{**asdict(t), "sigmas": t.sigmas if isfinite(t.sigmas) else None} for t in trials]
        print(json.dumps({"summary": asdict(found), "trials": each}, indent=2))
        return int(found.failed > 0)
    for trial in trials:
        if trial.failed:
            print(
                f"trial {trial.seed}, {trial.model}, {trial.field_deg:.0f} degrees: {trial.failed}"
            )
    print(
        f"{found.trials} calibrations of random lenses: {found.failed} failed\n"
        f"projection within {MOST_SIGMAS:.0f} of its stated standard deviations: {found.within}; "
        f"the worst {found.worst:.2f}\n"
        f"spread of all, in stated standard deviations: {found.spread:.2f}"
    )
    return int(found.failed > 0)


def _latency(args: argparse.Namespace) -> int:
    from ..bench import page_latency, video_latency
    from ..bench.figures import Figure

    browser = page_latency.browser_path()
    print("stamped 1280x720 H.264 at 30 frames/s over loopback ...", file=sys.stderr)
    figures = [video_latency.ours(args.seconds), video_latency.libavformat(args.seconds)]
    drawn_by = "skipped: no Chromium or Chrome here"
    if browser is None:
        figures.append(Figure(page_latency.POSE_TO_DRAWN, skipped=drawn_by))
    else:
        print("station, OpenTrack head at 250 Hz, page in headless Chromium ...", file=sys.stderr)
        in_page, drawn_by = page_latency.measure(args.seconds, browser)
        figures += in_page
    if args.json:
        rows = {f.name: {"skipped": f.skipped} if f.skipped else _percentiles(f) for f in figures}
        print(json.dumps({"drawn_by": drawn_by, "figures_ms": rows}, indent=2))
    else:
        _print_latencies(figures, drawn_by)
    return 0


def _percentiles(figure: Figure) -> dict[str, float]:
    shares = {f"p{percent}": figure.percentile_ms(percent) for percent in (50, 95, 99)}
    return {**shares, "count": len(figure.values_ms)}


def _print_latencies(figures: list[Figure], drawn_by: str) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title="latency on this machine, all parts on the same cores")
    table.add_column("path")
    for column in ("median ms", "p95 ms", "p99 ms", "count"):
        table.add_column(column, justify="right")
    for figure in figures:
        if figure.skipped:
            table.add_row(figure.name, figure.skipped, "", "", "")
        else:
            cells = _percentiles(figure)
            count = f"{cells.pop('count'):.0f}"
            table.add_row(figure.name, *(f"{value:.1f}" for value in cells.values()), count)
    Console().print(table)
    print(f"drawn by: {drawn_by}")
