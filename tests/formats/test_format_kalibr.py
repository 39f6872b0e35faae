"""Kalibr camchains against OpenCV and published formulas, and published ones of real cameras."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from reference_points import (
    FISHEYE,
    OMNI_D,
    OMNI_K,
    OMNI_PIXELS,
    OMNI_XI,
    PINHOLE,
    SAME_PX,
    by_double_sphere,
    by_extended_unified,
    by_field_of_view,
    by_fisheye,
    by_pinhole,
    matrix,
    omni_rays,
    rays,
)

from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import Choice, Document, Profile, format_module, format_of, parse_profile
from freelook.formats.kalibr import write
from freelook.lens import (
    DoubleSphere,
    Equidistant,
    ExtendedUnified,
    FieldOfView,
    KannalaBrandt,
    Lens,
    Mei,
    OpenCVRational,
    Perspective,
    Stereographic,
)

K = matrix(280.0, 276.5, 318.25, 243.75)
FUFV = [280.0, 276.5, 318.25, 243.75]


def cam(
    model: str = "pinhole",
    distortion: str = "equidistant",
    intrinsics: Any = None,
    coefficients: Any = None,
    **changes: Any,
) -> dict[str, Any]:
    """One camera of a chain; a value of None leaves the key out."""
    base = {
        "camera_model": model,
        "distortion_model": distortion,
        "intrinsics": FUFV if intrinsics is None else intrinsics,
        "distortion_coeffs": FISHEYE if coefficients is None else coefficients,
        "resolution": [640, 480],
        "rostopic": "/cam0/image_raw",
    }
    return {key: value for key, value in (base | changes).items() if value is not None}


def read(pick: str | None = None, **cams: dict[str, Any]) -> Profile:
    document = Document(yaml.safe_dump(cams))
    assert format_of(document) == "kalibr"
    return parse_profile(document, Choice(pick))


def whole(camera: Camera, half_deg: float) -> Camera:
    """The same camera with this much field, past the corners of the picture."""
    return make_camera(
        camera.size,
        camera.lens,
        center=camera.center,
        stretch=camera.stretch,
        field_deg=2 * half_deg,
    )


def test_equidistant_is_opencvs_fisheye() -> None:
    camera = read(cam0=cam()).camera
    assert camera.lens == KannalaBrandt(280.0, *FISHEYE)
    points = rays(np.radians(89))  # where OpenCV's functions end; ours goes on
    pixels = whole(camera, 89).project(points)
    np.testing.assert_allclose(pixels, by_fisheye(points, FISHEYE, K), atol=SAME_PX)


@pytest.mark.parametrize(("distortion", "d"), [("radtan", PINHOLE[:4]), ("none", [])])
def test_pinholes_are_opencvs_ordinary_model(distortion: str, d: list[float]) -> None:
    camera = read(cam0=cam("pinhole", distortion, FUFV, d)).camera
    points = rays(camera.theta_max)
    expected = by_pinhole(points, d or [0.0] * 4, K)
    np.testing.assert_allclose(camera.project(points), expected, atol=SAME_PX)


def test_omni_with_radtan_is_opencvs_omnidir() -> None:
    """Beyond 90 degrees too. Kalibr has no skew."""
    k = OMNI_K
    intrinsics = [OMNI_XI, k[0, 0], k[1, 1], k[0, 2], k[1, 2]]
    profile = read(cam0=cam("omni", "radtan", list(map(float, intrinsics)), OMNI_D))
    skewed = make_camera(
        (1280, 960),
        profile.camera.lens,
        center=profile.camera.center,
        stretch=profile.camera.stretch + np.array([[0, k[0, 1] / k[0, 0]], [0, 0]]),
    )
    pixels = skewed.project(omni_rays())
    np.testing.assert_allclose(pixels, list(OMNI_PIXELS.values()), atol=SAME_PX)


def test_omni_alone_is_mei_without_distortion() -> None:
    camera = read(cam0=cam("omni", "none", [1.25, *FUFV], [])).camera
    assert camera.lens == Mei(280.0, 1.25)


def test_field_of_view() -> None:
    camera = read(cam0=cam("pinhole", "fov", FUFV, [0.93])).camera
    points = rays(np.radians(89))
    pixels = whole(camera, 89).project(points)
    np.testing.assert_allclose(pixels, by_field_of_view(points, 0.93, K), atol=SAME_PX)


def test_double_sphere() -> None:
    camera = read(cam0=cam("ds", "none", [-0.27, 0.58, *FUFV], [])).camera
    assert camera.lens == DoubleSphere(280.0, -0.27, 0.58)
    points = rays(np.radians(110))
    pixels = whole(camera, 110).project(points)
    np.testing.assert_allclose(pixels, by_double_sphere(points, -0.27, 0.58, K), atol=SAME_PX)


def test_extended_unified() -> None:
    camera = read(cam0=cam("eucm", "none", [0.63, 1.04, *FUFV], [])).camera
    assert camera.lens == ExtendedUnified(280.0, 0.63, 1.04)
    points = rays(np.radians(110))
    pixels = whole(camera, 110).project(points)
    np.testing.assert_allclose(pixels, by_extended_unified(points, 0.63, 1.04, K), atol=SAME_PX)


def test_one_of_a_chain_is_picked() -> None:
    chain = {"cam0": cam(), "cam1": cam(intrinsics=[300.0, 300.0, 320.0, 240.0])}
    assert read("cam1", **chain).camera.center == (320.0, 240.0)
    assert read("cam1", **chain).name == "Kalibr cam1"
    with pytest.raises(ProfileError, match=r"2 cameras in one file.*FILE#cam0; .*cam0, cam1"):
        read(None, **chain)
    with pytest.raises(ProfileError, match="no camera 'cam2'"):
        read("cam2", **chain)


def test_where_cameras_sit_is_told() -> None:
    pose = np.eye(4).tolist()
    profile = read(cam0=cam(T_cam_imu=pose, T_cn_cnm1=pose, timeshift_cam_imu=-0.016684572))
    imu, other, shift = profile.notes
    assert "T_cam_imu" in imu
    assert "[[1.0, 0.0, 0.0, 0.0]" in imu
    assert "T_cn_cnm1" in other
    assert "t_imu = t_cam + (-0.016685 s)" in shift
    assert read(cam0=cam()).notes == ()


WRITTEN: list[tuple[Lens, str, str, list[float], list[float]]] = [
    (KannalaBrandt(280, *FISHEYE), "pinhole", "equidistant", [], FISHEYE),
    (
        KannalaBrandt(280, 1e-7, -1e-16, 1 / 3),
        "pinhole",
        "equidistant",
        [],
        [1e-7, -1e-16, 1 / 3, 0],
    ),
    (Equidistant(280), "pinhole", "equidistant", [], [0.0] * 4),
    (Perspective(280), "pinhole", "none", [], []),
    (OpenCVRational(280), "pinhole", "none", [], []),
    (OpenCVRational(280, *PINHOLE[:4]), "pinhole", "radtan", [], PINHOLE[:4]),
    (FieldOfView(280, 0.93), "pinhole", "fov", [], [0.93]),
    (Mei(280, 1.25), "omni", "none", [1.25], []),
    (Mei(280, 1.25, -0.12, 0.03, 0.0, 1e-3, -5e-4), "omni", "radtan", [1.25], OMNI_D),
    (DoubleSphere(280, -0.27, 0.58), "ds", "none", [-0.27, 0.58], []),
    (ExtendedUnified(280, 0.63, 1.04), "eucm", "none", [0.63, 1.04], []),
]


@pytest.mark.parametrize("written", WRITTEN, ids=lambda w: str(w[0])[:40])
def test_other_programs_read_what_is_written(written: Any) -> None:
    """What Kalibr's own reader checks: floats, whole sides, as many numbers as the model has."""
    lens, model, distortion, front, d = written
    camera = make_camera((640, 480), lens, center=(318.1, 243.75), stretch=np.diag([1, 0.98]))
    text = write(Profile(camera, "Lens A", "3 March"))
    assert text.startswith("# Lens A\n# 3 March\ncam0:\n")
    cam0 = yaml.safe_load(text)["cam0"]
    assert cam0["camera_model"] == model
    assert cam0["distortion_model"] == distortion
    assert cam0["intrinsics"] == [*front, 280.0, 280.0 * 0.98, 318.1, 243.75]
    assert cam0["distortion_coeffs"] == d
    assert cam0["resolution"] == [640, 480]
    assert cam0["rostopic"] == "/cam0/image_raw"
    assert all(type(value) is float for value in cam0["intrinsics"] + cam0["distortion_coeffs"])


