"""OpenCV's FileStorage against OpenCV itself."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from reference_points import (
    FISHEYE,
    OMNI_D,
    OMNI_K,
    OMNI_PIXELS,
    OMNI_XI,
    PINHOLE,
    RATIONAL,
    SAME_PX,
    by_fisheye,
    by_pinhole,
    matrix,
    omni_rays,
    rays,
)

from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import Choice, Document, Profile, load_profile, parse_profile
from freelook.formats.opencv import write
from freelook.lens import (
    DoubleSphere,
    Equidistant,
    KannalaBrandt,
    Lens,
    Mei,
    OpenCVRational,
    Perspective,
)

K = matrix(280.0, 276.5, 318.25, 243.75)

EVERY_KIND = pytest.mark.parametrize("suffix", [".yml", ".json", ".xml"])


def stored(path: Path, **values: Any) -> Path:
    """A file that OpenCV writes."""
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        storage.write(name, value)
    storage.release()
    return path


def read(text: str, pick: str | None = None, size: tuple[int, int] | None = None) -> Profile:
    return parse_profile(Document(text), Choice(pick, size))


@EVERY_KIND
@pytest.mark.parametrize("skew", [0.0, 3.5])
def test_fisheye_as_opencv_writes_and_projects_it(suffix: str, skew: float, tmp_path: Path) -> None:
    k = K + np.array([[0, skew, 0], [0, 0, 0], [0, 0, 0]])
    file = stored(
        tmp_path / f"f{suffix}",
        image_width=640,
        image_height=480,
        fisheye_model=1,
        camera_matrix=k,
        distortion_coefficients=np.array(FISHEYE)[:, None],
    )
    camera = load_profile(file).camera
    assert camera.lens == KannalaBrandt(280.0, *FISHEYE)
    points = rays(np.radians(89))  # where OpenCV's functions end; ours goes on
    np.testing.assert_allclose(
        make_wide(camera).project(points), by_fisheye(points, FISHEYE, k), atol=SAME_PX
    )


def make_wide(camera: Camera) -> Camera:
    """The same camera with all of a 178 degree field, past the corners of the picture."""
    return make_camera(
        camera.size, camera.lens, center=camera.center, stretch=camera.stretch, field_deg=178
    )


@EVERY_KIND
@pytest.mark.parametrize("count", [5, 8, 12, 14])
def test_ordinary_lenses_as_opencv_writes_and_projects_them(
    suffix: str, count: int, tmp_path: Path
) -> None:
    d = PINHOLE if count == 5 else RATIONAL[:count]
    file = stored(
        tmp_path / f"f{suffix}",
        image_size=np.array([[640, 480]]),
        camera_matrix=K,
        dist_coeffs=np.array(d),  # a flat list of them: a matrix of one dimension in OpenCV 5
    )
    camera = load_profile(file).camera
    assert np.degrees(camera.theta_max) > 45
    points = rays(camera.theta_max)
    np.testing.assert_allclose(camera.project(points), by_pinhole(points, d, K), atol=SAME_PX)


@EVERY_KIND
def test_omnidir_as_opencv_writes_and_projects_it(suffix: str, tmp_path: Path) -> None:
    """Beyond 90 degrees as well: OpenCV's own function goes there."""
    file = stored(
        tmp_path / f"f{suffix}",
        camera_matrix=OMNI_K,
        distortion_coefficients=np.array([OMNI_D]),
        xi=OMNI_XI,
        rms=0.25,
    )
    profile = load_profile(file, size=(1280, 960))
    assert profile.camera.lens == Mei(800.0, 1.25, -0.12, 0.03, 0.0, 1e-3, -5e-4)
    assert "rms" in profile.notes[0]
    assert "0.25 pixels" in profile.notes[0]
    pixels = profile.camera.project(omni_rays())
    np.testing.assert_allclose(pixels, list(OMNI_PIXELS.values()), atol=SAME_PX)


