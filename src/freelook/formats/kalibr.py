"""Kalibr camchain YAML: cam0, cam1 ... as pinhole, omni, double sphere (ds) or eucm cameras."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

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
from ._numbers import numbers, picture_size
from ._profile import Choice, Profile
from ._terms import (
    coefficients,
    fisheye,
    fisheye_terms,
    held_matrix,
    rational,
    rational_terms,
    without_skew,
)
from ._yaml_text import dump, heading

SUFFIX = ".yaml"
NEEDED = ("camera_model", "intrinsics", "distortion_model", "distortion_coeffs", "resolution")
CAMERA = re.compile(r"cam\d+")


@dataclass(frozen=True)
class _Kind:
    """One pair of camera_model and distortion_model.

    front  what stands in `intrinsics` before fu, fv, pu, pv
    count  how many distortion_coeffs there are
    lens   from fu, the values in front, and the coefficients
    """

    front: tuple[str, ...]
    count: int
    lens: Callable[[float, list[float], list[float]], Lens]


def _mei(fu: float, front: list[float], d: list[float]) -> Lens:
    return Mei(fu, front[0], **dict(zip(("k1", "k2", "p1", "p2"), d, strict=False)))


KINDS = {
    ("pinhole", "none"): _Kind((), 0, lambda fu, front, d: Perspective(fu)),
    ("pinhole", "radtan"): _Kind((), 4, lambda fu, front, d: rational(fu, d)),
    ("pinhole", "equidistant"): _Kind((), 4, lambda fu, front, d: fisheye(fu, d)),
    ("pinhole", "fov"): _Kind((), 1, lambda fu, front, d: FieldOfView(fu, *d)),
    ("omni", "none"): _Kind(("xi",), 0, _mei),
    ("omni", "radtan"): _Kind(("xi",), 4, _mei),
    ("ds", "none"): _Kind(("xi", "alpha"), 0, lambda fu, front, d: DoubleSphere(fu, *front)),
    ("eucm", "none"): _Kind(("alpha", "beta"), 0, lambda fu, front, d: ExtendedUnified(fu, *front)),
}
MODELS = (
    *("kannala_brandt", "equidistant", "double_sphere", "eucm", "mei"),
    *("fov", "opencv_rational", "perspective"),
)


def recognises(document: Document) -> bool:
    data = document.yaml
    return isinstance(data, dict) and bool(_cameras(data))


def read(document: Document, choice: Choice) -> Profile:
    """One camera of the chain. `equidistant` is OpenCV's fisheye model, here also beyond 90
    degrees from the axis; where the cameras sit is told and not used."""
    data = expect_mapping(document.yaml, "a Kalibr camchain", document.why_not_yaml)
    names = _cameras(data)
    if not names:
        raise ProfileError("no camera in it: a Kalibr camchain has cam0, cam1 ...")
    name = names[choice.of(names)]
    camera = _camera(data[name], name)
    return Profile(camera, name=f"Kalibr {name}", notes=tuple(_notes(data[name])))


def write(profile: Profile) -> str:
    """A chain of one camera, cam0."""
    camera = profile.camera
    matrix = without_skew(held_matrix(camera, MODELS, "Kalibr"), "Kalibr")
    kind, front, terms = _said(camera.lens)
    if min(camera.center) < 0:
        raise ProfileError(f"Kalibr refuses a centre outside the picture: {camera.center}")
    cam0 = {
        "cam_overlaps": [],
        "camera_model": kind[0],
        "distortion_coeffs": terms,
        "distortion_model": kind[1],
        "intrinsics": [*front, matrix.fx, matrix.fy, matrix.cx, matrix.cy],
        "resolution": list(camera.size),
        "rostopic": "/cam0/image_raw",
    }
    return heading(profile) + dump({"cam0": cam0})


def _cameras(data: dict[str, Any]) -> list[str]:
    return [name for name, cam in data.items() if CAMERA.fullmatch(name) and isinstance(cam, dict)]


def _camera(cam: dict[str, Any], name: str) -> Camera:
    missing = [key for key in NEEDED if key not in cam]
    if missing:
        raise ProfileError(f"key '{missing[0]}' is missing in {name}; needed: {', '.join(NEEDED)}")
    pair = (cam["camera_model"], cam["distortion_model"])
    kind = KINDS.get(pair) if all(isinstance(word, str) for word in pair) else None
    if kind is None:
        known = ", ".join("+".join(pair) for pair in KINDS)
        raise ProfileError(f"{name} is {pair[0]!r:.40} + {pair[1]!r:.40}; known: {known}")
    order = ", ".join((*kind.front, "fu", "fv", "pu", "pv"))
    where = f"intrinsics [{order}] of {name}"
    *front, fu, fv, pu, pv = numbers(cam["intrinsics"], len(kind.front) + 4, where)
    found = cam["distortion_coeffs"] if cam["distortion_coeffs"] is not None else []
    terms = coefficients(found, [kind.count], f"distortion_coeffs of {name}")
    matrix = Matrix(fu, fv, pu, pv)
    return make_camera(
        picture_size(cam["resolution"], f"resolution of {name}"),
        kind.lens(fu, front, terms),
        center=matrix.center,
        stretch=matrix.stretch,
    )


def _notes(cam: dict[str, Any]) -> list[str]:
    notes = []
    for key in cam:
        if key.startswith("T_"):  # T_cam_imu, T_cn_cnm1, and what other programs add
            notes.append(f"{key} (where the camera sits) is not used: {cam[key]!s:.300}")
    shift = cam.get("timeshift_cam_imu")
    if isinstance(shift, float) and shift:
        notes.append(f"timeshift_cam_imu is not used: t_imu = t_cam + ({shift:.6f} s)")
    return notes


def _said(lens: Lens) -> tuple[tuple[str, str], list[float], list[float]]:
    """(camera_model and distortion_model, what stands before fu, distortion_coeffs)."""
    if isinstance(lens, DoubleSphere):
        if not 0 <= lens.alpha < 1:
            raise ProfileError(f"Kalibr refuses an alpha outside [0, 1) of ds: {lens.alpha}")
        return ("ds", "none"), [lens.xi, lens.alpha], []
    if isinstance(lens, ExtendedUnified):
        return ("eucm", "none"), [lens.alpha, lens.beta], []
    if isinstance(lens, FieldOfView):
        return ("pinhole", "fov"), [], [lens.w]
    if isinstance(lens, Mei):
        return _said_omni(lens)
    if model_name(lens) in ("kannala_brandt", "equidistant"):
        return ("pinhole", "equidistant"), [], fisheye_terms(lens)
    terms = rational_terms(lens, (4,), "Kalibr")
    return ("pinhole", "radtan" if any(terms) else "none"), [], terms if any(terms) else []


def _said_omni(lens: Mei) -> tuple[tuple[str, str], list[float], list[float]]:
    if lens.k3:
        raise ProfileError("Kalibr has no place for k3 of this mei lens")
    if lens.xi < 0:
        raise ProfileError(f"Kalibr refuses an xi below 0, and this lens has {lens.xi}")
    terms = [lens.k1, lens.k2, lens.p1, lens.p2]
    return ("omni", "radtan" if any(terms) else "none"), [lens.xi], terms if any(terms) else []
