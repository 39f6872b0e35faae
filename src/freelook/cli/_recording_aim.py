"""Where the view of a recording looks: in the vehicle, in a steady base, or along a calm path."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable
from typing import Protocol

from scipy.spatial.transform import Rotation

from ..attitude_track import AttitudeTrack
from ..camera import Camera
from ..clock import NS_PER_S
from ..errors import AttitudeError, FreelookError
from ..gimbal import Stabiliser
from ..stabilisation.smooth_aim import Flight, SmoothAim
from ..stabilisation.smoothing import DEFAULT_HZ
from ..viewport import Viewport
from ._recording_time import recording_offset_s
from ._stabilising import check_mode, log_for, stabiliser_from_log

AROUND_S = 2.0  # of the log beside the recording: what is eased into begins before it
STABILIZE = ("horizon", "world", "smooth")
Look = Callable[[int], Rotation]


class RecordingAim(Protocol):
    """`body_from_view` for a frame's time (and, unused here, its capture), and what to tell
    afterwards."""

    def __call__(self, now_ns: int, capture_ns: int, /) -> Rotation: ...

    def report(self, output: str) -> None: ...


def add_stabilize_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--stabilize",
        choices=STABILIZE,
        help="horizon and world as --mode has them; smooth takes out only what is quicker than "
        "--smooth-hz, and no more than the lens has picture for; all need --attitude",
    )
    parser.add_argument(
        "--smooth-hz",
        type=float,
        metavar="HZ",
        help=f"cut-off (-3 dB) of --stabilize smooth, 0.02 to 10 (default {DEFAULT_HZ:g})",
    )


def recording_aim(
    args: argparse.Namespace, look: Look, camera: Camera, viewport: Viewport
) -> RecordingAim:
    """As the command line asks. Finding out when the log was, where that is wanted, takes a pass
    over the recording."""
    _check(args)
    if args.attitude is None:
        return _SteadyAim(stabiliser_from_log(args, None), look)
    log = log_for(args)
    for note in log.notes:
        print(f"{args.attitude}: {note}", file=sys.stderr)
    args.attitude_offset = recording_offset_s(args, camera, log.track)
    zero_ns = round(args.attitude_offset * NS_PER_S)
    duration_s = _duration_s(args.input, log.track, zero_ns)
    if args.stabilize == "smooth":
        return _CalmAim(args, look, camera, viewport, Flight(log.track, zero_ns, duration_s))
    end_ns = zero_ns + round((duration_s + AROUND_S) * NS_PER_S)
    needed = log.track.part(zero_ns - round(AROUND_S * NS_PER_S), end_ns)
    return _SteadyAim(stabiliser_from_log(args, needed), look)


def _check(args: argparse.Namespace) -> None:
    if args.stabilize is not None:
        if args.mode != "body":
            raise FreelookError("give either --mode or --stabilize, not both")
        if args.attitude is None:
            raise AttitudeError(
                f"--stabilize {args.stabilize} needs the vehicle's attitude: add --attitude LOG, "
                "or the video itself where its camera records a gyroscope"
            )
        if args.stabilize != "smooth":
            args.mode = args.stabilize
    if args.smooth_hz is not None and args.stabilize != "smooth":
        raise FreelookError("--smooth-hz is for --stabilize smooth")
    if args.attitude is not None and args.mode == "body" and args.stabilize is None:
        raise FreelookError("--attitude changes nothing without --stabilize or --mode")
    check_mode(args)


class _SteadyAim:
    """The look in the base that the gimbal's modes keep steady."""

    def __init__(self, stabiliser: Stabiliser, look: Look) -> None:
        self._stabiliser = stabiliser
        self._look = look
        self._degraded = 0
        self._notice = ""

    def __call__(self, now_ns: int, _capture_ns: int) -> Rotation:
        base = self._stabiliser.at(now_ns, now_ns)
        if base.state == "degraded":
            self._degraded += 1
            self._notice = self._notice or base.notice
        return base.body_from_base * self._look(now_ns)

    def report(self, output: str) -> None:
        """Say on how many frames the mode was not possible, if on any."""
        if self._degraded:
            print(f"{output}: in {self._degraded} frames {self._notice}", file=sys.stderr)


class _CalmAim:
    """The look from the vehicle's low-passed path."""

    def __init__(
        self,
        args: argparse.Namespace,
        look: Look,
        camera: Camera,
        viewport: Viewport,
        flight: Flight,
    ) -> None:
        cutoff_hz = DEFAULT_HZ if args.smooth_hz is None else args.smooth_hz
        self._aim = SmoothAim(flight, look, camera, viewport, cutoff_hz)

    def __call__(self, now_ns: int, _capture_ns: int) -> Rotation:
        return self._aim(now_ns)

    def report(self, output: str) -> None:
        """Say for how much of the recording the path was not as smooth as asked for."""
        if self._aim.unknown:
            share = f"{self._aim.unknown:.0%} of the time"
            print(f"{output}: for {share} there is no attitude in the log", file=sys.stderr)
        if self._aim.limited > self._aim.unknown:
            share = f"{self._aim.limited:.0%} of the time"
            print(
                f"{output}: for {share} the view is less smooth than asked for, to stay in the "
                "lens; a smaller --hfov or a higher --smooth-hz leaves it more room",
                file=sys.stderr,
            )


def _duration_s(path: str, track: AttitudeTrack, zero_ns: int) -> float:
    """Of the recording; of the rest of the log where the file does not say."""
    from ..media.pictures import is_picture
    from ..sources import file

    if is_picture(path):
        return 0.0
    source = file.FileSource(path, loop=False, pace=False, clock=lambda: 0)
    frames = source.expected_frames
    if frames:
        return frames / source.frames_per_s
    return max(0.0, math.ceil((int(track.times_ns[-1]) - zero_ns) / NS_PER_S))
