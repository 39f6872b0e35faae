"""Look around in live video: serves the page that shows the pilot's view.

The video goes to the browser untouched wherever the browser can decode it; the page turns the
view with the newest head pose. Stop with Ctrl-C.

  freelook fly /dev/video0 --lens lens.json
  freelook fly camera.sdp --lens lens.json --tracker opentrack --show window --monitor 2
  freelook fly camera.sdp --lens lens.json --show page --show stream:rtp://192.168.1.5:5600,hfov=70

With --show window the view is drawn on a screen of this machine instead: goggles on HDMI, say.
Streams, files, snapshots and the terminal are rendered here, each with its own view.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import re
import threading
import webbrowser
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..camera import Camera
from ..gimbal import Gimbal, GimbalSettings, Stabiliser
from ..head import Head
from ..hud.definition import THEMES
from ..prediction import make_predictor
from ..trackers import known_trackers, open_tracker
from ..viewport import Viewport
from ._arguments import add_projection_argument
from ._cameras import add_lens_arguments, mounted_camera
from ._circles import camera_by_circle
from ._progress import say
from ._renderers import add_renderer_arguments
from ._shows import FlightLine, add_show_argument, fly_outputs, parsed_shows, shown_outputs
from ._stabilising import (
    add_head_arguments,
    add_mode_arguments,
    gimbal_settings,
    vehicle_for,
)
from ._window import add_window_arguments, fly_in_window

if TYPE_CHECKING:  # the web libraries are slow to load, and may be missing
    from ..ingest import Ingest
    from ..outputs.spec import OutputSpec
    from ..web.serving import Door, Ending
    from ..web.station import About, Station

DEFAULT_PORT = 8042
HOLD_S = GimbalSettings().hold_s
EASE_S = GimbalSettings().ease_s
NAMED = re.compile(r"(?:([\w-]+)=)?(.*)", re.DOTALL)  # a tracker, maybe with a name of its own


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "source",
        metavar="SOURCE",
        help=f"a file, device or address, or KIND:ARGUMENT (kinds: {', '.join(source_kinds())})",
    )
    add_lens_arguments(parser)
    parser.add_argument("--loop", action="store_true", help="play a recording over and over")
    add_show_argument(parser)
    add_renderer_arguments(parser)
    add_flying_arguments(parser)
    add_window_arguments(parser)


def add_flying_arguments(parser: argparse.ArgumentParser) -> None:
    """What `fly` and `demo` share."""
    parser.add_argument(
        "--tracker",
        action="append",
        default=[],
        metavar="[NAME=]KIND:ARGUMENT",
        help=f"a head tracker, can be given again (kinds: {', '.join(known_trackers())}); "
        "mouse, touch, keys, gamepad and phone work in the page without any",
    )
    parser.add_argument(
        "--hold", type=float, default=HOLD_S, metavar="S", help="hold a lost tracker's view so long"
    )
    parser.add_argument(
        "--ease", type=float, default=EASE_S, metavar="S", help="then go to the centre in this time"
    )
    parser.add_argument(
        "--hfov", type=float, default=90.0, metavar="DEG", help="horizontal field of view at start"
    )
    add_projection_argument(parser)
    parser.add_argument(
        "--hud",
        choices=(*THEMES, "off"),
        default=THEMES[0],
        help="lines over the picture in page and window: head direction, horizon, dials, warnings; "
        "the colours to begin with (I switches them off and on, U changes the colours)",
    )
    add_head_arguments(parser)
    add_mode_arguments(parser)
    add_serving_arguments(parser)


def add_serving_arguments(parser: argparse._ActionsContainer) -> None:
    """Where the page is served, and to whom."""
    parser.add_argument(
        "--port",
        type=int,
        default=DEFAULT_PORT,
        metavar="N",
        help=f"port of the page (default {DEFAULT_PORT}, 0: any free one)",
    )
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="ADDRESS",
        help="listen here; 0.0.0.0 lets other machines in, with a token and by https",
    )
    parser.add_argument("--tls", action="store_true", help="serve by https on this machine too")
    parser.add_argument("--token", metavar="T", help="the token to ask for (default: a random one)")
    parser.add_argument("--cert", type=Path, metavar="FILE", help="TLS certificate (PEM)")
    parser.add_argument("--key", type=Path, metavar="FILE", help="its private key (PEM)")
    parser.add_argument(
        "--no-browser", action="store_true", help="only print the address, open no browser"
    )


def source_kinds() -> list[str]:
    """Kinds of sources, as far as the libraries they need are installed."""
    with contextlib.suppress(ModuleNotFoundError):
        from ..sources import modules

        return list(modules())
    return []


def run(args: argparse.Namespace) -> int:
    from ..ingest import Ingest
    from ..sources import open_source

    # says what is wrong with them before the camera is asked
    Viewport((640, 64), args.hfov, args.projection)
    first, others = parsed_shows(args.show)
    camera = mounted_camera(args, lambda fov_deg: camera_by_circle(args.source, fov_deg))
    ingest = Ingest(lambda: open_source(args.source, loop=args.loop))
    if first.kind == "window":
        fly_in_window(args, ingest, camera, first, others)
    elif first.kind == "page":
        from ..web.station import About

        about = About(
            args.source,
            False,
            args.hold,
            args.ease,
            args.hfov,
            args.limit,
            args.projection,
            args.hud,
        )
        fly(args, ingest, camera, about, never, others=others)
    else:
        fly_outputs(args, ingest, camera, [first, *others])
    return 0


def fly(
    args: argparse.Namespace,
    ingest: Ingest,
    camera: Camera,
    about: About,
    until: Ending,
    explain: Callable[[str], str] = lambda _state: "",
    others: Sequence[OutputSpec] = (),
) -> None:
    """Serve the page until Ctrl-C or until `until` returns or raises.

    `explain(state of the source)` may replace what is printed about the source; `others` are
    shown at the same time.
    """
    from ..web.server import make_app
    from ..web.serving import serve
    from ..web.station import Station

    Viewport((640, 64), about.hfov_deg, about.projection)  # these two say what is wrong
    gimbal_settings(args)
    vehicle = vehicle_for(args, ingest, camera)
    with contextlib.ExitStack() as opened, FlightLine(others) as line:
        gimbal = partial(gimbal_for, args, vehicle.stabiliser)
        heads = open_heads(args.tracker, gimbal, opened)
        door = opened.enter_context(opened_door(args))
        outputs = opened.enter_context(
            shown_outputs(args, others, ingest, camera, heads, vehicle.stabiliser, line)
        )
        station = Station(
            ingest, camera, heads, about, vehicle=vehicle, recordings=outputs.recordings
        )
        serving = serve(
            make_app(station, door.guard),
            door,
            ready=lambda: announce(door, not args.no_browser),
            report=lambda: line.show(summary(station, explain, outputs())),
            until=until,
        )
        asyncio.run(serving)


@contextlib.contextmanager
def opened_door(args: argparse.Namespace) -> Iterator[Door]:
    """Where to listen, from the arguments of `add_serving_arguments`."""
    from ..web.serving import open_door

    door = open_door(
        args.host,
        args.port,
        token=args.token,
        tls=args.tls,
        certificate=args.cert,
        key=args.key,
    )
    with door.socket:
        yield door


def gimbal_for(args: argparse.Namespace, stabiliser: Stabiliser | None = None) -> Gimbal:
    """A new one, as the arguments say."""
    return Gimbal(gimbal_settings(args), make_predictor(args.predictor), stabiliser)


def open_heads(
    specs: Sequence[str], gimbal: Callable[[], Gimbal], opened: contextlib.ExitStack
) -> dict[str, Head]:
    """Heads by name: as given (NAME=KIND:...), else the tracker's kind, numbered from the second
    of a name on."""
    heads: dict[str, Head] = {}
    for text in specs:
        match = NAMED.fullmatch(text)
        assert match is not None  # it takes anything
        given, spec = match.groups()
        name = _free_name(given or spec.partition(":")[0].partition("?")[0], heads)
        heads[name] = Head(name, open_tracker(spec), gimbal())
        opened.callback(heads[name].close)
    return heads


def _free_name(kind: str, taken: dict[str, Head]) -> str:
    names = [kind, *(f"{kind}{number}" for number in range(2, len(taken) + 2))]
    return next(name for name in names if name not in taken)


def announce(door: Door, open_browser: bool, *, webrtc: bool = True) -> None:
    from ..web.security import local_addresses
    from ..web.serving import can_open_browser

    for url in door.urls:
        say(f"view: {url}")
    if webrtc and not local_addresses():
        say(
            "this machine has no network address, and browsers take WebRTC video only over one: "
            "switch on any network, it need not lead anywhere"
        )
    if door.tls is not None:
        say("the browser will warn of a certificate it does not know, unless you gave a known one")
    if open_browser and can_open_browser():
        threading.Thread(target=webbrowser.open, args=(door.urls[-1],), daemon=True).start()


def summary(station: Station, explain: Callable[[str], str], outputs: str = "") -> str:
    """The station's state in one line."""
    status = station.status()
    source = status["source"]
    parts = [" ".join(filter(None, (source["state"], source["codec"], _size(source["size"]))))]
    message = explain(source["state"]) or source["message"]
    parts += [message, source["transcoding"] and f"transcoding: {source['transcoding']}"]
    parts += [f"{t['name']} {t['state']}" for t in status["trackers"]]
    vehicle = status["vehicle"]
    if vehicle["mode"] != "body":
        parts += [f"mode {vehicle['mode']}", vehicle["message"], vehicle["offset"]]
    viewers = status["viewers"]
    parts += [f"{viewers} viewer{'' if viewers == 1 else 's'}", outputs]
    return "; ".join(filter(None, parts))


def _size(size: Sequence[int] | None) -> str:
    return f"{size[0]}x{size[1]}" if size else ""


async def never() -> None:
    await asyncio.Event().wait()
