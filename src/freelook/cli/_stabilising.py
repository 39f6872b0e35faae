"""What `fly`, `demo` and `render` share of the gimbal: modes, attitude, limits."""

from __future__ import annotations

import argparse
import os
from typing import TYPE_CHECKING

from ..attitude import AttitudeBuffer
from ..attitude_track import AttitudeTrack
from ..camera import Camera
from ..clock import NS_PER_S
from ..errors import AttitudeError
from ..gimbal import (
    LIMITS,
    MODES,
    GimbalSettings,
    Stabiliser,
    StabiliserSettings,
    parse_shape,
    parse_target,
)
from ..prediction import DEFAULT, PREDICTORS
from ..types import AccessUnit, Attitude
from ..vehicle import Vehicle
from ._recording_time import recording_offset_s, seconds_or_auto

if TYPE_CHECKING:  # slow to load, and may be missing
    from ..attitudes._log import LogSource
    from ..ingest import Ingest

WHOLE_LOG_S = 1e9
AHEAD_MS = 20.0  # a screen of 60 Hz, and half a picture until it is next drawn


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
        type=seconds_or_auto,
        metavar="S",
        help="attitude time minus video time in seconds: of a log, its time at the first picture "
        "(default: found from what both have seen of the vehicle's turning)",
    )
    parser.add_argument(
        "--point",
        metavar="AZ,EL",
        help="what the mode point looks at: degrees from north and above the horizon, "
        "or LAT,LON,ALT",
    )
    parser.add_argument(
        "--follow",
        type=float,
        default=StabiliserSettings().follow_s,
        metavar="S",
        help="time constant of the mode follow: of a turn, 37 %% are missing after it (default 1)",
    )
    parser.add_argument(
        "--limit",
        choices=LIMITS,
        default="black",
        help="past the lens's edge: stop softly before it (soft), or show black (the default)",
    )


def add_head_arguments(parser: argparse.ArgumentParser) -> None:
    """What is made of a tracker's angles, at the station."""
    parser.add_argument(
        "--gain",
        default="",
        metavar="K",
        help="the view turns K times as far as the head: 2, or yaw=2,pitch=1.5",
    )
    parser.add_argument(
        "--dead-zone",
        default="",
        metavar="DEG",
        help="the head may turn so far before the view does: 3, or yaw=3,roll=90",
    )
    parser.add_argument(
        "--invert", default="", metavar="AXES", help="the other way round: pitch, or pitch,roll"
    )
    parser.add_argument(
        "--predictor",
        choices=tuple(PREDICTORS),
        default=DEFAULT,
        help=f"how the head is expected to go on (default {DEFAULT}; hold: not at all)",
    )
    parser.add_argument(
        "--ahead",
        type=float,
        default=AHEAD_MS,
        metavar="MS",
        help="expect it for so long after now: the way from here to the eye, 0 to 500 "
        f"(default {AHEAD_MS:g})",
    )


def gimbal_settings(args: argparse.Namespace) -> GimbalSettings:
    """From `add_head_arguments` and --hold and --ease."""
    return GimbalSettings(
        hold_s=args.hold,
        ease_s=args.ease,
        ahead_s=args.ahead / 1000,
        shape=parse_shape(args.gain, args.dead_zone, args.invert),
    )


def check_mode(args: argparse.Namespace) -> None:
    """AttitudeError for a mode that can never work."""
    if args.mode != "body" and args.attitude is None:
        raise AttitudeError(f"--mode {args.mode} needs the vehicle's attitude: add --attitude SPEC")


def stabiliser_for(args: argparse.Namespace, buffer: AttitudeBuffer | None = None) -> Stabiliser:
    """In the mode that was asked for, knowing no attitude yet."""
    check_mode(args)
    stabiliser = Stabiliser(StabiliserSettings(follow_s=args.follow), buffer)
    stabiliser.set_offset(round((args.attitude_offset or 0.0) * NS_PER_S))
    target = None if args.point is None else parse_target(args.point)
    stabiliser.set_mode(args.mode, target)
    return stabiliser


def vehicle_for(args: argparse.Namespace, ingest: Ingest, camera: Camera) -> Vehicle:
    """For flying. A live source is read as it comes, and its time beside the video's is found by
    itself unless it was told. A log is known from the beginning, and belongs to a recording: its
    times are told from the recording's own."""
    from ..attitudes import open_attitude
    from ..attitudes._log import LogSource

    check_mode(args)
    source = None if args.attitude is None else open_attitude(args.attitude)
    if isinstance(source, LogSource):
        return _vehicle_of_recording(args, ingest, camera, source)
    stabiliser = stabiliser_for(args)
    if source is None or args.attitude_offset is not None:
        return Vehicle(stabiliser, source)
    from ..offset_finder import OffsetFinder

    finder = OffsetFinder(source, camera, ingest.frames(), stabiliser.set_offset)
    return Vehicle(stabiliser, finder)


def _vehicle_of_recording(
    args: argparse.Namespace, ingest: Ingest, camera: Camera, source: LogSource
) -> Vehicle:
    recording = getattr(args, "source", "")
    if args.attitude_offset is None and os.path.isfile(recording):
        of_recording = argparse.Namespace(**{**vars(args), "input": recording})
        args.attitude_offset = recording_offset_s(of_recording, camera, source.track)
    stabiliser = stabiliser_for(args, AttitudeBuffer(span_s=WHOLE_LOG_S))
    _push_log(stabiliser, source)
    offset_ns = stabiliser.offset_ns

    def follow_recording(unit: AccessUnit) -> None:
        if unit.key and unit.media_ns is not None:
            stabiliser.set_offset(offset_ns + unit.media_ns - unit.capture_ns)

    ingest.subscribe(follow_recording)
    return Vehicle(stabiliser, source)


def log_for(args: argparse.Namespace) -> LogSource:
    """The log of --attitude; AttitudeError when it cannot be read or is none."""
    from ..attitudes import open_attitude
    from ..attitudes._log import LogSource

    source = open_attitude(args.attitude)
    if not isinstance(source, LogSource):
        raise AttitudeError(f"--attitude {args.attitude}: a recording needs a log, not a live one")
    return source


def stabiliser_from_log(args: argparse.Namespace, track: AttitudeTrack | None) -> Stabiliser:
    """For a recording: knowing the log's track. AttitudeError when it says nothing about the start
    of the video."""
    stabiliser = stabiliser_for(args, AttitudeBuffer(span_s=WHOLE_LOG_S))
    if track is None:
        return stabiliser
    start_ns, last_ns = int(track.times_ns[0]), int(track.times_ns[-1])
    if not start_ns - NS_PER_S <= stabiliser.offset_ns < last_ns:
        raise AttitudeError(
            f"--attitude {args.attitude}: the log knows the time from {start_ns / NS_PER_S:.3f} to "
            f"{last_ns / NS_PER_S:.3f} s, but the video begins at "
            f"{stabiliser.offset_ns / NS_PER_S:.3f} s of it; give --attitude-offset: the log's "
            "time at the first picture"
        )
    for index, t_ns in enumerate(track.times_ns.tolist()):
        stabiliser.push(Attitude(t_ns, track.world_from_body[index]))
    return stabiliser


def _push_log(stabiliser: Stabiliser, source: LogSource) -> None:
    for attitude in source.attitudes():
        stabiliser.push(attitude)
