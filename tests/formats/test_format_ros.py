"""ROS camera_info against OpenCV, which ROS itself projects with."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
import yaml
from reference_points import FISHEYE, PINHOLE, RATIONAL, SAME_PX, by_fisheye, by_pinhole, rays
from reference_points import matrix as k_matrix

from freelook.camera import make_camera
from freelook.errors import ProfileError
from freelook.formats import Document, Profile, format_of, parse_profile
from freelook.formats.ros import write
from freelook.lens import (
    DoubleSphere,
    Equidistant,
    KannalaBrandt,
    Lens,
    OpenCVRational,
    Perspective,
)

K = k_matrix(280.0, 276.5, 318.25, 243.75)


def matrix(rows: int, data: Any) -> dict[str, Any]:
    data = np.ravel(data).tolist()
    return {"rows": rows, "cols": len(data) // rows, "data": data}


def file_data(**changes: Any) -> dict[str, Any]:
    """What camera_calibration writes; a value of None leaves the key out."""
    base: dict[str, Any] = {
        "image_width": 640,
        "image_height": 480,
        "camera_name": "front",
        "camera_matrix": matrix(3, K),
        "distortion_model": "equidistant",
        "distortion_coefficients": matrix(1, FISHEYE),
        "rectification_matrix": matrix(3, np.eye(3)),
        "projection_matrix": matrix(3, np.eye(3, 4)),
    }
    return {key: value for key, value in (base | changes).items() if value is not None}


def message_data(**changes: Any) -> dict[str, Any]:
    """What `ros2 topic echo /camera_info` prints."""
    base: dict[str, Any] = {
        "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "camera"},
        "height": 480,
        "width": 640,
        "distortion_model": "equidistant",
        "d": FISHEYE,
        "k": K.ravel().tolist(),
        "r": np.eye(3).ravel().tolist(),
        "p": np.eye(3, 4).ravel().tolist(),
        "binning_x": 0,
        "binning_y": 0,
        "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False},
    }
    return {key: value for key, value in (base | changes).items() if value is not None}


def read(data: dict[str, Any]) -> Profile:
    document = Document(yaml.safe_dump(data))
    assert format_of(document) == "ros"
    return parse_profile(document)


def read_distorted(model: str, d: list[float]) -> list[Profile]:
    """From a file and from a message."""
    return [
        read(file_data(distortion_model=model, distortion_coefficients=matrix(1, d))),
        read(message_data(distortion_model=model, d=d)),
    ]


@pytest.mark.parametrize("model", ["equidistant", "fisheye"])
def test_fisheyes_project_as_opencvs(model: str) -> None:
    points = rays(np.radians(89))  # where OpenCV's functions end; ours goes on
    for profile in read_distorted(model, FISHEYE):
        c = profile.camera
        assert c.lens == KannalaBrandt(280.0, *FISHEYE)
        wide = make_camera(c.size, c.lens, center=c.center, stretch=c.stretch, field_deg=178)
        np.testing.assert_allclose(
            wide.project(points), by_fisheye(points, FISHEYE, K), atol=SAME_PX
        )


@pytest.mark.parametrize(
    ("model", "d"),
    [
        ("plumb_bob", PINHOLE),
        ("plumb_bob", PINHOLE[:4]),
        ("plumb_bob", []),
        ("plumb_bob", [*PINHOLE, 0.0, 0.0, 0.0]),  # as some drivers fill it up
        ("rational_polynomial", RATIONAL[:8]),
        ("rational_polynomial", RATIONAL[:12]),
        ("rational_polynomial", RATIONAL),
    ],
)
def test_ordinary_lenses_project_as_opencvs(model: str, d: list[float]) -> None:
    for profile in read_distorted(model, d):
        camera = profile.camera
        points = rays(camera.theta_max)
        given = d[:5] if model == "plumb_bob" else d
        np.testing.assert_allclose(
            camera.project(points), by_pinhole(points, given or [0.0] * 4, K), atol=SAME_PX
        )


def test_messages_of_ros_1_and_2_differ_in_case_only() -> None:
    message = message_data()
    first = {key.upper() if key in "dkrp" else key: value for key, value in message.items()}
    assert set(first) - set(message) == {"D", "K", "R", "P"}
    assert read(first).camera.lens == read(message).camera.lens


def test_the_end_of_a_printed_message_is_passed_over() -> None:
    text = yaml.safe_dump(message_data()) + "---\n"
    assert parse_profile(Document(text)).camera.size == (640, 480)


def test_a_missing_model_is_plumb_bob_and_told() -> None:
    """As ROS does, with a warning."""
    for said in (None, ""):
        profile = read(file_data(distortion_model=said))
        assert profile.camera.lens == OpenCVRational(280.0, *FISHEYE)
        assert "plumb_bob is assumed" in profile.notes[0]
    assert read(message_data(distortion_model="")).notes


def test_a_file_without_trouble_has_no_notes() -> None:
    assert read(file_data()).notes == ()
    roi = {"x_offset": 0, "y_offset": 0, "width": 640, "height": 480}
    assert read(message_data(binning_x=1, binning_y=1, roi=roi)).notes == ()


NOTES: list[tuple[dict[str, Any], str]] = [
    (file_data(rectification_matrix=matrix(3, np.diag([1, 1, 2]))), "rectification is not used"),
    (message_data(binning_x=2, binning_y=2), r"binning \[2, 2\]: the numbers are for the picture"),
    (message_data(roi={"x_offset": 8, "width": 100, "height": 50}), "roi is set: .*whole picture"),
    (
        file_data(
            camera_matrix=matrix(3, k_matrix(280, 276, 320, 240, skew=1.5)),
            distortion_model="plumb_bob",
        ),
        r"skew of 1\.5, which ROS ignores",
    ),
]


@pytest.mark.parametrize(("data", "words"), NOTES, ids=[words for _, words in NOTES])
def test_what_is_not_taken_over_is_told(data: dict[str, Any], words: str) -> None:
    (note,) = read(data).notes
    assert re.search(words, note)


def test_the_ignored_skew_is_ignored() -> None:
    k = matrix(3, k_matrix(280.0, 276.5, 318.25, 243.75, skew=1.5))
    model, d = "plumb_bob", matrix(1, PINHOLE)
    data = file_data(camera_matrix=k, distortion_model=model, distortion_coefficients=d)
    straight = file_data(distortion_model=model, distortion_coefficients=d)
    points = rays(np.radians(40))
    np.testing.assert_array_equal(
        read(data).camera.project(points), read(straight).camera.project(points)
    )


WRITTEN: list[tuple[Lens, str, list[float]]] = [
    (KannalaBrandt(280, *FISHEYE), "equidistant", FISHEYE),
    (Equidistant(280), "equidistant", [0.0] * 4),
    (Perspective(280), "plumb_bob", [0.0] * 5),
    (OpenCVRational(280, *PINHOLE), "plumb_bob", PINHOLE),
    (OpenCVRational(280, *RATIONAL[:8]), "rational_polynomial", RATIONAL[:8]),
    (KannalaBrandt(280, 1e-7, -1e-16, 1 / 3, 0), "equidistant", [1e-7, -1e-16, 1 / 3, 0]),
]


@pytest.mark.parametrize(("lens", "model", "d"), WRITTEN, ids=[str(w[0])[:40] for w in WRITTEN])
def test_other_programs_read_what_is_written(lens: Lens, model: str, d: list[float]) -> None:
    """All keys that camera_calibration_parsers asks for, as numbers for any YAML reader."""
    camera = make_camera((640, 480), lens, center=(318.1, 243.75), stretch=np.diag([1, 0.98]))
    text = write(Profile(camera, "Lens A / 8 mm", "3 March"))
    assert text.startswith("# Lens A / 8 mm\n# 3 March\n")
    data = yaml.safe_load(text)
    assert list(data) == list(file_data())
    assert (data["image_width"], data["image_height"]) == (640, 480)
    assert data["camera_name"] == "Lens_A_8_mm"
    assert data["distortion_model"] == model
    assert data["distortion_coefficients"] == {"rows": 1, "cols": len(d), "data": d}
    k = [280.0, 0, 318.1, 0, 280.0 * 0.98, 243.75, 0, 0, 1]
    assert data["camera_matrix"] == {"rows": 3, "cols": 3, "data": k}
    assert data["projection_matrix"]["data"] == [*k[:3], 0, *k[3:6], 0, *k[6:], 0]
    assert data["rectification_matrix"]["data"] == np.eye(3).ravel().tolist()


def test_the_cameras_name_is_kept() -> None:
    profile = read(file_data())
    assert profile.name == "front"
    assert yaml.safe_load(write(profile))["camera_name"] == "front"


REFUSED: list[tuple[Lens, Any, str]] = [
    (DoubleSphere(280), np.eye(2), "ROS camera_info has no lens model like 'double_sphere'"),
    (OpenCVRational(280, *RATIONAL[:12]), np.eye(2), "no place for s1, s2, s3, s4"),
    (Equidistant(280), np.array([[1, 0.01], [0, 1]]), r"cannot say skew, .* 2\.8 pixels"),
]


@pytest.mark.parametrize(("lens", "stretch", "words"), REFUSED, ids=[w for _, _, w in REFUSED])
def test_what_ros_cannot_say_is_refused(lens: Lens, stretch: Any, words: str) -> None:
    camera = make_camera((640, 480), lens, stretch=stretch, field_deg=90)
    with pytest.raises(ProfileError, match=words):
        write(Profile(camera))


FAULTS: list[tuple[dict[str, Any], str]] = [
    (file_data(distortion_model="division"), "'division' is not known; known: plumb_bob, ration"),
    (file_data(distortion_model=["equidistant"]), r"\['equidistant'\] is not known"),
    (
        file_data(distortion_model="plumb_bob", distortion_coefficients=matrix(1, RATIONAL)),
        "list of 0 or 4 or 5 num",
    ),
    (
        file_data(distortion_coefficients=matrix(1, PINHOLE)),
        "D of a equidistant camera must be a",
    ),
    (file_data(distortion_coefficients=None), "key 'distortion_coefficients' is missing"),
    (file_data(image_width=None), "key 'image_width' is missing"),
    (message_data(width=None), "key 'width' is missing"),
    (file_data(image_height=0), "width and height must be two whole numbers"),
    (file_data(camera_matrix=matrix(3, np.zeros((3, 3)))), "all zeros: this camera was never"),
    (message_data(k=[0.0] * 9), "all zeros: this camera was never calibrated"),
    (file_data(camera_matrix=matrix(3, K.T)), r"K must be \[fx, skew, cx, 0, fy, cy, 0, 0, 1\]"),
    (file_data(camera_matrix=matrix(3, K) | {"cols": 4}), r"K must have rows \* cols = 12 numbers"),
    (message_data(k=[280.0, 320.0]), "K must be a list of 9 numbers"),
]


@pytest.mark.parametrize(("data", "words"), FAULTS, ids=[words for _, words in FAULTS])
def test_faults_are_named(data: dict[str, Any], words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        read(data)


def test_another_text_is_refused_with_its_keys() -> None:
    with pytest.raises(ProfileError, match=r"not ROS camera_info: .*keys here are: a, b"):
        parse_profile(Document("a: 1\nb: 2\n"), format="ros")
    with pytest.raises(ProfileError, match="ROS camera_info cannot be read: not YAML"):
        parse_profile(Document("a: ["), format="ros")
