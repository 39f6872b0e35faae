"""Where views go: one file per kind of output, found by itself.

A sink module has a one-line docstring (its row in the documentation), `KIND`, and two functions:
`recognises(argument)` says whether this is one of its own, and `open(argument, settings)` makes
the sink. Opening checks what can be checked at once, such as a file that is there already. A sink
that is opened only with the first picture may have `check(argument, settings)` too, and one that
writes more than pictures `note(facts)`, called before each `write` with where the view looks. One
that others connect to may have `secured(argument)`, the argument with a password where it needs
one, and `invitation(argument)`, what to give to those who may come.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Literal

from ..addresses import without_password
from ..errors import SinkError
from ..plugins import modules_by_kind
from ..types import ColorSpace, Sink

By = Literal["auto", "software", "hardware"]


@dataclass(frozen=True)
class SinkSettings:
    """What to write. A sink raises SinkError for a setting that it cannot follow.

    size         (width, height) of every frame
    fps          nominal frames per second; recorded times come from the frames themselves
    color        colour space of the frames and of what is written
    codec        h264 or h265
    overwrite    replace a file that is there already
    audio_from   a recording whose sound is copied, at its own times
    sdp          a file to write the description of a live stream to
    bitrate      bits per second of a live stream; None: by the size
    encoder      of a live stream: auto, software or hardware (`freelook.media.encoder`)
    preset       of x264 or x265 for a video file, such as fast; None: a quick one
    """

    size: tuple[int, int]
    fps: float = 30.0
    color: ColorSpace = ColorSpace()  # noqa: RUF009 - frozen
    codec: str = "h264"
    overwrite: bool = False
    audio_from: str | None = None
    sdp: str | None = None
    bitrate: int | None = None
    encoder: By = "auto"
    preset: str | None = None


def modules() -> dict[str, ModuleType]:
    """The sink modules by their KIND."""
    return modules_by_kind(__name__)


def open_sink(
    argument: str,
    *,
    size: tuple[int, int],
    fps: float = 30.0,
    color: ColorSpace = ColorSpace(),  # noqa: B008 - frozen
    codec: str = "h264",
    overwrite: bool = False,
    audio_from: str | None = None,
    sdp: str | None = None,
    bitrate: int | None = None,
    encoder: By = "auto",
    preset: str | None = None,
) -> Sink:
    """The sink that an argument names: a file, an address, or `KIND:ARGUMENT`.

    The settings are those of `SinkSettings`. SinkError when the argument means nothing here or
    the output cannot be opened.
    """
    settings = SinkSettings(
        size, fps, color, codec, overwrite, audio_from, sdp, bitrate, encoder, preset
    )
    module, argument = find(argument)
    if module.KIND != "video":
        refuse(settings, f"{argument}, which is no video file,", "preset")
    sink: Sink = module.open(argument, settings)
    return sink


def check_sink(argument: str, settings: SinkSettings) -> None:
    """SinkError for what is known to be wrong before anything is opened: each module may have a
    `check(argument, settings)`."""
    module, argument = find(argument)
    if check := getattr(module, "check", None):
        check(argument, settings)


def find(argument: str) -> tuple[ModuleType, str]:
    """The module for an argument, and the argument without its kind. SinkError if there is none."""
    kinds = modules()
    prefix, colon, rest = argument.partition(":")
    if colon and prefix in kinds and not rest.startswith("//"):
        return kinds[prefix], rest
    return _recognise(argument, kinds), argument


def _recognise(argument: str, kinds: Mapping[str, ModuleType]) -> ModuleType:
    for module in kinds.values():
        if module.recognises(argument):
            return module
    rows = "\n".join(
        f"  {kind + ':':<9} {(module.__doc__ or '').splitlines()[0]}"
        for kind, module in kinds.items()
    )
    shown = without_password(argument)
    raise SinkError(f"do not know how to write '{shown}'; outputs are:\n{rows}")


def check_output_file(argument: str, *, overwrite: bool) -> Path:
    """The path, if a file may be written there; else SinkError says what to do."""
    path = Path(argument)
    if path.is_dir():
        raise SinkError(f"{argument} is a folder; name a file in it")
    if not path.parent.is_dir():
        raise SinkError(f"the folder {path.parent} does not exist; make it first")
    if path.exists() and not overwrite:
        raise SinkError(f"{argument} exists already; name another file or give --overwrite")
    return path


def refuse(settings: SinkSettings, what: str, *names: str) -> None:
    """SinkError for settings that this kind of output cannot follow."""
    for name in names:
        if getattr(settings, name):
            raise SinkError(
                f"{what} cannot have {name.replace('_', ' ')} = {getattr(settings, name)}"
            )
