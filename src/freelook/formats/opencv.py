"""OpenCV FileStorage (YAML, JSON, XML): camera_matrix and distortion_coefficients, or K and D."""

from __future__ import annotations

import re
from typing import Any

from ..camera import make_camera
from ..errors import ProfileError
from ..lens import Lens, Mei, model_name
from ._document import Document
from ._filestorage import flat, found, needed, plain_key, storage
from ._matrix import Matrix
from ._numbers import check_keys, number, numbers, picture_size
from ._profile import Choice, Profile
from ._terms import (
    coefficients,
    fisheye,
    fisheye_terms,
    held_matrix,
    matrix_from_rows,
    rational,
    rational_terms,
    rows_of,
    without_skew,
)
from ._yaml_text import heading, real

SUFFIX = ".yml"
MODELS = ("kannala_brandt", "equidistant", "opencv_rational", "perspective", "mei")

# as people spell them, without case and underscores
MATRIX = ("cameramatrix", "k", "mtx", "intrinsicmatrix")
TERMS = ("distortioncoefficients", "distcoeffs", "distcoeff", "distortioncoeffs", "dist", "d")
SIZE = ("imagesize", "imagesizewh", "resolution")
WIDTH, HEIGHT = ("imagewidth", "width"), ("imageheight", "height")
FLAG = ("fisheyemodel", "fisheye", "isfisheye", "usefisheye")
WORDS = ("model", "cameramodel", "distortionmodel", "lensmodel", "calibrationmodel")
ERROR = ("avgreprojectionerror", "reprojectionerror", "rms", "rmserror")

KINDS = {  # what names each of OpenCV's three models
    "fisheye": re.compile(r"fisheye|equidistant|kannala"),
    "omnidir": re.compile(r"omni|\bmei\b"),
    "pinhole": re.compile(r"pinhole|radtan|plumb|rational|brown"),
}
COUNTS = {"fisheye": (4,), "omnidir": (4,), "pinhole": (0, 4, 5, 8, 12, 14)}
SMALL = {"K", "D", "image_size_wh"}
SMALL_OPTIONAL = {"model", "note", "field_deg"}


def recognises(document: Document) -> bool:
    data = storage(document)
    k = next((value for key, value in data.items() if plain_key(key) in MATRIX), None)
    if isinstance(k, dict):
        return str(k.get("type_id", "")).startswith("opencv-")
    return isinstance(k, list) and any(isinstance(row, list) for row in k)


def read(document: Document, choice: Choice) -> Profile:
    """The camera of `cv2.fisheye`, `cv2.omnidir` or OpenCV's ordinary (pinhole) model.

    Four coefficients alone do not tell fisheye from pinhole: where the file does not say which it
    is, `FILE#fisheye` or `FILE#pinhole` does, and nothing is guessed. Rays beyond 90 degrees,
    where OpenCV's own fisheye functions end, are ordinary rays here.
    """
    data = storage(document)
    if not data:
        raise ProfileError(f"not OpenCV's FileStorage{_why_not(document)}")
    if document.looks_like_json and _is_small(data):
        return _read_small(data)
    name, k = needed(data, MATRIX, "a camera matrix")
    matrix = matrix_from_rows(numbers(flat(k, name), 9, name), name)
    name, d = needed(data, TERMS, "distortion coefficients")
    values = numbers(flat(d, name), range(33), name)
    kind = _kind(data, len(values), choice)
    notes = _notes(data)
    if kind == "pinhole" and matrix.skew:
        notes.append(f"K has a skew of {matrix.skew:.4g}, which OpenCV ignores; so it is here")
        matrix = Matrix(matrix.fx, matrix.fy, matrix.cx, matrix.cy)
    lens = _lens(kind, matrix.fx, coefficients(values, COUNTS[kind], f"{name} ({kind})"), data)
    camera = make_camera(_size(data, choice), lens, center=matrix.center, stretch=matrix.stretch)
    return Profile(camera, notes=tuple(notes))


def write(profile: Profile) -> str:
    """FileStorage YAML, as OpenCV's own calibration programs write and read it."""
    camera = profile.camera
    matrix = held_matrix(camera, MODELS, "OpenCV")
    last = "fisheye_model: 1"
    if isinstance(camera.lens, Mei):
        terms, last = _omnidir_terms(camera.lens), f"xi: {real(camera.lens.xi)}"
    elif model_name(camera.lens) in ("kannala_brandt", "equidistant"):
        terms = fisheye_terms(camera.lens)
    else:
        matrix, last = without_skew(matrix, "OpenCV's ordinary model"), "fisheye_model: 0"
        terms = rational_terms(camera.lens, (5, 8, 12, 14), "OpenCV")
    return (
        f"%YAML:1.0\n---\n{heading(profile)}"
        f"image_width: {camera.size[0]}\nimage_height: {camera.size[1]}\n"
        f"{_matrix_text('camera_matrix', 3, rows_of(matrix))}"
        f"{_matrix_text('distortion_coefficients', len(terms), terms)}{last}\n"
    )


