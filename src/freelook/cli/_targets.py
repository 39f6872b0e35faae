"""Which target it is: `--target`, or `--board` and `--square` for the usual ones."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..errors import CalibrationError
from ._arguments import size

if TYPE_CHECKING:
    from ..calibration.targets import Target

KINDS = """\
  chessboard:9x6:0.025               inner corners across x down, side of a square
  charuco:10x7:0.024:0.018:5x5_1000  squares, side of a square and of a marker, markers
  circles:9x6:0.025[:0.012]          circles, spacing, diameter
  acircles:4x11:0.02[:0.014]         every other row shifted: in a row x rows, between rows
  aprilgrid:6x6:0.088:0.3            tags, side of a tag, space between as a share of it
  april_6x6.yaml                     a target file of Kalibr
all in metres; or a kind alone, with --board and --square"""


def add_target_arguments(
    parser: argparse.ArgumentParser, default: str | None = None
) -> argparse._ArgumentGroup:
    """`default`: the kind that is taken if none is said; None: a chessboard of any size."""
    group = parser.add_argument_group("target", f"--target takes\n{KINDS}")
    usual = default or "chessboard, size found by itself"
    group.add_argument(
        "--target", default=default, metavar="T", help=f"what is held (default: {usual})"
    )
    group.add_argument(
        "--board",
        type=size,
        metavar="CxR",
        help="inner corners (charuco: squares; others: circles, tags) across x down",
    )
    group.add_argument(
        "--square", type=float, metavar="M", help="side of a square or tag, or spacing, metres"
    )
    return group


def check_target_arguments(args: argparse.Namespace) -> None:
    """CalibrationError where a size is said twice."""
    from ..calibration.targets import KINDS

    said = [f"--{name}" for name in ("board", "square") if getattr(args, name) is not None]
    if args.target is not None and args.target not in KINDS and said:
        raise CalibrationError(
            f"--target {args.target} says sizes, and so does {' and '.join(said)}; give one of them"
        )


def chosen_target(args: argparse.Namespace) -> Target:
    """What the arguments say; without --target a chessboard."""
    from ..calibration.targets import KINDS, parse_target, simple_target

    check_target_arguments(args)
    if args.target is not None and args.target not in KINDS:
        return parse_target(args.target)
    return simple_target(args.target or "chessboard", args.board, args.square)


def measured(target: Target) -> bool:
    """Whether its sizes are known: those of an unmeasured one are 1."""
    side = next(
        getattr(target, name) for name in ("tag", "square", "spacing") if hasattr(target, name)
    )
    return bool(side != 1.0)


def grid_without_names(target: Target) -> tuple[bool, tuple[int, int] | None]:
    """Whether its points are a grid numbered anyhow, for two cameras; and of how many, if known.

    CalibrationError for a grid of shifted circles of unknown size: it may be laid on itself in no
    way that keeps rows rows.
    """
    from ..calibration.targets import Chessboard, Circles

    if isinstance(target, Chessboard):
        return True, target.inner
    if not isinstance(target, Circles):
        return False, None
    if not target.asymmetric:
        return True, target.count
    if target.count is None:
        raise CalibrationError("two cameras must know which circle is which: give --board CxR")
    return False, None
