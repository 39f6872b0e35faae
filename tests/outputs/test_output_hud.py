"""Lines in recordings: only where they were asked for, and then those of that view."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from freelook.gimbal import Stabiliser
from freelook.hud import theme_named
from freelook.ingest import IngestStatus
from freelook.outputs.group import as_rendered, burnt_in
from freelook.outputs.spec import OutputSpec
from freelook.rotations import FRD_FROM_RDF
from freelook.session import View
from freelook.types import Attitude, Picture
from freelook.viewport import Viewport
from hud_states import CAMERA, attitude

pytest.importorskip("numba")

SECOND = 1_000_000_000
SIZE = (640, 360)


def flight(stabiliser: Stabiliser, state: str = "live") -> Any:
    ingest = SimpleNamespace(status=lambda _now_ns: IngestStatus(state, counters={"lost": 2}))
    return SimpleNamespace(ingest=ingest, heads={}, stabiliser=stabiliser, camera=CAMERA)


def view(age_ns: int = 0) -> View:
    gray = Picture("gray", (np.full((SIZE[1], SIZE[0]), 60, np.uint8),))
    return View(gray, FRD_FROM_RDF, SECOND, None, SECOND + age_ns, False)


def test_a_view_is_written_as_it_was_rendered() -> None:
    shown = view()
    assert as_rendered(shown) is shown.picture


def test_asked_for_the_horizon_is_that_of_the_frame() -> None:
    """A vehicle that rolls 20 degrees right: on the right side, the bright line is higher."""
    stabiliser = Stabiliser()
    for t_ns in (SECOND - SECOND // 10, SECOND):
        stabiliser.push(Attitude(t_ns, attitude(0, 0, 20)))
    burn = burnt_in(OutputSpec("file", "a.mp4", hud="plain"), flight(stabiliser), Viewport(SIZE))
    luma = burn(view()).planes[0].astype(int)
    bright = theme_named("plain")
    assert bright.color("line")[:3] == (1.0, 1.0, 1.0)
    for x in (250, 390):
        column = luma[110:250, x]
        assert 110 + column.argmax() == pytest.approx(
            180 - (x - 320) * np.tan(np.radians(20)), abs=2
        )
        assert column.max() > 180
    assert (luma[:90, 240:400] > 180).any()  # the tape


def test_lost_video_is_said_in_the_picture() -> None:
    stabiliser = Stabiliser()
    spec = OutputSpec("file", "a.mp4", hud="day")
    live = burnt_in(spec, flight(stabiliser), Viewport(SIZE))(view()).planes[0]
    lost = burnt_in(spec, flight(stabiliser, "lost"), Viewport(SIZE))(view(3 * SECOND)).planes[0]
    changed = np.flatnonzero((live != lost).any(axis=1))
    assert {row for row in changed if 100 < row < 130}  # the warning