def _why_not(document: Document) -> str:
    reasons = (
        document.why_not_json if document.looks_like_json else document.why_not_yaml,
        document.why_not_xml if document.looks_like_xml else "",
    )
    return "".join(f": {reason}" for reason in reasons if reason)


def _kind(data: dict[str, Any], count: int, choice: Choice) -> str:
    said = _said(data)
    if len(said) > 1:
        raise ProfileError(f"the file says that it is {' and '.join(sorted(said))}; it is one")
    if not said and count != 4:
        said = {"pinhole"}
    if said:
        choice.of(sorted(said))
        return said.pop()
    if choice.pick in ("fisheye", "pinhole"):
        return choice.pick
    raise ProfileError(
        "four distortion coefficients mean one lens in OpenCV's fisheye model and another in its "
        "ordinary one, and the file does not say which it is: name it FILE#fisheye or "
        "FILE#pinhole, or add a line 'fisheye_model: 1' (or 0)"
    )


def _said(data: dict[str, Any]) -> set[str]:
    """Every kind of camera that something in the file names."""
    said = {"omnidir"} if found(data, ("xi",))[0] else set()
    flag, is_fisheye = found(data, FLAG)
    if flag:
        if is_fisheye not in (0, 1):
            raise ProfileError(f"{flag} must be 1 or 0, not {is_fisheye!r:.80}")
        said.add("fisheye" if is_fisheye else "pinhole")
    for key, text in data.items():
        if plain_key(key) in WORDS and isinstance(text, str):
            said |= {kind for kind, words in KINDS.items() if words.search(text.lower())}
    return said


def _lens(kind: str, fx: float, terms: list[float], data: dict[str, Any]) -> Lens:
    if kind == "fisheye":
        return fisheye(fx, terms)
    if kind == "pinhole":
        return rational(fx, terms)
    name, xi = needed(data, ("xi",), "xi, which an omnidir camera has,")
    (xi,) = numbers(flat(xi, name), 1, name)
    return Mei(fx, xi, **dict(zip(("k1", "k2", "p1", "p2"), terms, strict=True)))


def _size(data: dict[str, Any], choice: Choice) -> tuple[int, int]:
    name, size = found(data, SIZE)
    if name:
        return picture_size(flat(size, name), name)
    (width_name, width), (height_name, height) = found(data, WIDTH), found(data, HEIGHT)
    if width_name and height_name:
        return picture_size([width, height], f"{width_name} and {height_name}")
    return choice.needed_size("the file does not say how large the picture is")


def _notes(data: dict[str, Any]) -> list[str]:
    name, error = found(data, ERROR)
    if not isinstance(error, float) or not 0 < error < 1e6:
        return []
    return [f"{name} of that calibration, as the file says: {error:.3g} pixels"]


def _omnidir_terms(lens: Mei) -> list[float]:
    if lens.k3:
        raise ProfileError("OpenCV's omnidir model has no place for k3 of this mei lens")
    return [lens.k1, lens.k2, lens.p1, lens.p2]


def _matrix_text(name: str, rows: int, data: list[float]) -> str:
    return (
        f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {len(data) // rows}\n   dt: d\n"
        f"   data: [ {', '.join(map(real, data))} ]\n"
    )


def _is_small(data: dict[str, Any]) -> bool:
    """Whether it is the small JSON with lists: K, D, image_size_wh."""
    return "K" in data and "D" in data and isinstance(data["K"], list)


def _read_small(data: dict[str, Any]) -> Profile:
    where = "OpenCV fisheye parameters"
    check_keys(data, SMALL, SMALL_OPTIONAL, where)
    model = data.get("model", "fisheye")
    if not isinstance(model, str) or "fisheye" not in model.lower():
        raise ProfileError(f"model is {model!r:.80}; only OpenCV's fisheye model can be read here")
    if not isinstance(data["K"], list) or len(data["K"]) != 3:
        raise ProfileError("K must be three rows of three numbers")
    rows = [numbers(row, 3, f"K[{i}]") for i, row in enumerate(data["K"])]
    matrix = matrix_from_rows([item for row in rows for item in row], "K")
    camera = make_camera(
        picture_size(data["image_size_wh"], "image_size_wh"),
        fisheye(matrix.fx, coefficients(flat(data["D"], "D"), COUNTS["fisheye"], "D")),
        center=matrix.center,
        field_deg=number(data["field_deg"], "field_deg") if "field_deg" in data else None,
        stretch=matrix.stretch,
    )
    unsaid = "no model is given: taken for OpenCV's fisheye model, not its ordinary one"
    return Profile(camera, notes=() if "model" in data else (unsaid,))
