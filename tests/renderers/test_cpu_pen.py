"""HUDs drawn into planes: what the OpenGL pen draws, and the colours of the picture's own space."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.color import i420_from_rgb, rgb_from_picture
from freelook.hud import Box, Lines, place_of, shapes, theme_named
from freelook.hud.place import Rect
from freelook.renderers.cpu_pen import CpuPen
from freelook.renderers.gl_pen import GlPen
from freelook.types import ColorSpace, Picture
from gl_here import gl_context
from hud_states import STATES

WIDTH, HEIGHT = SIZE = (320, 240)


def test_it_draws_what_opengl_draws() -> None:
    theme, made = theme_named("day"), shapes(STATES["rolled"], place_of(*SIZE))
    with gl_context() as context:
        frame = context.framebuffer([context.texture(SIZE, 3)])
        frame.use()
        context.clear(0.2, 0.4, 0.8)
        pen = GlPen(context, theme, 1.0)
        pen.draw([pen.ink(made)], SIZE)
        theirs = np.frombuffer(frame.read(components=3, alignment=1), np.uint8)
    theirs = theirs.reshape(HEIGHT, WIDTH, 3)[::-1]
    blank = np.full((HEIGHT, WIDTH, 3), (51, 102, 204), np.uint8)
    picture = Picture("rgb24", (blank,))
    ours = CpuPen(theme, 1.0).drawn([made], picture).planes[0]
    assert (picture.planes[0] == blank).all()  # what was given is left alone
    assert (ours != blank).any(axis=2).mean() > 0.05
    # the ends of lines may fall on the other side of a pixel's middle
    assert (np.abs(ours.astype(int) - theirs) > 6).mean() < 0.003


@pytest.mark.parametrize("color", [ColorSpace("bt709"), ColorSpace("bt601", full_range=True)])
def test_planes_get_the_themes_colours(color: ColorSpace) -> None:
    theme = theme_named("day")
    picture = i420_from_rgb(np.full((HEIGHT, WIDTH, 3), 0.3), color)
    wide = Lines(np.array([(20.0, 40.0, 200.0, 40.0)]), 24.0, "alert")
    drawn = rgb_from_picture(CpuPen(theme, 1.0).drawn([[wide]], picture))
    assert drawn[40, 100] == pytest.approx(theme.color("alert")[:3], abs=0.01)  # rounding
    assert drawn[100, 100] == pytest.approx(0.3, abs=0.01)


@pytest.mark.parametrize("layout", ["i420", "nv12", "gray"])
def test_every_layout(layout: str) -> None:
    y, chroma = np.full((HEIGHT, WIDTH), 90, np.uint8), np.full((120, 160), 128, np.uint8)
    planes = {"i420": (y, chroma, chroma), "nv12": (y, np.stack([chroma] * 2, -1)), "gray": (y,)}
    picture = Picture(layout, planes[layout])  # type: ignore[arg-type]
    box = Box(Rect(40, 60, 80, 50), "chosen")
    drawn = CpuPen(theme_named("plain"), 1.0).drawn([[box], []], picture)
    assert [plane.shape for plane in drawn.planes] == [p.shape for p in picture.planes]
    for plane, before in zip(drawn.planes, picture.planes, strict=True):
        scale = HEIGHT // plane.shape[0]
        inside = np.zeros(plane.shape[:2], bool)
        inside[60 // scale : 110 // scale, 40 // scale : 120 // scale] = True
        assert (plane != before)[inside].all()
        assert (plane == before)[~np.pad(inside, 1)[1:-1, 1:-1]].mean() > 0.99
