"""Argument types that several commands share; argparse turns their errors into usage lines."""

from __future__ import annotations

import argparse
import re

from ..projections import PROJECTIONS


def size(text: str) -> tuple[int, int]:
    """WIDTHxHEIGHT."""
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT, such as 1280x720")
    return int(match[1]), int(match[2])


def three_angles(text: str) -> tuple[float, float, float]:
    """YAW,PITCH,ROLL in degrees."""
    try:
        yaw, pitch, roll = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not three angles in degrees, such as 0,-90,0"
        ) from None
    return yaw, pitch, roll


def add_projection_argument(parser: argparse._ActionsContainer) -> None:
    listed = "; ".join(f"{kind.name}: {kind.about}" for kind in PROJECTIONS.values())
    parser.add_argument(
        "--projection",
        choices=tuple(PROJECTIONS),
        default="perspective",
        help=f"of the view; {listed}",
    )
