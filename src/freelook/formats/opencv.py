"""OpenCV fisheye parameters as JSON: K (3x3), D (4), image_size_wh, and optionally field_deg."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..camera import Camera, make_camera
from ..errors import ProfileError
from ..lens import KannalaBrandt
from . import check_keys, number, numbers, picture_size

OPTIONAL = {"model", "note", "field_deg"}


def recognises(data: Mapping[str, Any]) -> bool:
    return "K" in data and "D" in data


def read(data: Mapping[str, Any]) -> Camera:
    """The Kannala-Brandt camera with f = fx and stretch = [[1, skew], [0, fy/fx]].

    OpenCV's pixel convention is ours. The model text must name the fisheye model: the same
    numbers mean another lens in OpenCV's ordinary model.
    """
    check_keys(data, {"K", "D", "image_size_wh"}, OPTIONAL, "OpenCV fisheye parameters")
    model = data.get("model", "fisheye")
    if not isinstance(model, str) or "fisheye" not in model.lower():
        raise ProfileError(f"model is {model!r}; only OpenCV's fisheye model can be read here")
    if not isinstance(data["K"], list) or len(data["K"]) != 3:
        raise ProfileError("K must be three rows of three numbers")
    k = np.array([numbers(row, 3, f"K[{i}]") for i, row in enumerate(data["K"])])
    if k[0, 0] <= 0 or k[1, 1] <= 0:
        raise ProfileError(f"focal lengths in K must be positive, not {k[0, 0]} and {k[1, 1]}")
    return make_camera(
        picture_size(data["image_size_wh"], "image_size_wh"),
        KannalaBrandt(float(k[0, 0]), *numbers(data["D"], 4, "D")),
        center=(float(k[0, 2]), float(k[1, 2])),
        field_deg=number(data["field_deg"], "field_deg") if "field_deg" in data else None,
        stretch=np.array([[1.0, k[0, 1] / k[0, 0]], [0.0, k[1, 1] / k[0, 0]]]),
    )
