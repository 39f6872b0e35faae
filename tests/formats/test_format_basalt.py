"""Basalt calibrations against OpenCV and the formulas of Usenko et al. 2018."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from reference_points import (
    FISHEYE,
    RATIONAL,
    SAME_PX,
    by_double_sphere,
    by_extended_unified,
    by_field_of_view,
    by_fisheye,
    by_pinhole,
    by_unified,
    matrix,
    rays,
)

from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import Choice, Document, Profile, format_of, parse_profile
from freelook.formats.basalt import write
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
FOCALS = {"fx": 280.0, "fy": 276.5, "cx": 318.25, "cy": 243.75}
KB4 = dict(zip(("k1", "k2", "k3", "k4"), FISHEYE, strict=True))
RADTAN8 = dict(zip(("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"), RATIONAL, strict=False))


def cam(kind: str, **values: Any) -> dict[str, Any]:
    return {"camera_type": kind, "intrinsics": FOCALS | values}


def calibration(*cams: Any, **changes: Any) -> dict[str, Any]:
    value = {
        "T_imu_cam": [],
        "intrinsics": list(cams),
        "resolution": [[640, 480]] * len(cams),
    }
    return {"value0": value | changes}


def read(*cams: Any, pick: str | None = None, **changes: Any) -> Profile:
    document = Document(json.dumps(calibration(*cams, **changes)))
    assert format_of(document) == "basalt"
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


def test_kb4_is_opencvs_fisheye() -> None:
    camera = read(cam("kb4", **KB4)).camera
    points = rays(np.radians(89))  # where OpenCV's functions end; Basalt's and ours go on
    pixels = whole(camera, 89).project(points)
    np.testing.assert_allclose(pixels, by_fisheye(points, FISHEYE, K), atol=SAME_PX)


def test_kb4_beyond_90_degrees_is_the_written_formula() -> None:
    """Basalt takes theta = atan2(r, z)."""
    camera = whole(read(cam("kb4", **KB4)).camera, 97)
    points = rays(np.radians(97))
    x, y, z = points.T
    r = np.hypot(x, y)
    theta = np.arctan2(r, z)
    powers = np.stack([theta ** (2 * i + 3) for i in range(4)])
    scale = np.divide(theta + FISHEYE @ powers, r, out=np.zeros_like(r), where=r > 0)
    expected = np.stack([280.0 * x * scale + 318.25, 276.5 * y * scale + 243.75], axis=-1)
    np.testing.assert_allclose(camera.project(points), expected, atol=SAME_PX)


@pytest.mark.parametrize(("alpha", "half_deg"), [(0.0, 80), (0.3, 100), (0.5, 110), (0.62, 120)])
def test_unified(alpha: float, half_deg: float) -> None:
    """As Mei's model with a scaled focal length; at 1/2 and above it sees far behind."""
    camera = read(cam("ucm", alpha=alpha)).camera
    assert isinstance(camera.lens, Mei)
    assert camera.lens.xi == pytest.approx(alpha / (1 - alpha))
    points = rays(np.radians(half_deg))
    pixels = whole(camera, half_deg).project(points)
    np.testing.assert_allclose(pixels, by_unified(points, alpha, K), atol=SAME_PX)


def test_extended_unified() -> None:
    camera = read(cam("eucm", alpha=0.63, beta=1.04)).camera
    points = rays(np.radians(110))
    pixels = whole(camera, 110).project(points)
    np.testing.assert_allclose(pixels, by_extended_unified(points, 0.63, 1.04, K), atol=SAME_PX)


def test_double_sphere() -> None:
    camera = read(cam("ds", xi=-0.27, alpha=0.58)).camera
    points = rays(np.radians(110))
    pixels = whole(camera, 110).project(points)
    np.testing.assert_allclose(pixels, by_double_sphere(points, -0.27, 0.58, K), atol=SAME_PX)


def test_field_of_view() -> None:
    camera = whole(read(cam("fov", w=0.93)).camera, 89)
    points = rays(np.radians(89))
    np.testing.assert_allclose(
        camera.project(points), by_field_of_view(points, 0.93, K), atol=SAME_PX
    )


