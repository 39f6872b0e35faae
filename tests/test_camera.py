"""The projection: exact against tabulated, there and back, against OpenCV and by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.camera import GRID_SIZES, TABLE_SIZE, Camera, make_camera
from freelook.errors import ProfileError
from freelook.lens import (
    BentLens,
    Equidistant,
    KannalaBrandt,
    Lens,
    Mei,
    OpenCVRational,
    Orthographic,
    Perspective,
    Polynomial,
    RadTanThinPrismFisheye,
    SplinedStereographic,
    ThinPrismFisheye,
    growth_limit,
    image_point,
)
from freelook.rotations import RDF_FROM_FRD
from lens_examples import ALL, EXAMPLES

CAMERAS: dict[str, Camera] = {str(example): example.camera for example in ALL}
BENT = {name: camera for name, camera in CAMERAS.items() if isinstance(camera.lens, BentLens)}
ROUND = {name: camera for name, camera in CAMERAS.items() if name not in BENT}
WIDE = {
    name: camera.lens
    for name, camera in CAMERAS.items()
    # the prism lenses made for narrow fields fold long before
    if growth_limit(camera.lens) > np.radians(95) and (name in ROUND or camera.theta_max > 1.3)
}


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


def unit_rays(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    return np.stack(np.broadcast_arrays(x, y, np.cos(theta)), axis=-1)


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
    point = p * (g[index] + (g[index + 1] - g[index]) * part)[:, None]
    if camera.grid is not None:
        point += offset_float32(camera.grid.offsets, p / np.float32(camera.grid.p_max))
    pixel: np.ndarray = point @ camera.stretch.T.astype(np.float32)
    pixel += np.asarray(camera.center, np.float32)
    assert pixel.dtype == np.float32
    return pixel


def offset_float32(offsets: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Bilinear between the grid's nodes, in float32, of p within [-1, 1]."""
    last = len(offsets) - 1
    place = np.clip((p + 1) * np.float32(last / 2), 0, last)
    low = np.minimum(place.astype(np.int32), last - 1)
    (x, y), (u, v) = low.T, (place - low.astype(np.float32)).T[..., None]
    above = offsets[y, x] * (1 - u) + offsets[y, x + 1] * u
    below = offsets[y + 1, x] * (1 - u) + offsets[y + 1, x + 1] * u
    mixed: np.ndarray = above * (1 - v) + below * v
    return mixed


def worst_float32(camera: Camera, rays: np.ndarray) -> float:
    """The largest distance between what renderers compute and the exact formula, pixels."""
    apart = project_float32(camera, rays) - camera.project(rays)
    return float(np.linalg.norm(apart, axis=1).max())


def test_table_and_grid_in_float32_keep_their_promise(
    camera: Camera, rng: np.random.Generator
) -> None:
    rounding = 3e-7 * max(camera.size)  # float32 pixels of this size
    assert camera.residual_px < 0.01
    # the worst place between two entries of the table is known, of the grid only nearly
    assert worst_float32(camera, rays_inside(camera, rng)) < camera.residual_px * 1.05 + rounding


def test_table_owns_up_where_a_lens_defies_it(rng: np.random.Generator) -> None:
    """tan(theta) climbs too steeply near 90 degrees for straight lines between 256 entries."""
    camera = make_camera((9000, 9000), Perspective(300), field_deg=170)
    rays = rays_inside(camera, rng, 50_000)
    error = worst_float32(camera, rays)
    assert error > 0.1
    assert error == pytest.approx(camera.table.residual_px, rel=0.03)


def test_table_follows_even_powers_of_theta(rng: np.random.Generator) -> None:
    """The 2011 paper's general polynomial is not smooth in theta squared, nor is its g in t."""
    camera = make_camera((1000, 800), Polynomial(300, 50, -20), field_deg=188)
    rays = rays_inside(camera, rng, 50_000)
    error = worst_float32(camera, rays)
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
    pixel = camera.project(np.array([0, 0, 2.5]))
    # a free form may see its axis a little beside the centre, no other lens does
    free = isinstance(camera.lens, SplinedStereographic)
    np.testing.assert_allclose(pixel, camera.center, atol=2 if free else 1e-12)
    np.testing.assert_allclose(camera.ray(pixel), [0, 0, 1], atol=1e-9)


def test_outside_the_field_is_nan(camera: Camera) -> None:
    beyond = camera.theta_max + 1e-6
    ray = np.array([[np.sin(beyond), 0, np.cos(beyond)], [0, 0, -1], [0, 0, 0]])
    assert np.isnan(camera.project(ray)).all()
    rim = camera.lens.radius(np.array([camera.theta_max]))[0]
    bend = 0.0 if camera.grid is None else np.abs(camera.grid.offsets).max()
    outside = np.add(camera.center, [[0, rim + 2 * bend + 1], [1e6, 0], [0, -1e9]])
    assert np.isnan(camera.ray(outside)).all()


