"""The projection: exact against tabulated, there and back, against OpenCV and by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.camera import TABLE_SIZE, Camera, make_camera
from freelook.errors import ProfileError
from freelook.lens import (
    MODELS,
    Equidistant,
    Equisolid,
    KannalaBrandt,
    Lens,
    Orthographic,
    Perspective,
    Polynomial,
    Stereographic,
    model_name,
)
from freelook.rotations import RDF_FROM_FRD

# what each model is commonly used for, all but perspective and orthographic beyond 90 degrees
FIELDS: list[tuple[Lens, float]] = [
    (Perspective(300), 130.0),
    (Stereographic(300), 220.0),
    (Equidistant(300), 220.0),
    (Equisolid(300), 220.0),
    (Orthographic(300), 170.0),
    (Polynomial(300, -3, 10, -8, 1), 190.0),
    (KannalaBrandt(300, -0.01, 0.005, -0.002, 0.0003), 200.0),
]
CAMERAS: dict[str, Camera] = {
    model_name(lens): make_camera((1000, 800), lens, field_deg=field_deg)
    for lens, field_deg in FIELDS
}
TAKES_MORE_THAN_A_HALF_SPACE = set(MODELS) - {"perspective", "orthographic"}


@pytest.fixture(params=list(CAMERAS.values()), ids=list(CAMERAS))
def camera(request: pytest.FixtureRequest) -> Camera:
    made: Camera = request.param
    return made


def rays_inside(camera: Camera, rng: np.random.Generator, count: int = 5000) -> np.ndarray:
    """Rays of any length, spread over the whole field."""
    theta = rng.uniform(0, camera.theta_max * (1 - 1e-9), count)
    phi = rng.uniform(-np.pi, np.pi, count)
    unit = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )
    return unit * rng.uniform(0.1, 10, (count, 1))


def project_float32(camera: Camera, ray: np.ndarray) -> np.ndarray:
    """The renderers' few operations as written in `freelook.camera`, all in float32."""
    d = ray.astype(np.float32)
    p = d[:, :2] / (np.sqrt((d * d).sum(1)) + d[:, 2])[:, None]
    t = (p * p).sum(1)
    t_max = np.float32(camera.table.t_max)
    position = (np.sqrt(t) + t) * (np.float32(TABLE_SIZE - 1) / (np.sqrt(t_max) + t_max))
    index = np.minimum(position.astype(np.int32), TABLE_SIZE - 2)
    part = position - index.astype(np.float32)
    g = camera.table.g
    value = g[index] + (g[index + 1] - g[index]) * part
    stretched = (p * value[:, None]) @ camera.stretch.T.astype(np.float32)
    pixel: np.ndarray = stretched + np.asarray(camera.center, np.float32)
    assert pixel.dtype == np.float32
    return pixel


def test_every_model_is_tested_here() -> None:
    assert set(CAMERAS) == set(MODELS)


def test_table_in_float32_keeps_its_promise(camera: Camera, rng: np.random.Generator) -> None:
    rays = rays_inside(camera, rng)
    error = np.linalg.norm(project_float32(camera, rays) - camera.project(rays), axis=1).max()
    rounding = 3e-4  # float32 pixels of this size
    assert camera.table.residual_px < 0.01
    assert error < camera.table.residual_px * 1.05 + rounding


def test_table_owns_up_where_a_lens_defies_it(rng: np.random.Generator) -> None:
    """tan(theta) climbs too steeply near 90 degrees for straight lines between 256 entries."""
    camera = make_camera((9000, 9000), Perspective(300), field_deg=170)
    rays = rays_inside(camera, rng, 50_000)
    error = np.linalg.norm(project_float32(camera, rays) - camera.project(rays), axis=1).max()
    assert error > 0.1
    assert error == pytest.approx(camera.table.residual_px, rel=0.03)


def test_table_follows_even_powers_of_theta(rng: np.random.Generator) -> None:
    """The 2011 paper's general polynomial is not smooth in theta squared, nor is its g in t."""
    camera = make_camera((1000, 800), Polynomial(300, 50, -20), field_deg=188)
    rays = rays_inside(camera, rng, 50_000)
    error = np.linalg.norm(project_float32(camera, rays) - camera.project(rays), axis=1).max()
    assert error < 0.002


