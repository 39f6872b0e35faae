"""Lens models: where a ray lands, as one function of its angle from the axis.

A model is a frozen dataclass with `radius(theta)` and, where it is not round, `offset(theta, phi)`.
Its fields are, in one order, the keys of the JSON profile, the vector a calibration solves for,
and the documentation. To add one, write the class and name it in `MODELS`; tables, renderers,
browser, JSON and tests follow.
"""

from __future__ import annotations

from .base import (
    FIXED,
    BentLens,
    Floats,
    Lens,
    angle_at_radius,
    growth_limit,
    image_point,
    parameters,
    radius_slope,
    vector,
    with_vector,
)
from .classical import Equidistant, Equisolid, Orthographic, Perspective, Stereographic
from .polynomial import KannalaBrandt, Polynomial
from .prism import ThinPrismFisheye

MODELS: dict[str, type[Lens]] = {
    "perspective": Perspective,
    "stereographic": Stereographic,
    "equidistant": Equidistant,
    "equisolid": Equisolid,
    "orthographic": Orthographic,
    "polynomial": Polynomial,
    "kannala_brandt": KannalaBrandt,
    "thin_prism_fisheye": ThinPrismFisheye,
}


def model_name(lens: Lens) -> str:
    """The name under which this lens's model stands in `MODELS`."""
    return next(name for name, model in MODELS.items() if type(lens) is model)


__all__ = [
    "FIXED",
    "MODELS",
    "BentLens",
    "Equidistant",
    "Equisolid",
    "Floats",
    "KannalaBrandt",
    "Lens",
    "Orthographic",
    "Perspective",
    "Polynomial",
    "Stereographic",
    "ThinPrismFisheye",
    "angle_at_radius",
    "growth_limit",
    "image_point",
    "model_name",
    "parameters",
    "radius_slope",
    "vector",
    "with_vector",
]
