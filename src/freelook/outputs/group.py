"""All outputs of a flight: made from what was asked for, watched, closed together."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import TracebackType

from ..addresses import without_password
from ..camera import Camera
from ..clock import Clock, now_ns
from ..errors import SinkError
from ..formats import Profile
from ..formats.freelook import write
from ..gimbal import LensLimit, Stabiliser
from ..head import Head
from ..hud.definition import theme_named
from ..ingest import Ingest
from ..mailbox import Mailbox
from ..renderers import Renderer
from ..renderers.layout import SMALLEST_PX, LayoutRenderer
from ..rotations import body_from_view, head_angles_deg
from ..session import Aim, Session, View
from ..sinks import SinkSettings, check_sink, find, open_sink
from ..types import ColorSpace, Frame, Picture, Sink
from ..viewport import Viewport
from .runner import Output, OutputStatus
from .spec import OutputSpec

SIZE = (1280, 720)
NOMINAL_FPS = 30.0  # for bit rate and key pictures, where no rate was asked for
# what a kind is without being told: views a second
RATES_HZ = {"snapshot": 0.1, "terminal": 10.0}
# SINK: the module that writes a kind, where the argument does not say so itself
SINKS = {"file": "video", "snapshot": "snapshot", "terminal": "terminal"}
SINKS |= {"virtual-camera": "virtual-camera"}
STREAMS = ("rtp", "udp", "rtsp-server", "rtsp", "whip")
CODED = ("stream", "file")  # in which four pixels share a colour
# another attempt may help where the other end can come back, not where a file broke off
TRIED_AGAIN = ("stream", "snapshot", "virtual-camera")


@dataclass(frozen=True)
class Flight:
    """What all outputs have in common. `renderer` is called once for each, on its thread;
    `state` says how the flight goes, for outputs that show words too."""

    ingest: Ingest
    camera: Camera
    heads: Mapping[str, Head]
    stabiliser: Stabiliser
    renderer: Callable[[], Renderer]
    hfov_deg: float = 90.0
    projection: str = "perspective"
    soft_limit: bool = False
    state: Callable[[], str] = str
    clock: Clock = now_ns


class Outputs:
    """Of a flight; nothing is opened before `start`, but what can be wrong is found here.

    SinkError for a head that is not there or an output that cannot be. Use it in `with`.
    `invitations` are addresses at which viewers find what waits for them, passwords included.
    """

    def __init__(self, specs: Sequence[OutputSpec], flight: Flight) -> None:
        specs = [secured(spec) for spec in specs]
        for spec in specs:
            check(spec, flight)
        self.invitations = [told for spec in specs if (told := invitation(spec))]
        self.outputs = [make_output(spec, flight) for spec in specs]
        self._clock = flight.clock

    def __enter__(self) -> Outputs:
        for output in self.outputs:
            output.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for output in self.outputs:
            output.close()

    def status(self) -> list[OutputStatus]:
        return [output.status(self._clock()) for output in self.outputs]

    def summary(self) -> str:
        """In one line; empty without outputs."""
        return "; ".join(str(status) for status in self.status())

    @property
    def all_failed(self) -> bool:
        return bool(self.outputs) and all(output.failed for output in self.outputs)


def view_of(spec: OutputSpec, flight: Flight) -> Viewport:
    """RenderError for a view that cannot be."""
    size = settings_of(spec, ColorSpace()).size
    projection = spec.projection or flight.projection
    return Viewport(size, spec.hfov_deg or flight.hfov_deg, projection)


def check(spec: OutputSpec, flight: Flight) -> None:
    """What can be known to be wrong before there is a picture."""
    settings = settings_of(spec, ColorSpace())
    view_of(spec, flight)
    if spec.kind in CODED and any(side % 2 for side in settings.size):
        raise SinkError(f"--show {spec.text}: video needs an even width and height")
    if spec.layout and min(settings.size) < SMALLEST_PX:
        raise SinkError(
            f"--show {spec.text}: too small for several views; "
            f"make both sides at least {SMALLEST_PX}"
        )
    aim_of(spec, flight)
    check_sink(sink_argument(spec), settings)


def make_output(spec: OutputSpec, flight: Flight) -> Output:
    viewport = view_of(spec, flight)
    limit = LensLimit(flight.camera) if flight.soft_limit else None
    aim, camera = aim_of(spec, flight), flight.camera
    lens = write(Profile(camera))

    def make_session(box: Mailbox[Frame]) -> Session:
        renderer = flight.renderer()
        if spec.layout:
            renderer = LayoutRenderer(renderer, spec.layout)
        return Session(box, camera, aim, renderer, viewport, limit)

    def opened(color: ColorSpace) -> Sink:
        return open_sink(sink_argument(spec), **vars(settings_of(spec, color)))

    return Output(
        spec.name,
        flight.ingest.frames(),
        make_session,
        opened,
        clock=flight.clock,
        rate_hz=rate_of(spec),
        retry=spec.kind in TRIED_AGAIN,
        describe=lambda view: facts(view, viewport, lens) | {"state": flight.state()},
        finish=burnt_in(spec, flight, viewport) if spec.hud else as_rendered,
    )


def as_rendered(view: View) -> Picture:
    return view.picture


def burnt_in(spec: OutputSpec, flight: Flight, viewport: Viewport) -> Callable[[View], Picture]:
    """What draws the HUD of the spec's theme into views."""
    from .hud import BurntHud

    head = flight.heads.get(spec.head or next(iter(flight.heads), ""))
    follows = None if spec.look_deg is not None else head
    return BurntHud(theme_named(spec.hud or ""), viewport, flight, follows)


