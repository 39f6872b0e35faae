"""mrcal's .cameramodel: pinhole, stereographic, OpenCV 4 to 12, splined stereographic.

A Python dictionary with comments, of lensmodel, intrinsics, imagersize, extrinsics and what
mrcal itself needs to work on with it. It is parsed, never run. intrinsics are fx fy cx cy and the
model's own; (0, 0) is the middle of the top-left pixel. Source: mrcal's documentation, "lens
models" and "camera models", and its `cameramodel.py`.
"""

from __future__ import annotations

import ast
import re
import warnings
from dataclasses import replace
from typing import Any

import numpy as np

from ..camera import Camera, make_camera
from ..errors import ProfileError
from ..lens import (
    Lens,
    OpenCVRational,
    Perspective,
    SplinedStereographic,
    Stereographic,
    image_point,
    model_name,
)
from ._document import Document
from ._field import field_notes
from ._matrix import Matrix, matrix_of
from ._numbers import numbers, picture_size
from ._profile import Choice, Profile

SUFFIX = ".cameramodel"
MODELS = ("perspective", "stereographic", "opencv_rational", "splined_stereographic")

CORE = ("fx", "fy", "cx", "cy")
OPENCV = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")
OPENCV_SIZES = (4, 5, 8, 12)
KNOWN = (
    "LENSMODEL_PINHOLE",
    "LENSMODEL_STEREOGRAPHIC",
    *(f"LENSMODEL_OPENCV{n}" for n in OPENCV_SIZES),
    "LENSMODEL_SPLINED_STEREOGRAPHIC_order=..._Nx=..._Ny=..._fov_x_deg=...",
)
SPLINED = re.compile(
    r"LENSMODEL_SPLINED_STEREOGRAPHIC_order=(\d{1,2})_Nx=(\d{1,4})_Ny=(\d{1,4})"
    r"_fov_x_deg=(\d{1,3})"
)
NAMES = ("lensmodel", "lens_model", "distortion_model")  # the last two are those of old files
LOOKS_LIKE = re.compile(rf"""['"]({"|".join(NAMES)})['"]\s*:\s*['"](LENSMODEL|DISTORTION)_""")
OURS = {*NAMES, "intrinsics", "imagersize", "extrinsics", "valid_intrinsics_region"}
MRCALS = {"optimization_inputs", "icam_intrinsics", "icam_intrinsics_optimization_inputs"}
# Without its optimisation inputs, a large splined model has some 100 kB; Python's parser takes
# hundreds of bytes for each one it reads.
LARGEST = 2**18
INPUTS = re.compile(r"""b'[^'\\\n]{500,}'""")


def recognises(document: Document) -> bool:
    return bool(LOOKS_LIKE.search(document.text))


def read(document: Document, choice: Choice) -> Profile:
    """The camera of the intrinsics; the field ends where the picture leaves the spline."""
    data = _dictionary(document.text)
    name = _lensmodel(data)
    core, own = _intrinsics(data, name)
    matrix = Matrix(*core)
    lens = _lens(name, matrix.fx, own)
    camera = make_camera(
        picture_size(_list(data["imagersize"]), "imagersize"),
        lens,
        center=matrix.center,
        stretch=matrix.stretch,
    )
    notes = field_notes(camera)
    if isinstance(lens, SplinedStereographic):
        camera, more = _within_spline(camera, lens)
        notes = more or notes
    notes += _region(data, camera) + _extrinsics(data) + _others(data)
    return Profile(camera, source=_first_comment(document.text), notes=notes)


def write(profile: Profile) -> str:
    """The text of a model; mrcal reads it. Field, mounting and name have no place but comments."""
    camera = profile.camera
    name, own = _spelled_lens(camera.lens)
    f = float(camera.lens.f)  # type: ignore[attr-defined]
    matrix = matrix_of(camera, f, "mrcal")
    if abs(matrix.skew) > 1e-9 * matrix.fx:
        raise ProfileError(f"mrcal cannot say skew, and this camera has {matrix.skew:.4g} px")
    core = [matrix.fx, matrix.fy, matrix.cx, matrix.cy]
    said = " ".join(f"{profile.name} {profile.source}".split())
    comment = f"# {said}\n" if said else ""
    return (
        f"{comment}{{\n"
        f"    'lensmodel':  '{name}',\n\n"
        f"    # intrinsics are fx,fy,cx,cy,distortion0,distortion1,....\n"
        f"    'intrinsics': {[float(value) for value in (*core, *own)]},\n\n"
        f"    # extrinsics are rt_fromref\n"
        f"    'extrinsics': [0, 0, 0, 0, 0, 0],\n\n"
        f"    'imagersize': {list(camera.size)},\n"
        "}\n"
    )


