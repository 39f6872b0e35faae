"""Our own profile: JSON with size, model, parameters, center, field_deg, stretch, mount_deg."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera, make_camera
from ..errors import ProfileError
from ..lens import MODELS, Lens, model_name, parameters
from ..rotations import RDF_FROM_FRD, body_from_view, head_angles_deg
from . import check_keys, number, numbers, picture_size

VERSION = 1
REQUIRED = {"freelook_lens", "size", "model", "parameters"}
OPTIONAL = {"name", "source", "center", "field_deg", "stretch", "mount_deg"}
ANGLES = ("yaw", "pitch", "roll")


def recognises(data: Mapping[str, Any]) -> bool:
    return "freelook_lens" in data


def read(data: Mapping[str, Any]) -> Camera:
    """The camera of a profile; the fields are described in docs/lenses.md."""
    check_keys(data, REQUIRED, OPTIONAL, "the profile")
    if data["freelook_lens"] != VERSION:
        raise ProfileError(
            f"freelook_lens is {data['freelook_lens']!r}; this program reads version {VERSION}"
        )
    return make_camera(
        picture_size(data["size"], "size"),
        _lens(data["model"], data["parameters"]),
        center=_pair(data["center"]) if "center" in data else None,
        field_deg=number(data["field_deg"], "field_deg") if "field_deg" in data else None,
        stretch=_stretch(data["stretch"]) if "stretch" in data else None,
        camera_from_body=_mount(data["mount_deg"]) if "mount_deg" in data else RDF_FROM_FRD,
    )


def write(camera: Camera) -> dict[str, Any]:
    """The profile of a camera; `read` gives the same camera back."""
    yaw, pitch, roll = head_angles_deg(camera.camera_from_body.inv())
    return {
        "freelook_lens": VERSION,
        "size": list(camera.size),
        "model": model_name(camera.lens),
        "parameters": parameters(camera.lens),
        "center": list(camera.center),
        "field_deg": float(np.degrees(2 * camera.theta_max)),
        "stretch": camera.stretch.tolist(),
        "mount_deg": {"yaw": yaw, "pitch": pitch, "roll": roll},
    }


def _lens(model: Any, values: Any) -> Lens:
    if not isinstance(model, str) or model not in MODELS:
        raise ProfileError(f"unknown model {model!r}; known: {', '.join(MODELS)}")
    if not isinstance(values, dict):
        raise ProfileError(f"parameters must be an object, not {values!r}")
    names = [field.name for field in fields(MODELS[model])]  # type: ignore[arg-type]
    # the first parameter is the scale, in pixels; the terms behind it default to 0
    check_keys(values, {names[0]}, set(names), f"the parameters of model '{model}'")
    return MODELS[model](**{name: number(v, f"parameters.{name}") for name, v in values.items()})


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