WRITTEN: list[tuple[Lens, str, int]] = [
    (KannalaBrandt(280, *FISHEYE), "fisheye_model: 1", 4),
    (KannalaBrandt(280, 1e-7, -1e-16, 0.1, 1 / 3), "fisheye_model: 1", 4),
    (Equidistant(280), "fisheye_model: 1", 4),
    (Perspective(280), "fisheye_model: 0", 5),
    (OpenCVRational(280, *PINHOLE[:4]), "fisheye_model: 0", 5),
    (OpenCVRational(280, *RATIONAL[:8]), "fisheye_model: 0", 8),
    (OpenCVRational(280, *RATIONAL[:12]), "fisheye_model: 0", 12),
    (OpenCVRational(280, *RATIONAL), "fisheye_model: 0", 14),
    (Mei(800, 1.25, -0.12, 0.03, 0.0, 1e-3, -5e-4), "xi: 1.25", 4),
]


@pytest.mark.parametrize(("lens", "line", "count"), WRITTEN, ids=[str(w[0])[:40] for w in WRITTEN])
def test_opencv_reads_what_is_written(lens: Lens, line: str, count: int, tmp_path: Path) -> None:
    camera = make_camera((640, 480), lens, center=(318.1, 243.75), stretch=np.diag([1, 0.98]))
    path = tmp_path / "written.yml"
    path.write_text(write(Profile(camera, "Lens A, ø 8 mm", "3 March")), "utf-8")
    assert f"\n{line}\n" in path.read_text("utf-8")
    assert "\n# Lens A, ø 8 mm\n# 3 March\n" in path.read_text("utf-8")
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    f = lens.f  # type: ignore[attr-defined]
    np.testing.assert_array_equal(
        storage.getNode("camera_matrix").mat(), [[f, 0, 318.1], [0, f * 0.98, 243.75], [0, 0, 1]]
    )
    d = storage.getNode("distortion_coefficients").mat()
    assert d.size == count
    assert (storage.getNode("image_width").real(), storage.getNode("image_height").real()) == (
        640,
        480,
    )
    if not isinstance(lens, Mei):
        k = storage.getNode("camera_matrix").mat()
        points = rays(min(camera.theta_max, np.radians(89)))
        project = by_fisheye if "fisheye_model: 1" in line else by_pinhole
        np.testing.assert_allclose(camera.project(points), project(points, d, k), atol=SAME_PX)


REFUSED: list[tuple[Lens, Any, str]] = [
    (DoubleSphere(280), np.eye(2), "no lens model like 'double_sphere'; it has kannala_brandt, .*"),
    (Mei(280, 1, 0, 0, 0.1), np.eye(2), "no place for k3"),
    (Perspective(280), np.array([[1, 0.1], [0, 1]]), "ordinary model cannot say skew.* 28 pixels"),
    (Equidistant(280), np.array([[1, 0], [0.1, 1]]), "no stretch like"),
]


@pytest.mark.parametrize(("lens", "stretch", "words"), REFUSED, ids=[w for _, _, w in REFUSED])
def test_what_opencv_cannot_say_is_refused(lens: Lens, stretch: Any, words: str) -> None:
    camera = make_camera((640, 480), lens, stretch=stretch, field_deg=90)
    with pytest.raises(ProfileError, match=words):
        write(Profile(camera))


def storage_text(**changes: Any) -> str:
    """A file in the JSON way; a value of None leaves the key out."""
    base: dict[str, Any] = {
        "image_width": 640,
        "image_height": 480,
        "camera_matrix": cv_matrix(K),
        "distortion_coefficients": cv_matrix([FISHEYE]),
    }
    return json.dumps({key: v for key, v in (base | changes).items() if v is not None})


def cv_matrix(rows: Any) -> dict[str, Any]:
    rows = np.atleast_2d(rows)
    data = rows.ravel().tolist()
    sides = {"rows": rows.shape[0], "cols": rows.shape[1]}
    return {"type_id": "opencv-matrix", **sides, "dt": "d", "data": data}


def test_four_coefficients_alone_do_not_say_which_lens_it_is() -> None:
    with pytest.raises(ProfileError, match=r"FILE#fisheye or FILE#pinhole, or add .*fisheye_model"):
        read(storage_text())
    fisheye = read(storage_text(), "fisheye").camera
    assert fisheye.lens == KannalaBrandt(280.0, *FISHEYE)
    assert read(storage_text(), "pinhole").camera.lens == OpenCVRational(280.0, *FISHEYE)
    with pytest.raises(ProfileError, match="does not say which it is"):
        read(storage_text(), "cam0")


