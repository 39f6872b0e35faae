"""OpenCV fisheye parameters as JSON: K (3x3), D (4), image_size_wh, and optionally field_deg."""

from __future__ import annotations

from ..camera import make_camera
from ..errors import ProfileError
from ..lens import KannalaBrandt
from ._document import Document, expect_mapping
from ._matrix import Matrix
from ._numbers import check_keys, number, numbers, picture_size
from ._profile import Choice, Profile

SUFFIX = ".json"
MODELS = ("kannala_brandt",)
OPTIONAL = {"model", "note", "field_deg"}


def recognises(document: Document) -> bool:
    data = document.json
    return isinstance(data, dict) and "K" in data and "D" in data


def read(document: Document, choice: Choice) -> Profile:
    """The Kannala-Brandt camera with f = fx.

    OpenCV's pixel convention is ours. The model text must name the fisheye model: the same
    numbers mean another lens in OpenCV's ordinary model.
    """
    data = expect_mapping(document.json, "OpenCV fisheye parameters")
    check_keys(data, {"K", "D", "image_size_wh"}, OPTIONAL, "OpenCV fisheye parameters")
    model = data.get("model", "fisheye")
    if not isinstance(model, str) or "fisheye" not in model.lower():
        raise ProfileError(f"model is {model!r:.80}; only OpenCV's fisheye model can be read here")
    if not isinstance(data["K"], list) or len(data["K"]) != 3:
        raise ProfileError("K must be three rows of three numbers")
    k = [numbers(row, 3, f"K[{i}]") for i, row in enumerate(data["K"])]
    matrix = Matrix(k[0][0], k[1][1], k[0][2], k[1][2], skew=k[0][1])
    camera = make_camera(
        picture_size(data["image_size_wh"], "image_size_wh"),
        KannalaBrandt(matrix.fx, *numbers(data["D"], 4, "D")),
        center=matrix.center,
        field_deg=number(data["field_deg"], "field_deg") if "field_deg" in data else None,
        stretch=matrix.stretch,
    )
    return Profile(camera)


def write(profile: Profile) -> str:
    raise NotImplementedError