@pytest.mark.parametrize("rpmax", [{}, {"rpmax": 0.0}, {"rpmax": -1.0}])
def test_pinholes_are_opencvs_ordinary_model(rpmax: dict[str, float]) -> None:
    plain = read(cam("pinhole")).camera
    assert plain.lens == Perspective(280.0)
    for camera, d in (
        (plain, [0.0] * 4),
        (read(cam("pinhole-radtan8", **RADTAN8, **rpmax)).camera, RATIONAL[:8]),
    ):
        points = rays(camera.theta_max)
        np.testing.assert_allclose(camera.project(points), by_pinhole(points, d, K), atol=SAME_PX)


def test_the_field_ends_where_basalt_ends_it() -> None:
    """rpmax is the largest radius on the plane z = 1."""
    camera = read(cam("pinhole-radtan8", **RADTAN8, rpmax=1.0)).camera
    assert np.degrees(camera.theta_max) == pytest.approx(45)
    endless = read(cam("pinhole-radtan8", **RADTAN8)).camera
    farther = read(cam("pinhole-radtan8", **RADTAN8, rpmax=100.0)).camera
    assert farther.theta_max == endless.theta_max


def test_one_of_several_is_picked() -> None:
    cams = [cam("kb4", **KB4), cam("ds", xi=-0.2, alpha=0.6)]
    resolution = [[640, 480], [512, 500]]
    profile = read(*cams, pick="cam1", resolution=resolution)
    assert profile.camera.size == (512, 500)
    assert isinstance(profile.camera.lens, DoubleSphere)
    assert profile.name == "Basalt cam1"
    with pytest.raises(ProfileError, match=r"2 cameras in one file.*FILE#cam0; .*cam0, cam1"):
        read(*cams)


def test_what_is_not_used_is_told() -> None:
    pose = {"px": 0.1, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}
    profile = read(
        cam("pinhole"), T_imu_cam=[pose], cam_time_offset_ns=-5000, vignette=[{"value0": 0}]
    )
    where, offset, vignette = profile.notes
    assert "T_imu_cam" in where
    assert "'px': 0.1" in where
    assert "cam_time_offset_ns = -5000" in offset
    assert "vignette" in vignette
    assert read(cam("pinhole")).notes == ()


WRITTEN: list[tuple[Lens, str, dict[str, float]]] = [
    (KannalaBrandt(280, *FISHEYE), "kb4", KB4),
    (Equidistant(280), "kb4", dict.fromkeys(KB4, 0.0)),
    (Perspective(280), "pinhole", {}),
    (OpenCVRational(280), "pinhole", {}),
    (OpenCVRational(280, *RATIONAL[:8]), "pinhole-radtan8", RADTAN8 | {"rpmax": -1.0}),
    (FieldOfView(280, 0.93), "fov", {"w": 0.93}),
    (DoubleSphere(280, -0.27, 0.58), "ds", {"xi": -0.27, "alpha": 0.58}),
    (ExtendedUnified(280, 0.63, 1.04), "eucm", {"alpha": 0.63, "beta": 1.04}),
    (Mei(280, 1.5), "ucm", {"alpha": 0.6}),
]


@pytest.mark.parametrize(("lens", "kind", "values"), WRITTEN, ids=[str(w[0])[:40] for w in WRITTEN])
def test_a_whole_calibration_is_written(lens: Lens, kind: str, values: dict[str, float]) -> None:
    """Everything that `serialize` in basalt's headers_serialization.h asks for: it throws for a
    name that is missing."""
    camera = make_camera((640, 480), lens, center=(318.1, 243.75), stretch=np.diag([1, 0.98]))
    value = json.loads(write(Profile(camera)))["value0"]
    (intrinsics,) = value["intrinsics"]
    assert intrinsics["camera_type"] == kind
    f = 280 / 2.5 if kind == "ucm" else 280.0  # 1 + xi
    expected = {"fx": f, "fy": f * 0.98, "cx": 318.1, "cy": 243.75, **values}
    assert intrinsics["intrinsics"] == pytest.approx(expected, rel=1e-15)
    assert value["resolution"] == [[640, 480]]
    assert set(value["T_imu_cam"][0]) == {"px", "py", "pz", "qx", "qy", "qz", "qw"}
    lengths = {"calib_accel_bias": 9, "calib_gyro_bias": 12, "vignette": 0}
    lengths |= dict.fromkeys(("accel_noise_std", "gyro_noise_std"), 3)
    lengths |= dict.fromkeys(("accel_bias_std", "gyro_bias_std"), 3)
    assert {key: len(value[key]) for key in lengths} == lengths
    assert value["imu_update_rate"] == 200
    assert value["cam_time_offset_ns"] == 0


