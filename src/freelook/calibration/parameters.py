"""What a calibration solves for, as one row of numbers: lens, centre, pixel aspect, skew."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ..camera import Camera
from ..lens import (
    Floats,
    Lens,
    Mei,
    OpenCVRational,
    SplinedStereographic,
    free_fields,
    vector,
    with_vector,
)

# Parameters that stay as they are (0): views of a board do not tell them from the others. OpenCV
# and Kalibr leave the same ones out unless asked.
HELD: dict[type[Lens], tuple[str, ...]] = {
    Mei: ("k3",),
    OpenCVRational: ("s1", "s2", "s3", "s4", "tau_x", "tau_y"),
}


@dataclass(frozen=True)
class Freedom:
    """What is solved for; the rest stays as it is."""

    lens: bool = True
    center: bool = True
    aspect: bool = True
    skew: bool = False


@dataclass(frozen=True)
class Parameters:
    """The free values of `camera` and of cameras like it."""

    camera: Camera
    freedom: Freedom

    @property
    def free(self) -> Freedom:
        """What is free of this camera: the surface of a splined lens says centre, aspect and skew
        itself."""
        if isinstance(self.camera.lens, SplinedStereographic):
            return Freedom(self.freedom.lens, center=False, aspect=False)
        return self.freedom

    @property
    def names(self) -> tuple[str, ...]:
        free = self.free
        return (
            *(lens_names(self.camera.lens) if free.lens else ()),
            *(("center_x", "center_y") if free.center else ()),
            *(("aspect",) if free.aspect else ()),
            *(("skew",) if free.skew else ()),
        )

    @property
    def values(self) -> Floats:
        free, camera = self.free, self.camera
        return np.array(
            [
                *(lens_values(camera.lens) if free.lens else ()),
                *(camera.center if free.center else ()),
                *((camera.stretch[1, 1],) if free.aspect else ()),
                *((camera.stretch[0, 1],) if free.skew else ()),
            ]
        )

    def camera_of(self, values: Floats) -> Camera:
        """The camera with these values instead of its own."""
        free, lens = self.free, self.camera.lens
        if free.lens:
            count = len(lens_names(lens))
            lens, values = with_lens_values(lens, values[:count]), values[count:]
        left = values.tolist()
        center = (left.pop(0), left.pop(0)) if free.center else self.camera.center
        stretch = self.camera.stretch.copy()
        if free.aspect:
            stretch[1, 1] = left.pop(0)
        if free.skew:
            stretch[0, 1] = left.pop(0)
        return replace(self.camera, lens=lens, center=center, stretch=stretch)


def lens_names(lens: Lens) -> tuple[str, ...]:
    """Names of what is solved for; entries of lists are numbered, as in radii_px[2]."""
    return _layout(lens)[0]


def lens_values(lens: Lens) -> Floats:
    """What is solved for, in the order of `lens_names`."""
    return vector(lens)[_layout(lens)[1]]


def with_lens_values(lens: Lens, values: Floats) -> Lens:
    """The lens with other values; the reverse of `lens_values`."""
    every = vector(lens)
    every[_layout(lens)[1]] = values
    return with_vector(lens, every)


def _layout(lens: Lens) -> tuple[tuple[str, ...], NDArray[np.intp]]:
    """Names of what is solved for, and where these are in a lens's `vector`."""
    values = [getattr(lens, name) for name in free_fields(type(lens))]
    return _layout_of(type(lens), tuple(len(v) if isinstance(v, tuple) else None for v in values))


@cache
def _layout_of(
    model: type[Lens], counts: tuple[int | None, ...]
) -> tuple[tuple[str, ...], NDArray[np.intp]]:
    """`counts` of the entries of those parameters that are lists."""
    names: list[str] = []
    for name, count in zip(free_fields(model), counts, strict=True):
        names += [name] if count is None else [f"{name}[{i}]" for i in range(count)]
    held = HELD.get(model, ())
    free = [i for i, name in enumerate(names) if name not in held]
    return tuple(names[i] for i in free), np.array(free, np.intp)


def difference_step(value: float) -> float:
    """For central differences of a projection by one value: exact to 1e-9 of what it changes."""
    return 1e-6 * max(abs(value), 0.1)
