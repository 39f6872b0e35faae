"""A view that stands still is the same picture, without computing where its pixels look."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.camera import Camera, make_camera
from freelook.lens import Equidistant
from freelook.renderers import kernels
from freelook.renderers.cpu import CpuRenderer
from freelook.rotations import RDF_FROM_FRD, body_from_view
from freelook.types import Picture
from freelook.viewport import Viewport

CAMERA = make_camera((320, 240), Equidistant(75.0), field_deg=188.0)
VIEW = Viewport((160, 120), 90.0)
AHEAD = RDF_FROM_FRD * body_from_view(10, 5, 0)
RIM = RDF_FROM_FRD * body_from_view(60, 20, 10)  # with the edge of the image in the view


def pictures(*layouts: str) -> Iterator[Picture]:
    """A new one each time, of noise."""
    rng = np.random.default_rng(1)
    while True:
        for layout in layouts:
            luma = rng.integers(0, 256, (240, 320), dtype=np.uint8)
            half = rng.integers(0, 256, (120, 160, 2), dtype=np.uint8)
            planes = (luma, half) if layout == "nv12" else (luma,)
            yield Picture("nv12" if layout == "nv12" else "gray", planes)


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The first row of every band whose coordinates were computed."""
    rows: list[int] = []
    fill = kernels.fill_band

    def counted(first_row: int, *rest: Any) -> bool:
        rows.append(first_row)
        return bool(fill(first_row, *rest))

    monkeypatch.setattr(kernels, "fill_band", counted)
    return rows


@pytest.mark.parametrize("turn", [AHEAD, RIM], ids=["ahead", "rim"])
@pytest.mark.parametrize("threads", [1, 3])
def test_what_stands_still_is_computed_twice_and_stays_the_same(
    turn: Rotation, threads: int, computed: list[int]
) -> None:
    renderer = CpuRenderer(threads)
    for number, picture in zip(range(5), pictures("nv12"), strict=False):
        computed.clear()
        view = renderer.render(picture, CAMERA, turn, VIEW)
        assert bool(computed) == (number < 2)
        fresh = CpuRenderer(threads).render(picture, CAMERA, turn, VIEW)
        for plane, expected in zip(view.planes, fresh.planes, strict=True):
            np.testing.assert_array_equal(plane, expected)


def test_nothing_is_kept_for_another_direction_camera_view_or_layout() -> None:
    """Twice each, so that what was kept for the case before would show."""
    turned = RDF_FROM_FRD * body_from_view(10.001, 5, 0)
    resized: Camera = make_camera((320, 240), Equidistant(74.0), field_deg=188.0)
    cases = [
        ("nv12", CAMERA, AHEAD, VIEW),
        ("nv12", CAMERA, turned, VIEW),
        ("nv12", resized, turned, VIEW),
        ("nv12", resized, turned, Viewport((160, 120), 89.0)),
        ("gray", resized, turned, VIEW),
        ("nv12", resized, turned, VIEW),
    ]
    renderer = CpuRenderer(1)
    for layout, camera, turn, viewport in cases:
        for _, picture in zip(range(3), pictures(layout), strict=False):
            view = renderer.render(picture, camera, turn, viewport)
            fresh = CpuRenderer(1).render(picture, camera, turn, viewport)
            for plane, expected in zip(view.planes, fresh.planes, strict=True):
                np.testing.assert_array_equal(plane, expected)