@pytest.mark.parametrize("lens", WIDE.values(), ids=WIDE)
def test_rays_beyond_90_degrees_have_a_place(lens: Lens) -> None:
    camera = make_camera((1000, 800), lens, field_deg=189)
    theta, phi = np.radians([91.0, 94.4]), np.array([0.1, -2.0])
    pixels = camera.project(unit_rays(theta, phi))
    np.testing.assert_allclose(pixels - camera.center, image_point(lens, theta, phi), rtol=1e-9)
    np.testing.assert_allclose(camera.ray(pixels), unit_rays(theta, phi), atol=1e-9)


def test_most_models_reach_beyond_90_degrees() -> None:
    short = {"perspective", "orthographic", "poly3", "poly5", "ptlens", "opencv_rational"}
    short.add("radial_spline")  # the example's last point is at 93 degrees
    wide = {name for name, all_ in EXAMPLES.items() if any(e.lens in WIDE.values() for e in all_)}
    assert wide == set(EXAMPLES) - short


def test_stretch_and_centre_shape_the_image() -> None:
    stretch = np.array([[1.0, 0.1], [0.0, 0.9]])
    camera = make_camera((1000, 800), Equidistant(300), center=(510, 380), stretch=stretch)
    pixel = camera.project(np.array([0, np.sin(0.5), np.cos(0.5)]))
    np.testing.assert_allclose(pixel, [510 + 0.1 * 150, 380 + 0.9 * 150])
    np.testing.assert_allclose(camera.ray(pixel), [0, np.sin(0.5), np.cos(0.5)], atol=1e-9)


@given(st.integers(2, 4000), st.integers(2, 4000))
def test_resized_shows_the_same_thing_at_the_same_place(width: int, height: int) -> None:
    camera = make_camera((1000, 800), Equidistant(300), field_deg=220)
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


@pytest.mark.parametrize("camera", ROUND.values(), ids=ROUND)
def test_without_a_claim_the_field_reaches_the_farthest_corner(camera: Camera) -> None:
    camera = make_camera((400, 300), camera.lens)
    corner = np.hypot(200, 150)
    rim = camera.lens.radius(np.array([camera.theta_max]))[0]
    assert rim == pytest.approx(corner, abs=1e-6) or rim < corner


@pytest.mark.parametrize("lens", [Perspective(300), Orthographic(300)], ids=str)
def test_a_whole_half_space_may_be_claimed(lens: Lens) -> None:
    camera = make_camera((1000, 800), lens, field_deg=180)
    assert np.isfinite(camera.table.g).all()
    assert np.degrees(camera.theta_max) > 89.9


def test_a_camera_looks_forward_unless_mounted_otherwise() -> None:
    assert make_camera((10, 10), Equidistant(3)).camera_from_body == RDF_FROM_FRD


# ---- lenses that are not round


