"""Gyroflow's profiles: its projection, what it ignores, and its whole collection."""

from __future__ import annotations

import csv
import json
import re
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from freelook.camera import Camera, make_camera
from freelook.errors import ProfileError
from freelook.formats import Document, Profile, format_of, load_profile, parse_profile
from freelook.formats._gyroflow_models import LENSES
from freelook.formats.gyroflow import MODELS, write
from freelook.lens import MODELS as LENS_MODELS
from freelook.lens import Equidistant, KannalaBrandt, Lens, Perspective, model_name

SIZE = (2704, 2028)
FISHEYE = [0.0523, -0.0213, 0.0112, -0.0021]
PARAMS: dict[str, Any] = {
    "RMS_error": 0.37,
    "camera_matrix": [[1120.4, 0.0, 1368.8], [0.0, 1119.6, 989.0], [0.0, 0.0, 1.0]],
    "distortion_coeffs": FISHEYE,
    "radial_distortion_limit": None,
}
DOCS = Path(__file__).parent.parent.parent / "docs" / "lenses.md"


def document(params: dict[str, Any] | None = None, **changes: Any) -> dict[str, Any]:
    return {
        "name": "Maker_Cam_Wide",
        "camera_brand": "Maker",
        "camera_model": "Cam",
        "lens_model": "Wide",
        "camera_setting": "",
        "note": "no stabilisation",
        "calibrated_by": "someone",
        "num_images": 30,
        "calibrator_version": "1.5.4",
        "calib_dimension": {"w": SIZE[0], "h": SIZE[1]},
        "fisheye_params": PARAMS | (params or {}),
    } | changes


def profile_of(data: dict[str, Any]) -> Profile:
    return parse_profile(Document(json.dumps(data)))


def camera_of(params: dict[str, Any] | None = None, **changes: Any) -> Camera:
    return profile_of(document(params, **changes)).camera


# --- Gyroflow's formulas, written out from its distortion_models/*.rs: rays to (x, y) / f ---

Plane = Callable[[np.ndarray, list[float]], np.ndarray]


def of_angle(powers: list[int]) -> Plane:
    """theta_d = sum of k theta^power, with the angle taken by atan2 as newer versions do."""

    def plane(ray: np.ndarray, k: list[float]) -> np.ndarray:
        r = np.hypot(ray[:, 0], ray[:, 1])
        theta = np.arctan2(r, ray[:, 2])
        theta_d = sum(c * theta**p for c, p in zip(k, powers, strict=False))
        return np.asarray(ray[:, :2] * (theta_d / r)[:, None])

    return plane


def fisheye(ray: np.ndarray, k: list[float]) -> np.ndarray:
    return of_angle([1, 3, 5, 7, 9])(ray, [1.0, *k])


def of_tangent(factor: Callable[[np.ndarray, list[float]], np.ndarray]) -> Plane:
    def plane(ray: np.ndarray, k: list[float]) -> np.ndarray:
        xy = ray[:, :2] / ray[:, 2:]
        return np.asarray(xy * factor(np.hypot(xy[:, 0], xy[:, 1]), k)[:, None])

    return plane


def standard(ray: np.ndarray, k: list[float]) -> np.ndarray:
    k = [*k, *[0.0] * (12 - len(k))]
    x, y = (ray[:, :2] / ray[:, 2:]).T
    r2 = x * x + y * y
    ratio = (1 + k[0] * r2 + k[1] * r2**2 + k[4] * r2**3) / (
        1 + k[5] * r2 + k[6] * r2**2 + k[7] * r2**3
    )
    a1, a2, a3 = 2 * x * y, r2 + 2 * x * x, r2 + 2 * y * y
    return np.stack(
        [
            x * ratio + k[2] * a1 + k[3] * a2 + k[8] * r2 + k[9] * r2**2,
            y * ratio + k[2] * a3 + k[3] * a1 + k[10] * r2 + k[11] * r2**2,
        ],
        axis=-1,
    )


