"""Make a fisheye video of a simulated flight, with the exact truth beside it.

A vehicle flies a figure of eight over an airfield. Its camera has the lens you name, and the
colour along every ray is known exactly, so that renderers can be checked against it.

OUT is a video file (.mp4, .mov, .mkv), a picture (.png, .jpg), or a live stream like
rtp://127.0.0.1:5004, which runs until Ctrl-C.

  freelook simulate flight.mp4 --seconds 20
  freelook simulate flight.mp4 --lens cam.json --size 1440x1440 --truth truth.csv
  freelook simulate still.png --start 30
  freelook simulate rtp://127.0.0.1:5004 --sdp camera.sdp

The last one can be flown from a second terminal: freelook fly camera.sdp --lens demo
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import math
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from ..clock import NS_PER_S, Clock, FakeClock, now_ns
from ..errors import SinkError
from ..rotations import to_wxyz
from ..types import ColorSpace, Frame, Sink
from ._arguments import size

if TYPE_CHECKING:
    from ..simulation.camera import SimulatedCamera
    from ..simulation.flight import State
    from ..simulation.pacing import Pacer

FILE_SECONDS = 10.0
REPORT_NS = NS_PER_S
TRUTH_COLUMNS = ["t_s", "north_m", "east_m", "down_m", "qw", "qx", "qy", "qz"]

Note = Callable[[float, "State"], None]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("out", metavar="OUT", help="a video file, a picture or rtp://HOST:PORT")
    _add_camera_arguments(parser)
    parser.add_argument(
        "--seconds",
        type=positive,
        metavar="S",
        help="how long (default: 10 for a file; a live stream runs until Ctrl-C)",
    )
    parser.add_argument(
        "--start", type=float, default=0.0, metavar="S", help="begin this far into the flight"
    )
    parser.add_argument("--codec", choices=("h264", "h265"), default="h264")
    parser.add_argument(
        "--bitrate", type=positive, metavar="MBIT", help="of a live stream, in Mbit/s"
    )
    parser.add_argument("--sdp", metavar="FILE", help="write the live stream's description here")
    parser.add_argument(
        "--truth",
        metavar="CSV",
        help="write where the vehicle was and how it was turned, for every frame: seconds, metres "
        "north, east and down, and the quaternion world from body",
    )
    parser.add_argument(
        "--stamp", action="store_true", help="draw the time into the pictures, to measure latency"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist")


def _add_camera_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--lens",
        default="demo",
        metavar="PROFILE",
        help="lens profile: a file, or one that comes with freelook (default: demo)",
    )
    parser.add_argument(
        "--size", type=size, metavar="WxH", help="picture size (default: the lens profile's)"
    )
    parser.add_argument("--fps", type=positive, default=30.0, help="frames a second (default: 30)")
    parser.add_argument(
        "--softness",
        type=positive,
        metavar="DEG",
        help="half width of every edge (default: one pixel in the middle of the picture)",
    )
    parser.add_argument("--matrix", choices=("bt601", "bt709"), default="bt709")
    parser.add_argument("--full-range", action="store_true", help="luma 0 to 255, not 16 to 235")
    parser.add_argument(
        "--threads", type=int, default=1, metavar="N", help="cores sharing a picture (default: 1)"
    )


def positive(text: str) -> float:
    """A finite number above 0."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above 0")
    return value


def run(args: argparse.Namespace) -> int:
    from ..sinks import find, open_sink

    kind = find(args.out)[0].KIND
    camera = _camera(args)
    with contextlib.ExitStack() as stack:
        note = stack.enter_context(_truth_file(args.truth, args.overwrite))
        sink = open_sink(
            args.out,
            size=camera.camera.size,
            fps=args.fps,
            color=camera.color,
            codec=args.codec,
            overwrite=args.overwrite,
            sdp=args.sdp,
            bitrate=round(args.bitrate * 1e6) if args.bitrate else None,
        )
        stack.enter_context(contextlib.closing(sink))
        shot = Shot(camera, sink, note, round(args.start * NS_PER_S), args.stamp)
        if kind == "rtp":
            _stream(shot, args.out, args.fps, args.seconds)
        else:
            seconds = args.seconds or FILE_SECONDS
            frames = 1 if kind == "picture" else max(1, round(seconds * args.fps))
            _record(shot, args.out, args.fps, frames)
    return 0


