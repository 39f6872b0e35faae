"""What `freelook bench calibrate` runs and prints: calibrations side by side."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import FreelookError

if TYPE_CHECKING:
    from ..bench.calibrate import Row
    from ..bench.calibration_compared import Compared, Timed


UNPREDICTED = "without some of the views it fails, or does not see those left out"


def run(args: argparse.Namespace) -> int:
    from ..bench import calibrate
    from ..bench.calibration_compared import compared, timed

    simulated = sets = calibrate.simulated_sets()
    if args.data:
        print(f"looking for real sets in {args.data} ...", file=sys.stderr)
        if not (real := calibrate.real_sets(Path(args.data))):
            raise FreelookError(f"{args.data} has neither fish_1/*.jpg nor ov_plane/train/*.orpc")
        sets = real + simulated

    def say(what: str) -> None:
        if not args.json:
            print(what, file=sys.stderr)

    choices = (calibrate.CHOSEN,)
    rows = list(calibrate.run(sets, choices=choices, cross_validate=not args.quick, progress=say))
    say("how long ours takes")
    ours = {row.set for row in rows if row.way == calibrate.OURS[0].name and isfinite(row.rms_px)}
    times = [timed(each) for each in simulated if each.name in ours]
    if args.json:
        found = {
            "rows": [_figures(row) for row in rows],
            "compared": [_verdicts(each) for each in compared(rows)],
            "timed": [asdict(each) for each in times],
        }
        print(json.dumps(found, indent=2))
        return 0
    _print_rows(rows)
    for each in compared(rows):
        print(_said(each))
    if times:
        print(_times(times))
    if not args.data:
        print("fish_1, ov_plane: skipped: --data FOLDER says where they are")
    return 0


def _figures(row: Row) -> dict[str, Any]:
    """For JSON, which has no NaN."""
    figures: dict[str, Any] = {"set": row.set, "way": row.way}
    for key in ("skipped", "failed"):
        if said := getattr(row, key):
            return {**figures, key: said}
    for key in ("rms_px", "cross_validated_px", "seconds", "cpu_seconds"):
        value = float(getattr(row, key))
        figures[key] = value if isfinite(value) else None
    return figures


def _verdicts(each: Compared) -> dict[str, Any]:
    best = {"predicting": each.predicting, "fitting": each.fitting, "closest": each.closest}
    return {
        "set": each.set,
        "succeeds": each.succeeds,
        "predicts_near_best": each.predicts_near_best,
        "fits_near_best": each.fits_near_best,
        **{f"best_{key}": row.way if row else None for key, row in best.items()},
    }


def _print_rows(rows: Sequence[Row]) -> None:
    from rich.console import Console
    from rich.table import Table

    for name in dict.fromkeys(row.set for row in rows):
        table = Table(title=name)
        table.add_column("way")
        for column in ("RMS px", "left out px", "seconds", "of CPU"):
            table.add_column(column, justify="right")
        for row in rows:
            if row.set != name:
                continue
            if row.skipped or row.failed:
                said = f"skipped: {row.skipped}" if row.skipped else f"failed: {row.failed}"
                table.add_row(f"{row.way}\n  {said}", "", "", "", "")
            else:
                predicted = row.cross_validated_px
                held_out = f"{predicted:.3f}" if isfinite(predicted) else ""
                times = (f"{row.seconds:.2f}", f"{row.cpu_seconds:.2f}")
                table.add_row(row.way, f"{row.rms_px:.3f}", held_out, *times)
        Console().print(table)
    print(
        "RMS: 2-D, per point, each view with the pose that suits the way's camera best;\n"
        "left out: the same on views that the way's camera was calibrated without"
    )


def _said(each: Compared) -> str:
    ours = each.ours
    if not each.succeeds:
        return f"{each.set}: {ours.way} fails: {ours.failed}"
    lines = [f"{each.set}: {ours.way} succeeds"]
    for what, row, key, near in (
        ("on views left out", each.predicting, "cross_validated_px", each.predicts_near_best),
        ("RMS, of those not overfit", each.fitting, "rms_px", each.fits_near_best),
    ):
        best = f"{getattr(row, key):.3f} ({row.way})" if row else "no other"
        lines.append(
            f"  {what}: {getattr(ours, key):.3f} px, best of the others {best}; "
            f"within 5 %: {'yes' if near else 'no'}"
        )
    if each.closest and each.closest is not each.fitting:
        predicted = each.closest.cross_validated_px
        lines.append(
            f"  the closest fit of the others, {each.closest.rms_px:.3f} px "
            f"({each.closest.way}), is overfit: "
            + (f"{predicted:.3f} px on views left out" if isfinite(predicted) else UNPREDICTED)
        )
    return "\n".join(lines)


def _times(times: Sequence[Timed]) -> str:
    each = ", ".join(f"{one.seconds:.2f}" for one in times)
    cpu = ", ".join(f"{one.cpu_seconds:.2f}" for one in times)
    return (
        f"20 views of 50 corners, freelook, auto, from corners that are found: {each} s "
        f"(of CPU: {cpu}); each the best of three, of {len(times)} simulated lenses"
    )