REFUSED: list[tuple[Lens, Any, tuple[float, float], str]] = [
    (Stereographic(280), np.eye(2), (320, 240), "Kalibr has no lens model like 'stereographic'"),
    (OpenCVRational(280, *PINHOLE), np.eye(2), (320, 240), "no place for k3 of this lens"),
    (Mei(280, 1, k3=0.1), np.eye(2), (320, 240), "no place for k3 of this mei lens"),
    (DoubleSphere(280, 0.2, 1), np.eye(2), (320, 240), r"refuses an alpha outside \[0, 1\) of ds"),
    (Mei(280, -0.1), np.eye(2), (320, 240), r"refuses an xi below 0, and this lens has -0\.1"),
    (Equidistant(280), np.eye(2), (-1, 240), "refuses a centre outside the picture"),
    (Equidistant(280), np.array([[1, 0.01], [0, 1]]), (320, 240), r"cannot say skew.* 2\.8 pixels"),
]


@pytest.mark.parametrize(
    ("lens", "stretch", "center", "words"), REFUSED, ids=[r[3] for r in REFUSED]
)
def test_what_kalibr_cannot_say_is_refused(
    lens: Lens, stretch: Any, center: tuple[float, float], words: str
) -> None:
    camera = make_camera((640, 480), lens, stretch=stretch, center=center, field_deg=90)
    with pytest.raises(ProfileError, match=words):
        write(Profile(camera))


