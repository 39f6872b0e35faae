"""The shader in the browser: coordinates and colours against the definitions in Python."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from page_station import PageView

from freelook.camera import Camera, make_camera
from freelook.lens import (
    Equidistant,
    Equisolid,
    Floats,
    KannalaBrandt,
    Orthographic,
    Perspective,
    Polynomial,
    Stereographic,
    ThinPrismFisheye,
)
from freelook.rotations import RDF_FROM_FRD, body_from_view
from freelook.types import ColorSpace, Matrix, Picture, Plane
from freelook.viewport import Viewport

pytestmark = pytest.mark.browser

SIZE = (640, 480)
VIEW = Viewport((96, 64), 110.0)
HEADS = [(0.0, 0.0, 0.0), (-70.0, 35.0, 20.0), (160.0, -10.0, -120.0)]

CAMERAS = {
    "perspective": make_camera(SIZE, Perspective(f=200.0)),
    "stereographic": make_camera(SIZE, Stereographic(f=110.0), field_deg=220),
    "equidistant": make_camera(SIZE, Equidistant(f=140.0), field_deg=188),
    "equisolid": make_camera(SIZE, Equisolid(f=150.0), field_deg=200),
    "orthographic": make_camera(SIZE, Orthographic(f=230.0), field_deg=170),
    "polynomial": make_camera(SIZE, Polynomial(a=150.0, b=2.0, c=-6.0), field_deg=188),
    "kannala_brandt": make_camera(
        SIZE, KannalaBrandt(f=140.0, k1=-0.01, k2=0.004, k3=-0.001), field_deg=210
    ),
    "not round": make_camera(
        SIZE,
        ThinPrismFisheye(f=140.0, k1=-0.01, p1=4e-3, p2=-2e-3, sx1=-3e-3, sy1=2e-3),
        field_deg=200,
        stretch=np.array([[1.0, 0.01], [0.0, 0.98]]),
    ),
    "off-centre, stretched, tilted": make_camera(
        SIZE,
        Equidistant(f=140.0),
        center=(300.25, 251.5),
        field_deg=188,
        stretch=np.array([[1.08, 0.02], [-0.01, 0.97]]),
        camera_from_body=body_from_view(10.0, -25.0, 5.0).inv(),
    ),
}


def blank(size: tuple[int, int]) -> Picture:
    width, height = size
    chroma = np.full((height // 2, width // 2), 128, np.uint8)
    return Picture("i420", (np.full((height, width), 128, np.uint8), chroma, chroma))


def exact_pixels(camera: Camera, head: tuple[float, float, float], view: Viewport) -> Floats:
    rays = view.rays().reshape(-1, 3)
    camera_from_view = camera.camera_from_body * body_from_view(*head)
    return camera.project(camera_from_view.apply(rays)).reshape(*view.size[::-1], 2)


@pytest.mark.parametrize("name", CAMERAS)
def test_coordinates_are_those_of_the_exact_projection(name: str, open_page) -> None:  # type: ignore[no-untyped-def]
    camera = CAMERAS[name]
    page = open_page(camera)
    page.put(blank(camera.size))
    page.set_view(*VIEW.size, VIEW.hfov_deg)
    for head in HEADS:
        page.set_head(*head)
        drawn = page.coordinates()
        exact = exact_pixels(camera, head, VIEW)
        seen = ~np.isnan(exact[..., 0])
        assert np.abs(drawn[..., :2] - exact)[seen].max(initial=0) < 0.01
        assert ((drawn[..., 2] <= camera.table.t_max * (1 + 1e-5)) == seen).mean() > 0.999
        assert (drawn[..., 3][~seen] <= 0.51).all()
    assert any((~np.isnan(exact_pixels(camera, head, VIEW))).any() for head in HEADS)


@pytest.mark.parametrize("name", ["off-centre, stretched, tilted", "not round"])
def test_outlines_use_the_same_projection(name: str, open_page) -> None:  # type: ignore[no-untyped-def]
    """The page draws the view's outline over the whole picture without the shader."""
    camera = CAMERAS[name]
    page = open_page(camera)
    rays = [[0.1, -0.2, 1.0], [-2.0, 0.5, 0.3], [1.0, 1.0, -0.1], [0.0, 0.0, -1.0]]
    script = "rays => rays.map(ray => window.freelook.app.renderer.camera.project(ray))"
    pixels = [[np.nan] * 2 if at is None else at for at in page.page.evaluate(script, rays)]
    np.testing.assert_allclose(pixels, camera.project(np.array(rays)), atol=0.01)


