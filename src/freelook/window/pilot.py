"""Who turns the view: a tracker, or the hand on mouse, keys and gamepad; as on the page.

Whatever is touched takes control from a tracker; `give_back` returns it. Times in nanoseconds are
arguments. Angles as in `freelook.rotations`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S
from ..errors import TrackerError
from ..gimbal import CENTRE, MODES, Stabiliser
from ..gimbal.easing import Blend, blend
from ..gimbal.settings import RATE_DEG_S
from ..head import Head
from ..projections import PROJECTIONS, projection_named
from ..rotations import body_from_view, head_angles_deg
from ..viewport import fitting
from .events import Damaged, Drag, Event, Key, Left, Pad, Wheel

LOOK_PER_S = 0.8  # of the field of view, with a key held
ZOOM_PER_S = 2.0
STICK_DEG_PER_S = 120.0
STICK_DEAD = 0.12
LONGEST_STEP_S = 0.1
WHEEL_STEP = 1.1
BACK_S = 0.3  # from eyes front, at least
STEEP = 0.2  # near straight up or down a drag turns yaw no faster than 1 / STEEP

LOOKS = {"left": (-1, 0), "right": (1, 0), "up": (0, 1), "down": (0, -1)}
ZOOMS = {"+": -1, "-": 1}
WINDOWED = tuple(name for name in PROJECTIONS if name != "strip")  # which is lower than a window
OTHERS = {
    "f": ["full screen"],
    "i": ["lines"],
    "u": ["theme"],
    "o": ["projection"],
    "q": ["quit"],
    "escape": ["quit"],
}


@dataclass(frozen=True)
class Look:
    """Where to look; `pose_ns` is when that was measured or done, None if never."""

    body_from_view: Rotation
    pose_ns: int | None


class Pilot:
    """`heads` are trackers by name; the first has control at the beginning. `stabiliser` is what
    their gimbals use; the hand turns in its base too."""

    def __init__(
        self,
        heads: Mapping[str, Head],
        hfov_deg: float,
        stabiliser: Stabiliser | None = None,
        projection: str = "perspective",
    ) -> None:
        self.hfov_deg = hfov_deg
        self.projection = projection
        self._stabiliser = Stabiliser() if stabiliser is None else stabiliser
        self._heads = dict(heads)
        self._tracker = next(iter(self._heads), None)
        self._by_hand = self._tracker is None
        self._yaw_deg = self._pitch_deg = 0.0
        self._enabled = True
        self._back = Blend()
        self._hand_ns: int | None = None
        self._held: set[str] = set()
        self._pad_held: frozenset[str] = frozenset()
        self._stepped_ns: int | None = None

    def look(self, now_ns: int, capture_ns: int | None = None) -> Look:
        """Now, in a frame taken at `capture_ns` (None: the newest one known)."""
        head = self._head
        if head is not None:
            aim = head.aim(now_ns, capture_ns)
            return Look(aim.body_from_view, aim.pose_ns)
        base = self._stabiliser.at(now_ns, capture_ns)
        if not self._enabled:
            return Look(CENTRE, self._hand_ns)
        hand = body_from_view(self._yaw_deg, self._pitch_deg)
        return Look(self._back.left(now_ns) * base.body_from_base * hand, self._hand_ns)

    def command(self, now_ns: int) -> tuple[str, str, float | None]:
        """Who is in command ("hand": mouse, keys or gamepad), the state of its aim, and for a
        tracker how many milliseconds ago its newest pose was measured."""
        if self._head is None:
            return "hand", "tracking" if self._enabled else "front", None
        status = self._head.status(now_ns)
        age_ms = None if status.age_ns is None else status.age_ns / 1e6
        return status.name, status.state, age_ms

    def attitude(self, capture_ns: int) -> Rotation | None:
        """The vehicle's, `world_from_body`, when a frame was taken; None where not known."""
        return self._stabiliser.attitude_at(capture_ns)

    def take(self, events: Iterable[Event], now_ns: int, size: tuple[int, int]) -> list[str]:
        """Turn, zoom, recentre; returns what is for others to do: "full screen", "lines",
        "theme", "projection" (it is another one now), "draw again", "quit".

        `size` is that of an eye's view in window pixels.
        """
        others = []
        for event in events:
            if isinstance(event, Drag):
                self._drag(event, now_ns, size)
            elif isinstance(event, Wheel):
                self.zoom(WHEEL_STEP**-event.steps)
            elif isinstance(event, Key):
                others += self._key(event, now_ns)
            elif isinstance(event, Left):
                self._held.clear()
            elif isinstance(event, Damaged):
                others.append("draw again")
            else:
                others.append("quit")
        return others

    def advance(self, now_ns: int, pad: Pad | None = None) -> None:
        """Held keys and the gamepad's stick, for the time since the last call."""
        seconds = 0.0
        if self._stepped_ns is not None:
            seconds = min((now_ns - self._stepped_ns) / NS_PER_S, LONGEST_STEP_S)
        self._stepped_ns = now_ns
        if seconds <= 0:
            return
        right, up = (sum(LOOKS.get(key, (0, 0))[k] for key in self._held) for k in (0, 1))
        if right or up:
            step_deg = LOOK_PER_S * self.hfov_deg * seconds
            self._turn(right * step_deg, up * step_deg, now_ns)
        if wider := sum(ZOOMS.get(key, 0) for key in self._held):
            self.zoom(ZOOM_PER_S ** (wider * seconds))
        if pad is not None:
            self._pad(pad, seconds, now_ns)

    def zoom(self, factor: float) -> None:
        """Above 1: wider, as far as views go."""
        kind = projection_named(self.projection)
        self.hfov_deg = min(max(self.hfov_deg * factor, kind.narrowest_deg), kind.widest_deg)

    def recentre(self, now_ns: int) -> None:
        """Where the head points now becomes straight ahead; the hand goes there."""
        if self._head is not None:
            self._head.recentre(now_ns)
        else:
            self._yaw_deg = self._pitch_deg = 0.0
            self._hand_ns = now_ns

    def toggle(self, now_ns: int) -> None:
        """Eyes front, or after it, follow again."""
        self._enabled = not self._enabled
        self._hand_ns = now_ns
        if self._enabled and self._by_hand:  # at once to the front, gently back
            self._back = Blend()
            hand = self.look(now_ns).body_from_view
            self._back = blend(CENTRE, hand, now_ns, at_least_s=BACK_S, rate_deg_s=RATE_DEG_S)
        for head in self._heads.values():
            (head.enable if self._enabled else head.eyes_front)(now_ns)

    def next_mode(self) -> None:
        """Of what is taken out of the view; *point* only where there is something to point at."""
        after = MODES.index(self._stabiliser.mode) + 1
        try:
            self._stabiliser.set_mode(MODES[after % len(MODES)])
        except TrackerError:
            self._stabiliser.set_mode(MODES[0])

    def next_projection(self) -> None:
        """Of those that windows may have; with the same field, as far as its limits let it."""
        after = WINDOWED.index(self.projection) + 1 if self.projection in WINDOWED else 0
        self.projection = WINDOWED[after % len(WINDOWED)]
        self.zoom(1.0)

    def give_back(self) -> None:
        """To the tracker that had control before anything was touched, if there is one."""
        self._by_hand = self._tracker is None

    @property
    def _head(self) -> Head | None:
        return None if self._by_hand or self._tracker is None else self._heads[self._tracker]

    def _key(self, key: Key, now_ns: int) -> list[str]:
        if not key.pressed:
            self._held.discard(key.name)
            return []
        if key.name in LOOKS or key.name in ZOOMS:
            self._held.add(key.name)
        elif key.name == "r":
            self.recentre(now_ns)
        elif key.name == "e":
            self.toggle(now_ns)
        elif key.name == "m":
            self.next_mode()
        elif key.name == "g":
            self.give_back()
        elif key.name == "o":
            self.next_projection()
        return OTHERS.get(key.name, [])

    def _drag(self, drag: Drag, now_ns: int, size: tuple[int, int]) -> None:
        """The picture follows the mouse; exactly so in the middle of the view."""
        deg_per_px = float(np.degrees(1 / fitting(size, self.hfov_deg, self.projection).focal_px))
        self._take_over(now_ns)
        level = max(float(np.cos(np.radians(self._pitch_deg))), STEEP)
        self._turn(-drag.dx_px * deg_per_px / level, drag.dy_px * deg_per_px, now_ns)

    def _pad(self, pad: Pad, seconds: float, now_ns: int) -> None:
        step_deg = STICK_DEG_PER_S * seconds * min(1.0, self.hfov_deg / 90)
        right, down = _beyond_dead(pad.x), _beyond_dead(pad.y)
        if right or down:
            self._turn(right * step_deg, -down * step_deg, now_ns)
        if wider := ("wider" in pad.held) - ("narrower" in pad.held):
            self.zoom(ZOOM_PER_S ** (wider * seconds))
        for name in pad.held - self._pad_held:
            if name == "recentre":
                self.recentre(now_ns)
            elif name == "toggle":
                self.toggle(now_ns)
        self._pad_held = pad.held

    def _turn(self, right_deg: float, up_deg: float, now_ns: int) -> None:
        self._take_over(now_ns)
        self._yaw_deg = (self._yaw_deg + right_deg + 180) % 360 - 180
        self._pitch_deg = min(max(self._pitch_deg + up_deg, -90.0), 90.0)
        self._hand_ns = now_ns

    def _take_over(self, now_ns: int) -> None:
        """By hand from where the tracker looks, upright."""
        if not self._by_hand:
            base = self._stabiliser.newest.body_from_base
            looked = base.inv() * self.look(now_ns).body_from_view
            self._yaw_deg, self._pitch_deg, _ = head_angles_deg(looked)
            self._by_hand = True


def _beyond_dead(value: float) -> float:
    """Nothing near the middle, then growing from 0; finer near the middle."""
    beyond = max(0.0, abs(value) - STICK_DEAD) / (1 - STICK_DEAD)
    return float(np.sign(value)) * beyond * beyond
