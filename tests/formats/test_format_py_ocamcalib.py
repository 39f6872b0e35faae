"""py-OCamCalib's JSON against its own formulas, written out here once more."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import (
    Choice,
    Document,
    Profile,
    format_of,
    ocamcalib,
    parse_profile,
    py_ocamcalib,
)
from freelook.lens import Floats, OCamCalib, Stereographic

# The calibration the program comes with (jakarto3d/py-OCamCalib @f6eeb27d,
# checkpoints/calibration/calibration_fisheye_1_18052022_154907.json), for 1032 x 778 pictures.
SIZE = (1032, 778)
TAYLOR = [337.71684227978966, 0.0, -0.0012238320710672823, 1.3803997515890267e-06,
          -3.0106166073815756e-09]  # fmt: skip
CENTER = [543.9861511428039, 377.64882547339226]
STRETCH = [[1.0032962305648117, 0.00014800947722706114], [0.00017686046028285402, 1.0]]
INVERSE = [
    -1.3505550174375285, 12.863399898648574, -46.729025171144166, 72.39400507902279,
    -13.749079912593142, -94.022200026866, 100.86067075019912, -32.14422445443283,
    3.931359017257052, -5.757743649593935, 338.19818198264267, -0.012207504686747209,
]  # fmt: skip
DATA: dict[str, Any] = {
    "date": "18052022_154907",
    "camera_name": "fisheye_1",
    "valid": [True, False],
    "taylor_coefficient": TAYLOR,
    "distortion_center": CENTER,
    "stretch_matrix": STRETCH,
    "inverse_poly": INVERSE,
    "extrinsics_t": [[[1, 0, 0, 0.5], [0, 1, 0, 0.25], [0, 0, 1, 3]]],
    "img_path": ["one.jpg"],
    "rms_overall": 0.24125227245668737,
    "rms_mean_list": [0.27],
    "rms_std_list": [0.15],
}


def read(size: tuple[int, int] | None = SIZE, **changes: Any) -> Profile:
    return parse_profile(Document(json.dumps(DATA | changes)), Choice(size=size))


def cam2world(pixel: Floats) -> Floats:
    """Pixels (x, y) (n, 2) to unit vectors (x, y, z forward)."""
    u, v = np.linalg.solve(STRETCH, (pixel - CENTER).T)
    ray = np.stack([u, v, np.polyval(TAYLOR[::-1], np.hypot(u, v))], axis=-1)
    return np.asarray(ray / np.linalg.norm(ray, axis=-1, keepdims=True))


def world2cam(ray: Floats, stretch: Floats) -> Floats:
    """Rays (n, 3) to pixels: rho is the smallest positive root of the direct polynomial."""
    x, y, z = ray.T
    flat = np.hypot(x, y)
    rho = np.array([_root(m) for m in z / flat])
    return np.asarray(np.stack([x, y], axis=-1) * (rho / flat)[:, None] @ stretch.T + CENTER)


def _root(slope: float) -> float:
    roots = np.roots([*TAYLOR[:1:-1], TAYLOR[1] - slope, TAYLOR[0]])
    real = roots.real[np.abs(roots.imag) < 1e-9 * np.abs(roots)]
    return float(real[real > 0].min())


def field_rays(camera: Camera) -> Floats:
    theta = np.linspace(0.001, camera.theta_max - 1e-9, 50)[:, None]
    phi = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    z = np.cos(theta) + 0 * phi
    ray = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), z], axis=-1)
    return ray.reshape(-1, 3)


def test_the_parts_are_where_they_belong() -> None:
    profile = read()
    camera = profile.camera
    assert camera.size == SIZE
    assert camera.center == tuple(CENTER)
    assert camera.stretch.tolist() == STRETCH
    assert isinstance(camera.lens, OCamCalib)
    np.testing.assert_allclose(camera.lens.coefficients, TAYLOR, rtol=1e-14)
    assert np.degrees(camera.theta_max) > 95
    assert profile.name == "fisheye_1"
    assert profile.source == "py-OCamCalib, 18052022_154907, mean error 0.241 px"


def test_projection_is_its_own_over_the_whole_field() -> None:
    camera = read().camera
    ray = field_rays(camera)
    expected = world2cam(ray, np.array(STRETCH))
    np.testing.assert_allclose(camera.project(ray), expected, rtol=0, atol=1e-8)


def test_rays_are_its_own_over_the_whole_picture() -> None:
    camera = read().camera
    places = np.meshgrid(np.linspace(0, SIZE[0] - 1, 33), np.linspace(0, SIZE[1] - 1, 21))
    pixel = np.stack(places, axis=-1).reshape(-1, 2)
    np.testing.assert_allclose(camera.ray(pixel), cam2world(pixel), rtol=0, atol=1e-12)


def test_a_note_says_how_good_the_inverse_polynomial_is() -> None:
    (note,) = read().notes
    assert note == (
        "the direct polynomial is used; the file's inverse one is 0.035 px off the direct one at "
        "most (122 degrees)"
    )
    with pytest.raises(ProfileError, match="different lenses"):
        read(inverse_poly=INVERSE[::-1])


def test_stretching_twice_is_told_where_it_matters() -> None:
    """Its world2cam computes y from the stretched x, its cam2world does not."""
    stretch = [[1.02, 0.01], [0.03, 1.0]]
    profile = read(stretch_matrix=stretch)
    (note,) = [note for note in profile.notes if "world2cam" in note]
    ray = field_rays(profile.camera)
    (c, d), (e, _) = stretch
    twice = world2cam(ray, np.array([[c, d], [e * c, 1 + e * d]]))
    largest = np.abs(twice - profile.camera.project(ray)).max()
    assert f"up to {largest:.2g} px higher or lower" in note
    np.testing.assert_allclose(
        profile.camera.project(ray), world2cam(ray, np.array(stretch)), rtol=0, atol=1e-8
    )


def test_the_size_must_be_told() -> None:
    with pytest.raises(ProfileError, match=r"do not say how large the picture is; .*--lens-size"):
        read(size=None)


def test_a_written_file_is_the_same_camera_and_says_its_size() -> None:
    profile = read()
    text = py_ocamcalib.write(profile)
    assert format_of(Document(text)) == "py-ocamcalib"
    again = parse_profile(Document(text))
    camera = profile.camera
    assert again.name == "fisheye_1"
    assert again.camera.size == SIZE
    assert again.camera.center == camera.center
    np.testing.assert_allclose(again.camera.stretch, camera.stretch, rtol=0, atol=1e-15)
    ray = field_rays(camera)[:-24]  # the rim itself is another double
    np.testing.assert_allclose(again.camera.project(ray), camera.project(ray), atol=1e-9)
    data = json.loads(text)
    theta = np.linspace(0, camera.theta_max, 500)
    off = np.abs(np.polyval(data["inverse_poly"], theta) - camera.lens.radius(theta))
    assert off.max() < 0.01
    assert off.max() == pytest.approx(data["inverse_poly_error_px"], rel=0.05)


def test_both_files_of_one_lens_are_one_camera() -> None:
    """Rows and columns, signs and orders: each file is the other way round in all of them."""
    stretch = np.array([[0.98, 0.02], [-0.03, 1.01]])
    camera = make_camera((640, 480), OCamCalib(220.0), center=(301.5, 250.25), stretch=stretch)
    ray = field_rays(camera)[:-24]
    for module in (ocamcalib, py_ocamcalib):
        again = parse_profile(Document(module.write(Profile(camera)))).camera
        np.testing.assert_allclose(again.project(ray), camera.project(ray), atol=1e-9)


def test_other_lenses_and_turned_pictures_are_not_written() -> None:
    with pytest.raises(ProfileError, match=r"py-OCamCalib holds Scaramuzza's .* no stereographic"):
        py_ocamcalib.write(Profile(make_camera((640, 480), Stereographic(200))))
    turned = make_camera((640, 480), OCamCalib(200.0), stretch=np.array([[-1, 0], [0, -1]]))
    with pytest.raises(ProfileError, match="cannot turn the picture"):
        py_ocamcalib.write(Profile(turned))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"taylor_coefficient": [-a for a in TAYLOR]}, r"must be positive here, not -337\.717"),
        ({"taylor_coefficient": [300, 0]}, "taylor_coefficient must be a list of 3 to 12 numbers"),
        ({"taylor_coefficient": [300, 1, 0.1]}, r"a0, a1 = 0, a2, \.\.\. is needed"),
        ({"taylor_coefficient": [0.1, 0, 0.1]}, "a0 = 0.1 is no focal length in pixels"),
        ({"distortion_center": [1, 2, 3]}, "distortion_center must be a list of 2 numbers"),
        ({"stretch_matrix": [1, 0, 0, 1]}, "stretch_matrix must be two rows of two numbers"),
        ({"stretch_matrix": [[1, 0], [0, "x"]]}, r"stretch_matrix\[1\]\[1\] must be a number"),
        ({"stretch_matrix": [[1, 0], [2, 0]]}, "flattens the picture to a line"),
        ({"inverse_poly": []}, "inverse_poly must be a list of 1 to 64 numbers"),
        ({"rms_overall": float("1e40")}, "rms_overall = 1e"),
        ({"image_width": 1, "image_height": 2}, "two whole numbers of 2 to 65536"),
    ],
)
def test_faults_are_named(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        read(**changes)


def test_missing_keys_are_named() -> None:
    for key in py_ocamcalib.NEEDED[1:]:
        text = json.dumps({k: v for k, v in DATA.items() if k != key})
        with pytest.raises(ProfileError, match=f"key '{key}' is missing; needed: taylor_coeff"):
            parse_profile(Document(text), Choice(size=SIZE))
