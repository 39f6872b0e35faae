"""Views of every projection in every renderer, against the definition and the simulated world."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion
from scipy.spatial.transform import Rotation

from freelook.camera import Camera, make_camera
from freelook.color import i420_from_rgb
from freelook.lens import Equidistant, KannalaBrandt, ThinPrismFisheye
from freelook.projections import PROJECTIONS, Projection
from freelook.renderers import Renderer, cpu, kernels
from freelook.renderers.gl import GlRenderer
from freelook.renderers.gl_uniforms import most_shrunk
from freelook.renderers.reference import ReferenceRenderer
from freelook.renderers.reference import coordinates as exact_coordinates
from freelook.renderers.window import window_of
from freelook.rotations import RDF_FROM_FRD, body_from_view
from freelook.simulation.camera import SimulatedCamera
from freelook.simulation.world import World
from freelook.types import ColorSpace, Picture
from freelook.viewport import Viewport
from gl_here import gl_renderer

CAMERAS = {
    "round": make_camera((1000, 800), KannalaBrandt(220.0, -0.01, 0.004), field_deg=190),
    "not round": make_camera(
        (640, 480),
        ThinPrismFisheye(f=140.0, k1=-0.01, p1=4e-3, p2=-2e-3, sx1=-3e-3, sy1=2e-3),
        field_deg=200,
        stretch=np.array([[1.0, 0.01], [0.0, 0.98]]),
        camera_from_body=body_from_view(10.0, -25.0, 5.0).inv(),
    ),
}
HEADS = [(0, 0, 0), (-60, 25, 20), (150, 10, 0)]  # ahead, the rim in view, turned away
ALL = list(PROJECTIONS.values())
BY_NAME = pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.name)
Coordinates = Callable[[Camera, Rotation, Viewport], NDArray[np.float32]]


@pytest.fixture(scope="module")
def gl() -> Iterator[GlRenderer]:
    renderer = gl_renderer(antialias=False)
    yield renderer
    renderer.close()


def wide(kind: Projection, size: tuple[int, int]) -> Viewport:
    """As far as 170 degrees, and one of all around."""
    return Viewport(size, max(kind.narrowest_deg, min(kind.widest_deg, 170.0)), kind.name)


def views(kind: Projection) -> list[Viewport]:
    widest = Viewport((384, 96), min(kind.widest_deg, 300.0), kind.name)
    return [wide(kind, (384, 96)), widest]


def farthest(camera: Camera, kind: Projection, coordinates: Coordinates) -> float:
    """As in test_renderers_conformance.py: the largest distance in x or y, pixels."""
    worst, seen = 0.0, 0
    for viewport in views(kind):
        for head in HEADS:
            turn = camera.camera_from_body * body_from_view(*head)
            exact = exact_coordinates(camera, turn, viewport)
            ours = np.moveaxis(coordinates(camera, turn, viewport), 0, -1)
            exact_seen, ours_seen = ~np.isnan(exact[..., 0]), ~np.isnan(ours[..., 0])
            # pixels cut by the rim; a crop of a lens that is not round has the round lens's rim
            most = 1 / 30 if kind.cut and camera.grid else 1 / 96
            assert (exact_seen != ours_seen).mean() < most
            both = exact_seen & ours_seen
            seen += int(both.sum())
            worst = max(worst, float(np.abs(ours - exact)[both].max(initial=0.0)))
    assert seen > 20_000
    return worst


@pytest.mark.parametrize("lens", CAMERAS)
@BY_NAME
def test_coordinates_of_the_cpu_renderer(kind: Projection, lens: str) -> None:
    """Bounds as in test_renderers_conformance.py."""
    camera = CAMERAS[lens]
    residual_px = camera.residual_px * (3 if camera.grid else 1)
    assert farthest(camera, kind, cpu.coordinates) < 0.01 + residual_px


@pytest.mark.parametrize("lens", CAMERAS)
@BY_NAME
def test_coordinates_of_the_gl_renderer(kind: Projection, lens: str, gl: GlRenderer) -> None:
    """0.001 px for float32 beside the table's own error."""
    camera = CAMERAS[lens]
    gl.render(blank(camera), camera, RDF_FROM_FRD, Viewport((8, 8)))
    assert farthest(camera, kind, gl.coordinates) < 0.001 + 1.01 * camera.residual_px