def insta360(ray: np.ndarray, k: list[float]) -> np.ndarray:
    k1, k2, k3, p1, p2, xi = k
    x, y = (ray[:, :2] / (ray[:, 2:] + xi * np.linalg.norm(ray, axis=1, keepdims=True))).T
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    return np.stack(
        [
            x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y),
        ],
        axis=-1,
    )


FORMULAS: dict[str, tuple[Plane, list[float]]] = {
    "opencv_fisheye": (fisheye, FISHEYE),
    "opencv_standard": (standard, [-0.11, 0.02, 1e-3, -5e-4, -1e-3, 0.02, 0, 0, 1e-4, 0, 2e-4, 0]),
    "poly3": (of_tangent(lambda r, k: 1 + k[0] * r**2), [-0.012]),
    "poly5": (of_tangent(lambda r, k: 1 + k[0] * r**2 + k[1] * r**4), [-0.01, 0.002]),
    "ptlens": (
        of_tangent(lambda r, k: k[0] * r**3 + k[1] * r**2 + k[2] * r + 1),
        [0.002, -0.015, 0.01],
    ),
    "insta360": (insta360, [-0.12, 0.05, -0.01, 1e-4, -2e-4, 1.2]),
    "sony": (of_angle([1, 2, 3, 4, 5, 6]), [1.02, 0.003, -0.05, 0.002, -0.001, 0.0004]),
    "generic_polynomial": (of_angle(list(range(1, 13))), [1.0, 0.01, -0.04, 0.0, 0.001, -0.0003]),
}


def rays(camera: Camera, rng: np.random.Generator, count: int = 2000) -> np.ndarray:
    """Directions over the whole field, rim and axis included."""
    theta = np.sqrt(rng.uniform(1e-8, 1, count)) * camera.theta_max * (1 - 1e-9)
    phi = rng.uniform(0, 2 * np.pi, count)
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1)


def test_every_model_has_its_formula_here() -> None:
    assert set(FORMULAS) == set(LENSES)


@pytest.mark.parametrize("model", FORMULAS)
def test_rays_land_where_gyroflow_puts_them(model: str, rng: np.random.Generator) -> None:
    plane, k = FORMULAS[model]
    camera = camera_of({"distortion_coeffs": k}, distortion_model=model, asymmetrical=True)
    ray = rays(camera, rng)
    expected = plane(ray, k) * [1120.4, 1119.6] + [1368.8, 989.0]
    assert np.abs(camera.project(ray) - expected).max() < 1e-6


def opencv_pixels(camera: Camera, ray: np.ndarray) -> np.ndarray:
    """cv2.fisheye with the camera's numbers; rays below 90 degrees only."""
    lens = camera.lens
    assert isinstance(lens, KannalaBrandt)
    (xx, _), (_, yy) = camera.stretch
    matrix = np.array(
        [[lens.f * xx, 0, camera.center[0]], [0, lens.f * yy, camera.center[1]], [0, 0, 1]]
    )
    d = np.array([lens.k1, lens.k2, lens.k3, lens.k4])
    point = (ray / ray[:, 2:]).reshape(-1, 1, 3)
    pixel, _ = cv2.fisheye.projectPoints(point, np.zeros(3), np.zeros(3), matrix, d)
    return np.asarray(pixel).reshape(-1, 2)


def test_the_fisheye_model_agrees_with_opencv(rng: np.random.Generator) -> None:
    camera = camera_of()
    ray = rays(camera, rng)
    ray = ray[ray[:, 2] > 0.02]  # OpenCV's own functions end at 90 degrees
    assert len(ray) > 1000
    assert np.abs(camera.project(ray) - opencv_pixels(camera, ray)).max() < 1e-6


def test_the_axis_is_in_the_middle_unless_the_profile_is_asymmetrical() -> None:
    profile = profile_of(document())
    assert profile.camera.center == (1351.5, 1013.5)
    assert any("(1368.8, 989.0), 30.0 px from the middle" in note for note in profile.notes)
    profile = profile_of(document(asymmetrical=True))
    assert profile.camera.center == (1368.8, 989.0)
    assert not any("middle" in note for note in profile.notes)


