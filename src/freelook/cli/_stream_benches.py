"""`freelook bench streams` and `soak`: what receivers see, and what the sender holds."""

from __future__ import annotations

import argparse
import json
import sys
from math import isfinite
from statistics import mean
from typing import TYPE_CHECKING, Any

from ..errors import FreelookError

if TYPE_CHECKING:
    from ..bench.resident import Resident
    from ..bench.soak import Soak
    from ..bench.streams import Row

ABOUT_STREAMS = """\
How soon and how late other programs show what is streamed: ffmpeg, GStreamer, VLC, and headless
Chromium for WHIP. 640x360 at 30 frames/s, x264, all on this machine. What is missing is named.
For the page see freelook bench latency.

  freelook bench streams --seconds 5
"""
ABOUT_SOAK = """\
A flight with RTP, MPEG-TS, an RTSP server and a file for minutes, received by ffmpeg's program six
times: some stay, one is stopped for half of every minute, some are killed every 20 seconds. Says
what the sender's memory did and whether the rate held.

  freelook bench soak --minutes 10
"""
MB = 1e6


def add_streams_arguments(parser: argparse.ArgumentParser) -> None:
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = ABOUT_STREAMS
    parser.add_argument("--seconds", type=float, default=5.0, metavar="S", help="for each (5)")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.set_defaults(bench=streams)


def add_soak_arguments(parser: argparse.ArgumentParser) -> None:
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.description = ABOUT_SOAK
    parser.add_argument("--minutes", type=float, default=10.0, metavar="N", help="how long (10)")
    parser.add_argument("--json", action="store_true", help="print all that was seen as JSON")
    parser.set_defaults(bench=soak)


def streams(args: argparse.Namespace) -> int:
    from ..bench.streams import run

    if not 0 < args.seconds <= 600:
        raise FreelookError(f"--seconds {args.seconds:g}: above 0, and up to 600")
    rows = list(run(args.seconds, lambda what: print(what, file=sys.stderr)))
    if args.json:
        print(json.dumps([_row_figures(row) for row in rows], indent=2))
    else:
        _print_rows(rows)
    return 0


def _row_figures(row: Row) -> dict[str, Any]:
    names = {"stream": row.stream, "receiver": row.receiver}
    if row.skipped:
        return {**names, "skipped": row.skipped}
    late = {f"p{percent}_ms": row.late.percentile_ms(percent) for percent in (50, 95)}
    figures = {"first_s": row.first_s, **late, "pictures": len(row.late.values_ms)}
    return names | {k: v if isfinite(v) else None for k, v in figures.items()}


def _print_rows(rows: list[Row]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title="stamp, before encoding, to picture out of the receiver")
    table.add_column("stream")
    table.add_column("receiver")
    for column in ("first after", "median ms", "p95 ms", "pictures"):
        table.add_column(column, justify="right")
    for row in rows:
        if row.skipped:
            table.add_row(row.stream, f"{row.receiver}: {row.skipped}", "", "", "", "")
            continue
        late = [f"{row.late.percentile_ms(percent):.1f}" for percent in (50, 95)]
        count = str(len(row.late.values_ms))
        table.add_row(row.stream, row.receiver, f"{row.first_s:.2f} s", *late, count)
    Console().print(table)


def soak(args: argparse.Namespace) -> int:
    from ..bench.soak import run, steps
    from ._bars import bar

    if not 0.1 <= args.minutes <= 24 * 60:
        raise FreelookError(f"--minutes {args.minutes:g}: from 0.1 to {24 * 60}")
    with bar("flying", steps(args.minutes), "looks", quiet=args.json) as advance:
        seen = run(args.minutes, advance)
    if args.json:
        print(json.dumps(_soak_figures(seen), indent=2))
    else:
        _print_soak(seen)
    return 0


def _soak_figures(seen: Soak) -> dict[str, Any]:
    receivers = [
        {"name": one.name, "begun": one.begun, "pictures": one.pictures} for one in seen.receivers
    ]
    return {
        "seconds": seen.seconds,
        "memory": [_memory_figures(one) for one in seen.memory],
        "mean_rates_hz": {name: mean(rates) for name, rates in seen.rates.items()},
        "receivers": receivers,
        "left_out": seen.missing or None,
    }


def _memory_figures(one: Resident) -> dict[str, Any]:
    _, sizes = one.settled()
    slope = one.slope() * 60
    return {
        "name": one.name,
        "settled_bytes": sizes[0],
        "end_bytes": sizes[-1],
        "most_bytes": max(one.sizes),
        "slope_bytes_per_minute": slope if isfinite(slope) else None,
        "times_s": one.times_s,
        "bytes": one.sizes,
    }


def _print_soak(seen: Soak) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"memory in {seen.seconds / 60:g} minutes, the first fifth left out")
    table.add_column("program")
    for column in ("from MB", "to MB", "most MB", "slope kB/min"):
        table.add_column(column, justify="right")
    for one in seen.memory:
        _, sizes = one.settled()
        cells = [f"{size / MB:.1f}" for size in (sizes[0], sizes[-1], max(one.sizes))]
        table.add_row(one.name, *cells, f"{one.slope() * 60 / 1e3:.1f}")
    Console().print(table)
    for name, rates in seen.rates.items():
        print(f"{name}: {mean(rates):.1f} views/s")
    for receiver in seen.receivers:
        print(f"{receiver.name}: begun {receiver.begun} times, {receiver.pictures} pictures")
    if seen.missing:
        print(f"left out: {seen.missing}")
