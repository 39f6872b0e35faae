"""Gyroflow's lens profiles: JSON with calib_dimension, fisheye_params, distortion_model.

What the fields mean is what Gyroflow does with them (`src/core/lens_profile.rs`,
`stabilization/frame_transform.rs` and `stabilization/distortion_models`):

- The camera matrix is for a picture of `calib_dimension`, and of it only fx, fy, cx, cy are used.
- Unless the profile is `asymmetrical`, the axis is in the middle of the picture and cx, cy are
  not used: a profile is made for everybody's camera, not for one.
- `input_horizontal_stretch` and `input_vertical_stretch` lead from the video's picture to that of
  `calib_dimension`; the camera here is for the video's.
- Coefficients that are all 0 mean a perspective lens, not an equidistant one.
- `radial_distortion_limit` is the tangent of the largest angle. Newer versions write the angle
  itself, in radians, where the radius stops growing; that end is found here anyway.

Gyroflow's fisheye models end at 90 degrees from the axis; here they go on to where their radius
stops growing. See `_trust` for what is refused.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..camera import Camera, make_camera
from ..errors import ProfileError
from ..lens import Lens, growth_limit, parameters
from ._document import Document, expect_mapping
from ._gyroflow_models import LENSES, MODELS, coefficients_of, lens_of
from ._matrix import Matrix, matrix_of
from ._numbers import number, numbers, picture_size
from ._profile import Choice, Profile
from ._trust import GOOD_RMS_PX, check_curve, check_matrix, check_rms, middle, reaches_the_corners

SUFFIX = ".json"
__all__ = ["MODELS", "SUFFIX", "read", "recognises", "write"]


@dataclass(frozen=True)
class _Calibration:
    """What of a profile makes the camera, in pixels of a picture of `size`."""

    size: tuple[int, int]
    matrix: Matrix
    lens: Lens
    asymmetrical: bool
    limit: float | None
    stretch: tuple[float, float]
    rms_px: float | None


def recognises(document: Document) -> bool:
    data = document.json
    return isinstance(data, dict) and "fisheye_params" in data and "calib_dimension" in data


def read(document: Document, choice: Choice) -> Profile:
    """The camera of a profile, for the video's picture; ProfileError for one that is no lens."""
    data = expect_mapping(document.json, "the lens profile")
    found = _calibration(data)
    if found.rms_px is not None:
        check_rms(found.rms_px)
    check_matrix(found.matrix, found.size)
    camera = make_camera(
        found.size,
        found.lens,
        center=found.matrix.center if found.asymmetrical else None,
        stretch=found.matrix.stretch,
    )
    if found.limit is not None:
        camera = replace(camera, theta_max=min(camera.theta_max, found.limit))
    check_curve(camera, whole_picture=found.limit is None, remedy=_how_to_narrow)
    return Profile(_unstretched(camera, found.stretch), _name(data), _source(data), _notes(found))


def write(profile: Profile) -> str:
    """A profile that Gyroflow loads, and gives the same picture.

    What it cannot say is left out: the mounting, and the end of a field of 90 degrees to each side
    or more. ProfileError for a stretch with a skew.
    """
    camera = profile.camera
    model, coefficients = coefficients_of(camera.lens)
    matrix = matrix_of(camera, parameters(camera.lens)["f"], "Gyroflow")  # type: ignore[arg-type]
    if abs(matrix.skew) > 1e-9 * matrix.fx:
        raise ProfileError("a Gyroflow profile has no skew, and this camera's stretch has one")
    size = {"w": camera.size[0], "h": camera.size[1]}
    centred = np.allclose(camera.center, middle(camera.size), rtol=0, atol=1e-9)
    data: dict[str, Any] = {
        "name": profile.name,
        "note": profile.source,
        "calibrated_by": "",
        "camera_brand": "",
        "camera_model": "",
        "lens_model": "",
        "camera_setting": "",
        "calib_dimension": size,
        "orig_dimension": size,
        "output_dimension": size,
        "frame_readout_time": None,
        "gyro_lpf": None,
        "input_horizontal_stretch": 1.0,
        "input_vertical_stretch": 1.0,
        "num_images": 0,
        "fps": 0.0,
        "crop": None,
        "official": False,
        "asymmetrical": not centred,
        "fisheye_params": {
            "RMS_error": 0.0,
            "camera_matrix": [
                [matrix.fx, 0.0, matrix.cx],
                [0.0, matrix.fy, matrix.cy],
                [0.0, 0.0, 1.0],
            ],
            "distortion_coeffs": coefficients,
            "radial_distortion_limit": _limit_of(camera),
        },
        "identifier": "",
        "calibrator_version": "freelook",  # must not be empty
        "date": "",
        "compatible_settings": [],
        "sync_settings": None,
        "distortion_model": model,
        "digital_lens": None,
        "digital_lens_params": None,
        "interpolations": None,
        "focal_length": None,
        "crop_factor": None,
        "global_shutter": False,
    }
    return json.dumps(data, indent=2) + "\n"


def _calibration(data: Mapping[str, Any]) -> _Calibration:
    _refuse_pictures_changed_after_the_lens(data)
    dimension = expect_mapping(data.get("calib_dimension"), "calib_dimension")
    size = picture_size([dimension.get("w"), dimension.get("h")], "calib_dimension")
    params = expect_mapping(data.get("fisheye_params"), "fisheye_params")
    matrix = _matrix(params.get("camera_matrix"), data.get("crop"))
    lens = lens_of(_model(data), matrix.fx, params.get("distortion_coeffs"))
    rms = params.get("RMS_error")
    return _Calibration(
        size,
        matrix,
        lens,
        bool(data.get("asymmetrical", False)),
        _limit(params.get("radial_distortion_limit"), lens),
        (
            _stretch(data.get("input_horizontal_stretch"), "input_horizontal_stretch"),
            _stretch(data.get("input_vertical_stretch"), "input_vertical_stretch"),
        ),
        number(rms, "RMS_error") if rms is not None else None,
    )