def test_who_made_it_and_how_well_is_told() -> None:
    profile = profile_of(document())
    assert profile.name == "Maker Cam Wide no stabilisation"
    assert profile.source == "Gyroflow lens profile, calibrated by someone from 30 pictures"
    assert profile.notes[0] == "calibration error 0.37 px RMS"
    rough = profile_of(document({"RMS_error": 2.5}))
    assert rough.notes[0] == "calibration error 2.50 px RMS; good ones are below 1"


def test_a_stretched_picture_is_read_as_the_video_has_it(rng: np.random.Generator) -> None:
    """Gyroflow: uv = f distorted + c in the stretched picture, then uv / stretch."""
    plain = camera_of()
    camera = camera_of(input_horizontal_stretch=0.75, input_vertical_stretch=1.3333)
    assert camera.size == (round(2704 / 0.75), round(2028 / 1.3333))
    ray = rays(plain, rng)
    scale = np.array(camera.size) / plain.size
    expected = (plain.project(ray) + 0.5) * scale - 0.5
    np.testing.assert_allclose(camera.project(ray), expected, atol=1e-9)
    assert camera_of(input_horizontal_stretch=0, input_vertical_stretch=None).size == SIZE


def test_a_cropped_sensor_shows_things_larger() -> None:
    lens = camera_of(crop=0.5, asymmetrical=True).lens
    assert isinstance(lens, KannalaBrandt)
    assert lens.f == pytest.approx(2 * 1120.4)


@pytest.mark.parametrize("model", ["opencv_fisheye", "sony", "generic_polynomial"])
def test_coefficients_that_are_all_0_mean_a_perspective_lens(model: str) -> None:
    zero = {"distortion_coeffs": [0.0] * 4}
    assert camera_of(zero, distortion_model=model).lens == Perspective(1120.4)


def test_the_radial_limit_is_a_tangent_and_ends_the_field() -> None:
    camera = camera_of({"radial_distortion_limit": 1.2})
    assert np.degrees(camera.theta_max) == pytest.approx(np.degrees(np.arctan(1.2)))
    whole = camera_of().theta_max
    assert camera_of({"radial_distortion_limit": 1e4}).theta_max == whole
    assert camera_of({"radial_distortion_limit": 0}).theta_max == whole


# The radius stops growing at 75.2 degrees: 1 + 3 k1 theta^2 + ... = 0; the corner lies farther.
SHORT = {"distortion_coeffs": [-0.05, -0.03, -0.02, 0.0], "radial_distortion_limit": None}


def test_a_radius_that_stops_growing_inside_the_picture_is_refused_and_can_be_narrowed() -> None:
    with pytest.raises(ProfileError, match=r"stops growing at (\d+\.\d+) degrees") as refused:
        camera_of(SHORT)
    found = re.search(r'"radial_distortion_limit": ([\d.]+)', str(refused.value))
    assert found is not None
    half_deg = np.degrees(camera_of(SHORT | {"radial_distortion_limit": float(found[1])}).theta_max)
    said = re.search(r"growing at ([\d.]+)", str(refused.value))
    assert said is not None
    assert 0.98 * float(said[1]) < half_deg < float(said[1])


def test_the_limit_of_newer_versions_is_that_same_angle_and_no_excuse() -> None:
    with pytest.raises(ProfileError, match="stops growing") as refused:
        camera_of(SHORT)
    said = re.search(r"growing at ([\d.]+)", str(refused.value))
    assert said is not None
    radians = float(np.radians(float(said[1])))
    with pytest.raises(ProfileError, match="stops growing"):
        camera_of(SHORT | {"radial_distortion_limit": radians})


