"""py-OCamCalib's JSON: taylor_coefficient, distortion_center, stretch_matrix, inverse_poly.

Scaramuzza's lens as in OCamCalib's text file, with every convention the other way round:

    taylor_coefficient    the direct polynomial, ascending, a0 > 0: z is forward
    distortion_center     (x, y): column first; (0, 0) is the middle of the top-left pixel
    stretch_matrix        [[c, d], [e, 1]] on (x, y)
    inverse_poly          rho as a function of the angle from the axis, descending

Source: `modelling/camera.py` of jakarto3d/py-OCamCalib (cam2world, load_parameters). Its
`world2cam` computes y from the already stretched x; the matrix is taken as it stands, as its
`cam2world` does, and a note says where that makes a difference. The picture's size is not in its
files; `write` adds image_width and image_height, which its own program does not look at.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ..camera import Camera, make_camera
from ..errors import ProfileError
from ._document import Document, expect_mapping
from ._field import field_notes
from ._numbers import number, numbers, picture_size
from ._ocam import (
    MOST_DIRECT_TERMS,
    MOST_TERMS,
    check_inverse,
    expect_ocam,
    fit_inverse,
    lens_of,
    scaled,
)
from ._profile import Choice, Profile

SUFFIX = ".json"
MODELS = ("ocamcalib",)
NEEDED = ("taylor_coefficient", "distortion_center", "stretch_matrix")
SEEN_PX = 0.01  # below this nobody sees which of its two ways of stretching is meant


def recognises(document: Document) -> bool:
    data = document.json
    return isinstance(data, dict) and "taylor_coefficient" in data


def read(document: Document, choice: Choice) -> Profile:
    """The camera of the direct polynomial; notes say how good the inverse one is."""
    data = expect_mapping(document.json, "py-OCamCalib's calibration")
    for key in NEEDED:
        if key not in data:
            raise ProfileError(f"key '{key}' is missing; needed: {', '.join(NEEDED)}")
    direct = numbers(
        data["taylor_coefficient"], range(3, MOST_DIRECT_TERMS + 1), "taylor_coefficient"
    )
    if direct[0] <= 0:
        raise ProfileError(
            f"taylor_coefficient[0] must be positive here, not {direct[0]:g}: its z is forward; "
            "OCamCalib's own, negative ones stand in a text file"
        )
    x, y = numbers(data["distortion_center"], 2, "distortion_center")
    camera = make_camera(
        _size(data, choice), lens_of(direct), center=(x, y), stretch=_stretch(data)
    )
    return Profile(camera, str(data.get("camera_name", "")), _source(data), _notes(data, camera))


def write(profile: Profile) -> str:
    """The JSON text, with an inverse polynomial fitted as py-OCamCalib does: the lowest degree
    that is good to 0.01 px, here over the lens's field, or the best up to 25;
    inverse_poly_error_px says how good."""
    camera = profile.camera
    scale = float(camera.stretch[1, 1])
    if scale <= 0:
        raise ProfileError(f"py-OCamCalib cannot turn the picture: {camera.stretch.tolist()}")
    inverse = fit_inverse(camera, 0.0)
    data = {
        "camera_name": profile.name,
        "taylor_coefficient": scaled(expect_ocam(camera, "py-OCamCalib"), scale).coefficients,
        "distortion_center": camera.center,
        "stretch_matrix": (camera.stretch / scale).tolist(),
        "inverse_poly": [c * scale for c in reversed(inverse.coefficients)],
        "inverse_poly_error_px": inverse.error_px * scale,
        "image_width": camera.size[0],
        "image_height": camera.size[1],
    }
    return json.dumps(data, indent=4) + "\n"


def _size(data: dict[str, Any], choice: Choice) -> tuple[int, int]:
    if "image_width" in data and "image_height" in data:
        return picture_size([data["image_width"], data["image_height"]], "image_width, _height")
    return choice.needed_size("py-OCamCalib's files do not say how large the picture is")


def _stretch(data: dict[str, Any]) -> np.ndarray[Any, np.dtype[np.float64]]:
    rows = data["stretch_matrix"]
    if not isinstance(rows, list) or len(rows) != 2:
        raise ProfileError(f"stretch_matrix must be two rows of two numbers, not {rows!r:.80}")
    return np.array([numbers(row, 2, f"stretch_matrix[{i}]") for i, row in enumerate(rows)])


def _source(data: dict[str, Any]) -> str:
    words = ["py-OCamCalib"]
    if isinstance(data.get("date"), str) and data["date"]:
        words.append(data["date"][:40])
    if isinstance(data.get("rms_overall"), (int, float)):
        # it is called RMS there and is the mean of the distances
        words.append(f"mean error {number(data['rms_overall'], 'rms_overall'):.3g} px")
    return ", ".join(words)


def _notes(data: dict[str, Any], camera: Camera) -> tuple[str, ...]:
    notes: tuple[str, ...] = ()
    if "inverse_poly" in data:
        inverse = numbers(data["inverse_poly"], range(1, MOST_TERMS + 1), "inverse_poly")
        notes = check_inverse(camera, inverse[::-1], 0.0)
    (c, d), (e, _) = camera.stretch
    rim = float(camera.lens.radius(np.array([camera.theta_max]))[0])
    otherwise = abs(e) * rim * float(np.hypot(c - 1, d))
    if otherwise > SEEN_PX:
        notes += (
            f"py-OCamCalib's world2cam puts points up to {otherwise:.2g} px higher or lower: it "
            "stretches y by the x it has stretched before; stretch_matrix is used as it stands, "
            "as in its cam2world",
        )
    return notes + field_notes(camera)
