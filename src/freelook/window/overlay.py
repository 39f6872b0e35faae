"""The HUD over a flight's views in a window: what it says, its keys, and drawing it for each eye.

What rests (state, dials, warnings) is made a few times a second, before the pose is read. What
moves with the view is made after it, while a GPU is still busy with the picture.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from math import ceil
from typing import Any

from ..clock import NS_PER_S
from ..hud import (
    THEMES,
    Dial,
    HudState,
    Link,
    Recording,
    Situation,
    TrackerState,
    conditions,
    place_of,
    shapes,
    theme_named,
)
from ..hud.ink import Ink
from ..hud.place import MOVING, RESTING, Place, pixels_per_point
from ..renderers.gl_pen import GlPen
from .eyes import Eye, Optics, eyes

DIAL_S = 2.0  # of which moments the dials tell, as on the page
STEREO_INSET = 0.14  # of each side: in goggles the corners of a view are hard to see
RESTING_S = 0.25
NAMES = {"hand": "You"}  # as on the page


@dataclass
class RecentAges:
    """How old something was when it was shown, in the last moments."""

    values: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=1000))

    def add(self, now_ns: int, age_ns: int) -> None:
        self.values.append((now_ns, age_ns))

    def dial(self, now_ns: int) -> Dial:
        """The median and the 95th percentile, by nearest rank."""
        while self.values and now_ns - self.values[0][0] > DIAL_S * NS_PER_S:
            self.values.popleft()
        ages = sorted(age for _, age in self.values)
        if not ages:
            return Dial()
        median, p95 = (ages[max(0, ceil(share * len(ages)) - 1)] / 1e6 for share in (0.5, 0.95))
        return Dial(median, p95)


@dataclass(frozen=True)
class Told:
    """What the flight's other parts say, for the HUD."""

    situation: Situation = field(default_factory=Situation)
    link: Link | None = None
    recording: Recording | None = None


class Overlay:
    """`theme` as in hud.json, or "off": then the key shows the first one. RenderError for another
    name. Its context must be current in all that draws."""

    def __init__(self, context: Any, optics: Optics | None = None, theme: str = THEMES[0]) -> None:
        self.on = theme != "off"
        self.theme = theme if self.on else THEMES[0]
        theme_named(self.theme)
        self.head_ages, self.video_ages = RecentAges(), RecentAges()
        self.version = 0  # grows whenever it looks different from before
        self._context = context
        self._optics = Optics() if optics is None else optics
        self._pen: GlPen | None = None
        self._made_for: tuple[object, ...] = ()
        self._resting: Ink | None = None
        self._resting_of: tuple[object, ...] = ()
        self._rested_ns = -NS_PER_S

    def toggle(self) -> None:
        self.on = not self.on
        self.version += 1

    def next_theme(self) -> None:
        self.theme = THEMES[(THEMES.index(self.theme) + 1) % len(THEMES)]
        self.version += 1

    def is_due(self, now_ns: int) -> bool:
        """Whether what rests should be made anew."""
        return self.on and now_ns - self._rested_ns >= RESTING_S * NS_PER_S

    def rest(self, told: Told, state: HudState, size: tuple[int, int], now_ns: int) -> None:
        """Make what rests, if it changed; `state` needs to know nothing of it yet."""
        dials = {"head": self.head_ages.dial(now_ns), "video": self.video_ages.dial(now_ns)}
        situation = replace(told.situation, video_late_ms=dials["video"].median_ms)
        state = replace(
            state,
            link=told.link,
            recording=told.recording,
            tracker=TrackerState(NAMES.get(situation.head, situation.head), situation.head_state),
            mode=situation.mode,
            warnings=conditions(situation),
            dials=dials,
        )
        pen, place = self._pen_for(size), self._place(size, RESTING)
        self._rested_ns = now_ns
        new = (self._made_for, place, *_resting_parts(state))
        if new != self._resting_of:
            self._resting, self._resting_of = pen.ink(shapes(state, place)), new
            self.version += 1

    def draw(
        self, state: HudState | None, size: tuple[int, int], target: Any, focal_px: float
    ) -> None:
        """Over the views of all eyes, in the framebuffer in use; without a state what rests."""
        if not self.on:
            return
        pen = self._pen_for(size)
        inks = [] if self._resting is None else [self._resting]
        if state is not None:
            inks.insert(0, pen.ink(shapes(state, self._place(size, MOVING))))
        for eye in eyes(self._optics, size):
            target.viewport = (eye.x, size[1] - eye.y - eye.height, eye.width, eye.height)
            pen.draw(
                inks,
                (eye.width, eye.height),
                viewer_k=self._optics.k,
                focal_px=focal_px,
                shift_px=eye.shift_px,
            )

    def _eye(self, size: tuple[int, int]) -> Eye:
        return eyes(self._optics, size)[0]

    def _place(self, size: tuple[int, int], parts: tuple[str, ...]) -> Place:
        eye = self._eye(size)
        ratio = pixels_per_point((eye.width, eye.height))
        width, height = eye.width / ratio, eye.height / ratio
        inset = (0.0, 0.0)
        if self._optics.layout != "mono":
            across = STEREO_INSET * width + abs(eye.shift_px) / ratio
            inset = (across, STEREO_INSET * height)
        return place_of(width, height, parts, inset)

    def _pen_for(self, size: tuple[int, int]) -> GlPen:
        """Kept while theme and size stay."""
        eye = self._eye(size)
        wanted = (self.theme, pixels_per_point((eye.width, eye.height)))
        if self._pen is None or wanted != self._made_for:
            if self._pen is not None:
                self._pen.release()
            self._pen = GlPen(self._context, theme_named(self.theme), wanted[1])
            self._made_for, self._resting, self._resting_of = wanted, None, ()
            self._rested_ns = -NS_PER_S
        return self._pen


def _resting_parts(state: HudState) -> tuple[object, ...]:
    """What the resting parts show, as coarse as they show it."""
    dials = [(name, _tenth(d.median_ms), _tenth(d.p95_ms)) for name, d in state.dials.items()]
    return state.link, state.recording, state.tracker, state.mode, state.warnings, tuple(dials)


def _tenth(value: float | None) -> float | None:
    return None if value is None else round(value, 1)
