"""ROS camera_info YAML, as camera_calibration writes it or as `topic echo` prints the message."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..camera import make_camera
from ..errors import ProfileError
from ..lens import Lens, model_name
from ._document import Document, expect_mapping
from ._matrix import Matrix
from ._numbers import numbers, picture_size
from ._profile import Choice, Profile
from ._terms import (
    coefficients,
    fisheye,
    fisheye_terms,
    held_matrix,
    matrix_data,
    matrix_from_rows,
    rational,
    rational_terms,
    rows_of,
    without_skew,
)
from ._yaml_text import dump, heading

SUFFIX = ".yaml"
MODELS = ("kannala_brandt", "equidistant", "opencv_rational", "perspective")

COUNTS = {
    "plumb_bob": (0, 4, 5),
    "rational_polynomial": (8, 12, 14),
    "equidistant": (4,),
    "fisheye": (4,),  # what some drivers say for equidistant
}
FISHEYE = ("equidistant", "fisheye")


def recognises(document: Document) -> bool:
    data = document.yaml
    return isinstance(data, dict) and (_is_file(data) or _is_message(data))


def read(document: Document, choice: Choice) -> Profile:
    """The camera that took the raw picture: K and D, not the rectified picture's P.

    `equidistant` is OpenCV's fisheye model, here also beyond 90 degrees from the axis; the others
    are OpenCV's ordinary model, where a skew in K is ignored.
    """
    data = expect_mapping(document.yaml, "ROS camera_info", document.why_not_yaml)
    if not recognises(document):
        raise ProfileError(
            "not ROS camera_info: that has camera_matrix with rows, cols and data, or K and "
            f"distortion_model; the keys here are: {', '.join(list(data)[:20])}"
        )
    names = _MESSAGE if _is_message(data) else _FILE
    info = {name: _found(data, keys) for name, keys in names.items()}
    width, height, k, d = (_needed(info, name, names) for name in ("width", "height", "K", "D"))
    model, notes = _model(info["model"])
    matrix = _matrix(k)
    values = coefficients(matrix_data(d, "D"), COUNTS[model], f"D of a {model} camera")
    lens: Lens = fisheye(matrix.fx, values) if model in FISHEYE else rational(matrix.fx, values)
    if matrix.skew and model not in FISHEYE:
        notes.append(f"K has a skew of {matrix.skew:.4g}, which ROS ignores; so it is here")
        matrix = Matrix(matrix.fx, matrix.fy, matrix.cx, matrix.cy)
    size = picture_size([width, height], "width and height")
    camera = make_camera(size, lens, center=matrix.center, stretch=matrix.stretch)
    return Profile(camera, name=str(info["name"] or ""), notes=(*notes, *_notes(info)))


def write(profile: Profile) -> str:
    """A file as camera_calibration writes it, for a picture that is rectified to the same K."""
    camera = profile.camera
    matrix = without_skew(held_matrix(camera, MODELS, "ROS camera_info"), "ROS camera_info")
    if model_name(camera.lens) in ("kannala_brandt", "equidistant"):
        model, values = "equidistant", fisheye_terms(camera.lens)
    else:
        values = rational_terms(camera.lens, (5, 8), "ROS camera_info")
        model = "plumb_bob" if len(values) == 5 else "rational_polynomial"
    k = rows_of(matrix)
    data = {
        "image_width": camera.size[0],
        "image_height": camera.size[1],
        "camera_name": re.sub(r"[^A-Za-z0-9]+", "_", profile.name).strip("_") or "camera",
        "camera_matrix": _rows(3, k),
        "distortion_model": model,
        "distortion_coefficients": _rows(1, values),
        "rectification_matrix": _rows(3, np.eye(3).ravel().tolist()),
        "projection_matrix": _rows(3, [*k[0:3], 0.0, *k[3:6], 0.0, *k[6:9], 0.0]),
    }
    return heading(profile) + dump(data)


# what camera_calibration's files and the messages of ROS 1 and 2 call each thing
_FILE = {
    "width": ("image_width",),
    "height": ("image_height",),
    "name": ("camera_name",),
    "K": ("camera_matrix",),
    "model": ("distortion_model",),
    "D": ("distortion_coefficients",),
    "R": ("rectification_matrix",),
    "binning_x": (),
    "binning_y": (),
    "roi": (),
}
_MESSAGE = {
    "width": ("width",),
    "height": ("height",),
    "name": (),
    "K": ("k", "K"),
    "model": ("distortion_model",),
    "D": ("d", "D"),
    "R": ("r", "R"),
    "binning_x": ("binning_x",),
    "binning_y": ("binning_y",),
    "roi": ("roi",),
}


def _is_file(data: dict[str, Any]) -> bool:
    k = data.get("camera_matrix")
    return isinstance(k, dict) and "data" in k and "type_id" not in k  # OpenCV's have one


def _is_message(data: dict[str, Any]) -> bool:
    return "distortion_model" in data and _found(data, ("k", "K")) is not None


def _found(data: dict[str, Any], keys: Sequence[str]) -> Any:
    return next((data[key] for key in keys if key in data), None)


def _needed(info: dict[str, Any], name: str, names: Mapping[str, Sequence[str]]) -> Any:
    if info[name] is None:
        raise ProfileError(f"key '{names[name][0]}' is missing in ROS camera_info")
    return info[name]


def _model(said: Any) -> tuple[str, list[str]]:
    """The distortion model, and what is to be told about it."""
    if said in (None, ""):
        return "plumb_bob", ["no distortion_model is given: plumb_bob is assumed, as ROS does"]
    if not isinstance(said, str) or said not in COUNTS:
        raise ProfileError(
            f"distortion_model {said!r:.80} is not known; known: {', '.join(COUNTS)}"
        )
    return said, []


def _matrix(k: Any) -> Matrix:
    rows = numbers(matrix_data(k, "K"), 9, "K")
    if not any(rows):
        raise ProfileError("K is all zeros: this camera was never calibrated")
    return matrix_from_rows(rows, "K")


def _notes(info: dict[str, Any]) -> list[str]:
    notes = []
    if info["R"] is not None and matrix_data(info["R"], "R") != np.eye(3).ravel().tolist():
        notes.append("the rectification is not used: the picture is taken to be the raw one")
    binning = [info["binning_x"], info["binning_y"]]
    if any(step not in (None, 0, 1) for step in binning):
        notes.append(f"binning {binning!s:.40}: the numbers are for the picture before it")
    roi = info["roi"] if isinstance(info["roi"], dict) else {}
    whole = ([0, 0], [None, None], [info["width"], info["height"]])
    if [roi.get("width"), roi.get("height")] not in whole:
        notes.append("a roi is set: the numbers are for the whole picture, not for that part of it")
    return notes


def _rows(rows: int, data: list[float]) -> dict[str, Any]:
    return {"rows": rows, "cols": len(data) // rows, "data": data}