def test_a_file_name_says_which_lens_it_is(tmp_path: Path) -> None:
    path = tmp_path / "lens.json"
    path.write_text(storage_text())
    assert isinstance(load_profile(f"{path}#fisheye").camera.lens, KannalaBrandt)


SAID: list[tuple[dict[str, Any], type[Lens]]] = [
    ({"fisheye_model": 1}, KannalaBrandt),
    ({"fisheye_model": True}, KannalaBrandt),
    ({"fisheyeModel": 1}, KannalaBrandt),
    ({"is_fisheye": 0}, OpenCVRational),
    ({"model": "OpenCV fisheye (KB)"}, KannalaBrandt),
    ({"distortion_model": "equidistant"}, KannalaBrandt),
    ({"camera_model": "KannalaBrandt"}, KannalaBrandt),
    ({"model": "pinhole"}, OpenCVRational),
    ({"distortion_model": "plumb_bob"}, OpenCVRational),
    ({"xi": 1.2}, Mei),
    ({"xi": cv_matrix([[1.2]])}, Mei),
    ({"xi": [[1.2]], "model": "mei"}, Mei),
    ({"model": "Meike 6.5 mm", "fisheye_model": 1}, KannalaBrandt),
]


@pytest.mark.parametrize(("changes", "model"), SAID, ids=[str(said) for said, _ in SAID])
def test_ways_to_say_which_lens_it_is(changes: dict[str, Any], model: type[Lens]) -> None:
    assert type(read(storage_text(**changes)).camera.lens) is model


SPELLINGS: list[dict[str, Any]] = [
    {"K": cv_matrix(K), "D": cv_matrix([FISHEYE])},
    {"cameraMatrix": cv_matrix(K), "distCoeffs": cv_matrix([[k] for k in FISHEYE])},
    {"Camera_Matrix": cv_matrix(K), "Distortion_Coefficients": cv_matrix([FISHEYE])},
    {"mtx": K.tolist(), "dist": [FISHEYE]},
    {"camera_matrix": K.tolist(), "dist_coeff": FISHEYE},
    {"camera_matrix": cv_matrix(K), "D": {"type_id": "opencv-nd-matrix", "sizes": [4]}},
]
SPELLINGS[-1]["D"]["data"] = FISHEYE
SIZES: list[dict[str, Any]] = [
    {"image_width": 640, "image_height": 480},
    {"image_Width": 640, "image_Height": 480},
    {"width": 640, "height": 480},
    {"image_size": [640, 480]},
    {"imageSize": cv_matrix([[640, 480]])},
    {"resolution": [640, 480]},
]


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("spelling", SPELLINGS, ids=lambda s: ", ".join(s))
def test_spellings_of_the_keys(spelling: dict[str, Any], size: dict[str, Any]) -> None:
    camera = read(json.dumps(spelling | size), "fisheye").camera
    assert camera.size == (640, 480)
    assert camera.lens == KannalaBrandt(280.0, *FISHEYE)


def test_a_file_without_a_size_asks_for_it() -> None:
    text = storage_text(image_width=None, fisheye_model=1)
    with pytest.raises(ProfileError, match=r"how large the picture is; .*--lens-size WIDTHxHEIGHT"):
        read(text)
    assert read(text, size=(1280, 960)).camera.size == (1280, 960)


def test_a_skew_that_opencv_ignores_is_told() -> None:
    k = cv_matrix([[280.0, 1.4, 318.25], [0, 276.5, 243.75], [0, 0, 1]])
    profile = read(storage_text(camera_matrix=k, fisheye_model=0))
    assert "skew of 1.4, which OpenCV ignores" in profile.notes[0]
    points = rays(profile.camera.theta_max)
    np.testing.assert_allclose(
        profile.camera.project(points), by_pinhole(points, FISHEYE, K), atol=SAME_PX
    )


def test_the_small_json_tells_what_it_takes_for_granted() -> None:
    small: dict[str, Any] = {"K": K.tolist(), "D": FISHEYE, "image_size_wh": [640, 480]}
    (note,) = read(json.dumps(small)).notes
    assert "taken for OpenCV's fisheye model" in note
    assert read(json.dumps(small | {"model": "fisheye"})).notes == ()
    column = small | {"D": [[k] for k in FISHEYE]}  # as cv2.fisheye.calibrate returns it
    assert read(json.dumps(column)).camera.lens == KannalaBrandt(280.0, *FISHEYE)