def blank(camera: Camera) -> Picture:
    width, height = camera.size
    return Picture("gray", (np.zeros((height, width), np.uint8),), ColorSpace(full_range=True))


def smooth(camera: Camera) -> Picture:
    """Waves of 40 pixels and more: the steepest has 20 codes a pixel."""
    width, height = camera.size
    y, x = np.mgrid[:height, :width]
    luma = np.rint(128 + 60 * np.sin(x / 7) + 60 * np.cos(y / 9)).astype(np.uint8)
    u, v = (np.ascontiguousarray(luma[i::2, 1::2]) for i in (0, 1))
    return Picture("i420", (luma, u, v), ColorSpace(full_range=True))


@pytest.mark.parametrize("which", ["cpu", "gl"])
@BY_NAME
def test_pictures(kind: Projection, which: str, gl: GlRenderer) -> None:
    """Inside the rim, as in test_renderers_conformance.py: OpenCV's weights are 1/32 pixel."""
    renderer: Renderer = cpu.CpuRenderer(2) if which == "cpu" else gl
    camera = CAMERAS["round"]
    picture, viewport = smooth(camera), wide(kind, (192, 48))
    for head in HEADS[:2]:
        turn = camera.camera_from_body * body_from_view(*head)
        ours = renderer.render(picture, camera, turn, viewport)
        exact = ReferenceRenderer().render(picture, camera, turn, viewport)
        seen = well_inside(camera, turn, viewport)
        assert seen.mean() > 0.25
        for a, b, where in zip(
            ours.planes, exact.planes, (seen, *[seen[::2, ::2]] * 2), strict=True
        ):
            assert np.abs(a.astype(int) - b)[where].max() <= 3


def well_inside(camera: Camera, turn: Rotation, viewport: Viewport) -> NDArray[np.bool_]:
    """Pixels of the view with two seen ones around them on all sides."""
    pixel = exact_coordinates(camera, turn, viewport)
    seen = ((pixel >= 4) & (pixel <= np.array(camera.size) - 5)).all(axis=-1)
    return np.asarray(binary_erosion(seen, iterations=2))


@pytest.fixture(scope="module")
def filmed() -> tuple[SimulatedCamera, Picture]:
    camera = make_camera((800, 800), Equidistant(230.0), field_deg=190)
    simulated = SimulatedCamera(camera, World(softness_deg=1.0), threads=2)
    return simulated, simulated.picture(21_000_000_000)


@BY_NAME
def test_views_equal_the_exact_world(
    kind: Projection, filmed: tuple[SimulatedCamera, Picture]
) -> None:
    """Above 40 dB, as perspective views in test_truth.py; a crop's rays are those of its lens."""
    simulated, picture = filmed
    camera, viewport = simulated.camera, wide(kind, (240, 80))
    direction = body_from_view(-35, 15, 10)
    turn = camera.camera_from_body * direction
    view = cpu.CpuRenderer().render(picture, camera, turn, viewport)
    state = simulated.truth(21_000_000_000)
    ray = camera.ray(exact_coordinates(camera, turn, viewport)) if kind.cut else None
    if ray is None:
        rgb = simulated.exact_rgb(21_000_000_000, direction, viewport)
    else:
        world_from_camera = state.world_from_body * camera.camera_from_body.inv()
        rays = np.nan_to_num(ray, nan=1.0) @ world_from_camera.as_matrix().T
        rgb = simulated.world.render_rays(rays, state.position, threads=2)
    exact = i420_from_rgb(rgb, picture.color)
    seen = well_inside(camera, turn, viewport)
    assert seen.mean() > 0.4
    error = view.planes[0][seen].astype(float) - exact.planes[0][seen]
    assert 10 * np.log10(255**2 / np.mean(error**2)) > 40