def secured(spec: OutputSpec) -> OutputSpec:
    """With a password where other machines may come and none was given."""
    if spec.kind == "stream" and (made := getattr(find(spec.argument)[0], "secured", None)):
        return replace(spec, argument=made(spec.argument))
    return spec


def invitation(spec: OutputSpec) -> str:
    """Empty for what nobody comes to."""
    if spec.kind == "stream" and (made := getattr(find(spec.argument)[0], "invitation", None)):
        return str(made(spec.argument))
    return ""


def rate_of(spec: OutputSpec) -> float | None:
    return spec.rate_hz or RATES_HZ.get(spec.kind)


def sink_argument(spec: OutputSpec) -> str:
    """For `open_sink`. SinkError where it is no stream."""
    if spec.kind != "stream":
        return f"{SINKS[spec.kind]}:{spec.argument}"
    module, _ = find(spec.argument)
    if module.KIND not in STREAMS:
        address = without_password(spec.argument)
        raise SinkError(f"{address} is no live stream; for files there is file:PATH")
    return spec.argument


def settings_of(spec: OutputSpec, color: ColorSpace) -> SinkSettings:
    size = spec.size or SIZE
    if spec.kind == "terminal":
        from ..sinks.terminal import view_size

        size = view_size()
    return SinkSettings(
        size,
        fps=rate_of(spec) or NOMINAL_FPS,
        color=color,
        codec=spec.codec,
        overwrite=spec.overwrite,
        sdp=spec.sdp,
        bitrate=spec.bitrate,
        encoder=spec.encoder,
    )


def aim_of(spec: OutputSpec, flight: Flight) -> Aim:
    """The head asked for, or the first; a fixed direction in the gimbal's mode without any."""
    if spec.look_deg is not None or (spec.head is None and not flight.heads):
        fixed = body_from_view(*(spec.look_deg or (0.0, 0.0, 0.0)))
        at = flight.stabiliser.at
        return lambda now_ns, capture_ns: at(now_ns, capture_ns).body_from_base * fixed
    name = spec.head or next(iter(flight.heads))
    if name not in flight.heads:
        known = ", ".join(flight.heads) or "none; add --tracker NAME=KIND:ARGUMENT"
        raise SinkError(f"--show {spec.text}: there is no head '{name}'; heads: {known}")
    head = flight.heads[name]
    return lambda now_ns, capture_ns: head.aim(now_ns, capture_ns).body_from_view


def facts(view: View, viewport: Viewport, lens: str) -> dict[str, str]:
    """What a view shows, for its file: where it looks relative to the vehicle, through which lens
    (a profile), and when the frame was taken, on the machine's monotonic clock."""
    yaw, pitch, roll = head_angles_deg(view.body_from_view)
    return {
        "yaw_deg": f"{yaw:.4f}",
        "pitch_deg": f"{pitch:.4f}",
        "roll_deg": f"{roll:.4f}",
        "hfov_deg": f"{viewport.hfov_deg:g}",
        "projection": viewport.projection,
        "lens": lens,
        "capture_ns": str(view.capture_ns),
    }