def _refuse_pictures_changed_after_the_lens(data: Mapping[str, Any]) -> None:
    digital = data.get("digital_lens") or ("gopro_superview" if data.get("is_superview") else None)
    if digital:
        raise ProfileError(
            f"digital_lens is {digital!r:.80}: the camera bends its picture after the lens, which "
            "is not known here; record without it, in the camera's plain wide mode"
        )


def _model(data: Mapping[str, Any]) -> str:
    """The distortion model's name, checked; older versions had a number or a pair of switches."""
    name = data.get("distortion_model")
    if name is None:
        if data.get("distortion_model_id") or data.get("use_opencv_standard"):
            raise ProfileError("the model is given in an old way; save it with a newer Gyroflow")
        return "opencv_fisheye"
    if not isinstance(name, str) or name not in LENSES:
        raise ProfileError(f"unknown distortion_model {name!r:.80}; known: {', '.join(LENSES)}")
    return name


def _matrix(rows: Any, crop: Any) -> Matrix:
    if not isinstance(rows, list) or len(rows) != 3:
        raise ProfileError("camera_matrix must be three rows of three numbers")
    k = np.array([numbers(row, 3, f"camera_matrix[{i}]") for i, row in enumerate(rows)])
    if k[0, 1] != 0:
        raise ProfileError(f"camera_matrix has a skew of {k[0, 1]:g}, which Gyroflow never writes")
    zoom = 1.0 if crop is None else number(crop, "crop")
    if zoom <= 0:
        raise ProfileError(f"crop must be above 0, not {zoom:g}")
    return Matrix(k[0, 0] / zoom, k[1, 1] / zoom, k[0, 2], k[1, 2])


def _limit(value: Any, lens: Lens) -> float | None:
    """Half of the field in radians, or None where the profile does not narrow it."""
    if value is None or value == 0:
        return None
    limit = number(value, "radial_distortion_limit")
    if limit < 0:
        raise ProfileError(f"radial_distortion_limit must be above 0, not {limit:g}")
    if abs(limit - growth_limit(lens)) < 1e-3:  # a newer version's, and no news
        return None
    return float(np.arctan(limit))


def _stretch(value: Any, where: str) -> float:
    """The factor; Gyroflow takes what is missing or next to 0 for 1."""
    factor = 1.0 if value is None else number(value, where)
    return factor if factor > 0.01 else 1.0


def _unstretched(camera: Camera, stretch: tuple[float, float]) -> Camera:
    """The camera for the video's own picture."""
    if stretch == (1.0, 1.0):
        return camera
    width, height = (max(2, round(n / s)) for n, s in zip(camera.size, stretch, strict=True))
    return camera.resized((width, height))


def _name(data: Mapping[str, Any]) -> str:
    words = [data.get(key) for key in ("camera_brand", "camera_model", "lens_model")]
    words.append(data.get("camera_setting") or data.get("note"))
    said = " ".join(word for word in words if isinstance(word, str) and word)
    if data.get("camera_brand") and said:
        return said
    return str(data.get("name") or said)


def _source(data: Mapping[str, Any]) -> str:
    by, date, pictures = (data.get(key) for key in ("calibrated_by", "date", "num_images"))
    parts = [f"by {by}" if by else "", f"on {date}" if date else ""]
    parts.append(f"from {pictures} pictures" if pictures else "")
    said = " ".join(part for part in parts if part)
    return f"Gyroflow lens profile, calibrated {said}" if said else "Gyroflow lens profile"


def _notes(found: _Calibration) -> tuple[str, ...]:
    notes = []
    if found.rms_px:
        rough = "" if found.rms_px < GOOD_RMS_PX else f"; good ones are below {GOOD_RMS_PX:g}"
        notes.append(f"calibration error {found.rms_px:.2f} px RMS{rough}")
    shift = np.hypot(*(np.array(found.matrix.center) - middle(found.size)))
    if not found.asymmetrical and shift > 1:
        notes.append(
            f"the calibration found the axis at ({found.matrix.cx:.1f}, {found.matrix.cy:.1f}), "
            f"{shift:.1f} px from the middle; as in Gyroflow the middle is used, unless the "
            'profile says "asymmetrical": true'
        )
    if found.stretch != (1.0, 1.0):
        across, down = found.stretch
        notes.append(f"for the picture before Gyroflow stretches it {across:g} x {down:g}")
    if found.limit is not None:
        notes.append(f"field ends at {np.degrees(found.limit):.1f} degrees from the axis, it says")
    return tuple(notes)


def _how_to_narrow(half_deg: float) -> str:
    limit = np.tan(np.radians(half_deg))
    return (
        f'to use it up to {half_deg:.1f} degrees only, set "radial_distortion_limit": {limit:.4g} '
        "in the file"
    )


def _limit_of(camera: Camera) -> float | None:
    """radial_distortion_limit where the field ends before both picture and 90 degrees do."""
    if camera.theta_max > np.pi / 2 - 1e-6 or reaches_the_corners(camera):
        return None
    return float(np.tan(camera.theta_max))
