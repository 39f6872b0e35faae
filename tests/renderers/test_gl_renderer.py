"""The OpenGL renderer: shrinking without shimmer, enlarging sharply, colour, threads, mistakes.

Coordinates and pictures on every lens are in test_renderers_conformance.py.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from freelook.camera import make_camera
from freelook.color import i420_from_rgb, rgb_from_picture
from freelook.errors import MissingExtra, RenderError
from freelook.lens import Equidistant
from freelook.renderers import Renderer, gl_context, gl_shader
from freelook.renderers.blank import black_of
from freelook.renderers.cpu import CpuRenderer
from freelook.renderers.gl import GlRenderer
from freelook.renderers.gl_uniforms import most_shrunk
from freelook.renderers.reference import ReferenceRenderer
from freelook.renderers.reference import coordinates as exact_coordinates
from freelook.rotations import RDF_FROM_FRD, body_from_view
from freelook.types import ColorSpace, Picture
from freelook.viewport import Viewport
from gl_here import gl_renderer

SIDE = 600
CAMERA = make_camera((SIDE, SIDE), Equidistant(180.0), field_deg=188)
CENTRE = RDF_FROM_FRD * body_from_view(0, 0)
AHEAD = RDF_FROM_FRD * body_from_view(3, 2, 5)

Floats = NDArray[np.float64]


@pytest.fixture(scope="module")
def gl() -> Iterator[GlRenderer]:
    renderer = gl_renderer()
    yield renderer
    renderer.close()


def noise(rng: np.random.Generator) -> Picture:
    """The worst there is to shrink: every pixel different."""
    return Picture(
        "gray", (rng.integers(0, 256, (SIDE, SIDE), np.uint8),), ColorSpace(full_range=True)
    )


def supersampled(
    picture: Picture, camera_from_view: Rotation, viewport: Viewport, times: int
) -> Floats:
    """The mean of times x times samples in every pixel of the view."""
    width, height = viewport.size
    large = Viewport((width * times, height * times), viewport.hfov_deg)
    view = ReferenceRenderer().render(picture, CAMERA, camera_from_view, large).planes[0]
    return np.asarray(view.reshape(height, times, width, times).mean(axis=(1, 3)))


def rms(values: Floats) -> float:
    return float(np.sqrt((values**2).mean()))


# hfov, samples for the truth, RMS error over white noise (of its own 74 codes) and shimmer, both
# with half as much again as was measured
SHRINKING = [
    pytest.param(60.0, 4, 7.0, 6.0, id="2.9 times"),
    pytest.param(90.0, 8, 3.5, 3.5, id="5 times"),
    pytest.param(140.0, 16, 3.5, 5.0, id="14 times"),
]


@pytest.mark.parametrize(("hfov_deg", "times", "most_error", "most_shimmer"), SHRINKING)
def test_a_view_that_shrinks_the_picture_does_not_shimmer(
    hfov_deg: float, times: int, most_error: float, most_shimmer: float, rng: np.random.Generator
) -> None:
    """While the head turns by 0.15 view pixels a step. Shimmer: how the error changes from one
    step to the next. One sample a pixel, as a comparison, must be at least five times as bad."""
    picture, viewport = noise(rng), Viewport((72, 40), hfov_deg)
    smooth, plain = gl_renderer(), gl_renderer(antialias=False)
    step_deg = 0.15 * np.degrees(1 / viewport.focal_px)
    errors: dict[str, list[Floats]] = {"smooth": [], "plain": []}
    for k in range(3):
        turned = RDF_FROM_FRD * body_from_view(5 + k * step_deg, 3, 4)
        truth = supersampled(picture, turned, viewport, times)
        for name, renderer in (("smooth", smooth), ("plain", plain)):
            view = renderer.render(picture, CAMERA, turned, viewport).planes[0]
            errors[name].append(view - truth)
    error, plain_error = (rms(np.array(errors[name])) for name in ("smooth", "plain"))
    shimmer, plain_shimmer = (
        rms(np.diff(np.array(errors[name]), axis=0)) for name in ("smooth", "plain")
    )
    assert error < most_error
    assert shimmer < most_shimmer
    assert plain_error > 5 * error
    assert plain_shimmer > 5 * shimmer


def test_a_view_that_enlarges_is_not_smoothed(gl: GlRenderer, rng: np.random.Generator) -> None:
    """Where nothing shrinks, all there is to antialiasing is one bilinear sample."""
    picture, viewport = noise(rng), Viewport((96, 54), 15.0)
    view = gl.render(picture, CAMERA, AHEAD, viewport).planes[0]
    plain = ReferenceRenderer().render(picture, CAMERA, AHEAD, viewport).planes[0]
    assert np.abs(view.astype(int) - plain).max() <= 2  # weights of 1/256 of 255 codes, rounding


@pytest.mark.parametrize("kind", ["cpu", "gl"])
def test_bicubic_is_nearer_to_the_truth_than_bilinear(kind: str) -> None:
    """Enlarging a wave of 5 pixels, whose value is known everywhere."""

    def value(x: Floats, y: Floats) -> Floats:
        return np.asarray(127.5 + 100 * np.sin(2 * np.pi * x / 5.0) * np.cos(2 * np.pi * y / 6.0))

    y, x = np.mgrid[0:SIDE, 0:SIDE].astype(float)
    picture = Picture("gray", (np.rint(value(x, y)).astype(np.uint8),))
    viewport = Viewport((96, 54), 15.0)
    pixels = exact_coordinates(CAMERA, AHEAD, viewport)
    truth = value(pixels[..., 0], pixels[..., 1])
    errors = []
    for sampling in ("bilinear", "bicubic"):
        renderer: Renderer = (
            CpuRenderer(1, sampling=sampling) if kind == "cpu" else gl_renderer(sampling)
        )
        errors.append(rms(renderer.render(picture, CAMERA, AHEAD, viewport).planes[0] - truth))
    bilinear, bicubic = errors
    assert bicubic < bilinear / 3


@pytest.mark.parametrize("full_range", [False, True])
@pytest.mark.parametrize("matrix", ["bt601", "bt709"])
@pytest.mark.parametrize("layout", ["i420", "nv12", "gray", "rgb24"])
def test_colour_is_made_in_the_shader(
    layout: str, matrix: str, full_range: bool, gl: GlRenderer
) -> None:
    color = ColorSpace(matrix, full_range)  # type: ignore[arg-type]
    y, x = np.mgrid[0:SIDE, 0:SIDE] / SIDE
    rgb = np.stack([x, y, 1 - x], axis=-1) * 0.9 + 0.05
    i420 = i420_from_rgb(rgb, color)
    luma, u, v = i420.planes
    picture = {
        "i420": i420,
        "nv12": Picture("nv12", (luma, np.stack([u, v], axis=-1)), color),
        "gray": Picture("gray", (luma,), color),
        "rgb24": Picture("rgb24", (np.rint(rgb * 255).astype(np.uint8),), color),
    }[layout]
    viewport = Viewport((64, 36), 40.0)
    view = gl.render_rgb(picture, CAMERA, AHEAD, viewport)
    right = rgb_from_picture(ReferenceRenderer().render(picture, CAMERA, AHEAD, viewport))
    # the reference has rounded codes, and one step of limited-range chroma is two of blue; its
    # chroma is repeated, here it goes on smoothly: over half a pixel of these slopes, one more
    assert np.abs(view.planes[0] / 255 - right).max() < 4 / 255


@pytest.mark.parametrize("size", [(321, 181), (2, 2), (17, 400), (403, 3)])
def test_any_view_size(size: tuple[int, int], gl: GlRenderer) -> None:
    planes = (np.full((301, 333), 200, np.uint8), *(np.full((151, 167), 90, np.uint8),) * 2)
    picture = Picture("i420", planes)
    camera = make_camera((333, 301), Equidistant(300.0), field_deg=60)
    ours = gl.render(picture, camera, CENTRE, Viewport(size, 20.0))
    half = ((size[1] + 1) // 2, (size[0] + 1) // 2)
    assert [plane.shape for plane in ours.planes] == [(size[1], size[0]), half, half]
    assert all(plane[half[0] // 2, half[1] // 2] == 90 for plane in ours.planes[1:])


def test_planes_that_are_not_contiguous(gl: GlRenderer, rng: np.random.Generator) -> None:
    """Decoders pad their rows."""
    padded = rng.integers(0, 256, (SIDE, SIDE + 40), np.uint8)
    strided, packed = padded[:, :SIDE], np.ascontiguousarray(padded[:, :SIDE])
    views = [
        gl.render(Picture("gray", (plane,)), CAMERA, AHEAD, Viewport((64, 48), 60.0)).planes[0]
        for plane in (strided, packed)
    ]
    assert (views[0] == views[1]).all()


@pytest.mark.parametrize("full_range", [False, True])
def test_outside_the_field_is_black(full_range: bool, gl: GlRenderer) -> None:
    planes = (np.full((SIDE, SIDE), 200, np.uint8), *(np.full((300, 300), 90, np.uint8),) * 2)
    picture = Picture("i420", planes, ColorSpace(full_range=full_range))
    behind = RDF_FROM_FRD * body_from_view(180, 0)
    view = gl.render(picture, CAMERA, behind, Viewport((64, 48), 60.0))
    assert [set(np.unique(plane)) for plane in view.planes] == [{b} for b in black_of(picture)]


def test_the_rim_is_feathered_by_two_pixels_at_most(gl: GlRenderer) -> None:
    white = Picture("gray", (np.full((SIDE, SIDE), 255, np.uint8),), ColorSpace(full_range=True))
    at_rim = RDF_FROM_FRD * body_from_view(94, 0)
    row = gl.render(white, CAMERA, at_rim, Viewport((641, 361), 60.0)).planes[0][180].astype(int)
    between = np.flatnonzero((row > 0) & (row < 255))
    assert row[0] == 255
    assert row[-1] == 0
    assert 1 <= len(between) <= 2
    assert abs(between.mean() - 320) <= 0.75


def test_pictures_of_changing_size_and_layout(gl: GlRenderer, rng: np.random.Generator) -> None:
    """What is left of the picture before never shows."""
    viewport = Viewport((64, 36), 60.0)
    for side, layout in ((200, "gray"), (300, "rgb24"), (200, "gray"), (200, "rgb24")):
        shape = (side, side) if layout == "gray" else (side, side, 3)
        picture = Picture(layout, (rng.integers(90, 160, shape, np.uint8),))  # type: ignore[arg-type]
        camera = CAMERA.resized((side, side))
        view = gl.render(picture, camera, AHEAD, viewport)
        right = ReferenceRenderer().render(picture, camera, AHEAD, viewport)
        # shrunk a little here and there, and so less contrast than by one sample
        assert np.abs(view.planes[0].astype(int) - right.planes[0]).max() < 50
        assert abs(view.planes[0].mean() - right.planes[0].mean()) < 2


def test_one_renderer_on_several_threads_in_turn(gl: GlRenderer, rng: np.random.Generator) -> None:
    picture, viewport = noise(rng), Viewport((64, 36), 60.0)
    first = gl.render(picture, CAMERA, AHEAD, viewport).planes[0]
    views = []
    for _ in range(2):
        thread = threading.Thread(
            target=lambda: views.append(gl.render(picture, CAMERA, AHEAD, viewport).planes[0])
        )
        thread.start()
        thread.join()
    assert len(views) == 2
    assert all((view == first).all() for view in views)


def test_two_renderers_side_by_side(gl: GlRenderer, rng: np.random.Generator) -> None:
    viewport, other = Viewport((64, 36), 60.0), gl_renderer()
    dark = Picture("gray", (np.full((SIDE, SIDE), 20, np.uint8),))
    bright = Picture("gray", (np.full((SIDE, SIDE), 220, np.uint8),))
    for _ in range(2):
        assert (gl.render(dark, CAMERA, AHEAD, viewport).planes[0] == 20).all()
        assert (other.render(bright, CAMERA, AHEAD, viewport).planes[0] == 220).all()
    other.close()
    assert (gl.render(dark, CAMERA, AHEAD, viewport).planes[0] == 20).all()


def test_a_picture_of_the_wrong_size_is_refused(gl: GlRenderer) -> None:
    small = Picture("gray", (np.zeros((240, 320), np.uint8),))
    with pytest.raises(RenderError, match=r"320 x 240.*600 x 600"):
        gl.render(small, CAMERA, AHEAD, Viewport((64, 36)))


def test_a_device_that_is_not_there_is_refused(gl: GlRenderer) -> None:
    with pytest.raises(RenderError, match="freelook doctor"):
        GlRenderer(99)


def test_without_moderngl_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "moderngl", None)
    with pytest.raises(MissingExtra, match=r"freelook\[gl\]"):
        gl_context.open_context()


@pytest.mark.parametrize("hfov_deg", [20.0, 90.0, 140.0])
def test_how_much_a_view_shrinks_is_estimated_from_above(hfov_deg: float) -> None:
    """And not by much: within a third of what is measured where it is largest, in the middle."""
    viewport = Viewport((96, 54), hfov_deg)
    pixels = exact_coordinates(CAMERA, CENTRE, viewport)
    across = np.linalg.norm(np.diff(pixels, axis=1), axis=-1).max()
    down = np.linalg.norm(np.diff(pixels, axis=0), axis=-1).max()
    measured = max(across, down)
    assert measured * 0.99 < most_shrunk(CAMERA, viewport) < 2 * measured


PICTURES = (("PLANES",), ("NV12",), ())
VARIANTS = [
    *((*kind, *more) for kind in PICTURES for more in ((), ("BENT", "ANTIALIAS", "BICUBIC"))),
    *((*kind, "VIEWER", "ANTIALIAS") for kind in PICTURES),
    ("PLANE", "BICUBIC"),
    ("PLANE", "BENT", "ANTIALIAS"),
    ("COORDINATES", "BENT"),
    ("PLANES", "FISHEYE"),
]


@pytest.mark.parametrize("defines", VARIANTS, ids=lambda names: "-".join(names) or "plain")
def test_the_shader_is_understood_as_the_pages_and_as_ours(
    defines: tuple[str, ...], gl: GlRenderer
) -> None:
    """Desktop OpenGL from 4.3 on reads the language of WebGL2 too."""
    page = "#version 300 es\nprecision highp float;\nprecision highp int;\n"
    context = gl_context.open_context()
    headers = [gl_shader.HEADER, page] if context.version_code >= 430 else [gl_shader.HEADER]
    with context:
        for header in headers:
            version = header.partition("\n")[0] + "\n"
            head = header + "".join(f"#define {name}\n" for name in defines)
            context.program(
                vertex_shader=gl_shader.VERTEX.replace(gl_shader.HEADER, version),
                fragment_shader=head + gl_shader.body(),
            )
    context.release()
