"""The loop of a flight in a window: the newest frame, the pose read as late as possible, swap.

wait until the screen's next picture is nearly due -> take the newest frame to the GPU ->
read the pose -> draw, the HUD too -> swap, which waits for the screen -> note how old the pose was
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..clock import NS_PER_S, Clock
from ..errors import SinkError
from ..gimbal import CENTRE, LensLimit
from ..hud import HudState, LensField, definition
from ..mailbox import Mailbox
from ..renderers.blank import Sampling
from ..rotations import angle_between_deg
from ..session import same_shape
from ..types import Frame
from .ages import Figures
from .events import Event
from .eyes import Optics, eyes
from .overlay import Overlay, Told
from .pacing import Pacer, period_ns
from .painting import EyesPainter
from .pilot import Pilot
from .surface import Surface

IDLE_S = 0.005  # how soon a new frame or pose is noticed after nothing moved
STATUS_S = 0.25
# after a window changed: drivers may still hold a buffer of its old size
AFTER_DAMAGE = 3


@dataclass(frozen=True)
class Outside:
    """What the loop asks of the world: the clock, whether to stop, how far the video is lost
    (0 live, 1 lost), and what there is to tell the pilot."""

    clock: Clock
    stop: Callable[[], bool]
    grey: Callable[[int], float] = lambda _now_ns: 0.0
    told: Callable[[int], Told] = lambda _now_ns: Told()


class Flight:
    """Shows `frames` on `surface`, turned by `pilot`; with `limit` never past the lens. `hud` is
    the theme of the lines over it, or "off"."""

    def __init__(
        self,
        surface: Surface,
        frames: Mailbox[Frame],
        camera: Camera,
        pilot: Pilot,
        outside: Outside,
        optics: Optics | None = None,
        sampling: Sampling = "bilinear",
        limit: LensLimit | None = None,
        hud: str = "off",
    ) -> None:
        self.figures = Figures()
        self._surface = surface
        self._frames = frames
        self._camera = camera
        self._limit = limit
        self._pilot = pilot
        self._outside = outside
        self._optics = Optics() if optics is None else optics
        self._painter = EyesPainter(surface.context, self._optics, sampling, pilot.projection)
        self._overlay = Overlay(surface.context, self._optics, hud)
        self._lens = LensField.of(camera)
        self._held_deg = 0.0
        self._fresh_ns: int | None = None
        self._pacer = Pacer(period_ns(surface.refresh_hz))
        self._frame: Frame | None = None
        self._shown: tuple[object, ...] = ()
        self._shown_pose_ns: int | None = None
        self._grey, self._grey_ns = 0.0, -NS_PER_S
        self._ending = False
        self._redraw = AFTER_DAMAGE

    def run(self) -> Figures:
        """Until the window is closed, Q is pressed or `stop` says so.

        SinkError when the display goes away. What was measured until then is in `figures`.
        """
        while not self._outside.stop() and not self._ending:
            self._await_turn()
            if self._surface.lost:
                raise SinkError("the display went away, and the window with it")
            if not self._view():
                self._pacer.paused()
                self._handle(self._surface.events(IDLE_S))
        self.figures.missed = self._pacer.missed
        return self.figures

    def _await_turn(self) -> None:
        """Events are taken meanwhile, so that the last look at them is short."""
        while (left_ns := self._left_ns()) > 0 and not self._surface.lost:
            self._handle(self._surface.events(left_ns / NS_PER_S))
            if self._ending or self._outside.stop():
                return
        self._handle(self._surface.events())

    def _left_ns(self) -> int:
        now_ns = self._outside.clock()
        return self._pacer.begin_ns(now_ns) - now_ns

    def _handle(self, events: list[Event]) -> None:
        eye = eyes(self._optics, self._surface.size_points)[0]
        for asked in self._pilot.take(events, self._outside.clock(), (eye.width, eye.height)):
            if asked == "quit":
                self._ending = True
            elif asked == "draw again":
                self._redraw = AFTER_DAMAGE
            elif asked == "lines":
                self._overlay.toggle()
            elif asked == "theme":
                self._overlay.next_theme()
            elif asked == "projection":
                self._painter.projection = self._pilot.projection
                self._redraw = AFTER_DAMAGE
            else:
                self._surface.toggle_full_screen()
                self._pacer = Pacer(period_ns(self._surface.refresh_hz), self._pacer.missed)

    def _view(self) -> bool:
        """Draw and show one view; false when it would be the one that is shown already."""
        begun_ns = self._outside.clock()
        fresh = self._frames.take()
        frame = self._frame = fresh or self._frame
        size, grey = self._surface.size_px, self._grey_at(begun_ns)
        if min(size) < 4:
            return False
        if frame is None:
            self._wait_for_video(begun_ns, size)
            return False
        camera, hfov_deg = self._camera_for(frame), self._pilot.hfov_deg
        if fresh:
            self._painter.load(frame.picture, camera, size, hfov_deg)
            self._fresh_ns = begun_ns
        if self._overlay.is_due(begun_ns):
            self._overlay.rest(self._told(begun_ns), self._hud_of(frame), size, begun_ns)
        self._handle(self._surface.events())
        latched_ns = self._outside.clock()
        self._pilot.advance(latched_ns, self._surface.pad())
        look = self._pilot.look(latched_ns, frame.capture_ns)
        hfov_deg, body_from_view = self._pilot.hfov_deg, look.body_from_view
        if self._limit is not None:
            viewport = self._painter.viewport(size, hfov_deg)
            body_from_view = self._limit(body_from_view, viewport, latched_ns)
            self._held_deg = angle_between_deg(look.body_from_view, body_from_view)
        turn, version = tuple(body_from_view.as_quat()), self._overlay.version
        shown = (id(frame), size, hfov_deg, grey, version, turn)
        if shown == self._shown and not self._redraw:
            return False
        self._redraw = max(0, self._redraw - 1)
        self._draw(frame, camera, body_from_view, size, hfov_deg, grey)
        drawn_ns = self._outside.clock()
        self._surface.swap()
        self._surface.context.finish()  # drivers may return from a swap before it is done
        swapped_ns = self._outside.clock()
        self._shown = shown
        self._note(begun_ns, latched_ns, drawn_ns, swapped_ns, look.pose_ns)
        if fresh:
            self.figures.video_age.add(swapped_ns - frame.capture_ns)
            self._overlay.video_ages.add(swapped_ns, swapped_ns - frame.capture_ns)
        return True

    def _wait_for_video(self, now_ns: int, size: tuple[int, int]) -> None:
        """On black the words of the HUD: what there is to wait for."""
        hfov_deg, overlay, surface = self._pilot.hfov_deg, self._overlay, self._surface
        if overlay.is_due(now_ns):
            overlay.rest(self._told(now_ns), HudState(CENTRE, hfov_deg), size, now_ns)
        shown = (None, size, overlay.on, overlay.version)
        if shown == self._shown and not self._redraw:
            return
        self._redraw = max(0, self._redraw - 1)
        surface.screen.use()
        surface.screen.viewport = (0, 0, *size)
        surface.context.clear(0.0, 0.0, 0.0, 1.0)
        overlay.draw(None, size, surface.screen, self._painter.viewport(size, hfov_deg).focal_px)
        surface.swap()
        self._shown = shown

    def _draw(
        self,
        frame: Frame,
        camera: Camera,
        body_from_view: Rotation,
        size: tuple[int, int],
        hfov_deg: float,
        grey: float,
    ) -> None:
        camera_from_view = camera.camera_from_body * body_from_view
        self._painter.load(frame.picture, camera, size, hfov_deg)  # again only after a zoom
        self._painter.paint(self._surface.screen, size, camera, camera_from_view, hfov_deg, grey)
        if self._overlay.on:
            self._surface.flush()  # the view is drawn while the lines over it are being made
        viewport = self._painter.viewport(size, hfov_deg)  # maybe narrower than was wanted
        state = self._hud_of(frame, body_from_view, viewport.hfov_deg)
        self._overlay.draw(state, size, self._surface.screen, viewport.focal_px)
        self._surface.context.finish()

    def _note(
        self, begun_ns: int, latched_ns: int, drawn_ns: int, swapped_ns: int, pose_ns: int | None
    ) -> None:
        self._pacer.swapped(begun_ns, drawn_ns, swapped_ns)
        figures = self.figures
        figures.views += 1
        figures.first_ns = figures.first_ns or swapped_ns
        figures.last_ns = swapped_ns
        figures.latch_to_swap.add(swapped_ns - latched_ns)
        if pose_ns is not None and pose_ns != self._shown_pose_ns:
            figures.pose_to_swap.add(swapped_ns - pose_ns)
            self._overlay.head_ages.add(swapped_ns, swapped_ns - pose_ns)
            self._shown_pose_ns = pose_ns

    def _hud_of(
        self, frame: Frame, body_from_view: Rotation = CENTRE, hfov_deg: float = 90.0
    ) -> HudState:
        return HudState(
            body_from_view,
            hfov_deg,
            self._pilot.projection,
            self._pilot.attitude(frame.capture_ns),
            self._lens,
        )

    def _told(self, now_ns: int) -> Told:
        """What others know, and what is known here."""
        told = self._outside.told(now_ns)
        name, state, age_ms = self._pilot.command(now_ns)
        since_ns = None if self._fresh_ns is None else now_ns - self._fresh_ns
        situation = replace(
            told.situation,
            video_age_s=None if since_ns is None else since_ns / NS_PER_S,
            head=name,
            head_state=state,
            head_age_ms=age_ms,
            limited=self._held_deg > definition()["warnings"]["limit_deg"],
            keys="E",
        )
        return replace(told, situation=situation)

    def _grey_at(self, now_ns: int) -> float:
        if now_ns - self._grey_ns >= STATUS_S * NS_PER_S:
            self._grey, self._grey_ns = self._outside.grey(now_ns), now_ns
        return self._grey

    def _camera_for(self, frame: Frame) -> Camera:
        """Frames of another size are the camera's whole picture scaled, as in a session."""
        size = frame.picture.size
        if size != self._camera.size and same_shape(size, self._camera.size):
            self._camera = self._camera.resized(size)
        return self._camera