def _camera(args: argparse.Namespace) -> SimulatedCamera:
    from ..formats import load_camera
    from ..simulation.camera import SimulatedCamera, pixel_deg
    from ..simulation.world import World

    camera = load_camera(args.lens)
    if args.size is not None:
        camera = camera.resized(args.size)
    world = World(args.softness or pixel_deg(camera))
    color = ColorSpace(args.matrix, args.full_range)
    return SimulatedCamera(camera, world, color=color, threads=max(1, args.threads))


class Shot:
    """Takes frames of the flight and passes them on, with their truth."""

    def __init__(
        self, camera: SimulatedCamera, sink: Sink, note: Note, start_ns: int, stamp: bool
    ) -> None:
        self._camera, self._sink, self._note = camera, sink, note
        self._start_ns, self._stamp = start_ns, stamp

    def take(self, since_ns: int, capture_ns: int, clock: Clock) -> None:
        """The frame `since_ns` after the start; the stamp is the clock's time when it is ready."""
        from ..latency import draw_stamp

        picture = self._camera.picture(self._start_ns + since_ns)
        if self._stamp:
            try:
                draw_stamp(picture.planes[0], clock())
            except ValueError as error:
                raise SinkError(str(error)) from None
        self._sink.write(Frame(picture, capture_ns, since_ns))
        self._note(since_ns / NS_PER_S, self._camera.truth(self._start_ns + since_ns))


@contextlib.contextmanager
def _truth_file(name: str | None, overwrite: bool) -> Iterator[Note]:
    """A function that writes one row; does nothing where no file is wanted."""
    if name is None:
        yield lambda _t_s, _state: None
        return
    from ..sinks import check_output_file

    try:
        file = check_output_file(name, overwrite=overwrite).open("w", newline="", encoding="utf-8")
    except OSError as error:
        raise SinkError(f"{name}: {error.strerror}") from None
    with file:
        rows = csv.writer(file)
        rows.writerow(TRUTH_COLUMNS)

        def note(t_s: float, state: State) -> None:
            values = [*state.position, *to_wxyz(state.world_from_body)]
            rows.writerow([f"{t_s:.6f}", *(f"{value:.9f}" for value in values)])

        yield note


def _record(shot: Shot, out: str, fps: float, frames: int) -> None:
    """Frames as fast as they can be made; stamps are the frames' own times."""
    from ._bars import bar

    with bar(Path(out).name, frames, "frames", quiet=frames == 1) as advance:
        for index in range(frames):
            t_ns = round(index * NS_PER_S / fps)
            shot.take(t_ns, t_ns, FakeClock(t_ns))
            advance()


def _stream(shot: Shot, out: str, fps: float, seconds: float | None) -> None:
    """Frames when they are due by the clock; those it cannot keep up with are left out."""
    from ..simulation.pacing import Pacer
    from ._progress import StatusLine

    pacer = Pacer(fps)
    wait = threading.Event().wait
    end_ns = math.inf if seconds is None else seconds * NS_PER_S
    shot.take(0, now_ns(), now_ns)  # compiles on a machine's first run
    began_ns, reported_ns = now_ns(), 0
    with StatusLine() as status, contextlib.suppress(KeyboardInterrupt):
        while (due_ns := pacer.due_ns(now_ns() - began_ns)) < end_ns:
            early_ns = began_ns + due_ns - now_ns()
            if early_ns > 0:
                wait(early_ns / NS_PER_S)
            shot.take(due_ns, began_ns + due_ns, now_ns)
            elapsed_ns = now_ns() - began_ns
            if elapsed_ns - reported_ns >= REPORT_NS:
                reported_ns = elapsed_ns
                status.show(f"{out}: {_rate(pacer, elapsed_ns)}; Ctrl-C ends it")


def _rate(pacer: Pacer, elapsed_ns: int) -> str:
    return f"{pacer.taken / elapsed_ns * NS_PER_S:.1f} frames/s, {pacer.skipped} skipped"