@pytest.mark.parametrize("renderer", ["reference", "cpu", "gl"])
@BY_NAME
def test_what_was_right_of_the_middle_is_in_it_after_turning_right(
    kind: Projection, renderer: str, gl: GlRenderer
) -> None:
    """And above it, after looking up. The mark is 40 degrees to the right, 20 up."""
    camera = CAMERAS["round"]
    by_name: dict[str, Renderer] = {
        "reference": ReferenceRenderer(),
        "cpu": cpu.CpuRenderer(1),
        "gl": gl,
    }
    mark = camera.project(camera.camera_from_body.apply(body_from_view(40, 20).apply([0, 0, 1])))
    y, x = np.mgrid[: camera.size[1], : camera.size[0]]
    luma = np.where(np.hypot(x - mark[0], y - mark[1]) < 12, 255, 0).astype(np.uint8)
    viewport = wide(kind, (180, 60))

    def found(*head: float) -> NDArray[np.float64]:
        turn = camera.camera_from_body * body_from_view(*head)
        picture = Picture("gray", (luma,), ColorSpace(full_range=True))
        weight = by_name[renderer].render(picture, camera, turn, viewport).planes[0].astype(float)
        rows, columns = np.indices(weight.shape)
        x, y = ((axis * weight).sum() / weight.sum() for axis in (columns, rows))
        return np.array([x, y]) - (np.array(viewport.size) - 1) / 2

    assert np.abs(found(40, 20)).max() < 0.7
    x, y = found(30, 10)
    assert x > 3
    assert y < -3


def test_a_crop_is_the_pictures_own_pixels() -> None:
    """Where its focal length is the lens's and its middle a pixel's, they are copied."""
    rng = np.random.default_rng(1)
    camera = make_camera((401, 301), Equidistant(100.0), field_deg=200)
    picture = Picture("gray", (rng.integers(0, 256, (301, 401), np.uint8),))
    viewport = Viewport((181, 145), float(np.degrees(1.81)), "crop")
    assert viewport.focal_px == pytest.approx(100)
    for roll in (0.0, 50.0):  # which does not turn it
        turn = RDF_FROM_FRD * body_from_view(float(np.degrees(0.3)), 0.0, roll)
        view = cpu.CpuRenderer(1).render(picture, camera, turn, viewport).planes[0]
        # 1: OpenCV's weights of 1/32 pixel put nothing of the neighbour in but rounding
        expected = picture.planes[0][150 - 72 : 150 + 73, 200 + 30 - 90 : 200 + 30 + 91]
        assert np.abs(view.astype(int) - expected).max() <= 1


def test_a_crop_is_held_at_the_rim() -> None:
    camera = CAMERAS["round"]
    viewport = Viewport((64, 48), 60.0, "crop")
    rim = camera.lens.radius(np.array([camera.theta_max]))[0]
    for yaw in (100.0, 140.0, 180.0):
        window = window_of(camera, camera.camera_from_body * body_from_view(yaw, 0), viewport)
        np.testing.assert_allclose(window.middle - camera.center, [rim, 0], atol=1e-3)


def test_kernels_know_every_formula() -> None:
    """All but the equidistant one, by which only sizes are computed, each as it is defined."""
    for kind in ALL:
        if kind.name != "perspective" and not kind.cut:
            ray = kernels.view_ray(kind.code, np.float32(0.7), np.float32(-0.4))
            np.testing.assert_allclose(ray, kind.ray(np.array(0.7), np.array(-0.4)), atol=1e-6)


@BY_NAME
def test_pictures_are_halved_as_often_as_the_projection_needs(kind: Projection) -> None:
    """The estimate of how much a view shrinks is no less than what it does where it looks."""
    camera, viewport = CAMERAS["round"], wide(kind, (192, 48))
    pixel = exact_coordinates(camera, camera.camera_from_body, viewport)
    moved = [np.linalg.norm(np.diff(pixel, axis=axis), axis=-1) for axis in (0, 1)]
    most = max(float(np.nanmax(step)) for step in moved)
    assert most <= most_shrunk(camera, viewport) * 1.001
    assert most_shrunk(camera, replace(viewport, size=(96, 24))) > 1.5 * most
