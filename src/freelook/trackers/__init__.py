"""Head trackers: one file per kind, found by listing this package.

A tracker module has a docstring whose first line is its row in the documentation, and

    KIND        the word before the colon in `KIND:ARGUMENT?option=value&option=value`
    OPTIONS     names of its own options; yaw, pitch and roll (`freelook.axes`) are everybody's
    AXES        how its angles are meant when nothing else is said
    open(argument, *, axes, options, clock)     the tracker; TrackerError when it cannot be

Files whose name begins with an underscore are shared parts, not trackers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import ModuleType

from .. import axes as axes_module
from ..clock import Clock, now_ns
from ..errors import TrackerError
from ..plugins import modules_by_kind, split_options
from ..types import Tracker


def known_trackers() -> dict[str, ModuleType]:
    """KIND to module, for every tracker in this package."""
    return modules_by_kind(__name__)


def open_tracker(spec: str, *, clock: Clock = now_ns) -> Tracker:
    """Open `KIND`, `KIND:ARGUMENT` or `KIND:ARGUMENT?option=value&...`.

    TrackerError for an unknown kind or option (it lists the known ones), for text that is not
    understood, and for a tracker that cannot be opened.
    """
    kind_and_argument, given = split_options(spec, TrackerError)
    kind, _, argument = kind_and_argument.partition(":")
    modules = known_trackers()
    if kind not in modules:
        raise TrackerError(f"unknown tracker '{kind}' in '{spec}'; known: {', '.join(modules)}")
    module = modules[kind]
    axis_terms = {k: v for k, v in given.items() if k in axes_module.AXES}
    options = {k: v for k, v in given.items() if k not in axes_module.AXES}
    known = (*module.OPTIONS, *axes_module.AXES)
    for name in options:
        if name not in known:
            raise TrackerError(f"tracker {kind}: unknown option '{name}'; known: {_join(known)}")
    try:
        axes = axes_module.parse_axes(axis_terms, module.AXES)
        tracker: Tracker = module.open(argument, axes=axes, options=options, clock=clock)
    except TrackerError as error:
        raise TrackerError(f"tracker {kind}: {error}") from None
    return tracker


def number_option(
    options: Mapping[str, str], name: str, default: float, lowest: float, highest: float
) -> float:
    """An option that is a number between two bounds, or TrackerError."""
    text = options.get(name)
    if text is None:
        return default
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not lowest <= value <= highest:
        raise TrackerError(f"{name} must be a number from {lowest:g} to {highest:g}, not '{text}'")
    return value


def flag_option(options: Mapping[str, str], name: str) -> bool:
    """An option that is 1 or 0 (absent: 0), or TrackerError."""
    text = options.get(name, "0")
    if text not in ("0", "1"):
        raise TrackerError(f"{name} must be 0 or 1, not '{text}'")
    return text == "1"


def _join(names: tuple[str, ...]) -> str:
    return ", ".join(names)
