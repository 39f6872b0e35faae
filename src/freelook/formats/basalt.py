"""Basalt calibration JSON (TUM-VI's too): kb4, ds, eucm, ucm, fov and pinhole cameras."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..camera import Camera, make_camera
from ..errors import ProfileError
from ..lens import (
    DoubleSphere,
    ExtendedUnified,
    FieldOfView,
    Lens,
    Mei,
    Perspective,
    model_name,
)
from ._document import Document, expect_mapping
from ._matrix import Matrix
from ._numbers import check_keys, number, picture_size
from ._profile import Choice, Profile
from ._terms import (
    RATIONAL,
    fisheye,
    fisheye_terms,
    held_matrix,
    rational,
    rational_terms,
    without_skew,
)

SUFFIX = ".json"
FOCALS = ("fx", "fy", "cx", "cy")


@dataclass(frozen=True)
class _Kind:
    """A camera_type: its parameters behind fx, fy, cx, cy, and the lens from fx and those."""

    names: tuple[str, ...]
    lens: Callable[[float, list[float]], Lens]


def _ucm(fx: float, values: list[float]) -> Lens:
    """Usenko et al. 2018, the unified model: u = fx x / (alpha d + (1 - alpha) z) + cx.

    Divided by 1 - alpha this is Mei's f x / (xi d + z) with xi = alpha / (1 - alpha) and
    f = fx / (1 - alpha).
    """
    (alpha,) = values
    if not 0 <= alpha < 1:
        raise ProfileError(f"alpha of a ucm camera must be from 0 to below 1, not {alpha}")
    return Mei(fx / (1 - alpha), alpha / (1 - alpha))


RADTAN8 = RATIONAL[:8]
KINDS = {
    "pinhole": _Kind((), lambda fx, values: Perspective(fx)),
    "kb4": _Kind(("k1", "k2", "k3", "k4"), fisheye),
    "ds": _Kind(("xi", "alpha"), lambda fx, values: DoubleSphere(fx, *values)),
    "eucm": _Kind(("alpha", "beta"), lambda fx, values: ExtendedUnified(fx, *values)),
    "ucm": _Kind(("alpha",), _ucm),
    "fov": _Kind(("w",), lambda fx, values: FieldOfView(fx, *values)),
    "pinhole-radtan8": _Kind(RADTAN8, rational),
}
MODELS = (
    *("kannala_brandt", "equidistant", "double_sphere", "eucm", "mei"),
    *("fov", "opencv_rational", "perspective"),
)

# Calibration() in basalt/calibration/calibration.hpp: what Basalt starts from without an IMU
WITHOUT_IMU = {
    "calib_accel_bias": [0.0] * 9,
    "calib_gyro_bias": [0.0] * 12,
    "imu_update_rate": 200.0,
    "accel_noise_std": [0.016] * 3,
    "gyro_noise_std": [0.000282] * 3,
    "accel_bias_std": [0.001] * 3,
    "gyro_bias_std": [0.0001] * 3,
    "cam_time_offset_ns": 0,
    "vignette": [],
}
ORIGIN = {"px": 0.0, "py": 0.0, "pz": 0.0, "qx": 0.0, "qy": 0.0, "qz": 0.0, "qw": 1.0}


def recognises(document: Document) -> bool:
    data = document.json
    value = data.get("value0") if isinstance(data, dict) else None
    return isinstance(value, dict) and "intrinsics" in value


def read(document: Document, choice: Choice) -> Profile:
    """One of the cameras, which are called cam0, cam1 ... in the order of the file.

    Formulas: Usenko, Demmel and Cremers, "The Double Sphere Camera Model", 3DV 2018, and
    basalt-headers (`basalt/camera`). Where the cameras sit is told and not used.
    """
    data = expect_mapping(document.json, "a Basalt calibration", document.why_not_json)
    value = expect_mapping(data.get("value0"), "value0")
    cameras, sizes = (_list(value, key) for key in ("intrinsics", "resolution"))
    if len(sizes) != len(cameras):
        raise ProfileError(f"{len(cameras)} intrinsics and {len(sizes)} resolutions in value0")
    names = [f"cam{i}" for i in range(len(cameras))]
    i = choice.of(names)
    size = picture_size(sizes[i], f"resolution[{i}]")
    camera = _camera(size, expect_mapping(cameras[i], f"intrinsics[{i}]"), names[i])
    return Profile(camera, name=f"Basalt {names[i]}", notes=tuple(_notes(value, i)))


def write(profile: Profile) -> str:
    """A calibration of one camera and no IMU: what Basalt has before it knows one."""
    camera = profile.camera
    matrix = without_skew(held_matrix(camera, MODELS, "Basalt"), "Basalt")
    kind, values = _said(camera.lens)
    # a unified camera's fx is Mei's f over 1 + xi
    scale = 1 + camera.lens.xi if isinstance(camera.lens, Mei) else 1.0
    k = (matrix.fx / scale, matrix.fy / scale, matrix.cx, matrix.cy)
    names = (*FOCALS, *KINDS[kind].names)
    intrinsics = dict(zip(names, (*k, *values), strict=True))
    if kind == "pinhole-radtan8":
        intrinsics["rpmax"] = -1.0  # Basalt then finds itself where the lens folds
    data = {
        "T_imu_cam": [ORIGIN],
        "intrinsics": [{"camera_type": kind, "intrinsics": intrinsics}],
        "resolution": [list(camera.size)],
        **WITHOUT_IMU,
    }
    return json.dumps({"value0": data}, indent=4) + "\n"


def _list(value: dict[str, Any], key: str) -> list[Any]:
    found = value.get(key)
    if not isinstance(found, list) or not found:
        raise ProfileError(f"value0.{key} must be a list with one entry per camera")
    return found


def _camera(size: tuple[int, int], cam: dict[str, Any], name: str) -> Camera:
    kind = cam.get("camera_type")
    if not isinstance(kind, str) or kind not in KINDS:
        raise ProfileError(f"camera_type {kind!r:.80} of {name} is not known: {', '.join(KINDS)}")
    names, where = KINDS[kind].names, f"intrinsics of {name} ({kind})"
    values = expect_mapping(cam.get("intrinsics"), where)
    check_keys(values, {*FOCALS, *names}, {"rpmax"} if kind == "pinhole-radtan8" else set(), where)
    found = {key: number(value, f"{key} in the {where}") for key, value in values.items()}
    matrix = Matrix(*(found[key] for key in FOCALS))
    lens = KINDS[kind].lens(matrix.fx, [found[key] for key in names])
    camera = make_camera(size, lens, center=matrix.center, stretch=matrix.stretch)
    reach = found.get("rpmax", 0.0)  # the largest tan(theta); 0 and -1 say that there is none
    if reach <= 0:
        return camera
    return replace(camera, theta_max=min(camera.theta_max, float(np.arctan(reach))))


def _notes(value: dict[str, Any], i: int) -> list[str]:
    notes = []
    poses = value.get("T_imu_cam")
    if isinstance(poses, list) and i < len(poses) and poses[i] != ORIGIN:
        notes.append(f"T_imu_cam (where the camera sits) is not used: {poses[i]!s:.300}")
    if value.get("cam_time_offset_ns"):
        notes.append(f"cam_time_offset_ns = {value['cam_time_offset_ns']!s:.40} is not used")
    if value.get("vignette"):
        notes.append("vignette is not used")
    return notes


def _said(lens: Lens) -> tuple[str, list[float]]:
    """(camera_type, the values behind fx, fy, cx, cy)."""
    if isinstance(lens, DoubleSphere):
        return "ds", [lens.xi, lens.alpha]
    if isinstance(lens, ExtendedUnified):
        return "eucm", [lens.alpha, lens.beta]
    if isinstance(lens, FieldOfView):
        return "fov", [lens.w]
    if isinstance(lens, Mei):
        if any((lens.k1, lens.k2, lens.k3, lens.p1, lens.p2)) or lens.xi < 0:
            raise ProfileError(
                "of mei lenses Basalt can only say those with xi from 0 and no distortion (ucm); "
                "convert to another with --model, as double_sphere or kannala_brandt"
            )
        return "ucm", [lens.xi / (1 + lens.xi)]
    if model_name(lens) in ("kannala_brandt", "equidistant"):
        return "kb4", fisheye_terms(lens)
    terms = rational_terms(lens, (8,), "Basalt")
    return ("pinhole-radtan8", terms) if any(terms) else ("pinhole", [])
