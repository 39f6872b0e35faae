"""What the calibration station is asked to do, and what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ..calibration.calibrate import Calibration
from ..calibration.live import Progress
from ..calibration.parameters import Freedom
from ..calibration.targets import Finder, Gray


@dataclass(frozen=True)
class Result:
    """A finished calibration, and the views' pictures by name, if they were asked for."""

    calibration: Calibration
    progress: Progress
    pictures: dict[str, Gray]


@dataclass(frozen=True)
class Saved:
    """The profile's text, and in words where it was written to, or why it was not."""

    profile: str
    where: str
    done: bool


@dataclass(frozen=True)
class Plan:
    """What is calibrated and how; `save` is called with the result, on the solving thread."""

    source: str
    target: Finder
    save: Callable[[Result], Saved]
    model: str = "auto"
    freedom: Freedom = field(default_factory=Freedom)
    keep_pictures: bool = False
