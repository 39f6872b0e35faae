"""The lens models of Gyroflow's profiles: their names and the order of their coefficients.

Source: gyroflow/gyroflow, `src/core/stabilization/distortion_models`.
"""

from __future__ import annotations

from typing import Any

from ..errors import ProfileError
from ..lens import (
    KannalaBrandt,
    Lens,
    Mei,
    OpenCVRational,
    Perspective,
    Poly3,
    Poly5,
    PTLens,
    Sony,
    model_name,
    parameters,
)
from ._numbers import numbers

KB, SIX = ("k1", "k2", "k3", "k4"), ("k0", "k1", "k2", "k3", "k4", "k5")
# distortion_model: the lens, and the names of its parameters in the order of distortion_coeffs
LENSES: dict[str, tuple[type[Any], tuple[str, ...]]] = {
    "opencv_fisheye": (KannalaBrandt, KB),
    "opencv_standard": (
        OpenCVRational,
        ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4"),
    ),
    "poly3": (Poly3, ("k1",)),
    "poly5": (Poly5, ("k1", "k2")),
    "ptlens": (PTLens, ("a", "b", "c")),
    "insta360": (Mei, ("k1", "k2", "k3", "p1", "p2", "xi")),
    "sony": (Sony, SIX),
    "generic_polynomial": (Sony, SIX),  # it has twelve; those beyond the sixth must be 0
}
MODELS = (
    *("kannala_brandt", "perspective", "sony", "mei"),
    *("opencv_rational", "poly3", "poly5", "ptlens"),
)
PASSED_ON_AT_ZERO = ("opencv_fisheye", "sony", "generic_polynomial")
MOST_COEFFICIENTS = 12


def lens_of(model: str, f: float, values: Any) -> Lens:
    """The lens with Gyroflow's coefficients; those not given are 0, as in Gyroflow."""
    kind, names = LENSES[model]
    if not values:
        raise ProfileError(
            "distortion_coeffs is empty: Gyroflow takes this camera's from each video, so the "
            "profile does not have them"
        )
    given = numbers(values, range(1, MOST_COEFFICIENTS + 1), "distortion_coeffs")
    if any(given[len(names) :]):
        raise ProfileError(
            f"distortion_coeffs has {len(given)} numbers; of model '{model}' the first "
            f"{len(names)} can be read here, and the others are not 0"
        )
    if model in PASSED_ON_AT_ZERO and not any(given):
        return Perspective(f)
    full = dict(zip(names, [*given, *[0.0] * len(names)], strict=False))
    lens: Lens = kind(f, **full)
    return lens


def coefficients_of(lens: Lens) -> tuple[str, list[float]]:
    values: dict[str, Any] = parameters(lens)
    if isinstance(lens, Perspective):
        return "opencv_fisheye", [0.0] * 4
    for model, (kind, names) in LENSES.items():
        if type(lens) is kind:
            rest = {key: value for key, value in values.items() if key not in ("f", *names)}
            if any(rest.values()):
                raise ProfileError(f"Gyroflow's {model} has no {', '.join(rest)}")
            coefficients = [values[name] for name in names]
            if model in PASSED_ON_AT_ZERO and not any(coefficients):
                # all 0 would be a perspective lens; this is 3e-9 px at f = 300 and 180 degrees
                coefficients[0] = 1e-13
            return model, coefficients
    raise ProfileError(
        f"a Gyroflow profile cannot hold a {model_name(lens)} lens; it can: {', '.join(MODELS)}"
    )