def _dictionary(text: str) -> dict[str, Any]:
    """What the file says, without the optimisation inputs."""
    text = INPUTS.sub("b''", text.removeprefix("\ufeff"))
    if len(text) > LARGEST:
        raise ProfileError(
            f"{len(text)} characters besides its optimisation inputs; at most {LARGEST} are read"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # strange letters behind a backslash and the like
            body = ast.parse(text.strip(), mode="eval").body
            if not isinstance(body, ast.Dict):
                raise ProfileError("not mrcal's: it must be one Python dictionary")
            _no_giants(body)
            keys = [ast.literal_eval(key) if key else None for key in body.keys]
            values = [ast.literal_eval(value) for value in body.values]
    except SyntaxError as error:
        where = f" in line {error.lineno}" if error.lineno else ""
        raise ProfileError(f"not a Python dictionary: {error.msg}{where}") from None
    except (ValueError, TypeError, MemoryError, RecursionError) as error:
        raise ProfileError(
            f"not a Python dictionary of plain values: {str(error)[:80] or 'nested too deeply'}"
        ) from None
    data: dict[str, Any] = {}
    for key, value in zip(keys, values, strict=True):
        if not isinstance(key, str) or key in data:
            raise ProfileError(f"key {key!r:.40} is no name, or is given twice")
        data[key] = value
    return data


def _no_giants(body: ast.Dict) -> None:
    """Python reads 0xffff... of any length, and then cannot even print it."""
    for node in ast.walk(body):
        value = node.value if isinstance(node, ast.Constant) else None
        if isinstance(value, int) and value.bit_length() > 64:
            raise ProfileError("an integer of more than 64 bits is no number of a lens")


def _lensmodel(data: dict[str, Any]) -> str:
    for key in NAMES:
        if isinstance(data.get(key), str):
            return str(data[key]).replace("DISTORTION_", "LENSMODEL_")
    raise ProfileError(f"key 'lensmodel' is missing, or no text; known: {', '.join(KNOWN)}")


def _intrinsics(data: dict[str, Any], name: str) -> tuple[list[float], list[float]]:
    """(fx fy cx cy, what is behind), as many as the model has."""
    for key in ("intrinsics", "imagersize"):
        if key not in data:
            raise ProfileError(f"key '{key}' is missing; needed: lensmodel, intrinsics, imagersize")
    values = _list(data["intrinsics"])
    if isinstance(values, list):
        # control points that no corner was near are left at the likes of 3e-300 by its solver
        values = [0.0 if _next_to_nothing(value) else value for value in values]
    values = numbers(values, len(CORE) + _count(name), f"intrinsics of {name}")
    return values[: len(CORE)], values[len(CORE) :]


def _next_to_nothing(value: Any) -> bool:
    return isinstance(value, float) and abs(value) < 1e-30


def _count(name: str) -> int:
    """How many numbers a model has behind fx fy cx cy; ProfileError if it is not read here."""
    if name in ("LENSMODEL_PINHOLE", "LENSMODEL_STEREOGRAPHIC"):
        return 0
    if name in KNOWN:
        return int(name.removeprefix("LENSMODEL_OPENCV"))
    if match := SPLINED.fullmatch(name):
        return 2 * int(match[2]) * int(match[3])
    if name.startswith(("LENSMODEL_CAHVOR", "LENSMODEL_LONLAT", "LENSMODEL_LATLON")):
        why = (
            "its distortion is about an axis of its own, not the picture's"
            if "CAHVOR" in name
            else "a panorama has no axis"
        )
        raise ProfileError(
            f"{name:.60} is not read here: {why}; convert it first with mrcal-convert-lensmodel, "
            f"to one of: {', '.join(KNOWN)}"
        )
    raise ProfileError(f"unknown lensmodel '{name:.80}'; known: {', '.join(KNOWN)}")


def _lens(name: str, f: float, own: list[float]) -> Lens:
    if name == "LENSMODEL_PINHOLE":
        return Perspective(f)
    if name == "LENSMODEL_STEREOGRAPHIC":
        return Stereographic(f)
    if match := SPLINED.fullmatch(name):
        order, nx, ny = int(match[1]), int(match[2]), int(match[3])
        return SplinedStereographic(f, order, nx, ny, int(match[4]), tuple(own))
    return OpenCVRational(f, **dict(zip(OPENCV, own, strict=False)))


def _spelled_lens(lens: Lens) -> tuple[str, list[float]]:
    """mrcal's name of a lens and its numbers behind fx fy cx cy."""
    if isinstance(lens, Perspective):
        return "LENSMODEL_PINHOLE", []
    if isinstance(lens, Stereographic):
        return "LENSMODEL_STEREOGRAPHIC", []
    if isinstance(lens, OpenCVRational):
        if lens.tau_x or lens.tau_y:
            raise ProfileError("mrcal has no place for tau_x, tau_y: OpenCV's tilted sensor")
        values = [float(getattr(lens, key)) for key in OPENCV]
        size = next(n for n in OPENCV_SIZES if not any(values[n:]))
        return f"LENSMODEL_OPENCV{size}", values[:size]
    if isinstance(lens, SplinedStereographic):
        if lens.fov_x_deg != int(lens.fov_x_deg):
            raise ProfileError(f"mrcal takes whole degrees as fov_x_deg, not {lens.fov_x_deg}")
        name = (
            f"LENSMODEL_SPLINED_STEREOGRAPHIC_order={lens.order}_Nx={lens.nx}_Ny={lens.ny}"
            f"_fov_x_deg={int(lens.fov_x_deg)}"
        )
        return name, list(lens.control)
    raise ProfileError(
        f"mrcal has no model like '{model_name(lens)}'; it holds {', '.join(MODELS)}"
    )


def _within_spline(camera: Camera, lens: SplinedStereographic) -> tuple[Camera, tuple[str, ...]]:
    """The camera with a field that ends where the picture first shows what the spline does not
    cover.

    Beyond, mrcal goes on with the last polynomial, and so does the lens here; but nothing holds
    it there: converted models have been seen 50 px off, and 0.03 px within.
    """
    end = _leaves_spline(camera, lens)
    if end >= camera.theta_max:
        return camera, ()
    note = (
        f"the spline does not cover the whole picture: the field ends at {np.degrees(end):.1f} "
        "degrees from the axis, where it first leaves it; solve again with a larger fov_x_deg"
    )
    return replace(camera, theta_max=end), (note,)


def _leaves_spline(camera: Camera, lens: SplinedStereographic) -> float:
    """The smallest angle at which the picture shows the outline of what the spline covers, a
    rectangle in u; infinite if it never does."""
    along = np.linspace(-1, 1, 401)
    one = np.ones_like(along)
    sides = [(along, one), (along, -one), (one, along), (-one, along)]
    unit = np.concatenate([np.stack(side, axis=-1) for side in sides])
    u = unit * np.array([lens.nx - lens.order, lens.ny - lens.order]) * lens.spacing / 2
    theta, phi = 2 * np.arctan(np.hypot(u[:, 0], u[:, 1]) / 2), np.arctan2(u[:, 1], u[:, 0])
    pixel = camera.center + image_point(lens, theta, phi) @ camera.stretch.T
    shown = ((pixel >= -0.5) & (pixel <= np.array(camera.size) - 0.5)).all(axis=-1)
    return float(theta[shown].min(initial=np.inf))


def _region(data: dict[str, Any], camera: Camera) -> tuple[str, ...]:
    """What the outline says within which the calibration is called reliable."""
    if "valid_intrinsics_region" not in data:
        return ()
    rows = _list(data["valid_intrinsics_region"])
    if not isinstance(rows, list) or len(rows) > 10_000:
        raise ProfileError("valid_intrinsics_region must be a list of points, 10000 at most")
    if not rows:
        return ("valid_intrinsics_region is empty: by its own account it is reliable nowhere",)
    corners = np.array(
        [numbers(_list(row), 2, f"valid_intrinsics_region[{i}]") for i, row in enumerate(rows)]
    )
    places = int(np.clip(4000 // len(corners), 2, 500))
    sides = np.linspace(corners, np.roll(corners, -1, axis=0), places)
    ray = camera.ray(sides.reshape(-1, 2))
    theta = np.degrees(np.arctan2(np.hypot(ray[:, 0], ray[:, 1]), ray[:, 2]))
    theta = np.where(np.isnan(theta), np.degrees(camera.theta_max), theta)
    return (
        f"reliable to {theta.min():.1f} degrees from the axis all around, and to "
        f"{theta.max():.1f} at best (valid_intrinsics_region); the rest is extrapolated",
    )


def _extrinsics(data: dict[str, Any]) -> tuple[str, ...]:
    pose = numbers(_list(data.get("extrinsics", [0] * 6)), 6, "extrinsics")
    if not any(pose):
        return ()
    turned = np.degrees(np.linalg.norm(pose[:3]))
    return (
        f"extrinsics are not taken over: the camera is turned by {turned:.1f} degrees and moved by "
        f"{np.linalg.norm(pose[3:]):.3g} in its rig; say how it is mounted on the vehicle",
    )


def _others(data: dict[str, Any]) -> tuple[str, ...]:
    others = [key for key in data if key not in OURS | MRCALS]
    return (f"not taken over: {', '.join(others):.200}",) if others else ()


def _list(value: Any) -> Any:
    """Python's tuples are as good as lists."""
    return list(value) if isinstance(value, tuple) else value


def _first_comment(text: str) -> str:
    """mrcal writes the command that made a model into its first lines."""
    line = text.lstrip("\ufeff \t\r\n").partition("\n")[0]
    return line.lstrip("# ").strip()[:200] if line.startswith("#") else ""
