"""Render the view into a recording or a picture: look around afterwards.

  freelook render flight.mp4 left.mp4 --lens cam.json --yaw -35 --pitch 20 --hfov 80
  freelook render flight.mp4 view.mp4 --lens cam.json --poses head.csv --size 1920x1080
  freelook render shot.png view.png --lens cam.json --yaw 30
  freelook render shot.png wide.png --lens cam.json --projection pannini --hfov 170
  freelook render flight.mp4 level.mp4 --lens cam.json --stabilize horizon --attitude flight.ulg
  freelook render GX010001.MP4 calm.mp4 --lens cam.json --stabilize smooth --attitude GX010001.MP4

Frame times and sound are kept. Interrupted with Ctrl-C, what was written plays.
"""

from __future__ import annotations

import argparse
import itertools
import os
import sys
from collections.abc import Callable, Iterable

from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..errors import FreelookError, SourceError
from ..gimbal import LensLimit
from ..mailbox import Mailbox
from ..pose_script import read_script
from ..renderers import Renderer
from ..renderers.layout import LAYOUTS, LayoutRenderer
from ..rotations import body_from_view
from ..session import Session
from ..types import ColorSpace, Frame
from ..viewport import Viewport
from ._arguments import add_projection_argument, size
from ._cameras import add_lens_arguments, mounted_camera
from ._circles import camera_by_circle
from ._recording_aim import RecordingAim, add_stabilize_arguments, recording_aim
from ._renderers import add_renderer_arguments, opened_renderer
from ._stabilising import add_mode_arguments


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("input", metavar="IN", help="a video file or a picture")
    parser.add_argument("output", metavar="OUT", help="a video file (.mp4, .mkv) or a picture")
    add_lens_arguments(parser)
    for name, to in (("yaw", "right"), ("pitch", "up"), ("roll", "right ear down")):
        parser.add_argument(
            f"--{name}", type=float, default=0.0, metavar="DEG", help=f"look this far {to}"
        )
    parser.add_argument(
        "--poses",
        metavar="CSV",
        help="follow these poses instead: t_s,yaw_deg,pitch_deg,roll_deg or t_s,qw,qx,qy,qz, "
        "with times from the first frame",
    )
    parser.add_argument(
        "--hfov",
        type=float,
        default=90.0,
        metavar="DEG",
        help="horizontal field of view: 10-150, others than perspective views up to 360",
    )
    add_projection_argument(parser)
    parser.add_argument(
        "--size", type=size, default=(1280, 720), metavar="WxH", help="of the view (1280x720)"
    )
    parser.add_argument(
        "--layout",
        choices=("single", *LAYOUTS),
        default="single",
        help="several views in one picture: quad (also ahead, left, right), pip (with the whole "
        "fisheye), panorama (below a strip all around)",
    )
    add_mode_arguments(parser)
    add_stabilize_arguments(parser)
    add_renderer_arguments(parser)
    parser.add_argument(
        "--preset",
        metavar="NAME",
        help="of x264 for a video file, from ultrafast to veryslow: slower makes it smaller at "
        "the same quality (default: veryfast)",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace OUT if it exists")


def run(args: argparse.Namespace) -> int:
    from ..media.pictures import is_picture

    viewport = Viewport(args.size, args.hfov, args.projection)
    look = _look(args)
    if os.path.realpath(args.input) == os.path.realpath(args.output):
        raise FreelookError("IN and OUT are the same file; name another OUT")
    camera = mounted_camera(args, lambda fov_deg: camera_by_circle(args.input, fov_deg))
    aim = recording_aim(args, look, camera, viewport)
    if is_picture(args.input):
        _render_picture(args, camera, aim, viewport)
    else:
        _render_video(args, camera, aim, viewport)
    aim.report(args.output)
    return 0


def _renderer(args: argparse.Namespace) -> Renderer:
    renderer = opened_renderer(args)
    return renderer if args.layout == "single" else LayoutRenderer(renderer, args.layout)


def _look(args: argparse.Namespace) -> Callable[[int], Rotation]:
    """Where to look relative to what is kept steady; times count from the first frame."""
    if args.poses is None:
        fixed = body_from_view(args.yaw, args.pitch, args.roll)
        return lambda _now_ns: fixed
    if args.yaw or args.pitch or args.roll:
        raise FreelookError("give either --poses or --yaw, --pitch and --roll, not both")
    return read_script(args.poses).pose_at


def _render_picture(
    args: argparse.Namespace, camera: Camera, aim: RecordingAim, viewport: Viewport
) -> None:
    from ..media.pictures import is_picture, read_picture

    if not is_picture(args.output):
        raise FreelookError(f"IN is a picture, so OUT must be one too, not {args.output}")
    frame = read_picture(args.input)
    _write(args, [frame], camera, aim, viewport, total=1, color=frame.picture.color)


def _render_video(
    args: argparse.Namespace, camera: Camera, aim: RecordingAim, viewport: Viewport
) -> None:
    from ..media.decoder import Decoder
    from ..offline import decoded
    from ..sources import file

    source = file.FileSource(args.input, loop=False, pace=False, clock=lambda: 0)
    total = source.expected_frames  # asked before a short recording is read to its end
    decoder = Decoder(low_delay=False)
    frames = decoded(source.units(), decoder)
    first = next(frames, None)
    if first is None:
        raise SourceError(f"{args.input}: not a single picture in it can be decoded")
    _write(
        args,
        itertools.chain([first], frames),
        camera,
        aim,
        viewport,
        total=total,
        color=first.picture.color,
        fps=source.frames_per_s,
        audio_from=args.input,
    )
    if damaged := decoder.counters["undecodable"] + decoder.counters["corrupt"]:
        print(f"{args.input}: {damaged} damaged pictures, left out or patched up", file=sys.stderr)


def _write(
    args: argparse.Namespace,
    frames: Iterable[Frame],
    camera: Camera,
    aim: RecordingAim,
    viewport: Viewport,
    *,
    total: int | None,
    color: ColorSpace,
    fps: float = 30.0,
    audio_from: str | None = None,
) -> None:
    from ..offline import render_recording
    from ..sinks import open_sink
    from ._bars import bar

    mailbox: Mailbox[Frame] = Mailbox()
    limit = LensLimit(camera) if args.limit == "soft" else None
    session = Session(mailbox, camera, aim, _renderer(args), viewport, limit)
    sink = open_sink(
        args.output,
        size=viewport.size,
        fps=fps,
        color=color,
        overwrite=args.overwrite,
        audio_from=audio_from,
        preset=args.preset,
    )
    try:
        with bar(args.output, total, "frames", quiet=total == 1) as advance:
            render_recording(frames, mailbox, session, sink, advance)
    except KeyboardInterrupt:
        print(f"interrupted; what was written to {args.output} plays", file=sys.stderr)
        raise
    finally:
        sink.close()
