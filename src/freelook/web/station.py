"""The station: one camera, any number of heads, any number of viewers.

Everything here runs on the event loop, except where it says otherwise.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from .. import __version__
from ..addresses import without_password
from ..camera import Camera
from ..clock import Clock, now_ns
from ..gimbal import MODES, Aim, GimbalSettings, Stabiliser
from ..head import Head
from ..hud.definition import THEMES
from ..ingest import Ingest
from ..session import same_shape
from ..vehicle import Vehicle
from . import messages
from .feed import Feed
from .units import Hub
from .whep import Viewer, Viewers

if TYPE_CHECKING:
    from ..outputs.runner import OutputStatus

TICK_S = 1 / 30
TICKS_PER_STATUS = 7
ACTIONS = ("recentre", "enable", "disable", "eyes_front")


@dataclass(frozen=True)
class About:
    """What the page is told once."""

    source: str
    demo: bool = False
    hold_s: float = 1.0
    ease_s: float = 2.0
    hfov_deg: float = 90.0
    limit: str = "black"
    projection: str = "perspective"
    hud: str = THEMES[0]


class UnknownName(LookupError):  # noqa: N818 - an answer, not a failure
    """A tracker, an action or a mode that does not exist; says which do."""


class Station:
    """Wires ingest, heads and viewers together. `start` and `close` once each."""

    def __init__(
        self,
        ingest: Ingest,
        camera: Camera,
        heads: Mapping[str, Head],
        about: About,
        *,
        vehicle: Vehicle | None = None,
        most_viewers: int = 16,
        clock: Clock = now_ns,
        recordings: Callable[[], Sequence[OutputStatus]] = tuple,
    ) -> None:
        self.viewers: Viewers
        self._ingest = ingest
        self._camera = camera
        self._heads = dict(heads)
        self._about = about
        self._vehicle = Vehicle(Stabiliser()) if vehicle is None else vehicle
        self._most_viewers = most_viewers
        self._clock = clock
        self._recordings = recordings
        self._pose_pending = dict.fromkeys(self._heads, False)
        self._missed = dict.fromkeys(self._heads, False)
        self._states: dict[str, str] = {}

    async def start(self) -> None:
        """SourceError when the source can never work."""
        self._loop = asyncio.get_running_loop()
        self._hub = Hub(self._loop)
        self._feed = Feed(self._ingest, self._hub)
        self.viewers = Viewers(
            self._hub, self, self._most_viewers, lambda count: self._feed.want(count > 0)
        )
        self._ingest.start()
        self._feed.start()
        self._vehicle.start()
        for name, head in self._heads.items():
            head.start(partial(self._pose_arrived, name))
        self._ticker = asyncio.create_task(self._tick())

    async def close(self) -> None:
        self._ticker.cancel()
        await self.viewers.close()
        self._feed.close()
        await asyncio.to_thread(self._vehicle.close)
        for head in self._heads.values():
            await asyncio.to_thread(head.close)
        await asyncio.to_thread(self._ingest.close)

    def describe(self) -> dict[str, Any]:
        """GET /api/station."""
        return {
            "version": __version__,
            "source": without_password(self._about.source),
            "demo": self._about.demo,
            "camera": messages.camera_table(self._camera),
            "trackers": list(self._heads),
            "hold_s": self._about.hold_s,
            "ease_s": self._about.ease_s,
            "hfov_deg": self._about.hfov_deg,
            "limit": self._about.limit,
            "projection": self._about.projection,
            "hud": self._about.hud,
            "modes": list(MODES),
            "rate_deg_s": GimbalSettings().rate_deg_s,
            "zoom": messages.zoom(self._camera),
        }

    def control(self, tracker: str, action: str) -> None:
        """One of ACTIONS, to a tracker; UnknownName lists what there is."""
        if action not in ACTIONS:
            raise UnknownName(f"unknown action {action!r}; known: {', '.join(ACTIONS)}")
        if tracker not in self._heads:
            known = ", ".join(self._heads) or "none"
            raise UnknownName(f"unknown tracker {tracker!r}; known: {known}")
        getattr(self._heads[tracker], action)(self._clock())
        self._push_pose(tracker)

    def set_mode(self, mode: str) -> None:
        """Of everybody's view, as in `freelook.gimbal.MODES`. UnknownName for another one,
        TrackerError for *point* without anything to point at."""
        if mode not in MODES:
            raise UnknownName(f"unknown mode {mode!r}; known: {', '.join(MODES)}")
        self._vehicle.stabiliser.set_mode(mode)
        self._send_all(messages.text(self.status()))

    def status(self) -> dict[str, Any]:
        """The message of the 4 Hz status, as data."""
        now = self._clock()
        ingest = self._ingest.status(now)
        trouble = self._feed.error or wrong_shape(self._camera.size, ingest.stream)
        counters = (
            ingest.counters
            | messages.counts(self._feed.counters)
            | messages.counts(self._hub.counters, "relay_")
            | messages.counts(self.viewers.counters(), "viewers_")
        )
        source = messages.source_status(ingest, self._feed.why, trouble, counters)
        trackers = [head.status(now) for head in self._heads.values()]
        recordings = [messages.recording(one) for one in self._recordings()]
        return messages.status(
            source, trackers, len(self.viewers), self._vehicle.status(), recordings
        )

    # --- what viewers tell us

    def opened(self, viewer: Viewer) -> None:
        for name in self._heads:
            viewer.send(self._pose_message(name))
        viewer.send(messages.text(self.status()))

    def heard(self, viewer: Viewer, message: object) -> None:
        time_ms = messages.read_ping(message)
        if time_ms is None:
            viewer.counters.add("messages_not_understood")
        else:
            viewer.send(messages.pong(time_ms, self._clock()))

    def frame_sent(self, viewer: Viewer, rtp: int, capture_ns: int) -> None:
        base = self._vehicle.stabiliser.at(self._clock(), capture_ns)
        world = self._vehicle.stabiliser.attitude_at(capture_ns)
        viewer.send(messages.frame(rtp, capture_ns, base, world))

    def wants_key(self, viewer: Viewer) -> bool:
        return self._feed.request_key()

    def gone(self, viewer: Viewer) -> None:
        self.viewers.forget(viewer)

    # --- heads

    def _pose_arrived(self, name: str) -> None:
        """On the tracker's thread. Poses that come faster than the loop turns become one."""
        if self._pose_pending[name]:
            return
        self._pose_pending[name] = True
        with contextlib.suppress(RuntimeError):  # the loop is closed: nobody is left to tell
            self._loop.call_soon_threadsafe(self._push_pose, name)

    def _push_pose(self, name: str) -> None:
        self._pose_pending[name] = False
        if len(self.viewers):
            self._missed[name] = not self._send_all(self._pose_message(name))

    def _send_all(self, message: str) -> bool:
        """False when a viewer that listens did not get it."""
        sent = [viewer.send(message) for viewer in self.viewers if viewer.listening]
        return all(sent)

    def _pose_message(self, name: str) -> str:
        now = self._clock()
        aim = self._heads[name].aim(now)
        self._states[name] = aim.state
        return messages.pose(name, aim, now)

    def _is_due(self, name: str, aim: Aim) -> bool:
        """Whether viewers have to be told without a new pose."""
        changed = aim.state != self._states.get(name)
        return aim.moving or aim.state == "holding" or changed or self._missed[name]

    async def _tick(self) -> None:
        ticks = 0
        while True:
            await asyncio.sleep(TICK_S)
            ticks += 1
            if not len(self.viewers):
                continue
            for name, head in self._heads.items():
                if self._is_due(name, head.aim(self._clock())):
                    self._push_pose(name)
            if ticks % TICKS_PER_STATUS == 0:
                self._send_all(messages.text(self.status()))


def wrong_shape(profile: tuple[int, int], stream: Any) -> str | None:
    """Why this lens profile cannot be right for this video; None when it can, or nobody knows.

    Another size of the same shape is fine: the picture is scaled.
    """
    if stream is None or not stream.width or not stream.height:
        return None
    width, height = profile
    if same_shape(profile, (stream.width, stream.height)):
        return None
    return (
        f"the video is {stream.width} x {stream.height} pixels, but the lens profile is for "
        f"{width} x {height}, which has another shape; use the profile of this camera mode"
    )
