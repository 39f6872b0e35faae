"""Layouts: every part is the view that a renderer makes of it alone."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.camera import make_camera
from freelook.errors import RenderError
from freelook.lens import Equidistant
from freelook.renderers.cpu import CpuRenderer
from freelook.renderers.layout import LAYOUTS, LayoutRenderer
from freelook.rotations import body_from_view
from freelook.types import ColorSpace, Picture
from freelook.viewport import Viewport

CAMERA = make_camera((600, 600), Equidistant(170.0), field_deg=190)
TURN = CAMERA.camera_from_body * body_from_view(-30, 20, 10)
WHOLE = Viewport((320, 180), 80.0)


def picture() -> Picture:
    y, x = np.mgrid[:600, :600]
    luma = (60 + x // 5 + y // 10).astype(np.uint8)
    return Picture("i420", (luma, luma[::2, ::2].copy(), luma[1::2, ::2].copy()), ColorSpace())


def shown(name: str, viewport: Viewport = WHOLE) -> Picture:
    return LayoutRenderer(CpuRenderer(1), name).render(picture(), CAMERA, TURN, viewport)


def part(whole: Picture, x: int, y: int, size: tuple[int, int]) -> list[np.ndarray]:
    found = []
    for plane, scale in zip(whole.planes, (1, 2, 2), strict=True):
        rows, columns = size[1] // scale, size[0] // scale
        found.append(plane[y // scale :][:rows, x // scale :][:, :columns])
    return found


def assert_shows(whole: Picture, x: int, y: int, viewport: Viewport, *head: float) -> None:
    turn = CAMERA.camera_from_body * body_from_view(*head)
    alone = CpuRenderer(1).render(picture(), CAMERA, turn, viewport)
    assert alone.planes[0].max() > 100
    for ours, expected in zip(part(whole, x, y, viewport.size), alone.planes, strict=True):
        np.testing.assert_array_equal(ours, expected)


def test_quad() -> None:
    quarter = Viewport((160, 90), 80.0)
    whole = shown("quad")
    assert_shows(whole, 0, 0, quarter, -30, 20, 10)
    assert_shows(whole, 160, 0, quarter, 0, 0)
    assert_shows(whole, 0, 90, quarter, -60, 0)
    assert_shows(whole, 160, 90, quarter, 60, 0)


def test_panorama() -> None:
    whole = shown("panorama")
    assert_shows(whole, 0, 0, Viewport((320, 44), 190.0, "strip"), 0, 0)
    assert_shows(whole, 0, 44, Viewport((320, 136), 80.0), -30, 20, 10)


def test_picture_in_picture_holds_the_whole_fisheye() -> None:
    whole, alone = shown("pip"), CpuRenderer(1).render(picture(), CAMERA, TURN, WHOLE)
    np.testing.assert_array_equal(whole.planes[0][:100], alone.planes[0][:100])
    luma = whole.planes[0].astype(int)
    inset = luma[180 - 54 - 4 : 180 - 4, 320 - 54 - 4 : 320 - 4]
    seen = inset > 40
    # the circle touches the square's edges, but for the pixels that the rim cuts
    assert seen.mean() == pytest.approx(np.pi / 4, abs=0.02)
    assert seen[27].mean() > 0.95
    assert (inset[:3, :3] == 16).all()
    assert inset[27, 27] == pytest.approx(60 + 60 + 30, abs=3)  # the middle of the picture
    assert (luma[180 - 54 - 6 : 180 - 54 - 4, 262:316] == 16).all()  # its frame


@pytest.mark.parametrize("name", LAYOUTS)
def test_odd_sizes_and_wide_projections(name: str) -> None:
    for viewport in (Viewport((131, 97), 60.0), Viewport((200, 100), 360.0, "equirectangular")):
        assert shown(name, viewport).size == viewport.size


def test_mistakes() -> None:
    with pytest.raises(RenderError, match="known: quad, pip, panorama"):
        LayoutRenderer(CpuRenderer(1), "ring")
    with pytest.raises(RenderError, match="at least 64"):
        shown("pip", Viewport((320, 40)))