def test_rays_beyond_90_degrees_are_drawn(open_page) -> None:  # type: ignore[no-untyped-def]
    camera = CAMERAS["stereographic"]
    page = open_page(camera)
    page.put(blank(camera.size))
    page.set_view(16, 16, 10.0)
    page.set_head(100.0, 0.0)
    exact = exact_pixels(camera, (100.0, 0.0, 0.0), Viewport((16, 16), 10.0))
    assert np.abs(page.coordinates()[..., :2] - exact).max() < 0.01


def test_video_of_another_size_is_scaled(open_page) -> None:  # type: ignore[no-untyped-def]
    camera = CAMERAS["off-centre, stretched, tilted"]
    page = open_page(camera)
    page.put(blank((320, 240)))
    page.set_view(*VIEW.size, VIEW.hfov_deg)
    page.set_head(20.0, 5.0)
    exact = exact_pixels(camera.resized((320, 240)), (20.0, 5.0, 0.0), VIEW)
    seen = ~np.isnan(exact[..., 0])
    assert seen.mean() > 0.5
    assert np.abs(page.coordinates()[..., :2] - exact)[seen].max() < 0.01


def rgb_of(y: Floats, u: Floats, v: Floats, color: ColorSpace) -> Floats:
    """ITU-R BT.601 and BT.709, from the definitions of luma and colour differences."""
    kr, kb = {"bt601": (0.299, 0.114), "bt709": (0.2126, 0.0722)}[color.matrix]
    luma = y / 255 if color.full_range else (y - 16) / 219
    span = 255 if color.full_range else 224
    cb, cr = (u - 128) / span, (v - 128) / span
    red, blue = luma + 2 * (1 - kr) * cr, luma + 2 * (1 - kb) * cb
    green = (luma - kr * red - kb * blue) / (1 - kr - kb)
    return np.clip(np.stack([red, green, blue], -1), 0, 1) * 255


MATRICES: tuple[Matrix, ...] = ("bt601", "bt709")
SPACES = [ColorSpace(matrix, full) for matrix in MATRICES for full in (False, True)]
COLOURS = [(16, 128, 128), (235, 128, 128), (81, 90, 200), (120, 200, 60), (60, 60, 90)]


@pytest.mark.parametrize("layout", ["i420", "nv12"])
def test_colours_are_those_of_the_standard(view: PageView, layout: str) -> None:
    for color, (y, u, v) in product(SPACES, COLOURS):
        planes = [np.full((240, 320), y), np.full((120, 160), u), np.full((120, 160), v)]
        i420 = tuple(plane.astype(np.uint8) for plane in planes)
        nv12 = (i420[0], np.stack(i420[1:], -1))
        view.put(Picture("i420", i420, color) if layout == "i420" else Picture("nv12", nv12, color))
        view.set_view(8, 8, 20.0)
        expected = rgb_of(np.array(y), np.array(u), np.array(v), color)
        assert np.abs(view.view().astype(float) - expected).max() <= 1.0