def test_table_is_what_renderers_expect(camera: Camera) -> None:
    table = camera.table
    assert table.g.shape == (TABLE_SIZE,)
    assert table.g.dtype == np.float32
    assert (table.g > 0).all()
    assert table.t_max == pytest.approx(np.tan(camera.theta_max / 2) ** 2)
    ends = table(np.array([0.0, table.t_max, 2 * table.t_max]))
    assert ends.tolist() == [table.g[0], table.g[-1], table.g[-1]]


def test_pixel_to_ray_to_pixel(camera: Camera, rng: np.random.Generator) -> None:
    rays = rays_inside(camera, rng)
    pixels = camera.project(rays)
    back = camera.ray(pixels)
    np.testing.assert_allclose(np.linalg.norm(back, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(camera.project(back), pixels, atol=1e-6)
    unit = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    np.testing.assert_allclose(back, unit, atol=1e-6)


def test_axis_is_the_centre_and_back(camera: Camera) -> None:
    np.testing.assert_allclose(camera.project(np.array([0, 0, 2.5])), camera.center)
    np.testing.assert_allclose(camera.ray(np.array(camera.center)), [0, 0, 1], atol=1e-12)


def test_outside_the_field_is_nan(camera: Camera) -> None:
    beyond = camera.theta_max + 1e-6
    ray = np.array([[np.sin(beyond), 0, np.cos(beyond)], [0, 0, -1], [0, 0, 0]])
    assert np.isnan(camera.project(ray)).all()
    rim = camera.lens.radius(np.array([camera.theta_max]))[0]
    outside = np.add(camera.center, [[0, rim + 1], [1e6, 0]])
    assert np.isnan(camera.ray(outside)).all()


@pytest.mark.parametrize("name", sorted(TAKES_MORE_THAN_A_HALF_SPACE))
def test_rays_beyond_90_degrees_have_a_place(name: str) -> None:
    camera = CAMERAS[name]
    behind = np.radians(94.0)
    x, y = camera.project(np.array([np.sin(behind), 0, np.cos(behind)])) - camera.center
    assert x == pytest.approx(camera.lens.radius(np.array([behind]))[0])
    assert y == pytest.approx(0)


def test_stretch_and_centre_shape_the_image() -> None:
    stretch = np.array([[1.0, 0.1], [0.0, 0.9]])
    camera = make_camera((1000, 800), Equidistant(300), center=(510, 380), stretch=stretch)
    pixel = camera.project(np.array([0, np.sin(0.5), np.cos(0.5)]))
    np.testing.assert_allclose(pixel, [510 + 0.1 * 150, 380 + 0.9 * 150])
    np.testing.assert_allclose(camera.ray(pixel), [0, np.sin(0.5), np.cos(0.5)], atol=1e-9)


@given(st.integers(2, 4000), st.integers(2, 4000))
def test_resized_shows_the_same_thing_at_the_same_place(width: int, height: int) -> None:
    camera = CAMERAS["equidistant"]
    rays = np.array([[0.3, -0.2, 1.0], [-1.0, 0.4, 0.2]])
    relative = (camera.project(rays) + 0.5) / camera.size
    resized = camera.resized((width, height))
    np.testing.assert_allclose((resized.project(rays) + 0.5) / (width, height), relative)
    assert resized.theta_max == camera.theta_max


def opencv_camera(k: np.ndarray, d: list[float], size: tuple[int, int]) -> Camera:
    return make_camera(
        size,
        KannalaBrandt(float(k[0, 0]), *d),
        center=(float(k[0, 2]), float(k[1, 2])),
        stretch=np.array([[1.0, k[0, 1] / k[0, 0]], [0.0, k[1, 1] / k[0, 0]]]),
    )


def test_kannala_brandt_agrees_with_opencv_within_90_degrees(rng: np.random.Generator) -> None:
    cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed (freelook[render])")
    k = np.array([[280.0, 1.5, 318.0], [0.0, 276.0, 243.0], [0.0, 0.0, 1.0]])
    d = [-0.0137, 0.0207, -0.0128, 0.0025]
    camera = opencv_camera(k, d, (640, 480))
    theta, phi = rng.uniform(0, np.radians(88), 2000), rng.uniform(0, 2 * np.pi, 2000)
    inside = theta < camera.theta_max
    theta, phi = theta[inside], phi[inside]
    rays = np.stack(
        [np.tan(theta) * np.cos(phi), np.tan(theta) * np.sin(phi), np.ones_like(theta)], -1
    )
    # the skew of K must be stated apart for projectPoints: alpha = skew / fx
    plain = k * [[1, 0, 1], [0, 1, 1], [0, 0, 1]]
    pixels, _ = cv2.fisheye.projectPoints(
        rays[:, None], np.zeros(3), np.zeros(3), plain, np.array(d), alpha=k[0, 1] / k[0, 0]
    )
    assert len(theta) > 1000
    np.testing.assert_allclose(camera.project(rays), pixels[:, 0], atol=1e-9)


@pytest.mark.data
def test_published_cameras_can_be_used(shared_data: Path, rng: np.random.Generator) -> None:
    cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed (freelook[render])")
    published = json.loads((shared_data / "lens_references/published.json").read_text())
    tried = 0
    for name, entry in published.items():
        if not isinstance(entry, dict) or "kb4_kalibr" not in entry:
            continue
        tried += 1
        lens = entry["kb4_kalibr"]
        k = np.array([[lens["fx"], 0, lens["cx"]], [0, lens["fy"], lens["cy"]], [0, 0, 1]])
        camera = opencv_camera(k, lens["k"], tuple(entry["resolution"]))
        assert np.degrees(camera.theta_max) > 60, name
        assert camera.table.residual_px < 0.01, name
        rays = rays_inside(camera, rng)
        rays = rays[rays[:, 2] > 0.05]
        pixels, _ = cv2.fisheye.projectPoints(
            rays[:, None], np.zeros(3), np.zeros(3), k, np.array(lens["k"])
        )
        np.testing.assert_allclose(camera.project(rays), pixels[:, 0], atol=1e-6, err_msg=name)
    assert tried >= 3


@pytest.mark.parametrize(
    ("lens", "field_deg", "words"),
    [
        (Polynomial(300, 0, -100), 180.0, r"stops growing at 57\.30 degrees .* field_deg = 114\.6"),
        (Orthographic(300), 188.0, r"stops growing at 90\.00 degrees"),
        (Perspective(300), 188.0, r"stops growing at 90\.00 degrees"),
        (Polynomial(-1), 90.0, "does not grow with the angle, not even on the axis"),
        (Equidistant(300), 0.0, "field_deg must be 1 to 280, not 0"),
        (Equidistant(300), 281.0, "1 to 280"),
        (Equidistant(300), float("nan"), "1 to 280"),
        (Equidistant(0.1), 180.0, "radius of 0.157 pixels; parameters are in pixels"),
    ],
    ids=str,
)
def test_impossible_claims_say_where(lens: Lens, field_deg: float, words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        make_camera((1000, 800), lens, field_deg=field_deg)


def test_impossible_pictures_and_stretches_are_refused() -> None:
    with pytest.raises(ProfileError, match="at least 1 x 1"):
        make_camera((0, 800), Equidistant(300))
    with pytest.raises(ProfileError, match="flattens the picture"):
        make_camera((1000, 800), Equidistant(300), stretch=np.ones((2, 2)))


@pytest.mark.parametrize("lens", [c.lens for c in CAMERAS.values()], ids=str)
def test_without_a_claim_the_field_reaches_the_farthest_corner(lens: Lens) -> None:
    camera = make_camera((400, 300), lens)
    corner = np.hypot(200, 150)
    rim = lens.radius(np.array([camera.theta_max]))[0]
    assert rim == pytest.approx(corner, abs=1e-6) or rim < corner


@pytest.mark.parametrize("lens", [Perspective(300), Orthographic(300)], ids=str)
def test_a_whole_half_space_may_be_claimed(lens: Lens) -> None:
    camera = make_camera((1000, 800), lens, field_deg=180)
    assert np.isfinite(camera.table.g).all()
    assert np.degrees(camera.theta_max) > 89.9


def test_a_camera_looks_forward_unless_mounted_otherwise() -> None:
    assert make_camera((10, 10), Equidistant(3)).camera_from_body == RDF_FROM_FRD