REFUSED: list[tuple[Lens, Any, str]] = [
    (Stereographic(280), np.eye(2), "Basalt has no lens model like 'stereographic'"),
    (Mei(280, 1.5, p1=1e-3), np.eye(2), r"only say those with xi from 0 and no distortion \(ucm\)"),
    (Mei(280, -0.1), np.eye(2), "only say those with xi from 0"),
    (OpenCVRational(280, *RATIONAL[:12]), np.eye(2), "no place for s1, s2, s3, s4"),
    (Equidistant(280), np.array([[1, 0.01], [0, 1]]), r"cannot say skew.* 2\.8 pixels"),
]


@pytest.mark.parametrize(("lens", "stretch", "words"), REFUSED, ids=[w for _, _, w in REFUSED])
def test_what_basalt_cannot_say_is_refused(lens: Lens, stretch: Any, words: str) -> None:
    camera = make_camera((640, 480), lens, stretch=stretch, field_deg=90)
    with pytest.raises(ProfileError, match=words):
        write(Profile(camera))


FAULTS: list[tuple[dict[str, Any], str]] = [
    (calibration(), r"value0\.intrinsics must be a list with one entry per camera"),
    (calibration(cam("pinhole"), resolution={}), r"value0\.resolution must be a list"),
    (calibration(cam("pinhole"), resolution=[[1, 2], [3, 4]]), "1 intrinsics and 2 resolutions"),
    (
        calibration(cam("pinhole"), resolution=[[0, 2]]),
        r"resolution\[0\] must be two whole numbers",
    ),
    (calibration(5), r"intrinsics\[0\] must be an object, not 5"),
    (
        calibration(cam("bal")),
        "camera_type 'bal' of cam0 is not known: pinhole, kb4, ds, eucm, ucm",
    ),
    (calibration({"camera_type": ["kb4"]}), r"camera_type \['kb4'\] of cam0 is not known"),
    (calibration({"camera_type": "ds"}), r"intrinsics of cam0 \(ds\) must be an object, not None"),
    (
        calibration(cam("ds", xi=0.1)),
        r"key 'alpha' is missing in intrinsics of cam0 \(ds\); needed",
    ),
    (
        calibration(cam("kb4", **KB4, k5=0)),
        r"unknown key 'k5' in intrinsics of cam0 \(kb4\); known",
    ),
    (calibration(cam("ucm", alpha=1)), "alpha of a ucm camera must be from 0 to below 1, not 1"),
    (calibration(cam("ucm", alpha=-0.1)), r"must be from 0 to below 1, not -0\.1"),
    (calibration(cam("eucm", alpha=0.5, beta=-1)), "does not grow with the angle"),
    (calibration(cam("fov", w="1")), r"w in the intrinsics of cam0 \(fov\) must be a number"),
    (calibration(cam("pinhole", fx=0)), "focal lengths must be positive, not 0"),
    (calibration(cam("pinhole", rpmax=1.0)), "unknown key 'rpmax'"),
]


@pytest.mark.parametrize(("data", "words"), FAULTS, ids=[words for _, words in FAULTS])
def test_faults_are_named(data: dict[str, Any], words: str) -> None:
    with pytest.raises(ProfileError, match=words):
        parse_profile(Document(json.dumps(data)))


def test_another_text_is_refused() -> None:
    with pytest.raises(ProfileError, match="value0 must be an object, not None"):
        parse_profile(Document('{"a": 1}'), format="basalt")
    with pytest.raises(ProfileError, match="a Basalt calibration cannot be read: not JSON"):
        parse_profile(Document("value0: 1"), format="basalt")


def test_numbers_of_old_files_may_be_whole() -> None:
    camera = read({"camera_type": "pinhole", "intrinsics": {k: 300 for k in FOCALS}}).camera
    assert camera.lens == Perspective(300.0)
