"""How an output is written down: `KIND:ARGUMENT,key=value,...`.

stream:rtp://192.168.1.5:5600,size=1280x720,hfov=90,head=observer
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..addresses import without_password
from ..errors import SinkError
from ..hud.definition import THEMES
from ..projections import PROJECTIONS
from ..renderers.layout import LAYOUTS
from ..sinks import By

LOOK = ("yaw", "pitch", "roll")
VIEW = ("size", "hfov", "projection", "layout", "hud", "head", *LOOK)
ENCODERS: tuple[By, ...] = ("auto", "software", "hardware")
CODECS = ("h264", "h265")

# kind -> (whether it needs an argument, what can be said about it)
KINDS: dict[str, tuple[bool, tuple[str, ...]]] = {
    "page": (False, ()),
    "window": (False, ("size", "hfov")),
    "stream": (True, (*VIEW, "fps", "codec", "bitrate", "encoder", "sdp")),
    "file": (True, (*VIEW, "fps", "codec", "overwrite")),
    "snapshot": (True, (*VIEW, "every")),
    "terminal": (False, ("hfov", "projection", "head", *LOOK, "fps")),
    "virtual-camera": (False, (*VIEW, "fps")),
}


@dataclass(frozen=True)
class OutputSpec:
    """One `--show`. What is None was not said.

    `look_deg` is (yaw, pitch, roll) of a view that follows no head; `rate_hz` views a second,
    else one for every frame of the video; `text` is as it was written, but for a password.
    """

    kind: str
    argument: str = ""
    text: str = ""
    size: tuple[int, int] | None = None
    hfov_deg: float | None = None
    projection: str | None = None
    layout: str | None = None
    hud: str | None = None
    head: str | None = None
    look_deg: tuple[float, float, float] | None = None
    rate_hz: float | None = None
    codec: str = "h264"
    bitrate: int | None = None
    encoder: By = "auto"
    sdp: str | None = None
    overwrite: bool = False

    @property
    def name(self) -> str:
        """For people: the kind, and where it goes, without a password."""
        return f"{self.kind}:{without_password(self.argument)}" if self.argument else self.kind


def parse(text: str) -> OutputSpec:
    """SinkError says what is wrong with it and what there is."""
    head, options = _split(text)
    kind, _, argument = head.partition(":")
    text = without_password(text)
    if kind not in KINDS:
        raise SinkError(f"--show {text}: unknown kind '{kind}'; known: {', '.join(KINDS)}")
    needed, allowed = KINDS[kind]
    if needed and not argument:
        raise SinkError(f"--show {text}: say where to: {kind}:{EXAMPLES[kind]}")
    shown = without_password(argument)
    if argument and not needed and kind != "virtual-camera":
        raise SinkError(f"--show {text}: {kind} takes no '{shown}'")
    for key in options:
        if key not in allowed:
            known = ", ".join(allowed) or "none"
            raise SinkError(f"--show {text}: {kind} has no option '{key}'; its options: {known}")
    return _with(OutputSpec(kind, argument, text), options)


EXAMPLES = {
    "stream": "rtp://127.0.0.1:5600",
    "file": "view.mp4",
    "snapshot": "view.png",
}


def _split(text: str) -> tuple[str, dict[str, str]]:
    """What comes before the options, and them."""
    head, *parts = text.split(",")
    text = without_password(text)
    options: dict[str, str] = {}
    for part in parts:
        key, equals, value = part.partition("=")
        if not equals and key != "overwrite":
            raise SinkError(f"--show {text}: '{part}' is not key=value")
        if key in options:
            raise SinkError(f"--show {text}: '{key}' is given twice")
        options[key] = value
    return head, options


def _with(spec: OutputSpec, options: dict[str, str]) -> OutputSpec:
    if "hud" in options and "layout" in options:
        raise SinkError(f"--show {spec.text}: a HUD belongs to one view; leave hud or layout out")
    if "head" in options and any(key in options for key in LOOK):
        raise SinkError(f"--show {spec.text}: give either a head or yaw, pitch and roll")
    changes: dict[str, Any] = {}
    look = [0.0, 0.0, 0.0]
    for key, value in options.items():
        try:
            known = READERS[key](value)
        except ValueError as error:
            raise SinkError(f"--show {spec.text}: {key}={value}: {error}") from None
        if key in LOOK:
            look[LOOK.index(key)] = known
            changes["look_deg"] = tuple(look)
        else:
            changes[FIELDS.get(key, key)] = known
    return replace(spec, **changes)


FIELDS = {"hfov": "hfov_deg", "fps": "rate_hz", "every": "rate_hz"}


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if not match:
        raise ValueError("not WIDTHxHEIGHT, such as 1280x720")
    return int(match[1]), int(match[2])


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise ValueError("not a number") from None
    if not abs(value) < 1e9:
        raise ValueError("not a number")
    return value


def _between(least: float, most: float, unit: str) -> Callable[[str], float]:
    def read(text: str) -> float:
        value = _number(text)
        if not least <= value <= most:
            raise ValueError(f"must be {least:g} to {most:g} {unit}")
        return value

    return read


def _bits(text: str) -> int:
    """800k, 4M or plain bits per second."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?)([kM]?)", text)
    value = float(match[1]) * {"": 1, "k": 1e3, "M": 1e6}[match[2]] if match else 0
    if not 1e4 <= value <= 1e9:
        raise ValueError("not bits per second, such as 800k or 4M")
    return round(value)


def _one_of(names: Sequence[str]) -> Callable[[str], str]:
    def read(text: str) -> str:
        if text not in names:
            raise ValueError(f"known: {', '.join(names)}")
        return text

    return read


def _flag(text: str) -> bool:
    if text not in ("", "yes"):
        raise ValueError("write just 'overwrite'")
    return True


def _some_text(text: str) -> str:
    if not text:
        raise ValueError("is empty")
    return text


def _theme(text: str) -> str:
    """Of the HUD; "on" is the usual one."""
    return THEMES[0] if text == "on" else _one_of(("on", *THEMES))(text)


READERS: dict[str, Callable[[str], Any]] = {
    "size": _size,
    "hfov": _between(10, 360, "degrees"),
    "projection": _one_of(tuple(PROJECTIONS)),
    "layout": _one_of(tuple(LAYOUTS)),
    "hud": _theme,
    "head": _some_text,
    "yaw": _number,
    "pitch": _number,
    "roll": _number,
    "fps": _between(0.1, 240, "views a second"),
    "every": lambda text: 1 / _between(0.1, 86400, "seconds")(text),
    "codec": _one_of(CODECS),
    "bitrate": _bits,
    "encoder": _one_of(ENCODERS),
    "sdp": _some_text,
    "overwrite": _flag,
}