def test_the_view_is_the_bilinear_sample_at_the_exact_pixel(open_page, rng) -> None:  # type: ignore[no-untyped-def]
    camera = CAMERAS["equidistant"]
    width, height = camera.size
    small = rng.integers(30, 220, (height // 8, width // 8))
    luma = np.kron(small, np.ones((8, 8))).astype(np.uint8)
    chroma = np.full((height // 2, width // 2), 128, np.uint8)
    page = open_page(camera)
    page.put(Picture("i420", (luma, chroma, chroma), ColorSpace("bt709", full_range=True)))
    page.set_view(*VIEW.size, VIEW.hfov_deg)
    page.set_head(12.0, -7.0, 3.0)
    exact = exact_pixels(camera, (12.0, -7.0, 3.0), VIEW)
    low = np.floor(exact).astype(int)
    inside = ((low >= 0) & (low < np.array([width - 1, height - 1]))).all(-1)
    (x, y), (fx, fy) = low[inside].T, (exact - low)[inside].T
    l00, l01, l10, l11 = (luma[y + j, x + i].astype(float) for j in (0, 1) for i in (0, 1))
    expected = (l00 * (1 - fx) + l01 * fx) * (1 - fy) + (l10 * (1 - fx) + l11 * fx) * fy
    assert inside.mean() > 0.9
    # One eighth bit of the sampler's weights, times the largest step, and rounding.
    assert np.abs(page.view()[..., 1][inside] - expected).max() < 2.5


def test_chroma_sits_in_the_middle_of_its_luma_pixels(open_page) -> None:  # type: ignore[no-untyped-def]
    camera = CAMERAS["equidistant"]
    width, height = camera.size
    step = np.zeros((height // 2, width // 2), np.uint8) + 60
    step[:, 160:] = 200  # between luma columns 319 and 320
    even = np.full_like(step, 128)
    page = open_page(camera)
    luma = np.full((height, width), 128, np.uint8)
    page.put(Picture("i420", (luma, even, step), ColorSpace("bt709", full_range=True)))
    page.set_view(400, 4, 60.0)
    page.set_head(0.0, 0.0)
    red = page.view()[1, :, 0].astype(float)
    x = page.coordinates()[1, :, 0]
    middle = (red.max() + red.min()) / 2
    crossing = np.interp(middle, red[195:206], x[195:206])
    assert crossing == pytest.approx(319.5, abs=0.1)


def test_outside_the_lens_is_black_and_the_rim_is_feathered_by_about_a_pixel(open_page) -> None:  # type: ignore[no-untyped-def]
    camera = make_camera((640, 640), Equidistant(f=140.0), field_deg=120)
    chroma = np.full((320, 320), 128, np.uint8)
    white = Picture("i420", (np.full((640, 640), 235, np.uint8), chroma, chroma))
    page = open_page(camera)
    page.put(white)
    page.set_view(301, 3, 100.0)
    page.set_head(60.0, 0.0)
    row = page.view()[1, :, 1].astype(float) / 255
    angle = 60 + np.degrees(np.arctan((np.arange(301) - 150) / Viewport((301, 3), 100.0).focal_px))
    assert (row[angle < 59.2] > 0.99).all()
    assert (row[angle > 60.8] == 0).all()
    assert 1 <= ((row > 0.01) & (row < 0.99)).sum() <= 3


def test_beyond_the_pictures_border_is_black(open_page) -> None:  # type: ignore[no-untyped-def]
    camera = make_camera((200, 200), Equidistant(f=140.0), field_deg=170)
    chroma = np.full((100, 100), 128, np.uint8)
    white = Picture("i420", (np.full((200, 200), 235, np.uint8), chroma, chroma))
    page = open_page(camera)
    page.put(white)
    page.set_view(201, 3, 120.0)
    page.set_head(0.0, 0.0)
    drawn, x = page.view()[1, :, 0] / 255, page.coordinates()[1, :, 0].astype(np.float64)
    cover = np.clip(x + 1, 0, 1) * np.clip(200 - x, 0, 1)
    assert np.abs(drawn - cover).max() < 0.01
    assert cover.min() == 0


def colours_by_direction(camera: Camera) -> Picture:
    """Left of the nose red-ish (V high), right blue-ish (U high); above bright, below dark."""
    width, height = camera.size
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    ray = np.nan_to_num(camera.ray(np.stack([x, y], -1).astype(np.float64)))
    in_head = RDF_FROM_FRD * camera.camera_from_body.inv()
    ray = in_head.apply(ray.reshape(-1, 3)).reshape(ray.shape)
    luma = np.where(ray[..., 1] < 0, 180, 70).astype(np.uint8)
    left = ray[::2, ::2, 0] < 0
    u, v = np.where(left, 100, 200), np.where(left, 200, 100)
    planes = (luma, u.astype(np.uint8), v.astype(np.uint8))
    return Picture("i420", planes, ColorSpace("bt709", full_range=True))


@pytest.fixture
def painted(open_page) -> PageView:  # type: ignore[no-untyped-def]
    camera = CAMERAS["equidistant"]
    page: PageView = open_page(camera)
    page.put(colours_by_direction(camera))
    page.set_view(61, 61, 40.0)
    return page


def redder(pixels: Plane) -> bool:
    return bool(pixels[..., 0].mean() > pixels[..., 2].mean() + 30)


def test_head_left_shows_what_was_on_the_left(painted: PageView) -> None:
    painted.set_head(-40.0, 0.0)
    assert redder(painted.view())
    painted.set_head(40.0, 0.0)
    assert not redder(painted.view())


def test_head_up_shows_what_was_above(painted: PageView) -> None:
    painted.set_head(0.0, 40.0)
    above = painted.view().mean()
    painted.set_head(0.0, -40.0)
    assert above > painted.view().mean() + 60


def test_tilting_the_head_right_tilts_the_horizon_left(painted: PageView) -> None:
    """The right ear goes down; the horizon turns anticlockwise: its right end rises."""
    painted.set_head(0.0, 0.0, 20.0)
    bright = painted.view().mean(axis=2) > 125
    left_end, right_end = bright[:, 3].sum(), bright[:, 57].sum()  # rows of sky above the horizon
    slope = np.degrees(np.arctan((left_end - right_end) / 54))
    assert slope == pytest.approx(20.0, abs=2.0)