FAULTS: list[tuple[dict[str, Any], str]] = [
    (cam(resolution=None), "key 'resolution' is missing in cam0; needed: camera_model, intrinsics"),
    (
        cam("omni", "equidistant", [1.0, *FUFV]),
        r"cam0 is 'omni' \+ 'equidistant'; known: pinhole\+n",
    ),
    (cam("fisheye"), r"cam0 is 'fisheye' \+ 'equidistant'; known: .*eucm\+none"),
    (cam(camera_model=["pinhole"]), r"cam0 is \['pinhole'\]"),
    (cam("ds", "none", FUFV, []), r"intrinsics \[xi, alpha, fu, fv, pu, pv\] of cam0 must be a li"),
    (
        cam("pinhole", "radtan", FUFV, PINHOLE),
        "distortion_coeffs of cam0 must be a list of 4 numbers",
    ),
    (
        cam("pinhole", "none", FUFV, FISHEYE),
        "distortion_coeffs of cam0 must be a list of 0 numbers",
    ),
    (cam("pinhole", "fov", FUFV, [4.0]), "does not grow with the angle"),
    (cam("ds", "none", [-1.5, 0.5, *FUFV], []), "DoubleSphere.*does not grow with the angle"),
    (cam("omni", "none", [-1.5, *FUFV], []), "does not grow with the angle"),
    (cam(intrinsics=[-280.0, 280.0, 320.0, 240.0]), "focal lengths must be positive"),
    (cam(resolution=[640, 480.5]), "resolution of cam0 must be two whole numbers"),
    (cam(coefficients="none"), "distortion_coeffs of cam0 must be a list"),
]


@pytest.mark.parametrize(("cam0", "words"), FAULTS, ids=[words for _, words in FAULTS])
def test_faults_are_named(cam0: dict[str, Any], words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        read(cam0=cam0)


def test_a_chain_without_cameras_is_refused() -> None:
    with pytest.raises(ProfileError, match=r"a Kalibr camchain has cam0, cam1"):
        parse_profile(Document("a: 1\n"), format="kalibr")


# Real cameras, as published


def as_kalibr(camera: dict[str, Any]) -> str:
    kb4 = camera["kb4_kalibr"]
    intrinsics = [kb4[key] for key in ("fx", "fy", "cx", "cy")]
    chain = cam(intrinsics=intrinsics, coefficients=kb4["k"], resolution=camera["resolution"])
    return yaml.safe_dump({"cam0": chain})


def as_basalt(camera: dict[str, Any]) -> str:
    kb4 = camera["kb4_kalibr"]
    values = {key: kb4[key] for key in ("fx", "fy", "cx", "cy")}
    values |= {f"k{i + 1}": k for i, k in enumerate(kb4["k"])}
    intrinsics = [{"camera_type": "kb4", "intrinsics": values}]
    value = {"T_imu_cam": [], "intrinsics": intrinsics, "resolution": [camera["resolution"]]}
    return json.dumps({"value0": value})


def as_opencv(camera: dict[str, Any]) -> str:
    kb4 = camera["kb4_kalibr"]
    k = matrix(*(kb4[key] for key in ("fx", "fy", "cx", "cy"))).ravel().tolist()
    width, height = camera["resolution"]
    return (
        f"%YAML:1.0\n---\nimage_width: {width}\nimage_height: {height}\nfisheye_model: 1\n"
        f"K: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: {k}\n"
        f"D: !!opencv-matrix\n   rows: 4\n   cols: 1\n   dt: d\n   data: {kb4['k']}\n"
    )


@pytest.mark.data
@pytest.mark.parametrize("name", ["tumvi_cam0", "tumvi_cam1", "uzhfpv_indoor_cam0"])
def test_published_cameras_are_the_same_in_every_format(name: str, shared_data: Path) -> None:
    published = json.loads((shared_data / "lens_references/published.json").read_text("utf-8"))
    texts = [form(published[name]) for form in (as_kalibr, as_basalt, as_opencv)]
    cameras = [parse_profile(Document(text)).camera for text in texts]
    assert [format_of(Document(text)) for text in texts] == ["kalibr", "basalt", "opencv"]
    kb4 = published[name]["kb4_kalibr"]
    k = matrix(*(kb4[key] for key in ("fx", "fy", "cx", "cy")))
    field_deg = 97.5 if name.startswith("tumvi") else 93  # TUM VI says 195 degrees, UZH-FPV 186
    points = rays(np.radians(field_deg))
    before = points[:, 2] > np.cos(np.radians(89.9))
    first = whole(cameras[0], field_deg).project(points)
    assert (~before).any()  # and beyond
    for camera in cameras:
        assert list(camera.size) == published[name]["resolution"]
        pixels = whole(camera, field_deg).project(points)
        np.testing.assert_allclose(pixels, first, atol=1e-10)
        expected = by_fisheye(points[before], kb4["k"], k)
        np.testing.assert_allclose(pixels[before], expected, atol=SAME_PX)
        for other in ("kalibr", "basalt", "opencv", "ros"):
            written = format_module(other).write(Profile(camera))
            again = whole(parse_profile(Document(written)).camera, field_deg).project(points)
            np.testing.assert_allclose(again, first, atol=1e-10)
