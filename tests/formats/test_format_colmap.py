"""COLMAP's cameras.txt: every model against pycolmap over the whole field, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import Choice, Document, Profile, colmap, load_camera, parse_profile
from freelook.lens import (
    Equidistant,
    Equisolid,
    KannalaBrandt,
    Lens,
    OpenCVRational,
    Perspective,
    ThinPrismFisheye,
    parameters,
)

SIZE = "640 480"
LINES = {  # every model, with numbers that make each parameter count
    "SIMPLE_PINHOLE": "280 319.25 241.5",
    "PINHOLE": "280 276 319.25 241.5",
    "SIMPLE_RADIAL": "480 319.25 241.5 -0.12",
    "RADIAL": "480 319.25 241.5 -0.12 0.03",
    "OPENCV": "480 474 319.25 241.5 -0.12 0.03 0.002 -0.001",
    "FULL_OPENCV": "420 416 319.25 241.5 0.41 0.02 4e-4 -3e-4 1e-3 0.7 0.09 1.5e-3",
    "SIMPLE_FISHEYE": "230 319.25 241.5",
    "FISHEYE": "230 227 319.25 241.5",
    "SIMPLE_RADIAL_FISHEYE": "230 319.25 241.5 -0.03",
    "RADIAL_FISHEYE": "230 319.25 241.5 -0.03 0.004",
    "OPENCV_FISHEYE": "230 227 319.25 241.5 -0.0137 0.0207 -0.0128 0.0025",
    "THIN_PRISM_FISHEYE": "230 227 319.25 241.5 -0.03 0.01 1e-3 -2e-3 -0.003 5e-4 2e-3 -1e-3",
    "RAD_TAN_THIN_PRISM_FISHEYE": (
        "230 227 319.25 241.5 -0.03 0.01 -0.004 0.001 -2e-4 1e-5 1e-3 -2e-3 3e-3 -1e-3 2e-3 5e-4"
    ),
    "FOV": "280 276 319.25 241.5 0.9",
    "EUCM": "280 276 319.25 241.5 0.6 1.1",
}


def line(model: str, number: int = 1) -> str:
    return f"{number} {model} {SIZE} {LINES[model]}\n"


def read(text: str, pick: str | None = None) -> Profile:
    return parse_profile(Document(text), Choice(pick))


def pycolmap_with(model: str) -> Any:
    """COLMAP itself; the test is skipped where it is absent or too old for a model."""
    pycolmap = pytest.importorskip("pycolmap")
    if model not in pycolmap.CameraModelId.__members__:
        pytest.skip(f"this pycolmap does not know {model} yet")
    return pycolmap


def field_rays(camera: Camera) -> np.ndarray:
    """Rays over the whole field but a hair, and not beyond 89.9 degrees, where COLMAP ends."""
    widest = min(camera.theta_max - 1e-9, np.radians(89.9))
    theta = np.linspace(0, widest, 60)[:, None]
    phi = np.linspace(0, 2 * np.pi, 37)
    xy = np.sin(theta)[..., None] * np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    z = np.broadcast_to(np.cos(theta)[..., None], (*xy.shape[:-1], 1))
    return np.concatenate([xy, z], axis=-1).reshape(-1, 3)


def test_every_model_is_tried() -> None:
    assert set(LINES) == set(colmap.COLMAP_MODELS)


@pytest.mark.parametrize("model", LINES)
def test_projection_is_that_of_colmap_itself(model: str) -> None:
    pycolmap = pycolmap_with(model)
    camera = read(line(model)).camera
    assert np.degrees(camera.theta_max) > 35
    rays = field_rays(camera)
    theirs = pycolmap.Camera(
        model=model, width=640, height=480, params=list(map(float, LINES[model].split()))
    ).img_from_cam(rays)
    np.testing.assert_allclose(camera.project(rays), theirs - 0.5, rtol=0, atol=1e-9)


def test_pycolmap_knows_no_other_model_with_an_axis() -> None:
    pycolmap = pytest.importorskip("pycolmap")
    theirs = set(pycolmap.CameraModelId.__members__)
    refused = {"INVALID", "SIMPLE_DIVISION", "DIVISION", "EQUIRECTANGULAR"}
    assert theirs - refused <= set(colmap.COLMAP_MODELS)  # older ones know fewer


def test_the_corner_of_the_picture_is_colmaps_origin() -> None:
    camera = read(f"1 SIMPLE_PINHOLE {SIZE} 300 320 240").camera
    assert camera.center == (319.5, 239.5)  # the middle of the picture
    ray = np.array([0.1, -0.2, 1.0])  # 300 * 0.1 + 320 = 350 for COLMAP
    np.testing.assert_allclose(camera.project(ray), [349.5, 179.5], atol=1e-12)


def test_fisheye_models_go_on_beyond_90_degrees() -> None:
    camera = read(f"1 OPENCV_FISHEYE {SIZE} 150 150 320 240 0 0 0 0").camera
    assert np.degrees(camera.theta_max) > 140 - 1e-9
    pixel = camera.project(np.array([np.sin(1.9), 0, np.cos(1.9)]))
    np.testing.assert_allclose(pixel, [319.5 + 150 * 1.9, 239.5], atol=1e-9)


def test_a_field_that_ends_inside_the_picture_is_told() -> None:
    """r = f t (1 - 0.6 t^2) grows to t = 1 / sqrt(1.8), which is 36.7 degrees."""
    profile = read(f"1 SIMPLE_RADIAL {SIZE} 480 320 240 -0.6")
    (note,) = profile.notes
    assert "ends at 36.7 degrees from the axis, inside the picture" in note
    assert np.degrees(profile.camera.theta_max) == pytest.approx(36.70, abs=0.01)
    assert read(line("SIMPLE_RADIAL")).notes == ()


@pytest.mark.parametrize("model", LINES)
def test_a_written_camera_is_the_same_model_and_the_same_camera(model: str) -> None:
    profile = read(line(model))
    text = colmap.write(profile)
    assert text.splitlines()[-1].split()[:4] == ["1", model, "640", "480"]
    again = read(text).camera
    assert again.lens == profile.camera.lens
    assert again.center == profile.camera.center
    np.testing.assert_allclose(again.stretch, profile.camera.stretch, rtol=0, atol=1e-15)


@pytest.mark.parametrize("model", LINES)
def test_colmap_reads_what_is_written(model: str, tmp_path: Path) -> None:
    pycolmap = pycolmap_with(model)
    (tmp_path / "cameras.txt").write_text(colmap.write(read(line(model))))
    for name in ("images", "points3D"):
        (tmp_path / f"{name}.txt").write_text("")
    (camera,) = pycolmap.Reconstruction(str(tmp_path)).cameras.values()
    assert camera.model.name == model
    assert (camera.width, camera.height) == (640, 480)
    expected = list(map(float, LINES[model].split()))
    np.testing.assert_allclose(camera.params, expected, rtol=1e-14)


def test_a_lens_is_written_as_the_smallest_model_that_holds_it() -> None:
    def written(lens: Lens, fy: float = 1.0) -> str:
        stretch = np.array([[1, 0], [0, fy]])
        camera = make_camera((640, 480), lens, stretch=stretch)
        return colmap.write(Profile(camera)).splitlines()[-1].split()[1]

    assert written(Perspective(300)) == "SIMPLE_PINHOLE"
    assert written(Perspective(300), fy=0.99) == "PINHOLE"
    assert written(OpenCVRational(600, k1=-0.1)) == "SIMPLE_RADIAL"
    assert written(OpenCVRational(600, k1=-0.1), fy=0.99) == "OPENCV"
    assert written(OpenCVRational(600, k1=-0.1, k3=0.01)) == "FULL_OPENCV"
    assert written(Equidistant(200)) == "SIMPLE_FISHEYE"
    assert written(KannalaBrandt(200, 0, 0.01)) == "RADIAL_FISHEYE"
    assert written(KannalaBrandt(200, 0, 0, 0.001)) == "OPENCV_FISHEYE"


def test_what_colmap_cannot_say_is_refused() -> None:
    def refused(words: str, lens: Lens, stretch: list[list[float]] | None = None) -> None:
        camera = make_camera((640, 480), lens, stretch=np.array(stretch or np.eye(2)))
        with pytest.raises(ProfileError, match=words):
            colmap.write(Profile(camera))

    refused("COLMAP has no model like 'equisolid'; it holds perspective, ", Equisolid(300))
    refused("no place for s1 of a opencv_rational", OpenCVRational(600, s1=0.001))
    refused("no place for tau_x, tau_y", OpenCVRational(600, tau_x=0.01, tau_y=0.01))
    refused("cannot say skew, and this camera has 3 px", Equidistant(300), [[1, 0.01], [0, 1]])
    refused("COLMAP can say pixel aspect and skew only", Equidistant(300), [[1, 0], [0.1, 1]])


TWO = "# Camera list\n# Number of cameras: 2\n\n" + line("FISHEYE", 3) + line("EUCM", 12)


def test_one_of_several_cameras_is_picked_by_its_number(tmp_path: Path) -> None:
    (tmp_path / "cameras.txt").write_text(TWO)
    camera = load_camera(f"{tmp_path}/cameras.txt#12")
    assert parameters(camera.lens) == {"f": 280.0, "alpha": 0.6, "beta": 1.1}
    assert isinstance(read(TWO, "3").camera.lens, Equidistant)
    with pytest.raises(ProfileError, match=r"2 cameras in one file.*as in FILE#3; .*: 3, 12"):
        read(TWO)
    with pytest.raises(ProfileError, match="no camera '1' in it; there are: 3, 12"):
        read(TWO, "1")


def test_thousands_of_cameras_are_not_listed() -> None:
    text = "".join(line("FISHEYE", number) for number in range(5, 3005))
    assert read(text, "1234").name == "COLMAP camera 1234"
    for pick in (None, "3"):
        with pytest.raises(ProfileError, match=r"3000 cameras in it: add .*, as in FILE#5$"):
            read(text, pick)


def test_a_model_that_is_not_read_does_not_spoil_the_others() -> None:
    text = f"1 EQUIRECTANGULAR {SIZE} 640 480\n" + line("THIN_PRISM_FISHEYE", 2)
    assert isinstance(read(text, "2").camera.lens, ThinPrismFisheye)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            f"1 EQUIRECTANGULAR {SIZE} 640 480",
            "EQUIRECTANGULAR is not read here; known: SIMPLE_PIN",
        ),
        (f"1 DIVISION {SIZE} 280 280 320 240 0.1", r"DIVISION is not read here; known: .*EUCM"),
        (f"1 FISHEYE {SIZE} 230 320 240", r"FISHEYE has 4 parameters \(fx, fy, cx, cy\), not 3"),
        (f"1 FISHEYE {SIZE} 230 230 320 240 7", "FISHEYE has 4 parameters .*, not 5"),
        (f"1 FISHEYE {SIZE} 230 nan 320 240", "fy of camera 1 must be a number, not 'nan'"),
        (f"1 FISHEYE {SIZE} 230 1e999 320 240", "fy of camera 1 = inf is not a number a lens"),
        (f"1 FISHEYE {SIZE} 230 1_0 320 240", "fy of camera 1 must be a number, not '1_0'"),
        (f"1 FISHEYE {SIZE} 230 -230 320 240", "focal lengths must be positive"),
        ("1 FISHEYE 640 1 230 230 320 240", "WIDTH HEIGHT must be two whole numbers"),
        (line("FISHEYE") * 2, "a CAMERA_ID is given twice: 1, 1"),
        (line("FISHEYE") + "2 FISHEYE", "2 cameras in one file"),
        (f"1 EUCM {SIZE} 280 276 320 240 0.6 -1", "does not grow with the angle"),
        (f"1 FOV {SIZE} 280 276 320 240 0", "does not grow with the angle"),
    ],
)
def test_faults_are_named(text: str, words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        read(text)


def test_short_lines_and_empty_files_are_named() -> None:
    with pytest.raises(ProfileError, match="camera 2 must be CAMERA_ID MODEL WIDTH HEIGHT"):
        read(line("FISHEYE") + "2 FISHEYE", "2")
    with pytest.raises(ProfileError, match="no camera in it, only comments"):
        parse_profile(Document("# Camera list\n"), format="colmap")
