"""Make the 2011 paper's figures and tables again, and say where its numbers hold.

The paper is O. Rawashdeh, B. Sababha, "An Image-Processing-Based Gimbal System Using Fisheye
Video" (2011), the idea behind freelook. OUTDIR gets a page (index.html), every figure as PNG and
SVG, and the numbers of each as CSV. Experiments are simulated; the page says with which noise.

  freelook paper report
  freelook paper report --overwrite --seed 7
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from pathlib import Path

LEAST_DRAWS = 50


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("outdir", metavar="OUTDIR", type=Path, help="a new or empty folder")
    parser.add_argument(
        "--overwrite", action="store_true", help="write into OUTDIR though it is not empty"
    )
    parser.add_argument(
        "--seed", type=whole(0), default=2011, metavar="N", help="of all noise (default: 2011)"
    )
    parser.add_argument(
        "--draws",
        type=whole(LEAST_DRAWS),
        default=20_000,
        metavar="N",
        help="trials of each Monte Carlo (default: 20000)",
    )


def whole(least: int) -> Callable[[str], int]:
    """A whole number, `least` or more."""

    def number(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from {least} on")
        return int(text)

    return number


def run(args: argparse.Namespace) -> int:
    from ..paper.exhibit import Settings
    from ..paper.report import PAGE, SECTIONS, open_folder, write_report
    from ._bars import bar

    settings = Settings(seed=args.seed, draws=args.draws, threads=os.cpu_count() or 1)
    open_folder(args.outdir, overwrite=args.overwrite)
    with bar("paper", len(SECTIONS), "sections") as advance:
        sections = write_report(args.outdir, settings, advance)
    figures = sum(exhibit.draw is not None for s in sections for exhibit in s.exhibits)
    print(f"{args.outdir / PAGE}: {len(sections)} sections, {figures} figures")
    return 0
