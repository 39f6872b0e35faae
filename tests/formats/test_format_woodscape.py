"""WoodScape's calibrations: their projection, and where their cameras look on the vehicle."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.camera import make_camera
from freelook.errors import ProfileError
from freelook.formats import Document, Profile, format_of, parse_profile
from freelook.formats.woodscape import write
from freelook.lens import Equidistant, Polynomial
from freelook.rotations import angle_between_deg, body_from_view, head_angles_deg

# The numbers of the front camera that WoodScape's own example prints.
INTRINSIC: dict[str, Any] = {
    "aspect_ratio": 1.0,
    "cx_offset": 3.942,
    "cy_offset": -3.093,
    "height": 966.0,
    "k1": 339.749,
    "k2": -31.988,
    "k3": 48.275,
    "k4": -7.201,
    "model": "radial_poly",
    "poly_order": 4,
    "width": 1280.0,
}
FRONT = [0.5941767906169857, -0.5878843193897473, 0.3873184109007999, -0.3890121040340926]


def calibration(quaternion: list[float] | None = None, **intrinsic: Any) -> dict[str, Any]:
    return {
        "extrinsic": {"quaternion": quaternion or FRONT, "translation": [3.7484, 0.0, 0.66]},
        "intrinsic": INTRINSIC | intrinsic,
        "name": "FV",
    }


def profile_of(data: dict[str, Any]) -> Profile:
    return parse_profile(Document(json.dumps(data)))


def reference_pixels(data: dict[str, Any], ray_in_vehicle: np.ndarray) -> np.ndarray:
    """u, v by the formulas of WoodScape's calibration_readme.txt, far points only."""
    k = data["intrinsic"]
    camera_from_vehicle = Rotation.from_quat(data["extrinsic"]["quaternion"]).inv()
    x, y, z = camera_from_vehicle.apply(ray_in_vehicle).T
    chi = np.sqrt(x**2 + y**2)
    theta = np.pi / 2 - np.arctan2(z, chi)
    rho = k["k1"] * theta + k["k2"] * theta**2 + k["k3"] * theta**3 + k["k4"] * theta**4
    u = rho * x / chi + k["cx_offset"] + k["width"] / 2 - 0.5
    v = rho * y / chi * k["aspect_ratio"] + k["cy_offset"] + k["height"] / 2 - 0.5
    return np.stack([u, v], axis=-1)


@pytest.mark.parametrize("aspect", [1.0, 1.0173])
def test_rays_of_the_vehicle_land_where_woodscape_says(
    rng: np.random.Generator, aspect: float
) -> None:
    data = calibration(aspect_ratio=aspect)
    camera = profile_of(data).camera
    ray_in_vehicle = rng.normal(size=(4000, 3))
    ray_in_body = ray_in_vehicle * [1, -1, -1]  # forward, left, up -> forward, right, down
    pixels = camera.project(camera.camera_from_body.apply(ray_in_body))
    seen = ~np.isnan(pixels[:, 0])
    assert seen.sum() > 2000  # more than half of the sphere: rays beyond 90 degrees among them
    off = pixels[seen] - reference_pixels(data, ray_in_vehicle[seen])
    assert np.abs(off).max() < 1e-6


def test_the_lens_is_the_papers_polynomial() -> None:
    camera = profile_of(calibration()).camera
    assert camera.lens == Polynomial(339.749, -31.988, 48.275, -7.201)
    assert camera.size == (1280, 966)
    assert camera.center == pytest.approx((3.942 + 639.5, -3.093 + 482.5))


