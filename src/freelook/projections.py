"""The projections of a view: which way each of its places looks.

A place (x, y) is counted from the middle of the view, x to the right, y down, in focal lengths; a
focal length is as many pixels as there are to one radian in the middle. `ray` is the definition,
in float64. Renderers have the same formulas, by the same names: `view_ray` in renderers/kernels.py
and in renderers/view.glsl, and `RAYS` in web/static/projections.js.

The formulas are those of

    Snyder, Map Projections: A Working Manual, USGS Professional Paper 1395 (1987): stereographic
        (chapter 21) and equirectangular (12); cylindrical is his central one (page 104)
    Sharpless, Postle and German, Pannini: A New Projection for Rendering Wide Angle Perspective
        Images, Computational Aesthetics (2010): the basic one, d = 1

for a sphere of radius 1 seen from inside. With k = x / 2 = tan(azimuth / 2), a Pannini view's ray
(sin(azimuth), y / (1 + k^2), cos(azimuth)) is (x, y, 1 - k^2) but for its length.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from .errors import RenderError
from .lens import Floats

Formula = Literal[
    "perspective", "pannini", "stereographic", "cylindrical", "equirectangular", "equidistant"
]
FORMULAS: tuple[Formula, ...] = (
    "perspective",
    "pannini",
    "stereographic",
    "cylindrical",
    "equirectangular",
    "equidistant",
)


@dataclass(frozen=True)
class Projection:
    """A projection that a view may have.

    formula         of its rays
    narrowest_deg, widest_deg  the limits of its horizontal field
    tallest_deg     the limit of its vertical field; None: only what the horizontal one leaves
    cut             a window of the camera's picture as it is: which way its places look depends
                    on the lens, and its formula only says how large it is
    about           when to take it, for people
    """

    name: str
    formula: Formula
    narrowest_deg: float
    widest_deg: float
    about: str
    tallest_deg: float | None = None
    cut: bool = False

    @property
    def code(self) -> int:
        """Its formula by number, for compiled loops."""
        return FORMULAS.index(self.formula)

    def ray(self, x: Floats, y: Floats) -> Floats:
        """The rays (..., 3) in the view frame, of any length, through places (...)."""
        return RAYS[self.formula](*np.broadcast_arrays(x, y))

    def place(self, ray: Floats) -> Floats:
        """The places (..., 2) of rays (..., 3) of any length; NaN where the projection has none."""
        x, y, z = np.moveaxis(np.asarray(ray, dtype=np.float64), -1, 0)
        return np.stack(PLACES[self.formula](x, y, z), axis=-1)

    def half_width(self, half_deg: float) -> float:
        """x of the direction so far to the right, in focal lengths."""
        angle = np.radians(half_deg)
        return float(self.place(np.array([np.sin(angle), 0.0, np.cos(angle)]))[0])

    def half_height(self, half_deg: float) -> float:
        """y of the direction so far down, in focal lengths."""
        angle = np.radians(half_deg)
        return float(self.place(np.array([0.0, np.sin(angle), np.cos(angle)]))[1])

    def angle_deg(self, x: float, y: float) -> float:
        """How far from the middle a place on one of its two axes looks."""
        ray = self.ray(np.asarray(x), np.asarray(y))
        return float(np.degrees(np.arctan2(np.hypot(ray[0], ray[1]), ray[2])))


def _stacked(x: Floats, y: Floats, z: Floats) -> Floats:
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def _perspective(x: Floats, y: Floats) -> Floats:
    return _stacked(x, y, np.ones_like(x))


def _pannini(x: Floats, y: Floats) -> Floats:
    return _stacked(x, y, 1 - x * x / 4)


def _stereographic(x: Floats, y: Floats) -> Floats:
    return _stacked(x, y, 1 - (x * x + y * y) / 4)


def _cylindrical(x: Floats, y: Floats) -> Floats:
    return _stacked(np.sin(x), y, np.cos(x))


def _equirectangular(x: Floats, y: Floats) -> Floats:
    return _stacked(np.sin(x) * np.cos(y), np.sin(y), np.cos(x) * np.cos(y))


def _equidistant(x: Floats, y: Floats) -> Floats:
    angle = np.hypot(x, y)
    sinc = np.sinc(angle / np.pi)
    return _stacked(x * sinc, y * sinc, np.cos(angle))


RAYS: dict[Formula, Callable[[Floats, Floats], Floats]] = {
    "perspective": _perspective,
    "pannini": _pannini,
    "stereographic": _stereographic,
    "cylindrical": _cylindrical,
    "equirectangular": _equirectangular,
    "equidistant": _equidistant,
}


def _ratio(above: Floats, below: Floats) -> Floats:
    """NaN where there is no positive number below."""
    nowhere = np.full_like(below, np.nan)
    return np.divide(above, below, out=nowhere, where=below > 0)


def _place_perspective(x: Floats, y: Floats, z: Floats) -> tuple[Floats, Floats]:
    return _ratio(x, z), _ratio(y, z)


def _place_pannini(x: Floats, y: Floats, z: Floats) -> tuple[Floats, Floats]:
    depth = (np.hypot(x, z) + z) / 2
    return _ratio(x, depth), _ratio(y, depth)


def _place_stereographic(x: Floats, y: Floats, z: Floats) -> tuple[Floats, Floats]:
    depth = (np.sqrt(x * x + y * y + z * z) + z) / 2
    return _ratio(x, depth), _ratio(y, depth)


def _place_cylindrical(x: Floats, y: Floats, z: Floats) -> tuple[Floats, Floats]:
    return np.arctan2(x, z), _ratio(y, np.hypot(x, z))


def _place_equirectangular(x: Floats, y: Floats, z: Floats) -> tuple[Floats, Floats]:
    return np.arctan2(x, z), np.arctan2(y, np.hypot(x, z))


def _place_equidistant(x: Floats, y: Floats, z: Floats) -> tuple[Floats, Floats]:
    sine = np.hypot(x, y)
    angle = np.arctan2(sine, z)
    # straight ahead any direction will do, as it is multiplied with 0
    scale = np.divide(angle, sine, out=np.ones_like(sine), where=sine > 0)
    return x * scale, y * scale


PLACES: dict[Formula, Callable[[Floats, Floats, Floats], tuple[Floats, Floats]]] = {
    "perspective": _place_perspective,
    "pannini": _place_pannini,
    "stereographic": _place_stereographic,
    "cylindrical": _place_cylindrical,
    "equirectangular": _place_equirectangular,
    "equidistant": _place_equidistant,
}

PROJECTIONS = {
    projection.name: projection
    for projection in (
        Projection("perspective", "perspective", 10, 150, "straight lines stay straight"),
        Projection("pannini", "pannini", 10, 240, "wide, with upright and unstretched edges"),
        Projection("stereographic", "stereographic", 10, 300, "wide, with small shapes kept"),
        Projection("cylindrical", "cylindrical", 10, 360, "all around, upright lines straight"),
        Projection(
            "equirectangular", "equirectangular", 10, 360, "everything, for maps", tallest_deg=180
        ),
        Projection("strip", "equirectangular", 180, 360, "a low band all around", tallest_deg=90),
        Projection("crop", "equidistant", 10, 240, "a window of the picture as it is", cut=True),
    )
}


def projection_named(name: str) -> Projection:
    """RenderError for an unknown name lists the known ones."""
    if name not in PROJECTIONS:
        raise RenderError(f"unknown projection {name!r}; known: {', '.join(PROJECTIONS)}")
    return PROJECTIONS[name]
