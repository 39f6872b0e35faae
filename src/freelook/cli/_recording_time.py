"""Which time of an attitude log a recording begins at: as told, as its own, or found by itself."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator

from ..alignment.image_turns import ImageTurn, ImageTurns
from ..alignment.time_offset import TimeOffset, find_offset, turned_axes
from ..attitude_track import AttitudeTrack
from ..camera import Camera
from ..clock import NS_PER_S
from ..errors import AttitudeError
from ..rotations import head_angles_deg
from ..types import Frame

LOOK_EVERY_S = 20.0  # of video that has been seen since the last try
ENOUGH_NS = 500_000.0
LIKELY, BETTER = 0.8, 0.05  # correlations at which another mounting is worth a word
MOST_SECONDS = 5e9


def seconds_or_auto(text: str) -> float | None:
    """For argparse: a number of seconds that nanoseconds can hold, or None for "auto"."""
    if text == "auto":
        return None
    value = float(text)
    if not abs(value) <= MOST_SECONDS:
        raise argparse.ArgumentTypeError(f"'{text}' is not a time in seconds")
    return value


def recording_offset_s(args: argparse.Namespace, camera: Camera, track: AttitudeTrack) -> float:
    """The log's time at the first picture, in seconds.

    --attitude-offset where it is a number; 0 for a recording's own telemetry; else it is found
    from the pictures, and reported. AttitudeError when they do not show it with confidence.
    """
    if args.attitude_offset is not None:
        return float(args.attitude_offset)
    spec = args.attitude.partition("?")[0].removeprefix("telemetry:")
    if os.path.realpath(spec) == os.path.realpath(args.input):
        return 0.0
    found, turns = _found(args.input, camera, track)
    begins = f"{args.input} begins at {found.offset_ns / NS_PER_S:.4f} s of the log's time"
    hint = _mounting_hint(found, turns, camera, track)
    if not found.sure:
        raise AttitudeError(
            f"perhaps {begins}, but its pictures do not show it surely: {found.evidence}. "
            f"{hint}Give --attitude-offset: the log's time at the first picture, in seconds"
        )
    print(f"{begins}: {found.evidence}", file=sys.stderr)
    if hint:
        print(hint, file=sys.stderr)
    return found.offset_ns / NS_PER_S


def _mounting_hint(
    found: TimeOffset, turns: list[ImageTurn], camera: Camera, track: AttitudeTrack
) -> str:
    """What to do if another mounting would explain the turns better; nothing otherwise."""
    axes = turned_axes(turns, track)
    if axes is None or axes.correlation < max(LIKELY, found.correlation + BETTER):
        return ""
    camera_from_body = camera.camera_from_body * axes.body_from_told.inv()
    yaw, pitch, roll = head_angles_deg(camera_from_body.inv())
    return (
        f"Video and log would agree better (correlation {axes.correlation:.2f}) if the camera were "
        f"mounted with --mount={yaw:.0f},{pitch:.0f},{roll:.0f}: try that. "
    )


def _found(path: str, camera: Camera, track: AttitudeTrack) -> tuple[TimeOffset, list[ImageTurn]]:
    """From as many pictures as it takes to be sure, at most all; and the turns they show."""
    turns: list[ImageTurn] = []
    looked_ns = 0
    for turn in _turns(path, camera):
        turns.append(turn)
        if turn.end_ns - looked_ns < LOOK_EVERY_S * NS_PER_S:
            continue
        looked_ns = turn.end_ns
        found = find_offset(turns, track)
        if found.sure and found.uncertainty_ns < ENOUGH_NS:
            return found, turns
    return find_offset(turns, track), turns


def _turns(path: str, camera: Camera) -> Iterator[ImageTurn]:
    """How the camera turned from picture to picture; times count from the first."""
    from ..media.decoder import Decoder
    from ..offline import decoded
    from ..sources import file
    from ._bars import bar

    source = file.FileSource(path, loop=False, pace=False, clock=lambda: 0)
    measuring = ImageTurns(camera)
    first_ns: int | None = None
    with bar("matching video and attitude", source.expected_frames, "frames") as advance:
        for frame in decoded(source.units(), Decoder(low_delay=False)):
            media_ns = frame.capture_ns if frame.media_ns is None else frame.media_ns
            first_ns = media_ns if first_ns is None else first_ns
            turn = measuring.push(Frame(frame.picture, media_ns - first_ns))
            advance()
            if turn is not None:
                yield turn
