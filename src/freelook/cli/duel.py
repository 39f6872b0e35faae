"""freelook against a servo gimbal: the same head, camera, link and display, modelled and measured.

Each HEAD_FILE is a recording of a head: a first line that names its columns, timestamp and w x y z
among them, or a pose script (t_s,yaw_deg,pitch_deg,roll_deg). Without one, a made-up head moves for
a minute. The motion goes through two chains of delays: freelook's, which turns a virtual camera in
the video that has arrived, and a gimbal's, whose motors turn the camera itself.

Told are the angle between where the head looks and what it is shown at that time (median, 95th
and 99th percentile), the lag by cross-correlation, how late a turn of 60 degrees is shown, and how
old the picture is. There freelook wins nothing: the link is the same, the way into a computer
longer.

  freelook duel
  freelook duel user1.txt user2.txt --gimbal hobby-servo --link analogue --out duel
  freelook duel user1.txt --gimbal brushless --link digital --predict both
  freelook duel --seconds 20 --out duel --video
  freelook duel --set slew_deg_s=300 --set accel_deg_s2=5000
  freelook duel --list

The motors are modelled at their best: no load, no play, never an overshoot. docs/duel.md says
where every figure is from and what the model leaves out.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..clock import NS_PER_S
from ..errors import SinkError, TrackerError
from ._progress import say
from .simulate import positive

if TYPE_CHECKING:
    from ..duel.contest import Duel, MakePredictor, Side
    from ..duel.figures import Figure, Settings
    from ..duel.head import HeadMotion

WHO = ("freelook", "both", "none")
VIDEO_SECONDS = 20.0
VIDEO_FPS = 30.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "heads", nargs="*", metavar="HEAD_FILE", help="recorded heads (default: a made-up one)"
    )
    parser.add_argument(
        "--gimbal", default="hobby-servo", metavar="PRESET", help="default: hobby-servo; see --list"
    )
    parser.add_argument(
        "--link",
        default="analogue",
        metavar="PRESET",
        help="video link, radio and display (default: analogue; see --list)",
    )
    parser.add_argument(
        "--set",
        type=setting,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="change one figure; may be given several times (--list shows the names)",
    )
    parser.add_argument(
        "--predict",
        choices=WHO,
        default="freelook",
        help="who predicts the head: freelook, as when flying (default); both; none",
    )
    parser.add_argument(
        "--predictor", metavar="NAME", help="how (default: freelook's own; see freelook.prediction)"
    )
    parser.add_argument("--start", type=float, default=0.0, metavar="S", help="begin here")
    parser.add_argument(
        "--seconds", type=positive, metavar="S", help="use so much of each head (default: all)"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="write duel.json and a plot of each head here"
    )
    parser.add_argument(
        "--format", choices=("svg", "png"), default="svg", help="of the plots (default: svg)"
    )
    parser.add_argument(
        "--video",
        action="store_true",
        help="also both pilots' views side by side, over the simulated world (needs --out)",
    )
    parser.add_argument(
        "--video-seconds",
        type=positive,
        default=VIDEO_SECONDS,
        metavar="S",
        help=f"how long the video is at most (default: {VIDEO_SECONDS:.0f})",
    )
    parser.add_argument(
        "--lens", default="demo", metavar="PROFILE", help="freelook's fisheye (default: demo)"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist")
    parser.add_argument(
        "--list", action="store_true", help="show the presets, every figure with its source"
    )


def setting(text: str) -> tuple[str, float]:
    """NAME=VALUE."""
    name, equals, value = text.partition("=")
    try:
        if equals:
            return name.strip(), float(value)
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE, such as slew_deg_s=300")


def run(args: argparse.Namespace) -> int:
    from ..duel.contest import fight, steps
    from ..duel.figures import changed, figures, settings_of
    from ..formats import load_camera
    from ._bars import bar

    if args.list:
        _list()
        return 0
    chosen = changed(figures(args.gimbal, args.link), dict(args.set))
    settings = settings_of(chosen)
    ours, theirs = _predictors(args)
    heads = _heads(args)
    _check_out(args, [head.name for head in heads])
    field_deg = math.degrees(2 * load_camera(args.lens).theta_max)
    say(f"gimbal {args.gimbal}, link {args.link}, prediction: {args.predict}")
    say(f"  {_expected(settings)}")
    found = []
    for head in heads:
        total = steps(head, settings, ours is not None, theirs is not None)
        with bar(head.name, total, "steps") as advance:
            duel = fight(head, settings, ours, theirs, advance)
        found.append(duel)
        for line in _table(duel, field_deg):
            say(line)
        if args.out:
            _draw(args, duel)
        if args.video:
            _film(args, duel)
    if args.out:
        _write_json(args, found, chosen)
    return 0


def _predictors(args: argparse.Namespace) -> tuple[MakePredictor, MakePredictor]:
    from ..prediction import DEFAULT, make_predictor

    if args.predictor and args.predict == "none":
        raise TrackerError("--predictor says how to predict, --predict none that nobody does")
    name = args.predictor or DEFAULT
    make_predictor(name)  # says what is known, before long work

    def make() -> Any:
        return make_predictor(name)

    return (
        make if args.predict != "none" else None,
        make if args.predict == "both" else None,
    )


def _heads(args: argparse.Namespace) -> list[HeadMotion]:
    from ..duel.head import read_head, synthetic_head

    heads = [read_head(path) for path in args.heads] or [synthetic_head()]
    start_ns = round(args.start * NS_PER_S)
    cut = []
    for head in heads:
        end_ns = start_ns + round(args.seconds * NS_PER_S) if args.seconds else head.duration_ns
        cut.append(head.cut(start_ns, end_ns).centred())
    return cut


def _expected(settings: Settings) -> str:
    """The sums of the delays: what the measurement should find where nothing else is in the way."""
    return (
        f"delays add up to {settings.freelook_lag_ms:.0f} ms for freelook without prediction, "
        f"{settings.gimbal_lag_ms:.0f} ms for the gimbal before its motors' own time"
    )


def _table(duel: Duel, field_deg: float) -> Iterator[str]:
    yield f"{duel.head.name}, {duel.head.duration_ns / NS_PER_S:.0f} s"
    yield (
        f"  {'':<9} {'error p50':>9} {'p95':>6} {'p99':>6} deg {'lag':>6} ms   turn at "
        f"{'10':>5} {'50':>5} {'90 %':>5} ms   {'picture':>7} ms old"
    )
    for name, side in (("freelook", duel.freelook), ("gimbal", duel.gimbal)):
        yield _row(name, side)
    beyond = duel.beyond(field_deg)
    if beyond > 0.001:
        yield (
            f"  {100 * beyond:.0f} % of the time the head looks beyond a fixed fisheye of "
            f"{field_deg:.0f} degrees: right direction, nothing to see"
        )


def _row(name: str, side: Side) -> str:
    error = side.direction
    turn = " ".join(f"{median:5.0f}" for median, _ in side.turn_ms.values())
    return (
        f"  {name:<9} {error.p50:9.2f} {error.p95:6.2f} {error.p99:6.2f} {'':3} "
        f"{side.lag_ms:6.1f} {'':12} {turn} {'':4} {side.picture_age_ms.p50:7.0f}"
    )


def _list() -> None:
    from ..duel.figures import GIMBALS, HEAD, LINKS

    groups = [("head tracker and freelook's station", {"always": HEAD})]
    groups += [("--gimbal", GIMBALS), ("--link", LINKS)]
    for title, presets in groups:
        for name, preset in presets.items():
            say(f"{title} {name}" if title.startswith("--") else title)
            for key, figure in preset.items():
                say(f"  {key:<18} {figure.value:>8g}   {figure.source}")


def _check_out(args: argparse.Namespace, names: list[str]) -> None:
    """Everything that can be known to fail, before the work."""
    if args.video and not args.out:
        raise SinkError("--video needs --out DIR, the folder to write it to")
    if not args.out:
        return
    try:
        args.out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SinkError(f"cannot make {args.out}: {error.strerror}") from None
    if twice := [name for name in names if names.count(name) > 1]:
        raise SinkError(f"two heads are called {twice[0]}: their files would have one name")
    suffixes = [args.format, *(["mp4"] if args.video else [])]
    for file in ["duel.json", *(f"{_stem(name)}.{end}" for name in names for end in suffixes)]:
        _file(args, file)


def _file(args: argparse.Namespace, name: str) -> Path:
    from ..sinks import check_output_file

    return check_output_file(str(args.out / name), overwrite=args.overwrite)


def _stem(name: str) -> str:
    return name.replace(" ", "-")


def _draw(args: argparse.Namespace, duel: Duel) -> None:
    from ..plots._style import save
    from ..plots.duel import duel_figure

    path = _file(args, f"{_stem(duel.head.name)}.{args.format}")
    title = f"{duel.head.name}: freelook and a gimbal ({args.gimbal}, {args.link} link)"
    save(duel_figure(duel, title), path)
    say(f"  {path}")


def _film(args: argparse.Namespace, duel: Duel) -> None:
    from ..duel.views import SideBySide, times_ns
    from ..formats import load_camera
    from ..sinks import open_sink
    from ..viewport import Viewport
    from ._bars import bar

    path = _file(args, f"{_stem(duel.head.name)}.mp4")
    labels = ("freelook", f"gimbal: {args.gimbal}, {args.link} link")
    threads = os.cpu_count() or 1
    views = SideBySide(duel, load_camera(args.lens), Viewport((640, 480), 90), labels, threads)
    times = times_ns(duel, VIDEO_FPS)[: max(1, round(args.video_seconds * VIDEO_FPS))]
    sink = open_sink(str(path), size=views.size, fps=VIDEO_FPS, overwrite=args.overwrite)
    with contextlib.closing(sink), bar(path.name, len(times), "frames") as advance:
        for t_ns in times:
            sink.write(views.frame(t_ns))
            advance()
    say(f"  {path}")


def _write_json(args: argparse.Namespace, found: list[Duel], chosen: dict[str, Figure]) -> None:
    path = _file(args, "duel.json")
    document = {
        "gimbal": args.gimbal,
        "link": args.link,
        "predict": args.predict,
        "settings": {
            name: {
                "value": figure.value if math.isfinite(figure.value) else None,  # no limit
                "source": figure.source,
            }
            for name, figure in chosen.items()
        },
        "heads": [duel.numbers() for duel in found],
    }
    try:
        path.write_text(json.dumps(document, indent=2) + "\n", "utf-8")
    except OSError as error:
        raise SinkError(f"cannot write {path}: {error.strerror}") from None
    say(f"{path}")