@pytest.mark.parametrize(
    ("quaternion", "looks"),
    [
        # columns: camera x, y, z in the vehicle's forward, left, up
        ([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], (0, 0, 0)),
        ([[1, 0, 0], [0, 0, 1], [0, -1, 0]], (-90, 0, 0)),
        ([[-1, 0, 0], [0, 0, -1], [0, -1, 0]], (90, 0, 0)),
    ],
    ids=["front", "mirror on the left", "mirror on the right"],
)
def test_the_mounting_is_forward_right_down(
    quaternion: list[list[float]], looks: tuple[float, float, float]
) -> None:
    camera = profile_of(calibration(Rotation.from_matrix(quaternion).as_quat().tolist())).camera
    assert head_angles_deg(camera.camera_from_body.inv()) == pytest.approx(looks, abs=1e-6)


def test_woodscapes_own_front_camera_looks_forward_and_down() -> None:
    yaw, pitch, roll = head_angles_deg(profile_of(calibration()).camera.camera_from_body.inv())
    assert abs(yaw) < 1
    assert pitch == pytest.approx(-23.4, abs=0.1)
    assert abs(roll) < 1


def test_where_it_sits_is_told_and_a_missing_extrinsic_too() -> None:
    profile = profile_of(calibration())
    assert profile.name == "FV"
    assert "3.75 m ahead" in profile.notes[0]
    bare = calibration()
    del bare["extrinsic"]
    profile = profile_of(bare)
    assert head_angles_deg(profile.camera.camera_from_body.inv()) == pytest.approx((0, 0, 0))
    assert "straight forward" in profile.notes[0]


def test_written_and_read_again_it_is_the_same_camera() -> None:
    camera = make_camera(
        (1280, 966),
        Polynomial(330.0, -20.0, 40.0, -7.0),
        center=(641.0, 480.0),
        stretch=np.diag([1.01, 0.98]),
        camera_from_body=body_from_view(100, -20, 3).inv(),
    )
    text = write(Profile(camera, "left mirror"))
    assert format_of(Document(text)) == "woodscape"
    again = parse_profile(Document(text))
    assert again.name == "left mirror"
    assert angle_between_deg(again.camera.camera_from_body, camera.camera_from_body) < 1e-6
    rays = np.random.default_rng(1).normal(size=(500, 3))
    np.testing.assert_allclose(again.camera.project(rays), camera.project(rays), atol=1e-9)


def test_what_the_format_cannot_say_is_an_error() -> None:
    with pytest.raises(ProfileError, match="cannot hold a equidistant"):
        write(Profile(make_camera((640, 480), Equidistant(200.0))))
    with pytest.raises(ProfileError, match="theta\\^5"):
        write(Profile(make_camera((640, 480), Polynomial(200.0, e=-1.0))))
    skewed = make_camera((640, 480), Polynomial(200.0), stretch=np.array([[1, 0.01], [0, 1]]))
    with pytest.raises(ProfileError, match="no skew"):
        write(Profile(skewed))


@pytest.mark.parametrize(
    ("intrinsic", "words"),
    [
        ({"model": "mei"}, "only 'radial_poly'"),
        ({"poly_order": 5}, "only 'radial_poly' of order 4"),
        ({"width": 0}, "whole numbers"),
        ({"k1": "339"}, "intrinsic.k1 must be a number"),
        ({"k1": -339.0}, "does not grow"),
        ({"aspect_ratio": 0.0}, "must be positive"),
        ({"k5": 1.0}, "unknown key 'k5'"),
    ],
)
def test_what_is_wrong_is_said(intrinsic: dict[str, Any], words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        profile_of(calibration(**intrinsic))


@pytest.mark.parametrize(
    ("extrinsic", "words"),
    [
        ({}, "quaternion must be a list"),
        ({"quaternion": [0, 0, 0, 0]}, "length 0"),
        ({"quaternion": [1, 0, 0, 0.5]}, "no rotation"),
        ({"quaternion": FRONT, "translation": [1]}, "translation must be a list of 3"),
        ([], "extrinsic must be an object"),
    ],
)
def test_a_mounting_that_is_none_is_refused(extrinsic: Any, words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        profile_of(calibration() | {"extrinsic": extrinsic})
