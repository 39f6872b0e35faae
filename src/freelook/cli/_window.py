"""`freelook fly --show window`: its options, and a flight in a window of this machine."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from ..camera import Camera
from ..clock import now_ns
from ..errors import RenderError
from ..gimbal import LensLimit
from ..hud import Link, Recording, Situation
from ..viewport import Viewport
from ._arguments import size
from ._progress import say
from ._shows import FlightLine, Shown, shown_outputs
from ._signals import asked_to_stop
from ._stabilising import vehicle_for

if TYPE_CHECKING:
    from ..head import Head
    from ..ingest import Ingest
    from ..outputs.spec import OutputSpec
    from ..vehicle import Vehicle
    from ..window.ages import Figures
    from ..window.overlay import Told

EYES = ("mono", "side-by-side", "top-bottom")
KEYS = (
    "drag or arrows look, wheel or + and - zoom, R recentres, E eyes front and back, M mode, "
    "O projection, G gives the tracker control again, I lines on and off, U their colours, "
    "F full screen, Q or Esc ends"
)


def add_window_arguments(parser: argparse.ArgumentParser) -> None:
    window = parser.add_argument_group("in a window (--show window)")
    window.add_argument(
        "--window-size", type=size, default=(1280, 720), metavar="WxH", help="(1280x720)"
    )
    window.add_argument(
        "--monitor", metavar="N", help="fill this screen at once: its number, or part of its name"
    )
    window.add_argument(
        "--eyes", choices=EYES, default="mono", help="for stereo goggles and viewers"
    )
    window.add_argument(
        "--eye-offset",
        type=float,
        default=0.0,
        metavar="PX",
        help="move each eye's view towards the nose",
    )
    window.add_argument(
        "--viewer-lens",
        type=two_numbers,
        default=(0.0, 0.0),
        metavar="K1,K2",
        help="shrink what the lenses of a viewer enlarge: by 1 + K1 r^2 + K2 r^4",
    )
    window.add_argument(
        "--no-vsync", action="store_true", help="do not wait for the screen: sooner, but torn"
    )


def two_numbers(text: str) -> tuple[float, float]:
    """K1,K2."""
    try:
        one, two = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not K1,K2, such as 0.22,0.24") from None
    return one, two


def fly_in_window(
    args: argparse.Namespace,
    ingest: Ingest,
    camera: Camera,
    window: OutputSpec,
    others: Sequence[OutputSpec] = (),
) -> None:
    """Until the window is closed or Ctrl-C; then says how old poses were when they were shown.

    `others` are shown at the same time.
    """
    from ..window.eyes import Optics
    from ..window.flight import Flight, Outside
    from ..window.pilot import Pilot
    from ..window.surface import Surface
    from .fly import gimbal_for, open_heads

    if args.projection == "strip":
        raise RenderError(
            "a strip is lower than a window; take --projection equirectangular, or --show page"
        )
    view = Viewport((640, 64), window.hfov_deg or args.hfov, args.projection)  # within its limits
    optics = Optics(args.eyes, args.eye_offset, args.viewer_lens)
    vehicle = vehicle_for(args, ingest, camera)
    with contextlib.ExitStack() as opened:
        size_points = window.size or args.window_size
        surface = opened.enter_context(Surface(size_points, args.monitor, not args.no_vsync))
        say(f"window: drawn by {surface.renderer}")
        say(KEYS)
        gimbal = partial(gimbal_for, args, vehicle.stabiliser)
        heads = open_heads(args.tracker, gimbal, opened)
        opened.callback(vehicle.close)
        opened.callback(ingest.close)
        line = opened.enter_context(FlightLine(others))
        outputs = opened.enter_context(
            shown_outputs(args, others, ingest, camera, heads, vehicle.stabiliser, line)
        )
        frames = ingest.frames()
        ingest.start()
        vehicle.start()
        for head in heads.values():
            head.start()
        report = Report(ingest, vehicle, heads, line, outputs)
        outside = Outside(now_ns, opened.enter_context(asked_to_stop()), report.grey, report.told)
        pilot = Pilot(heads, view.hfov_deg, vehicle.stabiliser, args.projection)
        limit = LensLimit(camera) if args.limit == "soft" else None
        flight = Flight(
            surface, frames, camera, pilot, outside, optics, args.sampling, limit, args.hud
        )
        opened.callback(lambda: say(summary(flight.figures)))
        flight.run()


class Report:
    """How the source, the mode, the trackers and the outputs are: on the terminal's line, and for
    the HUD."""

    def __init__(
        self,
        ingest: Ingest,
        vehicle: Vehicle,
        heads: Mapping[str, Head],
        line: FlightLine,
        outputs: Shown,
    ) -> None:
        self._ingest, self._vehicle, self._heads = ingest, vehicle, heads
        self._line, self._outputs = line, outputs

    def grey(self, at_ns: int) -> float:
        """Says it; the picture greys while the source is lost."""
        status, mode = self._ingest.status(at_ns), self._vehicle.status()
        parts = [f"source: {status.state}", status.message, f"mode: {mode.mode}", mode.message]
        told = [head.status(at_ns) for head in self._heads.values()]
        parts += [f"{one.name} {one.state}: {one.message}" for one in told if one.message]
        parts.append(self._outputs())
        self._line.show("; ".join(filter(None, parts)))
        return 1.0 if status.state == "lost" else 0.0

    def told(self, at_ns: int) -> Told:
        from ..window.overlay import Told

        source, mode = self._ingest.status(at_ns), self._vehicle.status()
        recordings = self._outputs.recordings()
        situation = Situation(
            source_state=source.state,
            source_message=source.message,
            mode=mode.mode,
            mode_trouble=mode.message,
            broken=tuple(one.message for one in recordings if one.state == "failed"),
        )
        shown = [one.counters.get("shown", 0) for one in recordings if one.state == "live"]
        recording = Recording("live", max(shown)) if shown else None
        return Told(situation, Link(source.state, source.counters.get("lost", 0)), recording)


def summary(figures: Figures) -> str:
    if not figures.views:
        return "window: no picture was shown"
    return (
        f"window: {figures.views} views, {figures.rate_hz:.1f} a second, {figures.missed} late; "
        f"pose to swap: {figures.pose_to_swap}; pose read to swap: {figures.latch_to_swap}; "
        f"video age: {figures.video_age}"
    )
