"""What `fly`, `demo` and `render` share of the gimbal: modes, attitude, limits."""

from __future__ import annotations

import argparse

from ..attitude import AttitudeBuffer
from ..clock import NS_PER_S
from ..errors import AttitudeError
from ..gimbal import LIMITS, MODES, Stabiliser, parse_target

WHOLE_LOG_S = 1e9


def add_mode_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--mode",
        choices=MODES,
        default="body",
        help="what is taken out of the view: nothing (body), the vehicle's roll and pitch "
        "(horizon), its heading too (world), its heading smoothly (follow), or all, to look at "
        "one direction or place (point); all but body need --attitude",
    )
    parser.add_argument(
        "--attitude",
        metavar="SPEC",
        help="where the vehicle's attitude comes from: a log, or KIND:ARGUMENT",
    )
    parser.add_argument(
        "--attitude-offset",
        type=float,
        metavar="S",
        help="attitude time minus video time in seconds (default 0)",
    )
    parser.add_argument(
        "--point",
        metavar="AZ,EL",
        help="what the mode point looks at: degrees from north and above the horizon, "
        "or LAT,LON,ALT",
    )
    parser.add_argument(
        "--limit",
        choices=LIMITS,
        default="black",
        help="past the lens's edge: stop softly before it (soft), or show black (the default)",
    )


def check_mode(args: argparse.Namespace) -> None:
    """AttitudeError for a mode that can never work."""
    if args.mode != "body" and args.attitude is None:
        raise AttitudeError(f"--mode {args.mode} needs the vehicle's attitude: add --attitude SPEC")


def stabiliser_for(args: argparse.Namespace, buffer: AttitudeBuffer | None = None) -> Stabiliser:
    """In the mode that was asked for, knowing no attitude yet."""
    check_mode(args)
    stabiliser = Stabiliser(buffer=buffer)
    stabiliser.set_offset(round((args.attitude_offset or 0.0) * NS_PER_S))
    target = None if args.point is None else parse_target(args.point)
    stabiliser.set_mode(args.mode, target)
    return stabiliser


def stabiliser_from_log(args: argparse.Namespace) -> Stabiliser:
    """Knowing the whole log; AttitudeError when it cannot be read or has none at the start of the
    video."""
    from ..attitudes import open_attitude
    from ..attitudes._log import LogSource

    stabiliser = stabiliser_for(args, AttitudeBuffer(span_s=WHOLE_LOG_S))
    if args.attitude is None:
        return stabiliser
    source = open_attitude(args.attitude)
    if not isinstance(source, LogSource):
        raise AttitudeError(f"--attitude {args.attitude}: a recording needs a log, not a live one")
    start_ns, last_ns = int(source.track.times_ns[0]), int(source.track.times_ns[-1])
    if not start_ns - NS_PER_S <= stabiliser.offset_ns < last_ns:
        raise AttitudeError(
            f"--attitude {args.attitude}: the log knows the time from {start_ns / NS_PER_S:.3f} to "
            f"{last_ns / NS_PER_S:.3f} s, but the video begins at "
            f"{stabiliser.offset_ns / NS_PER_S:.3f} s of it; give --attitude-offset: the log's "
            "time at the first picture"
        )
    for attitude in source.attitudes():
        stabiliser.push(attitude)
    return stabiliser
