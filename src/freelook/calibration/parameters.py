"""What a calibration solves for, as one row of numbers: lens, centre, pixel aspect, skew."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from ..camera import Camera
from ..lens import (
    Floats,
    Lens,
    Mei,
    OpenCVRational,
    SplinedStereographic,
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
        left = list(map(float, values))
        if free.lens:
            count = len(lens_names(lens))
            lens, left = with_lens_values(lens, np.array(left[:count])), left[count:]
        center = (left.pop(0), left.pop(0)) if free.center else self.camera.center
        stretch = self.camera.stretch.copy()
        if free.aspect:
            stretch[1, 1] = left.pop(0)
        if free.skew:
            stretch[0, 1] = left.pop(0)
        return replace(self.camera, lens=lens, center=center, stretch=stretch)


def lens_names(lens: Lens) -> tuple[str, ...]:
    """Names of what is solved for; entries of lists are numbered, as in radii_px[2]."""
    return tuple(name for name in _all_names(lens) if name not in HELD.get(type(lens), ()))


def lens_values(lens: Lens) -> Floats:
    """What is solved for, in the order of `lens_names`."""
    return vector(lens)[_free(lens)]


def with_lens_values(lens: Lens, values: Floats) -> Lens:
    """The lens with other values; the reverse of `lens_values`."""
    every = vector(lens)
    every[_free(lens)] = values
    return with_vector(lens, every)


def _free(lens: Lens) -> list[int]:
    held = HELD.get(type(lens), ())
    return [i for i, name in enumerate(_all_names(lens)) if name not in held]


def _all_names(lens: Lens) -> list[str]:
    names: list[str] = []
    for field in fields(lens):  # type: ignore[arg-type]
        value = getattr(lens, field.name)
        if field.metadata.get("fixed"):
            continue
        if isinstance(value, tuple):
            names += [f"{field.name}[{i}]" for i in range(len(value))]
        else:
            names.append(field.name)
    return names


def difference_step(value: float) -> float:
    """For central differences of a projection by one value: exact to 1e-9 of what it changes."""
    return 1e-6 * max(abs(value), 0.1)
