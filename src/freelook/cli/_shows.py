"""`freelook fly --show ...`: what is shown, and a flight without page or window."""

from __future__ import annotations

import argparse
import contextlib
import time
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from types import TracebackType
from typing import TYPE_CHECKING

from ..camera import Camera
from ..clock import now_ns
from ..errors import SinkError
from ..gimbal import Stabiliser
from ..head import Head
from ._progress import StatusLine, say
from ._renderers import renderer_maker
from ._signals import asked_to_stop
from ._stabilising import vehicle_for

if TYPE_CHECKING:  # slow to load, and may be missing
    from ..ingest import Ingest, IngestStatus
    from ..outputs.group import Outputs
    from ..outputs.runner import OutputStatus
    from ..outputs.spec import OutputSpec

SCREENS = ("page", "window")
STATUS_S = 0.25


def add_show_argument(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--show",
        action="append",
        default=[],
        metavar="KIND[:WHERE][,KEY=VALUE...]",
        help="page (the default; for browsers), window, stream:URL (rtp, udp, rtsp, "
        "rtsp-server, whip+http, whip+https), file:PATH, "
        "snapshot:PATH, terminal or virtual-camera; can be given again. Keys: size=1280x720, "
        "hfov=90, projection=NAME, layout=quad|pip|panorama, "
        "hud=on (or a theme of --hud: lines burnt into the picture), head=NAME (of a tracker), "
        "yaw=, pitch=, roll= (a fixed direction), fps=, bitrate=4M, codec=h264|h265, "
        "encoder=auto|software|hardware, sdp=FILE, every=SECONDS, overwrite",
    )


def parsed_shows(texts: Sequence[str]) -> tuple[OutputSpec, list[OutputSpec]]:
    """(the page or window, or what comes first; all others). SinkError for two screens."""
    from ..outputs.spec import parse

    specs = [parse(text) for text in texts or ("page",)]
    screens = [spec for spec in specs if spec.kind in SCREENS]
    if len(screens) > 1:
        raise SinkError(
            f"--show {' and --show '.join(s.text for s in screens)}: only one page or window to a "
            "flight; other machines can open the page's address too"
        )
    first = next(iter(screens), specs[0])
    return first, [spec for spec in specs if spec is not first]


class FlightLine:
    """What a flight says of itself: on its line, or in a view that fills the terminal."""

    def __init__(self, specs: Sequence[OutputSpec]) -> None:
        taken = any(spec.kind == "terminal" for spec in specs)
        self._line = None if taken else StatusLine()
        self.newest = ""

    def __enter__(self) -> FlightLine:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._line is not None:
            self._line.__exit__(kind, error, trace)

    def show(self, text: str) -> None:
        self.newest = text
        if self._line is not None:
            self._line.show(text)


class Shown:
    """The outputs of a flight, or none."""

    def __init__(self, outputs: Outputs | None = None) -> None:
        self._outputs = outputs

    def __call__(self) -> str:
        """How they are, in one line."""
        return self._outputs.summary() if self._outputs else ""

    def recordings(self) -> list[OutputStatus]:
        """Of those that are video files."""
        status = self._outputs.status() if self._outputs else []
        return [one for one in status if one.name.startswith("file:")]


@contextlib.contextmanager
def shown_outputs(
    args: argparse.Namespace,
    specs: Sequence[OutputSpec],
    ingest: Ingest,
    camera: Camera,
    heads: Mapping[str, Head],
    stabiliser: Stabiliser,
    line: FlightLine,
) -> Iterator[Shown]:
    """Shows them until the end; yields what says how they are."""
    if not specs:
        yield Shown()
        return
    with _outputs(args, specs, ingest, camera, heads, stabiliser, line) as outputs:
        yield Shown(outputs)


def _outputs(
    args: argparse.Namespace,
    specs: Sequence[OutputSpec],
    ingest: Ingest,
    camera: Camera,
    heads: Mapping[str, Head],
    stabiliser: Stabiliser,
    line: FlightLine,
) -> Outputs:
    from ..outputs.group import Flight, Outputs

    flight = Flight(
        ingest,
        camera,
        heads,
        stabiliser,
        renderer_maker(args),
        hfov_deg=args.hfov,
        projection=args.projection,
        soft_limit=args.limit == "soft",
        state=lambda: line.newest,
    )
    outputs = Outputs(specs, flight)
    for invitation in outputs.invitations:
        for url in reachable(invitation):
            say(f"stream: {url}")
    return outputs


def reachable(url: str) -> list[str]:
    """Of a server at every address of this machine: one for each, where they can be known."""
    try:
        from ..web.security import local_addresses
    except ImportError:  # of the extra "web", which streams do not need
        return [url]
    every = {"0.0.0.0": 4, "[::]": 6}
    host = next((host for host in every if f"@{host}:" in url), None)
    if host is None:
        return [url]
    found = [a for a in local_addresses() if every[host] == 6 or ":" not in a]
    shown = [f"[{a}]" if ":" in a else a for a in ["127.0.0.1", *found]]
    return [url.replace(f"@{host}:", f"@{address}:") for address in shown]


def fly_outputs(
    args: argparse.Namespace, ingest: Ingest, camera: Camera, specs: Sequence[OutputSpec]
) -> None:
    """Without page or window: until Ctrl-C or the end of the recording.

    SinkError when nothing is shown any more, as every output failed for good.
    """
    from .fly import gimbal_for, open_heads

    vehicle = vehicle_for(args, ingest, camera)
    with contextlib.ExitStack() as opened:
        stop = opened.enter_context(asked_to_stop())
        heads = open_heads(args.tracker, partial(gimbal_for, args, vehicle.stabiliser), opened)
        opened.callback(vehicle.close)
        line = opened.enter_context(FlightLine(specs))
        opened.callback(ingest.close)
        outputs = opened.enter_context(
            _outputs(args, specs, ingest, camera, heads, vehicle.stabiliser, line)
        )
        ingest.start()
        vehicle.start()
        for head in heads.values():
            head.start()
        while not stop():
            status = ingest.status(now_ns())
            line.show(source_line(status, outputs.summary()))
            if outputs.all_failed:
                raise SinkError(outputs.summary())
            if status.state in ("ended", "failed"):
                return
            time.sleep(STATUS_S)


def source_line(status: IngestStatus, outputs: str) -> str:
    source = f"source: {status.state}"
    return "; ".join(filter(None, (source, status.message, outputs)))
