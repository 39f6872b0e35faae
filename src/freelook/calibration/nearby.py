"""Lenses of other models near a given one: where a solver may start, in a thousandth of a second.

Round lenses only, and only r(theta) is looked at; the solver moves centre and stretch by itself.
The fits are linear: models with nothing but a focal length and polynomials are linear as they are,
and so are the two sphere models once one of their parameters is fixed, which is tried out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..lens import (
    MODELS,
    DoubleSphere,
    Equidistant,
    Equisolid,
    ExtendedUnified,
    Floats,
    KannalaBrandt,
    Lens,
    Orthographic,
    Perspective,
    Polynomial,
    Stereographic,
    ThinPrismFisheye,
    growth_limit,
)

ONE_NUMBER = (Perspective, Stereographic, Equidistant, Equisolid, Orthographic)
BETAS = np.geomspace(0.1, 10.0, 49)
XIS = np.linspace(-0.9, 0.9, 37)
SHARES = (0.001, 0.999)  # alpha; at 0 and 1 nothing pulls it back
PLACES = 60
ENDS_EARLY = 0.999  # of the angle: how far a lens must reach


def nearby(model: str, lens: Lens, theta_max: float) -> Lens | None:
    """The lens of a model nearest to a round one up to theta_max (radians); None where this way
    does not find one."""
    theta = theta_max * (np.arange(PLACES) + 0.5) / PLACES
    radius = lens.radius(theta)
    kind = MODELS[model]
    if kind in ONE_NUMBER:
        return _scaled(model, theta, radius)
    if kind is Polynomial:
        return Polynomial(*_coefficients(theta, radius).tolist())
    if kind is ThinPrismFisheye and isinstance(lens, KannalaBrandt):
        return ThinPrismFisheye(lens.f, lens.k1, lens.k2, k3=lens.k3, k4=lens.k4)
    if kind in (ExtendedUnified, DoubleSphere):
        return _best(_spheres(kind, theta, radius), theta, radius)
    return None


def _scaled(model: str, theta: Floats, radius: Floats) -> Lens | None:
    """The one focal length, of errors in pixels that count by the area they cover."""
    unit = MODELS[model](1.0)  # type: ignore[call-arg]
    if unit.hard_limit <= theta[-1]:
        return None
    shape = unit.radius(theta)
    f = float(np.sum(theta * radius * shape) / np.sum(theta * shape**2))
    return MODELS[model](f)  # type: ignore[call-arg]


def _coefficients(theta: Floats, radius: Floats) -> Floats:
    powers = theta[:, None] ** np.arange(1, 6)
    return np.asarray(np.linalg.lstsq(powers, radius, rcond=None)[0])


def _spheres(kind: type[Lens], theta: Floats, radius: Floats) -> Iterator[Lens]:
    """With z and h of the model, sin(theta) / r = (1 / f) z + (alpha / f) (h - z)."""
    sine, cosine = np.sin(theta), np.cos(theta)
    for fixed in BETAS if kind is ExtendedUnified else XIS:
        if kind is ExtendedUnified:
            z, h = cosine, np.sqrt(fixed * sine**2 + cosine**2)
        else:
            z = fixed + cosine
            h = np.hypot(sine, z)
        weight = np.sqrt(theta) * radius**2 / sine  # errors of sin / r as errors of r
        columns = np.stack([z, h - z], axis=-1) * weight[:, None]
        a, b = np.linalg.lstsq(columns, weight * sine / radius, rcond=None)[0].tolist()
        if a > 0:
            alpha = float(np.clip(b / a, *SHARES))
            made: Callable[[float, float, float], Lens] = kind
            yield (
                made(1 / a, alpha, float(fixed))
                if kind is ExtendedUnified
                else made(1 / a, float(fixed), alpha)
            )


def _best(lenses: Iterator[Lens], theta: Floats, radius: Floats) -> Lens | None:
    """The nearest of those that see all of it."""
    able = [lens for lens in lenses if lens.hard_limit > theta[-1]]
    with np.errstate(all="ignore"):
        off = [float(np.sum(theta * (lens.radius(theta) - radius) ** 2)) for lens in able]
    for index in np.argsort(off):
        if growth_limit(able[index], float(theta[-1])) > ENDS_EARLY * theta[-1]:
            return able[index]
    return None
