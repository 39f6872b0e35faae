"""Views of every projection in the page: its shader, its own formulas, keys and limits."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from page_station import PageView

from freelook.camera import make_camera
from freelook.gimbal.limits import reach_of
from freelook.lens import Equidistant, ThinPrismFisheye
from freelook.projections import PROJECTIONS
from freelook.renderers.reference import coordinates
from freelook.rotations import body_from_view
from freelook.types import Picture
from freelook.viewport import Viewport
from freelook.web import messages

pytestmark = pytest.mark.browser

HFOV = {"perspective": 110.0, "strip": 240.0}
CAMERA = make_camera(
    (640, 480),
    ThinPrismFisheye(f=140.0, k1=-0.01, p1=4e-3, p2=-2e-3, sx1=-3e-3, sy1=2e-3),
    field_deg=200,
    stretch=np.array([[1.0, 0.01], [0.0, 0.98]]),
)
VIEWS = [Viewport((96, 32), HFOV.get(name, 170.0), name) for name in PROJECTIONS]


def blank() -> Picture:
    width, height = CAMERA.size
    chroma = np.full((height // 2, width // 2), 128, np.uint8)
    return Picture("i420", (np.full((height, width), 128, np.uint8), chroma, chroma))


def test_coordinates_of_every_projection(open_page: Any) -> None:
    """0.01 px, as for perspective views. The rim of a crop is that of the round lens: the offsets
    of this one, 2 px there, may put a pixel on the other side."""
    page = open_page(CAMERA)
    page.put(blank())
    for view in VIEWS:
        page.set_view(*view.size, view.hfov_deg, view.projection)
        for head in [(0.0, 0.0, 0.0), (-70.0, 35.0, 20.0)]:
            page.set_head(*head)
            drawn = page.coordinates()
            exact = coordinates(CAMERA, CAMERA.camera_from_body * body_from_view(*head), view)
            seen = ~np.isnan(exact[..., 0])
            assert seen.mean() > 0.2
            assert np.abs(drawn[..., :2] - exact)[seen].max() < 0.01
            agree = (drawn[..., 2] <= CAMERA.table.t_max * (1 + 1e-5)) == seen
            assert agree.mean() > (0.96 if view.kind.cut else 0.999)


def test_rays_places_and_limits_are_those_of_the_definition(view: PageView) -> None:
    """What the page computes without the shader: lines over the picture, zoom and soft stop."""
    script = """async view => {
      const { placeOf, rayOf } = await import('./static/projections.js');
      const { PROJECTIONS } = await import('./static/projections.js');
      const { focalPx } = await import('./static/viewport.js');
      const { reachOf } = await import('./static/limit.js');
      const ray = rayOf(view.projection, 0.7, -0.4);
      return {
        ray, place: placeOf(view.projection, ray), focal: focalPx(view),
        reach: reachOf([0.6, 0.8], view, 1.9),
        tallest: PROJECTIONS[view.projection].tallestDeg ?? null,
      };
    }"""
    for shown in VIEWS:
        (width, height), kind = shown.size, shown.kind
        found = view.js(
            script,
            {"width": width, "height": height, "hfovDeg": shown.hfov_deg, "projection": kind.name},
        )
        np.testing.assert_allclose(found["ray"], kind.ray(np.array(0.7), np.array(-0.4)), atol=1e-9)
        np.testing.assert_allclose(found["place"], [0.7, -0.4], atol=1e-9)
        assert found["focal"] == pytest.approx(shown.focal_px)
        assert found["tallest"] == kind.tallest_deg
        assert found["reach"] == pytest.approx(reach_of((0.6, 0.8), shown, 1.9), abs=1e-6)


def test_a_key_goes_through_the_projections_each_with_its_own_limits(
    open_page: Any, page_station: Any
) -> None:
    camera = make_camera((320, 240), Equidistant(f=70.0), field_deg=220)
    usual, page_station.zoom = page_station.zoom, messages.zoom(camera)
    page = open_page(camera)
    page_station.zoom = usual  # for the pages of other tests
    page.put(
        Picture("i420", tuple(np.full(s, 128, np.uint8) for s in [(240, 320), *[(120, 160)] * 2]))
    )
    names = [*PROJECTIONS, "perspective"]
    for now, following in pairwise(names):
        page.until(f"freelook.app.zoom.projection === '{now}'")
        widest = page.js("freelook.app.zoom.range.widest_deg")
        kind = PROJECTIONS[now]
        assert widest == pytest.approx(max(kind.narrowest_deg, min(kind.widest_deg, 220)))
        page.page.keyboard.press("o")
        page.shows(f"Projection: {following}")
        assert page.js("document.getElementById('projection-select').value") == following
    page.until("freelook.app.zoom.projection === 'perspective'")
    assert page.js("freelook.app.zoom.fieldDeg") == pytest.approx(90)  # as it was left


def test_a_strip_fills_the_width_and_no_more_height_than_it_has(open_page: Any) -> None:
    page = open_page()
    page.js("freelook.app.settings.set('projection', 'strip')")
    page.js("freelook.app.zoom.use('strip')")
    page.js("freelook.app.zoom.fieldDeg = 240")
    main = page.js("freelook.app.screen.panes().main")
    assert main["width"] == 640
    assert main["height"] == math.floor(640 * 90 / 240)
    assert main["y"] == (480 - main["height"]) // 2
