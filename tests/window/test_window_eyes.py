"""Two eyes on one window: where they lie, which way they are moved, and the viewer's lens."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from freelook.camera import make_camera
from freelook.errors import SinkError
from freelook.lens import Equidistant
from freelook.renderers.reference import ReferenceRenderer, coordinates
from freelook.rotations import RDF_FROM_FRD, body_from_view
from freelook.types import ColorSpace, Picture
from freelook.viewport import Viewport, fitting
from freelook.window.eyes import Eye, Layout, Optics, eyes
from freelook.window.painting import EyesPainter
from gl_here import gl_context

CAMERA = make_camera((600, 600), Equidistant(180.0), field_deg=188)
AHEAD = RDF_FROM_FRD * body_from_view(0, 0)
SIZE = (240, 120)

Rgb = NDArray[np.uint8]


@pytest.fixture(scope="module")
def context() -> Iterator[Any]:
    with gl_context() as opened:
        yield opened


def smooth_picture() -> Picture:
    """Brightness says how far right, and how far down, a pixel of the picture lies."""
    y, x = np.mgrid[0:600, 0:600]
    planes = np.stack([x * 255 / 599, y * 255 / 599, np.full_like(x, 80)], axis=-1)
    return Picture("rgb24", (np.rint(planes).astype(np.uint8),), ColorSpace(full_range=True))


def painted(
    context: Any,
    optics: Optics,
    size: tuple[int, int] = SIZE,
    hfov_deg: float = 80.0,
    projection: str = "perspective",
) -> Rgb:
    """As a window of this size would show it, (rows, columns, 3) from the top."""
    target = context.framebuffer([context.texture(size, 3)])
    painter = EyesPainter(context, optics, projection=projection)
    painter.load(smooth_picture(), CAMERA, size, hfov_deg)
    painter.paint(target, size, CAMERA, AHEAD, hfov_deg)
    data = np.frombuffer(target.read(components=3, alignment=1), np.uint8)
    return data.reshape(size[1], size[0], 3)[::-1]


@pytest.mark.parametrize(
    ("layout", "size", "expected"),
    [
        ("mono", (640, 480), [Eye(0, 0, 640, 480)]),
        ("side-by-side", (641, 480), [Eye(0, 0, 320, 480, 7), Eye(321, 0, 320, 480, -7)]),
        ("top-bottom", (640, 481), [Eye(0, 0, 640, 240, 7), Eye(0, 241, 640, 240, -7)]),
    ],
)
def test_where_eyes_lie(layout: Layout, size: tuple[int, int], expected: list[Eye]) -> None:
    offset_px = 0.0 if layout == "mono" else 7.0
    assert eyes(Optics(layout, offset_px), size) == expected


def test_optics_that_make_no_sense_are_refused() -> None:
    with pytest.raises(SinkError, match=r"mono, side-by-side, top-bottom"):
        Optics("cinema")  # type: ignore[arg-type]
    with pytest.raises(SinkError, match="two of them"):
        Optics("mono", 5.0)


def test_one_eye_is_the_view(context: Any) -> None:
    """In the middle of the view is the middle of the picture, and up is up."""
    view = painted(context, Optics()).astype(float)
    middle = view[59:61, 119:121].mean(axis=(0, 1))
    assert middle == pytest.approx([127.5, 127.5, 80], abs=1)
    assert view[60, 200, 0] > view[60, 40, 0] + 50
    assert view[110, 120, 1] > view[10, 120, 1] + 50


@pytest.mark.parametrize("layout", ["side-by-side", "top-bottom"])
def test_both_eyes_see_the_same(context: Any, layout: Layout) -> None:
    view = painted(context, Optics(layout))
    left, right = np.split(view, 2, axis=1 if layout == "side-by-side" else 0)
    # float rounding of coordinates at other places may turn a code
    assert np.abs(left.astype(int) - right).max() <= 1
    assert left.std() > 20


def test_the_offset_moves_views_towards_the_nose(context: Any) -> None:
    """By whole pixels, so that the pictures are the same ones, moved."""
    plain = painted(context, Optics("side-by-side")).astype(int)
    moved = painted(context, Optics("side-by-side", 6.0)).astype(int)
    left, right = slice(0, 120), slice(120, 240)
    assert np.abs(moved[:, left][:, 6:] - plain[:, left][:, :-6]).max() <= 1
    assert np.abs(moved[:, right][:, :-6] - plain[:, right][:, 6:]).max() <= 1
    assert np.abs(moved - plain).max() > 5


def test_the_viewers_lens_is_made_up_for(context: Any) -> None:
    """At r focal lengths from the middle is what else is at r (1 + k1 r^2 + k2 r^4)."""
    k1, k2 = 0.5, 0.4
    plain = painted(context, Optics()).astype(float)[60, :, 0]
    bent = painted(context, Optics(k=(k1, k2))).astype(float)[60, :, 0]
    columns = np.arange(SIZE[0])
    focal_px, middle = Viewport(SIZE, 80.0).focal_px, (SIZE[0] - 1) / 2
    r = np.hypot(columns - middle, 0.5) / focal_px  # row 60 is half a pixel below the middle
    there = middle + (columns - middle) * (1 + k1 * r**2 + k2 * r**4)
    inside = (there > 1) & (there < SIZE[0] - 2)
    assert 100 < inside.sum() < SIZE[0]
    expected = np.interp(there, columns, plain)
    # codes are whole numbers in both; along the row they change by less than three a pixel
    assert np.abs(bent - expected)[inside].max() <= 2
    assert np.abs(bent - plain).max() > 12


def test_a_window_of_an_odd_or_tiny_size(context: Any) -> None:
    for size in ((241, 121), (5, 4)):
        for layout in ("mono", "side-by-side", "top-bottom"):
            view = painted(context, Optics(layout), size)
            assert view.shape == (size[1], size[0], 3)
            assert view.max() > 50


def test_a_lost_video_is_grey(context: Any) -> None:
    target = context.framebuffer([context.texture(SIZE, 3)])
    painter = EyesPainter(context)
    painter.load(smooth_picture(), CAMERA, SIZE, 80.0)
    painter.paint(target, SIZE, CAMERA, AHEAD, 80.0, grey=1.0)
    data = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(-1, 3)
    assert (np.ptp(data, axis=1) == 0).all()
    assert data.std() > 5


@pytest.mark.parametrize(
    ("projection", "hfov_deg"), [("stereographic", 170.0), ("equirectangular", 360.0)]
)
def test_windows_show_other_projections_as_wide_as_they_may_be(
    context: Any, projection: str, hfov_deg: float
) -> None:
    """Two codes: those of the renderers' own tests. An upright window narrows what is too high."""
    size = (120, 100)
    shown = painted(context, Optics(), size, hfov_deg, projection)
    view = fitting(size, hfov_deg, projection)
    exact = ReferenceRenderer().render(smooth_picture(), CAMERA, AHEAD, view).planes[0]
    seen = binary_erosion(~np.isnan(coordinates(CAMERA, AHEAD, view)[..., 0]), iterations=2)
    assert seen.mean() > 0.3
    assert np.abs(shown.astype(int) - exact)[seen].max() <= 2
