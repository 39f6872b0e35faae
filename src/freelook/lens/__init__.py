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
    free_fields,
    growth_limit,
    image_point,
    parameters,
    radius_slope,
    vector,
    with_vector,
)
from .classical import Equidistant, Equisolid, Orthographic, Perspective, Stereographic
from .measured import OCamCalib, RadialSpline
from .polynomial import KannalaBrandt, KannalaBrandt9, Polynomial, Sony
from .prism import RadTanThinPrismFisheye, ThinPrismFisheye
from .rectilinear import FieldOfView, OpenCVRational, Poly3, Poly5, PTLens
from .sphere import DoubleSphere, ExtendedUnified, Mei
from .splined import SplinedStereographic

MODELS: dict[str, type[Lens]] = {
    "perspective": Perspective,
    "stereographic": Stereographic,
    "equidistant": Equidistant,
    "equisolid": Equisolid,
    "orthographic": Orthographic,
    "polynomial": Polynomial,
    "kannala_brandt": KannalaBrandt,
    "kannala_brandt_9": KannalaBrandt9,
    "sony": Sony,
    "double_sphere": DoubleSphere,
    "eucm": ExtendedUnified,
    "mei": Mei,
    "ocamcalib": OCamCalib,
    "fov": FieldOfView,
    "poly3": Poly3,
    "poly5": Poly5,
    "ptlens": PTLens,
    "opencv_rational": OpenCVRational,
    "thin_prism_fisheye": ThinPrismFisheye,
    "rad_tan_thin_prism_fisheye": RadTanThinPrismFisheye,
    "radial_spline": RadialSpline,
    "splined_stereographic": SplinedStereographic,
}


def model_name(lens: Lens) -> str:
    """The name under which this lens's model stands in `MODELS`."""
    return next(name for name, model in MODELS.items() if type(lens) is model)


__all__ = [
    "FIXED",
    "MODELS",
    "BentLens",
    "DoubleSphere",
    "Equidistant",
    "Equisolid",
    "ExtendedUnified",
    "FieldOfView",
    "Floats",
    "KannalaBrandt",
    "KannalaBrandt9",
    "Lens",
    "Mei",
    "OCamCalib",
    "OpenCVRational",
    "Orthographic",
    "PTLens",
    "Perspective",
    "Poly3",
    "Poly5",
    "Polynomial",
    "RadTanThinPrismFisheye",
    "RadialSpline",
    "Sony",
    "SplinedStereographic",
    "Stereographic",
    "ThinPrismFisheye",
    "angle_at_radius",
    "free_fields",
    "growth_limit",
    "image_point",
    "model_name",
    "parameters",
    "radius_slope",
    "vector",
    "with_vector",
]
