"""COLMAP's cameras.txt: all its models that have an axis; FILE#ID for one of several cameras.

A line is CAMERA_ID MODEL WIDTH HEIGHT PARAMS. COLMAP counts pixels from the corner of the
picture, so its (0.5, 0.5) is our (0, 0). Models, the order of their parameters, and the formulas:
`colmap/sensor/models.h`. COLMAP itself ends at 90 degrees from the axis; here the fisheye models
go on to where their radius stops growing. It has no place for a field, a mounting or a name.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..camera import Camera, make_camera
from ..errors import ProfileError
from ..lens import MODELS as LENS_MODELS
from ..lens import Lens, model_name, parameters
from ._document import Document
from ._field import field_notes
from ._matrix import Matrix, matrix_of
from ._numbers import picture_size
from ._profile import Choice, Profile
from ._words import without_comments, word_number, word_numbers

SUFFIX = ".txt"


@dataclass(frozen=True)
class _Model:
    """One of COLMAP's models: the lens, how many focal lengths, and the lens's other parameters.

    The parameters begin with f cx cy, or fx fy cx cy.
    """

    lens: str
    focals: int
    others: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        return (*(("f",) if self.focals == 1 else ("fx", "fy")), "cx", "cy", *self.others)


RAD_TAN = ("k0", "k1", "k2", "k3", "k4", "k5", "p0", "p1", "s0", "s1", "s2", "s3")

# Of those with one lens the smaller ones stand first: a lens is written as the first it fits.
COLMAP_MODELS = {
    "SIMPLE_PINHOLE": _Model("perspective", 1),
    "PINHOLE": _Model("perspective", 2),
    "SIMPLE_RADIAL": _Model("opencv_rational", 1, ("k1",)),
    "RADIAL": _Model("opencv_rational", 1, ("k1", "k2")),
    "OPENCV": _Model("opencv_rational", 2, ("k1", "k2", "p1", "p2")),
    "FULL_OPENCV": _Model("opencv_rational", 2, ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")),
    "SIMPLE_FISHEYE": _Model("equidistant", 1),
    "FISHEYE": _Model("equidistant", 2),
    "SIMPLE_RADIAL_FISHEYE": _Model("kannala_brandt", 1, ("k1",)),
    "RADIAL_FISHEYE": _Model("kannala_brandt", 1, ("k1", "k2")),
    "OPENCV_FISHEYE": _Model("kannala_brandt", 2, ("k1", "k2", "k3", "k4")),
    "THIN_PRISM_FISHEYE": _Model(
        "thin_prism_fisheye", 2, ("k1", "k2", "p1", "p2", "k3", "k4", "sx1", "sy1")
    ),
    "RAD_TAN_THIN_PRISM_FISHEYE": _Model("rad_tan_thin_prism_fisheye", 2, RAD_TAN),
    "FOV": _Model("fov", 2, ("w",)),
    "EUCM": _Model("eucm", 2, ("alpha", "beta")),
}
MODELS = tuple(dict.fromkeys(model.lens for model in COLMAP_MODELS.values()))
MANY = 100  # with a camera for every picture there are thousands: too many to list
LINE = re.compile(r"\d+\s+[A-Z][A-Z0-9_]+\s+\d+\s+\d+\s+[-+.\d]")


def recognises(document: Document) -> bool:
    return bool(LINE.match(next(without_comments(document.text), "")))


def read(document: Document, choice: Choice) -> Profile:
    """The camera of a line, as COLMAP numbers it."""
    rows = [line.split() for line in without_comments(document.text)]
    if not rows:
        raise ProfileError("no camera in it, only comments")
    ids = [row[0] for row in rows]
    if len(set(ids)) < len(ids):
        raise ProfileError(f"a CAMERA_ID is given twice: {', '.join(ids[:20])}")
    if len(ids) > MANY and choice.pick not in ids:
        raise ProfileError(f"{len(ids)} cameras in it: add a CAMERA_ID, as in FILE#{ids[0]:.20}")
    row = rows[choice.of(ids)]
    camera = _camera(row, f"camera {row[0]}")
    return Profile(camera, name=f"COLMAP camera {row[0]}", notes=field_notes(camera))


def write(profile: Profile) -> str:
    """One camera, number 1, as the smallest model that holds it."""
    camera = profile.camera
    matrix = _matrix(camera)
    name, model = _model_for(camera.lens, one_focal=matrix.fx == matrix.fy)
    focals = (matrix.fx,) if model.focals == 1 else (matrix.fx, matrix.fy)
    others = (getattr(camera.lens, other) for other in model.others)
    numbers = (*focals, matrix.cx + 0.5, matrix.cy + 0.5, *others)
    words = ("1", name, *map(str, camera.size), *(repr(float(value)) for value in numbers))
    return (
        "# Camera list with one line of data per camera:\n"
        "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
        "# Number of cameras: 1\n" + " ".join(words) + "\n"
    )


def _camera(row: list[str], where: str) -> Camera:
    if len(row) < 4:
        raise ProfileError(f"{where} must be CAMERA_ID MODEL WIDTH HEIGHT PARAMS, not {row}")
    model = _known(row[1])
    size = picture_size(word_numbers(row[2:4], f"WIDTH HEIGHT of {where}"), "WIDTH HEIGHT")
    if len(row[4:]) != len(model.names):
        raise ProfileError(
            f"{where}: {row[1]} has {len(model.names)} parameters ({', '.join(model.names)}), "
            f"not {len(row[4:])}"
        )
    values = {
        name: word_number(word, f"{name} of {where}")
        for name, word in zip(model.names, row[4:], strict=True)
    }
    fx = values.get("f", values.get("fx", 0.0))
    matrix = Matrix(fx, values.get("fy", fx), values["cx"] - 0.5, values["cy"] - 0.5)
    lens = LENS_MODELS[model.lens](**{"f": fx} | {other: values[other] for other in model.others})
    return make_camera(size, lens, center=matrix.center, stretch=matrix.stretch)


def _known(name: str) -> _Model:
    if name not in COLMAP_MODELS:
        raise ProfileError(
            f"COLMAP's model {name:.40} is not read here; known: {', '.join(COLMAP_MODELS)}"
        )
    return COLMAP_MODELS[name]


def _matrix(camera: Camera) -> Matrix:
    if model_name(camera.lens) not in MODELS:
        raise ProfileError(
            f"COLMAP has no model like '{model_name(camera.lens)}'; it holds {', '.join(MODELS)}"
        )
    matrix = matrix_of(camera, float(parameters(camera.lens)["f"]), "COLMAP")  # type: ignore[arg-type]
    if abs(matrix.skew) > 1e-9 * matrix.fx:
        raise ProfileError(f"COLMAP cannot say skew, and this camera has {matrix.skew:.4g} px")
    return matrix


def _model_for(lens: Lens, *, one_focal: bool) -> tuple[str, _Model]:
    """The first of COLMAP's models that leaves nothing of this lens out."""
    left: list[str] = []
    for name, model in COLMAP_MODELS.items():
        if model.lens == model_name(lens) and (one_focal or model.focals == 2):
            left = _left_out(lens, model)
            if not left:
                return name, model
    raise ProfileError(f"COLMAP has no place for {', '.join(left)} of a {model_name(lens)} lens")


def _left_out(lens: Lens, model: _Model) -> list[str]:
    """The lens's parameters that say something and have no place in the model."""
    others = {name: value for name, value in parameters(lens).items() if name != "f"}
    return [name for name, value in others.items() if value and name not in model.others]
