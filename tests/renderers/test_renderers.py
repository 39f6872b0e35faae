"""Every renderer against the definition, every lens model, and the picture formats."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from freelook.camera import Camera, make_camera
from freelook.errors import RenderError
from freelook.lens import (
    Equidistant,
    Equisolid,
    KannalaBrandt,
    Lens,
    Orthographic,
    Perspective,
    Polynomial,
    Stereographic,
    ThinPrismFisheye,
)
from freelook.renderers.blank import black_of
from freelook.renderers.cpu import CpuRenderer, coordinates
from freelook.renderers.reference import ReferenceRenderer
from freelook.renderers.reference import coordinates as exact_coordinates
from freelook.rotations import RDF_FROM_FRD, body_from_view
from freelook.types import ColorSpace, Layout, Picture, Plane
from freelook.viewport import Viewport

SIZE = (640, 480)

LENSES: list[tuple[Lens, float | None]] = [
    (Perspective(300.0), None),
    (Stereographic(130.0), 200.0),
    (Equidistant(150.0), 220.0),
    (Equisolid(150.0), 220.0),
    (Orthographic(230.0), 180.0),
    (Polynomial(150.0, 2.0, -3.0, 0.5, -0.2), 188.0),
    (KannalaBrandt(158.0, -0.02, 0.003, -0.001, 0.0001), 200.0),
    (ThinPrismFisheye(158.0, -0.02, 0.003, 4e-3, -2e-3, sx1=-3e-3, sy1=2e-3), 200.0),
]
HEADS = [(0, 0, 0), (35, -20, 10), (-80, 15, -30), (10, 80, 0), (170, 0, 0)]


@pytest.fixture(params=LENSES, ids=lambda pair: type(pair[0]).__name__)
def camera(request: pytest.FixtureRequest) -> Camera:
    lens, field_deg = request.param
    stretch = np.array([[1.02, 0.01], [0.0, 0.97]])
    return make_camera(SIZE, lens, center=(310.5, 251.0), field_deg=field_deg, stretch=stretch)


def smooth_plane(width: int, height: int, *channels: int) -> Plane:
    """Values that change slowly, so that a small coordinate error is a small value error."""
    y, x = np.mgrid[0:height, 0:width]
    waves = [
        127.5 + 120 * np.sin(x / (31 + 7 * k) + k) * np.cos(y / (43 - 5 * k))
        for k in range(channels[0] if channels else 1)
    ]
    stacked = np.stack(waves, axis=-1) if channels else waves[0]
    plane: Plane = np.rint(stacked).astype(np.uint8)
    return plane


def picture(layout: Layout, size: tuple[int, int] = SIZE, full_range: bool = False) -> Picture:
    width, height = size
    half = ((width + 1) // 2, (height + 1) // 2)
    planes = {
        "gray": (smooth_plane(width, height),),
        "i420": (smooth_plane(width, height), smooth_plane(*half), smooth_plane(*half)),
        "nv12": (smooth_plane(width, height), smooth_plane(*half, 2)),
        "rgb24": (smooth_plane(width, height, 3),),
    }[layout]
    return Picture(layout, planes, ColorSpace(full_range=full_range))


def directions() -> Iterator[Rotation]:
    for yaw, pitch, roll in HEADS:
        yield RDF_FROM_FRD * body_from_view(yaw, pitch, roll)


@pytest.mark.parametrize("hfov_deg", [10.0, 60.0, 90.0, 150.0])
def test_coordinates_equal_the_exact_projection(camera: Camera, hfov_deg: float) -> None:
    """Below 0.01 px: half for the cubics between nodes, the rest for the 256-entry table."""
    viewport = Viewport((320, 180), hfov_deg)
    compared = 0
    for camera_from_view in directions():
        ours = np.moveaxis(coordinates(camera, camera_from_view, viewport), 0, -1)
        exact = exact_coordinates(camera, camera_from_view, viewport)
        both = ~np.isnan(exact[..., 0]) & ~np.isnan(ours[..., 0])
        disagree = np.isnan(exact[..., 0]) != np.isnan(ours[..., 0])
        assert disagree.mean() < 0.004  # pixels cut by the rim may fall on either side
        if both.any():
            compared += int(both.sum())
            assert np.abs(ours - exact)[both].max() < 0.01
    assert compared > 10_000


@pytest.mark.parametrize("height", [3, 9, 136, 137])
def test_short_bands_are_as_exact(height: int) -> None:
    """A few rows left over for the last band, or a view of a few rows altogether."""
    camera = make_camera(SIZE, Equidistant(150.0), field_deg=188)
    viewport, ahead = Viewport((320, height), 150.0), RDF_FROM_FRD * body_from_view(3, 2, 1)
    ours = np.moveaxis(coordinates(camera, ahead, viewport), 0, -1)
    assert np.abs(ours - exact_coordinates(camera, ahead, viewport)).max() < 0.01


@pytest.mark.parametrize("layout", ["gray", "i420", "nv12", "rgb24"])
@pytest.mark.parametrize("threads", [1, 3])
def test_views_equal_the_reference(camera: Camera, layout: Layout, threads: int) -> None:
    source, renderer = picture(layout), CpuRenderer(threads)
    viewport = Viewport((322, 182), 80.0)
    for camera_from_view in directions():
        view = renderer.render(source, camera, camera_from_view, viewport)
        exact = ReferenceRenderer().render(source, camera, camera_from_view, viewport)
        inside = well_inside(camera, camera_from_view, viewport)
        for ours, reference in zip(view.planes, exact.planes, strict=True):
            step = 1 if ours.shape[0] == viewport.size[1] else 2
            seen = inside[::step, ::step]
            error = np.abs(ours.astype(int) - reference)[seen]
            # one code value of rounding, and one because OpenCV weighs in 1/32 pixel
            assert error.size == 0 or error.max() <= 2


def well_inside(
    camera: Camera, camera_from_view: Rotation, viewport: Viewport
) -> NDArray[np.bool_]:
    """Pixels away from the feather, and not blended with the black beyond the picture: there
    1/32 of a pixel is worth four code values."""
    pixels = exact_coordinates(camera, camera_from_view, viewport)
    last = np.array(camera.size) - 1
    seen = ((pixels >= 2) & (pixels <= last - 2)).all(axis=-1)  # false for NaN
    padded = np.pad(seen, 3, constant_values=False)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (7, 7))
    return np.asarray(windows.all(axis=(2, 3)))


@pytest.mark.parametrize("size", [(321, 181), (2, 2), (17, 400), (1283, 3)])
def test_any_view_size(size: tuple[int, int]) -> None:
    camera = make_camera(SIZE, Equidistant(150.0), field_deg=188)
    source = picture("i420")
    view = CpuRenderer(2).render(
        source, camera, RDF_FROM_FRD * body_from_view(5, 5), Viewport(size)
    )
    half = ((size[1] + 1) // 2, (size[0] + 1) // 2)
    assert [plane.shape for plane in view.planes] == [(size[1], size[0]), half, half]
    assert view.color == source.color


@pytest.mark.parametrize("full_range", [False, True])
def test_outside_the_field_is_black(full_range: bool) -> None:
    camera = make_camera((600, 600), Equidistant(100.0), field_deg=188)
    source = picture("i420", (600, 600), full_range)
    behind = RDF_FROM_FRD * body_from_view(180, 0)
    view = CpuRenderer().render(source, camera, behind, Viewport((64, 48), 60))
    assert [set(np.unique(plane)) for plane in view.planes] == [{b} for b in black_of(source)]
    assert view.planes[0][0, 0] == (0 if full_range else 16)


@pytest.mark.parametrize("hfov_deg", [20.0, 90.0, 150.0])
def test_the_rim_is_feathered_by_two_pixels_at_most(hfov_deg: float) -> None:
    camera = make_camera((600, 600), Equidistant(160.0), field_deg=188)
    white = Picture("gray", (np.full((600, 600), 255, np.uint8),), ColorSpace(full_range=True))
    viewport = Viewport((640, 360), hfov_deg)
    quarter_pixel_deg = np.degrees(0.25 / viewport.focal_px)
    at_rim = RDF_FROM_FRD * body_from_view(94 + quarter_pixel_deg, 0)
    row = CpuRenderer().render(white, camera, at_rim, viewport).planes[0][180].astype(int)
    between = np.flatnonzero((row > 0) & (row < 255))
    assert row[0] == 255
    assert row[-1] == 0
    assert 1 <= len(between) <= 2
    # 94 degrees to the right is the middle of this view, less a quarter of a pixel
    assert abs(between.mean() - 319.25) <= 0.75


def test_beyond_the_picture_is_black() -> None:
    """A lens that sees more than the sensor: bilinear towards black, then black."""
    camera = make_camera((200, 200), Equidistant(150.0), field_deg=188)
    white = Picture("gray", (np.full((200, 200), 255, np.uint8),), ColorSpace(full_range=True))
    right = RDF_FROM_FRD * body_from_view(60, 0)
    view = CpuRenderer().render(white, camera, right, Viewport((200, 100), 60)).planes[0]
    assert view[50, 0] == 255
    assert view[50, -1] == 0


def test_turning_the_head_left_shows_what_was_on_the_left() -> None:
    camera = make_camera((400, 400), Equidistant(110.0), field_deg=188)
    y, x = np.mgrid[0:400, 0:400]
    left_bright = Picture("gray", (np.where(x < 200, 200, 30).astype(np.uint8),))
    render = CpuRenderer().render
    for yaw, expected in ((-40, 200), (40, 30)):
        view = render(
            left_bright, camera, RDF_FROM_FRD * body_from_view(yaw, 0), Viewport((64, 48), 30)
        )
        assert view.planes[0].mean() == pytest.approx(expected, abs=1)
    top_bright = Picture("gray", (np.where(y < 200, 200, 30).astype(np.uint8),))
    for pitch, expected in ((40, 200), (-40, 30)):
        view = render(
            top_bright, camera, RDF_FROM_FRD * body_from_view(0, pitch), Viewport((64, 48), 30)
        )
        assert view.planes[0].mean() == pytest.approx(expected, abs=1)


def test_tilting_the_head_right_tilts_the_horizon_left() -> None:
    camera = make_camera((400, 400), Equidistant(110.0), field_deg=188)
    sky = (np.mgrid[0:400, 0:400][0] < 200).astype(np.uint8) * 200
    tilted = RDF_FROM_FRD * body_from_view(0, 0, 20)
    view = CpuRenderer().render(Picture("gray", (sky,)), camera, tilted, Viewport((200, 200), 60))
    horizon_left = int(np.argmin(view.planes[0][:, 20]))
    horizon_right = int(np.argmin(view.planes[0][:, 180]))
    # anticlockwise: the left end of the horizon sinks, the right end rises
    assert horizon_left > 100 > horizon_right
    slope = np.degrees(np.arctan2(horizon_left - horizon_right, 160))
    assert slope == pytest.approx(20, abs=1)


def test_a_picture_of_the_wrong_size_is_refused() -> None:
    camera = make_camera(SIZE, Equidistant(150.0), field_deg=188)
    for renderer in (CpuRenderer(), ReferenceRenderer()):
        with pytest.raises(RenderError, match=r"320 x 240.*640 x 480"):
            renderer.render(picture("gray", (320, 240)), camera, RDF_FROM_FRD, Viewport((64, 48)))


def test_a_moved_view_does_not_change_the_one_before() -> None:
    camera = make_camera(SIZE, Equidistant(150.0), field_deg=188)
    source, renderer = picture("i420"), CpuRenderer()
    first = renderer.render(source, camera, RDF_FROM_FRD * body_from_view(0, 0), Viewport((64, 48)))
    kept = [plane.copy() for plane in first.planes]
    renderer.render(source, camera, RDF_FROM_FRD * body_from_view(50, 0), Viewport((64, 48)))
    assert all((a == b).all() for a, b in zip(first.planes, kept, strict=True))