def test_a_fisheye_whose_circle_ends_inside_the_picture_is_read() -> None:
    """f sin(theta) up to theta^9 with the circle's end moved to 100 degrees."""
    circle = {
        "camera_matrix": [[900.0, 0, 1351.5], [0, 900.0, 1013.5], [0, 0, 1]],
        "distortion_coeffs": [-0.11, 0.0, 0.0, 0.0],
    }
    camera = camera_of(circle)
    assert np.degrees(camera.theta_max) == pytest.approx(np.degrees(np.sqrt(1 / 0.33)), abs=0.01)
    rim_px = camera.lens.radius(np.array([camera.theta_max]))[0]
    assert rim_px < np.hypot(*SIZE) / 2


def k_matrix(fx: float, fy: float, cx: float = 1352.0, cy: float = 1014.0) -> dict[str, Any]:
    return {"camera_matrix": [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]}


@pytest.mark.parametrize(
    ("params", "changes", "words"),
    [
        ({"RMS_error": 5.01}, {}, "RMS_error is 5.01 px"),
        ({"RMS_error": -1.0}, {}, "RMS_error is -1 px"),
        ({"RMS_error": "good"}, {}, "RMS_error must be a number"),
        ({"camera_matrix": []}, {}, "camera_matrix must be three rows"),
        ({"camera_matrix": [[0] * 3] * 3}, {}, "focal lengths must be positive"),
        ({"camera_matrix": [[1], [2], [3]]}, {}, r"camera_matrix\[0\] must be a list of 3"),
        ({"camera_matrix": [[900, 5, 1352], [0, 900, 1014], [0, 0, 1]]}, {}, "skew of 5"),
        (k_matrix(-900, 900), {}, "must be positive"),
        (k_matrix(900, 0), {}, "must be positive"),
        (k_matrix(900, 2000), {}, "fy is 2.22 times fx"),
        (k_matrix(2000, 900), {}, "fy is 0.45 times fx"),
        (k_matrix(900, 900, cx=2050), {}, r"\(\+0.26, \+0.00\) of the 2704 x 2028 picture"),
        (k_matrix(900, 900, cy=-3000), {}, r"\(\+0.00, -1.98\)"),
        ({**k_matrix(1e6, 1e6), "distortion_coeffs": [0.0] * 4}, {}, "0.19 degrees across"),
        ({**k_matrix(250, 250), "distortion_coeffs": [0.0] * 4}, {}, "times as fast at"),
        ({"distortion_coeffs": []}, {}, "takes this camera's from each video"),
        ({"distortion_coeffs": [0.1] * 13}, {}, "1 to 12 numbers"),
        ({"distortion_coeffs": [0.1] * 5}, {}, "the first 4 can be read here"),
        ({"distortion_coeffs": [1e13, 0, 0, 0]}, {}, "not a number a lens can have"),
        ({"distortion_coeffs": [0.0, None]}, {}, "must be a number, not None"),
        ({"distortion_coeffs": [-5.0, 0, 0, 0]}, {}, "stops growing at 14.79 degrees"),
        ({"radial_distortion_limit": -1}, {}, "must be above 0"),
        ({}, {"calib_dimension": {"w": 0, "h": 0}}, "whole numbers"),
        ({}, {"calib_dimension": {}}, "must be a number, not None"),
        ({}, {"calib_dimension": None}, "calib_dimension must be an object"),
        ({}, {"fisheye_params": []}, "fisheye_params must be an object"),
        ({}, {"distortion_model": "gopro"}, "known: opencv_fisheye, opencv_standard, poly3"),
        ({}, {"distortion_model": 3}, "unknown distortion_model 3"),
        ({}, {"distortion_model_id": 2}, "given in an old way"),
        ({}, {"digital_lens": "gopro_hyperview"}, "digital_lens is 'gopro_hyperview'"),
        ({}, {"is_superview": True}, "digital_lens is 'gopro_superview'"),
        ({}, {"crop": 0}, "crop must be above 0"),
    ],
)
def test_what_is_no_lens_is_refused_and_why_is_said(
    params: dict[str, Any], changes: dict[str, Any], words: str
) -> None:
    with pytest.raises(ProfileError, match=words):
        camera_of(params, **changes)