@pytest.mark.parametrize("camera", BENT.values(), ids=BENT)
class TestBentLenses:
    def test_point_is_radius_and_offset(self, camera: Camera, rng: np.random.Generator) -> None:
        rays = rays_inside(camera, rng, 500)
        theta = np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2])
        point = image_point(camera.lens, theta, np.arctan2(rays[:, 1], rays[:, 0]))
        np.testing.assert_allclose(camera.project(rays), point + camera.center, atol=1e-9)

    def test_grid_is_the_offset_at_its_nodes(self, camera: Camera) -> None:
        assert isinstance(camera.lens, BentLens)
        grid = camera.grid
        assert grid is not None
        assert grid.offsets.dtype == np.float32
        size = len(grid.offsets)
        assert grid.offsets.shape == (size, size, 2)
        assert size in GRID_SIZES
        p = np.array([5.0, -3.0]) * 2 * grid.p_max / (size - 1)  # 5 columns right, 3 rows up
        theta, phi = 2 * np.arctan(np.hypot(*p)), np.arctan2(p[1], p[0])
        exact = camera.lens.offset(np.array(theta), np.array(phi))
        node = grid.offsets[size // 2 - 3, size // 2 + 5]
        np.testing.assert_allclose(node, exact, atol=1e-5)  # float32
        np.testing.assert_allclose(grid(p), exact, atol=1e-5)
        np.testing.assert_array_equal(grid(np.array([9.0, -9.0])), grid.offsets[0, -1])

    def test_grid_goes_straight_on_beyond_the_rim(self, camera: Camera) -> None:
        """Renderers interpolate over the rim, from places nobody sees: no kink there."""
        assert camera.grid is not None
        offsets = camera.grid.offsets.astype(float)
        last = len(offsets) - 1
        first = int(last * (1 + (1 + 3 / last) / np.sqrt(2)) / 2) + 1  # on the diagonal
        steps = np.diff(offsets[range(first, last + 1), range(first, last + 1)], axis=0)
        assert len(steps) >= 2
        assert np.abs(steps).max() > 1e-3
        np.testing.assert_allclose(steps, steps[:1].repeat(len(steps), 0), rtol=0.01, atol=1e-4)

    def test_far_corners_of_the_picture_decide_the_field(self, camera: Camera) -> None:
        small = make_camera((300, 200), camera.lens)
        corners = small.ray(np.array([[x, y] for x in (-0.5, 299.5) for y in (-0.5, 199.5)]))
        angles = np.arctan2(np.hypot(corners[:, 0], corners[:, 1]), corners[:, 2])
        assert angles.max() == pytest.approx(small.theta_max, abs=1e-9)

    def test_pixels_that_no_ray_has_are_nan(self, camera: Camera) -> None:
        wild = np.array([[1e5, 1e5], [-1e9, 3.0], [np.nan, 1.0]])
        assert np.isnan(camera.ray(wild)).all()

    def test_shapes_are_kept(self, camera: Camera) -> None:
        pixels = np.full((2, 3, 2), 100.0) + camera.center
        assert camera.ray(pixels).shape == (2, 3, 3)
        assert camera.ray(pixels[0, 0]).shape == (3,)
        assert camera.ray(pixels[:0]).shape == (0, 3, 3)


def test_a_lens_that_could_bend_but_does_not_needs_no_grid() -> None:
    for lens in (Mei(600.0), ThinPrismFisheye(300.0, 0.1), OpenCVRational(300.0, 0.1)):
        camera = make_camera((640, 480), lens)
        assert camera.grid is None
        assert camera.residual_px == camera.table.residual_px


def test_a_grid_owns_up_where_a_lens_defies_it(rng: np.random.Generator) -> None:
    camera = make_camera((4000, 4000), OpenCVRational(1500.0, tau_x=0.1), field_deg=90)
    assert camera.grid is not None
    assert camera.grid.offsets.shape == (129, 129, 2)
    error = worst_float32(camera, rays_inside(camera, rng, 50_000))
    assert error > 0.02
    assert error == pytest.approx(camera.residual_px, rel=0.2)


def test_opposite_bends_do_not_hide_from_the_grid(rng: np.random.Generator) -> None:
    """Offsets like u^2 - v^2: in the middle of a cell their errors cancel, on its edges not."""
    lens = ThinPrismFisheye(1500.0, p2=0.02, sx1=-0.04)
    camera = make_camera((4000, 4000), lens, field_deg=60)
    error = worst_float32(camera, rays_inside(camera, rng, 50_000))
    assert error < camera.residual_px * 1.05 + 1e-3  # float32 pixels of this size
    assert error < 0.006


FOLDING: list[tuple[Lens, float]] = [
    (ThinPrismFisheye(300.0, p1=0.3), 180.0),
    (RadTanThinPrismFisheye(300.0, s0=-0.4), 180.0),
    (Mei(600.0, 1.0, p2=0.4), 180.0),
    (OpenCVRational(300.0, tau_x=0.5), 170.0),
]


@pytest.mark.parametrize(
    ("lens", "field_deg"), FOLDING, ids=[type(lens).__name__ for lens, _ in FOLDING]
)
def test_a_lens_that_folds_ends_there(lens: Lens, field_deg: float) -> None:
    with pytest.raises(
        ProfileError, match=r"folds at .* two rays land on one pixel; claim at most"
    ):
        make_camera((1000, 800), lens, field_deg=field_deg)
    camera = make_camera((4000, 4000), lens)
    assert np.radians(10) < camera.theta_max < np.radians(field_deg / 2)
    again = make_camera((4000, 4000), lens, field_deg=2 * float(np.degrees(camera.theta_max)))
    assert again.theta_max == pytest.approx(camera.theta_max, abs=1e-6)
    # before the fold no two rays meet: there and back again
    theta = np.linspace(0.01, 0.98 * camera.theta_max, 40)[:, None]
    rays = unit_rays(theta, np.radians(np.arange(0, 360, 7.0)))
    np.testing.assert_allclose(camera.ray(camera.project(rays)), rays, atol=1e-7)


def test_a_lens_that_folds_at_once_is_none() -> None:
    with pytest.raises(ProfileError, match=r"folds at 0\.00 degrees"):
        make_camera((1000, 800), ThinPrismFisheye(300.0, p1=1e6))
