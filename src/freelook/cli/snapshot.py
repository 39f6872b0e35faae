"""One view of what a camera shows now, as a PNG that says where it looks.

  freelook snapshot /dev/video0 view.png --lens lens.json --yaw -35 --hfov 80

The PNG has the direction, the field of view, the lens as a profile and the time in its text
chunks. During a flight: freelook fly ... --show snapshot:PATH
"""

from __future__ import annotations

import argparse

from ..clock import now_ns
from ..errors import SourceError
from ..mailbox import Mailbox
from ..rotations import body_from_view
from ..session import Session
from ..types import Frame
from ..viewport import Viewport
from ._arguments import add_projection_argument, size
from ._cameras import add_lens_arguments, mounted_camera
from ._circles import camera_by_circle
from ._progress import say
from ._renderers import add_renderer_arguments, opened_renderer

LOOK_S = 0.5  # between looks at why there is no picture yet


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("source", metavar="SOURCE", help="as of freelook fly")
    parser.add_argument("output", metavar="OUT", help="a .png file, or a folder for dated ones")
    add_lens_arguments(parser)
    for name, to in (("yaw", "right"), ("pitch", "up"), ("roll", "right ear down")):
        parser.add_argument(
            f"--{name}", type=float, default=0.0, metavar="DEG", help=f"look this far {to}"
        )
    parser.add_argument("--hfov", type=float, default=90.0, metavar="DEG", help="10-150 (90)")
    add_projection_argument(parser)
    parser.add_argument(
        "--size", type=size, default=(1280, 720), metavar="WxH", help="of the view (1280x720)"
    )
    parser.add_argument(
        "--wait", type=float, default=15.0, metavar="S", help="so long for the first picture (15)"
    )
    add_renderer_arguments(parser)


def run(args: argparse.Namespace) -> int:
    from ..formats import Profile
    from ..formats.freelook import write
    from ..outputs.group import facts
    from ..sinks import SinkSettings, snapshot

    viewport = Viewport(args.size, args.hfov, args.projection)
    sink = snapshot.open(args.output, SinkSettings(args.size))
    camera = mounted_camera(args, lambda fov_deg: camera_by_circle(args.source, fov_deg))
    look = body_from_view(args.yaw, args.pitch, args.roll)
    box: Mailbox[Frame] = Mailbox()
    session = Session(box, camera, lambda _now, _then: look, opened_renderer(args), viewport)
    box.put(first_frame(args.source, args.wait))
    view = session.step(now_ns())
    assert view is not None
    sink.note(facts(view, viewport, write(Profile(camera))))
    sink.write(Frame(view.picture, view.capture_ns))
    say(f"{sink.written}")
    return 0


def first_frame(source: str, wait_s: float) -> Frame:
    """The first picture; SourceError with what is wrong when none comes."""
    from ..ingest import Ingest
    from ..sources import open_source

    ingest = Ingest(lambda: open_source(source, loop=False))
    frames = ingest.frames()
    ingest.start()
    try:
        until_ns = now_ns() + round(wait_s * 1e9)
        while (at_ns := now_ns()) < until_ns:
            if frame := frames.take(min(LOOK_S, (until_ns - at_ns) / 1e9)):
                return frame
            if ingest.status(at_ns).state in ("ended", "failed"):
                break
        message = ingest.status(now_ns()).message
        raise SourceError(f"{source}: no picture in {wait_s:g} s: {message}", retry=True)
    finally:
        ingest.close()
