"""`freelook bench predict`: errors, jitter and lag of predictions, as tables or JSON."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..bench.predict import Row

BASE = "constant_rate"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "files",
        nargs="+",
        type=Path,
        metavar="FILE",
        help="recorded head motion: text, first line 'timestamp w x y z', seconds",
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.set_defaults(bench=run)


def run(args: argparse.Namespace) -> int:
    from ..bench import predict
    from ..prediction import PREDICTORS
    from ._bars import bar

    recordings = [predict.read_recording(path) for path in args.files]
    found: list[Row] = []
    samples = sum(len(recording.t_ns) for recording in recordings) * len(PREDICTORS)
    with bar("predicting", samples, "samples", quiet=args.json) as advance:
        for recording in recordings:
            for name in PREDICTORS:
                found += predict.rows(recording, name, advance)
    jitter = {
        name: {f"{ahead:g}": deg for ahead, deg in predict.jitter_at_rest_deg(name).items()}
        for name in PREDICTORS
    }
    lag = {
        name: {
            f"{speed:g}": predict.smoothing_lag_ms(name, speed) for speed in predict.SPEEDS_DEG_S
        }
        for name in PREDICTORS
    }
    if args.json:
        figures = {
            "errors_deg": [_figures(row, found) for row in found],
            "jitter_at_rest_deg_by_horizon_ms": jitter,
            "smoothing_lag_ms_by_deg_s": lag,
        }
        print(json.dumps(figures, indent=2))
    else:
        _print_errors(found)
        _print_still(jitter, lag)
    return 0


def _below_base_percent(row: Row, rows: list[Row]) -> float:
    """How far the p95 lies below that of the constant rate."""
    (base,) = (
        other
        for other in rows
        if (other.recording, other.horizon_ms, other.predictor)
        == (row.recording, row.horizon_ms, BASE)
    )
    return 100.0 * (1.0 - row.errors_deg[95] / base.errors_deg[95])


def _figures(row: Row, rows: list[Row]) -> dict[str, object]:
    return {
        "recording": row.recording,
        "predictor": row.predictor,
        "horizon_ms": row.horizon_ms,
        **{f"p{percent}": error for percent, error in row.errors_deg.items()},
        "p95_below_constant_rate_percent": _below_base_percent(row, rows),
        "samples": row.samples,
    }


def _print_errors(rows: list[Row]) -> None:
    from rich.console import Console
    from rich.table import Table

    for recording in dict.fromkeys(row.recording for row in rows):
        table = Table(title=f"{recording}: error in degrees")
        table.add_column("ahead")
        table.add_column("predictor", no_wrap=True)
        for column in ("p50", "p95", "p99", "p95 against constant rate"):
            table.add_column(column, justify="right")
        for row in sorted(
            (row for row in rows if row.recording == recording), key=lambda row: row.horizon_ms
        ):
            below = _below_base_percent(row, rows)
            table.add_row(
                f"{row.horizon_ms:g} ms",
                row.predictor,
                *(f"{error:.2f}" for error in row.errors_deg.values()),
                "" if row.predictor == BASE else f"{-below:+.1f} %",
            )
        Console().print(table)


def _print_still(jitter: dict[str, dict[str, float]], lag: dict[str, dict[str, float]]) -> None:
    from rich.console import Console
    from rich.table import Table

    from ..bench.predict import STILL_NOISE_DEG, STILL_RATE_HZ

    table = Table(
        title="shaking of a still head's view, deg rms, "
        f"for noise of {STILL_NOISE_DEG:g} deg rms per axis at {STILL_RATE_HZ:g} Hz"
    )
    table.add_column("predictor", no_wrap=True)
    first = next(iter(jitter.values()))
    for ahead in first:
        table.add_column(f"{ahead} ms ahead", justify="right")
    for name, row in jitter.items():
        table.add_row(name, *(f"{value:.3f}" for value in row.values()))
    Console().print(table)
    table = Table(title="how late smoothing makes the present, ms")
    table.add_column("predictor", no_wrap=True)
    for speed in next(iter(lag.values())):
        table.add_column(f"{speed} deg/s", justify="right")
    for name, row in lag.items():
        table.add_row(name, *(f"{value:.1f}" for value in row.values()))
    Console().print(table)