WRITTEN: list[Lens] = [
    KannalaBrandt(900.0, *FISHEYE),
    KannalaBrandt(900.0),
    Perspective(900.0),
    *(
        LENSES[model][0](900.0, **dict(zip(LENSES[model][1], FORMULAS[model][1], strict=False)))
        for model in ("opencv_standard", "poly3", "poly5", "ptlens", "insta360", "sony")
    ),
]


def test_every_model_it_can_hold_is_written_here() -> None:
    assert {model_name(lens) for lens in WRITTEN} == set(MODELS)
    assert set(MODELS) <= set(LENS_MODELS)


@pytest.mark.parametrize("lens", WRITTEN, ids=lambda lens: type(lens).__name__)
@pytest.mark.parametrize("center", [(959.5, 539.5), (950.25, 545.75)])
def test_written_and_read_again_it_is_the_same_camera(
    lens: Lens, center: tuple[float, float], rng: np.random.Generator
) -> None:
    camera = make_camera((1920, 1080), lens, center=center, stretch=np.diag([1.02, 0.99]))
    text = write(Profile(camera, "n", "s"))
    assert format_of(Document(text)) == "gyroflow"
    again = parse_profile(Document(text)).camera
    assert again.theta_max == pytest.approx(camera.theta_max, abs=1e-6)
    ray = rays(camera, rng)
    # 1e-8: a Kannala-Brandt lens without terms is written with one of 1e-13
    np.testing.assert_allclose(again.project(ray), camera.project(ray), atol=1e-8)


def test_a_narrowed_field_is_written_where_it_can_be_said() -> None:
    camera = make_camera((1920, 1080), KannalaBrandt(500.0, -0.02), field_deg=130)
    again = parse_profile(Document(write(Profile(camera)))).camera
    assert np.degrees(again.theta_max) == pytest.approx(65)


def test_gyroflow_finds_all_it_needs() -> None:
    """LensProfile::load_from_data wants these; the rest of its fields have defaults."""
    data = json.loads(write(Profile(make_camera((640, 480), KannalaBrandt(200.0, 0.01)))))
    assert data["calibrator_version"]
    assert len(data["fisheye_params"]["camera_matrix"]) == 3
    assert data["calib_dimension"] == {"w": 640, "h": 480}
    assert data["input_horizontal_stretch"] == data["input_vertical_stretch"] == 1.0
    assert data["asymmetrical"] is False


def test_what_the_format_cannot_say_is_an_error() -> None:
    with pytest.raises(ProfileError, match="cannot hold a equidistant lens; it can: kannala"):
        write(Profile(make_camera((640, 480), Equidistant(200.0))))
    lens = KannalaBrandt(200.0, 0.01)
    skewed = make_camera((640, 480), lens, stretch=np.array([[1, 0.01], [0, 1]]))
    with pytest.raises(ProfileError, match="no skew"):
        write(Profile(skewed))
    tilted = LENS_MODELS["opencv_rational"](300.0, tau_x=0.01)  # type: ignore[call-arg]
    with pytest.raises(ProfileError, match="has no tau_x, tau_y"):
        write(Profile(make_camera((640, 480), tilted)))


# --- The whole collection, gyroflow/lens_profiles at 886fc616 ---

# why (as docs/lenses.md says it): what the error says, how many of 200 files and of 9,748 rows
OUTCOMES: dict[str, tuple[str, int, int]] = {
    "read": ("", 173, 9123),
    "the radius stops growing inside the picture, below 90 degrees": ("stops growing", 27, 350),
    "the axis is more than a quarter of the picture from its middle": ("the axis at", 0, 222),
    "the calibration's own error is above 5 px": ("RMS_error is", 0, 30),
    "the radius grows over 8 times as fast farther out": ("times as fast", 0, 12),
    "pixels more than 2.2 to 1 from square": ("times fx", 0, 4),
    "a coefficient beyond 1e12": ("not a number a lens can have", 0, 4),
    "the whole picture is less than 2 degrees across": ("degrees across", 0, 3),
}


