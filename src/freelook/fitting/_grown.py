"""Fits that end in lenses whose radius grows over all angles measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ..lens import Floats, Lens
from ._minimum import Minimum
from ._models import grows

# The slope that a radius is held to where it would fall, as a share of its mean slope. The small
# ones are tried first; it takes more where the radius still falls between the places looked at.
HELD_SLOPES = (1e-5, 1e-3, 2e-3, 5e-3, 2e-2)


def grown(
    fit: Callable[[Floats, float | None], Minimum],
    lens_of: Callable[[Floats], Lens | None],
    start: Floats,
    theta_max: float,
) -> Minimum:
    """The free minimum if its lens grows to theta_max (radians), else the nearest that is held to.

    fit  a start, and the least slope or None for none, to the minimum

    `forced` tells which it is. Even a held one may not grow; its lens is to be looked at.
    """
    found = fit(start, None)
    if _good(lens_of(found.x), theta_max):
        return found
    for least_slope in HELD_SLOPES:
        found = fit(start, least_slope)
        if _good(lens_of(found.x), theta_max):
            break
    return replace(found, forced=True)


def _good(lens: Lens | None, theta_max: float) -> bool:
    return lens is not None and grows(lens, theta_max)