FAULTS: list[tuple[dict[str, Any], str]] = [
    ({"fisheye_model": 2}, "fisheye_model must be 1 or 0, not 2"),
    ({"fisheye_model": "yes"}, "fisheye_model must be 1 or 0, not 'yes'"),
    ({"fisheye_model": 1, "xi": 1}, "it is fisheye and omnidir; it is one"),
    ({"fisheye_model": 0, "model": "fisheye"}, "it is fisheye and pinhole; it is one"),
    ({"model": "omnidir"}, "no xi, which an omnidir camera has"),
    ({"xi": "1"}, r"xi must be a list of 1 numbers, not '1'"),
    ({"xi": -1.5}, "does not grow with the angle"),
    ({"K": cv_matrix(K)}, "'camera_matrix' and 'K' mean the same thing; remove one"),
    ({"distortion_coefficients": None}, r"no distortion coefficients \(distortioncoeff.*keys are:"),
    (
        {"distortion_coefficients": cv_matrix([[1.0] * 6])},
        r"0 or 4 or 5 .* or 14 numbers, not of 6",
    ),
    (
        {"distortion_coefficients": cv_matrix([PINHOLE]), "fisheye_model": 1},
        "must be a list of 4 numbers",
    ),
    ({"distortion_coefficients": "k1"}, "must be a list of 0 to 32 numbers, not 'k1'"),
    ({"camera_matrix": cv_matrix(K[:2])}, "camera_matrix must be a list of 9 numbers"),
    ({"camera_matrix": cv_matrix(K) | {"rows": 4}}, r"must have rows \* cols = 12 numbers in data"),
    ({"camera_matrix": cv_matrix(K) | {"data": 1}}, r"must have rows \* cols = 9 numbers in data"),
    ({"camera_matrix": cv_matrix(K) | {"rows": "3"}}, "rows and cols of camera_matrix"),
    ({"camera_matrix": cv_matrix(K.T)}, r"must be \[fx, skew, cx, 0, fy, cy, 0, 0, 1\]"),
    ({"camera_matrix": cv_matrix(-K), "fisheye_model": 1}, r"must be \[fx, skew, cx"),
    ({"camera_matrix": cv_matrix(K * [[-1], [1], [1]])}, "must be positive, not -280"),
    ({"image_width": 0, "fisheye_model": 1}, "image_width and image_height must be two whole"),
    ({"image_size": [1, 2, 3], "fisheye_model": 1}, "image_size must be a list of 2 numbers"),
]


@pytest.mark.parametrize(("changes", "words"), FAULTS, ids=[words for _, words in FAULTS])
def test_faults_are_named(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        read(storage_text(**changes))


def test_numbers_that_are_none_are_refused_in_every_way_of_writing(tmp_path: Path) -> None:
    """OpenCV writes .Nan also where that is no JSON."""
    for suffix, words in ((".yml", "= nan is not"), (".json", "not JSON"), (".xml", "= nan is")):
        d = np.array([[np.nan, 0, 0, 0, 0]])
        file = stored(tmp_path / f"n{suffix}", K=K, D=d, image_width=640, image_height=480)
        with pytest.raises(ProfileError, match=words):
            load_profile(file)


def test_comments_that_opencv_writes_into_json_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    storage.writeComment("flags: fix_k3")
    for name, value in {"K": K, "D": np.array([PINHOLE])}.items():
        storage.write(name, value)
        storage.writeComment(f"that was {name}")
    storage.release()
    assert re.search(r"^\s*// that was K$", path.read_text(), re.M)
    assert load_profile(path, size=(640, 480)).camera.lens == OpenCVRational(280.0, *PINHOLE)


def test_what_is_no_file_storage_says_why() -> None:
    for text, words in [
        ("<opencv_storage><a>", "not OpenCV's FileStorage: .*not XML"),
        ("<!DOCTYPE a><opencv_storage/>", "document type"),
        ("<a/>", "not OpenCV's FileStorage: it is XML"),
        ("{", "not OpenCV's FileStorage: not JSON"),
        ("a: [", "not OpenCV's FileStorage: not YAML"),
        ("just words", "not OpenCV's FileStorage"),
    ]:
        with pytest.raises(ProfileError, match=words):
            parse_profile(Document(text), format="opencv")
