"""The HUD in an output's own pictures, where that was asked for: `--show file:PATH,hud=day`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ..clock import NS_PER_S
from ..head import Head
from ..hud import HudState, LensField, Link, Situation, TrackerState, conditions, place_of, shapes
from ..hud.definition import Theme
from ..hud.place import MOVING, pixels_per_point
from ..session import View
from ..types import Picture
from ..viewport import Viewport

if TYPE_CHECKING:
    from .group import Flight

TOLD = ("state", "warnings")  # no dials: pictures are not shown to anybody here


class BurntHud:
    """Draws what is known of each view; the words are those at the view's time."""

    def __init__(self, theme: Theme, viewport: Viewport, flight: Flight, head: Head | None) -> None:
        from ..renderers.cpu_pen import CpuPen

        self._ratio = pixels_per_point(viewport.size)
        self._pen = CpuPen(theme, self._ratio)
        self._viewport, self._flight, self._head = viewport, flight, head
        self._lens = LensField.of(flight.camera)

    def __call__(self, view: View) -> Picture:
        width, height = (side / self._ratio for side in self._viewport.size)
        state = self._state(view)
        groups = [shapes(state, place_of(width, height, parts)) for parts in (MOVING, TOLD)]
        return self._pen.drawn(groups, view.picture)

    def _state(self, view: View) -> HudState:
        flight, now_ns = self._flight, view.display_ns
        source = flight.ingest.status(now_ns)
        head = None if self._head is None else self._head.status(now_ns)
        situation = Situation(
            video_age_s=max(0, now_ns - view.capture_ns) / NS_PER_S,
            source_state=source.state,
            source_message=source.message,
        )
        if head is not None:
            age_ms = None if head.age_ns is None else head.age_ns / 1e6
            situation = replace(
                situation, head=head.name, head_state=head.state, head_age_ms=age_ms
            )
        return HudState(
            view.body_from_view,
            self._viewport.hfov_deg,
            self._viewport.projection,
            flight.stabiliser.attitude_at(view.capture_ns),
            self._lens,
            Link(source.state, source.counters.get("lost", 0)),
            None if head is None else TrackerState(head.name, head.state),
            flight.stabiliser.mode,
            warnings=conditions(situation),
        )