def outcome(error: ProfileError) -> str:
    """The key in OUTCOMES; a reason that is not there is a KeyError's worth of news."""
    (found,) = [why for why, (words, *_) in OUTCOMES.items() if words and words in str(error)]
    return found


def test_the_table_in_the_documentation_is_this_one() -> None:
    text = DOCS.read_text("utf-8")
    for why, (_, files, rows) in OUTCOMES.items():
        assert f"| {why} | {files} | {rows:,} |" in text
    assert sum(files for _, files, _ in OUTCOMES.values()) == 200
    assert sum(rows for _, _, rows in OUTCOMES.values()) == 9748


def check_accepted(camera: Camera) -> None:
    """Grows over its whole field, covers its picture or ends at 90 degrees or a stated limit."""
    radius = camera.lens.radius(np.linspace(0, camera.theta_max * (1 - 1e-9), 400))
    assert (np.diff(radius) > 0).all()
    # high terms of narrow lenses in 8k pictures bend that much between entries; most do not
    assert camera.table.residual_px < 0.12


@pytest.mark.data
def test_all_200_files_are_read_or_refused_with_a_reason(
    shared_data: Path, rng: np.random.Generator
) -> None:
    files = sorted((shared_data / "gyroflow_profiles" / "profiles").rglob("*.json"))
    counts: Counter[str] = Counter()
    for file in files:
        try:
            profile = load_profile(file)
        except ProfileError as error:
            counts[outcome(error)] += 1
            continue
        counts["read"] += 1
        camera = profile.camera
        check_accepted(camera)
        assert profile.name
        assert any("px RMS" in note for note in profile.notes)
        ray = rays(camera, rng, 200)
        ray = ray[ray[:, 2] > 0.02]
        assert np.abs(camera.project(ray) - opencv_pixels(camera, ray)).max() < 1e-6
    assert counts == {why: files for why, (_, files, _) in OUTCOMES.items() if files}


NUMBERS = ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "rms")


def row_documents(shared_data: Path) -> Iterator[dict[str, Any]]:
    """Profiles of the summary's columns: they say nothing of asymmetry, stretches and limits."""
    path = shared_data / "gyroflow_profiles" / "summary_all.csv"
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            n = {
                key: float(row[key])
                for key in ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "rms"]
            }
            yield {
                "calib_dimension": {"w": int(row["w"]), "h": int(row["h"])},
                "fisheye_params": {
                    "RMS_error": n["rms"],
                    "camera_matrix": [[n["fx"], 0, n["cx"]], [0, n["fy"], n["cy"]], [0, 0, 1]],
                    "distortion_coeffs": [n["k1"], n["k2"], n["k3"], n["k4"]],
                },
            }


@pytest.mark.data
def test_all_9748_rows_are_read_or_refused_with_a_reason(
    shared_data: Path, rng: np.random.Generator
) -> None:
    counts: Counter[str] = Counter()
    residuals, half_deg = [], []
    for data in row_documents(shared_data):
        try:
            camera = profile_of(data).camera
        except ProfileError as error:
            counts[outcome(error)] += 1
            continue
        counts["read"] += 1
        check_accepted(camera)
        residuals.append(camera.table.residual_px)
        half_deg.append(np.degrees(camera.theta_max))
        if counts["read"] % 20 == 0:
            ray = rays(camera, rng, 50)
            ray = ray[ray[:, 2] > 0.02]
            assert np.abs(camera.project(ray) - opencv_pixels(camera, ray)).max() < 1e-6
    assert counts == {why: rows for why, (_, _, rows) in OUTCOMES.items() if rows}
    assert np.percentile(residuals, 93) < 0.01
    wide = np.array(half_deg) > 60
    assert wide.sum() > 1000
    assert np.array(residuals)[wide].max() < 0.025
