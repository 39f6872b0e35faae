"""WoodScape's camera calibration: JSON with intrinsic (radial_poly) and extrinsic.

The radius in pixels is k1 theta + k2 theta^2 + k3 theta^3 + k4 theta^4, which is our `polynomial`;
pixel (0, 0) is the middle of the top-left pixel, the principal point is (cx_offset, cy_offset)
from the middle of the picture, and aspect_ratio multiplies y. The extrinsic leads from the camera
(x right, y down, z forward, as ours) to the vehicle of ISO 8855 (x forward, y left, z up), its
quaternion being (x, y, z, w); ours is forward, right, down. Source: valeoai/WoodScape,
`scripts/calibration/calibration_readme.txt` and `projection.py`.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import make_camera
from ..errors import ProfileError
from ..lens import Polynomial, model_name
from ..rotations import RDF_FROM_FRD
from ._document import Document, expect_mapping
from ._field import field_notes
from ._matrix import Matrix, matrix_of
from ._numbers import check_keys, number, numbers, picture_size
from ._profile import Choice, Profile

SUFFIX = ".json"
MODELS = ("polynomial",)
ORDER = 4
COEFFICIENTS = ("k1", "k2", "k3", "k4")
INTRINSIC = {"aspect_ratio", "cx_offset", "cy_offset", "height", "width", *COEFFICIENTS}
FLU_FROM_FRD = Rotation.from_matrix(np.diag([1.0, -1.0, -1.0]))


def recognises(document: Document) -> bool:
    data = document.json
    if not isinstance(data, dict):
        return False
    intrinsic = data.get("intrinsic")
    return isinstance(intrinsic, dict) and {"cx_offset", "k1"} <= set(intrinsic)


def read(document: Document, choice: Choice) -> Profile:
    """The camera, mounted as its extrinsic says; straight forward where there is none."""
    data = expect_mapping(document.json, "the calibration")
    intrinsic = expect_mapping(data.get("intrinsic"), "intrinsic")
    check_keys(intrinsic, INTRINSIC, {"model", "poly_order"}, "intrinsic")
    model, order = intrinsic.get("model", "radial_poly"), intrinsic.get("poly_order", ORDER)
    if model != "radial_poly" or order != ORDER:
        raise ProfileError(
            f"intrinsic has model {model!r:.80} and poly_order {order!r:.80}; only 'radial_poly' "
            f"of order {ORDER} is known"
        )
    values = {key: number(intrinsic[key], f"intrinsic.{key}") for key in sorted(INTRINSIC)}
    size = picture_size([values["width"], values["height"]], "intrinsic width and height")
    matrix = Matrix(
        1.0,
        values["aspect_ratio"],
        values["cx_offset"] + (size[0] - 1) / 2,
        values["cy_offset"] + (size[1] - 1) / 2,
    )
    mount, notes = _mount(data.get("extrinsic"))
    camera = make_camera(
        size,
        Polynomial(*(values[key] for key in COEFFICIENTS)),
        center=matrix.center,
        stretch=matrix.stretch,
        camera_from_body=mount,
    )
    name = data.get("name", "")
    name = name if isinstance(name, str) else ""
    return Profile(camera, name, "WoodScape calibration", notes + field_notes(camera))


def write(profile: Profile) -> str:
    """A calibration that WoodScape's own `projection.py` reads.

    The camera's place on the vehicle is not known here: translation is 0. ProfileError for a
    stretch with a skew, and for a fifth coefficient.
    """
    camera = profile.camera
    if not isinstance(camera.lens, Polynomial):
        raise ProfileError(
            f"WoodScape's format cannot hold a {model_name(camera.lens)} lens; it can: polynomial"
        )
    if camera.lens.e:
        raise ProfileError("WoodScape's polynomial ends at theta^4, and this lens has theta^5")
    matrix = matrix_of(camera, 1.0, "WoodScape's format")
    if abs(matrix.skew) > 1e-9 * matrix.fx:
        raise ProfileError("WoodScape's format has no skew, and this camera's stretch has one")
    lens = camera.lens
    scaled = (k * matrix.fx for k in (lens.a, lens.b, lens.c, lens.d))
    vehicle_from_camera = FLU_FROM_FRD * camera.camera_from_body.inv()
    data = {
        "extrinsic": {
            "quaternion": vehicle_from_camera.as_quat().tolist(),
            "translation": [0.0, 0.0, 0.0],
        },
        "intrinsic": {
            "aspect_ratio": matrix.fy / matrix.fx,
            "cx_offset": matrix.cx - (camera.size[0] - 1) / 2,
            "cy_offset": matrix.cy - (camera.size[1] - 1) / 2,
            "height": float(camera.size[1]),
            **dict(zip(COEFFICIENTS, scaled, strict=True)),
            "model": "radial_poly",
            "poly_order": ORDER,
            "width": float(camera.size[0]),
        },
        "name": profile.name,
    }
    return json.dumps(data, indent=2) + "\n"


def _mount(extrinsic: Any) -> tuple[Rotation, tuple[str, ...]]:
    """(camera_from_body, what is not taken over)."""
    if extrinsic is None:
        return RDF_FROM_FRD, ("no extrinsic in it: the camera is taken to look straight forward",)
    extrinsic = expect_mapping(extrinsic, "extrinsic")
    quaternion = np.array(numbers(extrinsic.get("quaternion"), 4, "extrinsic.quaternion"))
    length = float(np.linalg.norm(quaternion))
    if abs(length - 1) > 1e-3:
        raise ProfileError(
            f"extrinsic.quaternion has the length {length:.4g}, so it is no rotation"
        )
    vehicle_from_camera = Rotation.from_quat(quaternion)
    place = extrinsic.get("translation")
    if place is None:
        notes: tuple[str, ...] = ()
    else:
        x, y, z = numbers(place, 3, "extrinsic.translation")
        notes = (
            f"it sits {x:.3g} m ahead and {y:.3g} m to the left of the rear axle's middle, "
            f"{z:.3g} m above the ground; only where it looks is used",
        )
    return vehicle_from_camera.inv() * FLU_FROM_FRD, notes
