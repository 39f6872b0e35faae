"""Our own profile: JSON with size, model, parameters, center, field_deg, stretch, mount_deg."""

from __future__ import annotations

import json
from dataclasses import MISSING, fields
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import make_camera
from ..errors import ProfileError
from ..lens import MODELS as LENS_MODELS
from ..lens import Lens, model_name, parameters
from ..rotations import RDF_FROM_FRD, body_from_view, head_angles_deg
from ._document import Document, expect_mapping
from ._numbers import check_keys, number, numbers, picture_size
from ._profile import Choice, Profile

SUFFIX = ".json"
MODELS = tuple(LENS_MODELS)

VERSION = 1
REQUIRED = {"freelook_lens", "size", "model", "parameters"}
OPTIONAL = {"name", "source", "center", "field_deg", "stretch", "mount_deg"}
ANGLES = ("yaw", "pitch", "roll")


def recognises(document: Document) -> bool:
    return isinstance(document.json, dict) and "freelook_lens" in document.json


def read(document: Document, choice: Choice) -> Profile:
    """The camera of a profile; the fields are described in docs/lenses.md."""
    data = expect_mapping(document.json, "the profile")
    check_keys(data, REQUIRED, OPTIONAL, "the profile")
    if data["freelook_lens"] != VERSION:
        raise ProfileError(
            f"freelook_lens is {data['freelook_lens']!r}; this program reads version {VERSION}"
        )
    camera = make_camera(
        picture_size(data["size"], "size"),
        _lens(data["model"], data["parameters"]),
        center=_pair(data["center"]) if "center" in data else None,
        field_deg=number(data["field_deg"], "field_deg") if "field_deg" in data else None,
        stretch=_stretch(data["stretch"]) if "stretch" in data else None,
        camera_from_body=_mount(data["mount_deg"]) if "mount_deg" in data else RDF_FROM_FRD,
    )
    return Profile(camera, str(data.get("name", "")), str(data.get("source", "")))


def write(profile: Profile) -> str:
    """The text of a profile; `read` gives the same camera back."""
    camera = profile.camera
    yaw, pitch, roll = head_angles_deg(camera.camera_from_body.inv())
    said = {"name": profile.name, "source": profile.source}
    data = {
        "freelook_lens": VERSION,
        **{key: text for key, text in said.items() if text},
        "size": list(camera.size),
        "model": model_name(camera.lens),
        "parameters": parameters(camera.lens),
        "center": list(camera.center),
        "field_deg": float(np.degrees(2 * camera.theta_max)),
        "stretch": camera.stretch.tolist(),
        "mount_deg": {"yaw": yaw, "pitch": pitch, "roll": roll},
    }
    return json.dumps(data, indent=2) + "\n"


def _lens(model: Any, values: Any) -> Lens:
    if not isinstance(model, str) or model not in LENS_MODELS:
        raise ProfileError(f"unknown model {model!r:.80}; known: {', '.join(LENS_MODELS)}")
    values = expect_mapping(values, "parameters")
    known = fields(LENS_MODELS[model])  # type: ignore[arg-type]
    # the scale, in pixels, is needed; terms behind it have their defaults
    needed = {field.name for field in known if field.default is MISSING}
    names = {field.name for field in known}
    check_keys(values, needed, names, f"the parameters of model '{model}'")
    lists = {field.name for field in known if "tuple" in str(field.type)}
    return LENS_MODELS[model](
        **{
            name: tuple(numbers(value, range(1, 4097), f"parameters.{name}"))
            if name in lists
            else number(value, f"parameters.{name}")
            for name, value in values.items()
        }
    )


def _pair(value: Any) -> tuple[float, float]:
    x, y = numbers(value, 2, "center")
    return x, y


def _stretch(value: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    if not isinstance(value, list) or len(value) != 2:
        raise ProfileError(f"stretch must be two rows of two numbers, not {value!r}")
    return np.array([numbers(row, 2, f"stretch[{i}]") for i, row in enumerate(value)])


def _mount(value: Any) -> Rotation:
    if not isinstance(value, dict):
        raise ProfileError(f"mount_deg must be an object with {', '.join(ANGLES)}, not {value!r}")
    check_keys(value, set(), set(ANGLES), "mount_deg")
    yaw, pitch, roll = (number(value.get(a, 0.0), f"mount_deg.{a}") for a in ANGLES)
    return body_from_view(yaw, pitch, roll).inv()
