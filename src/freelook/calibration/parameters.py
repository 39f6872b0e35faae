"""What a calibration solves for, as one row of numbers: lens, centre, pixel aspect, skew."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from ..camera import Camera
from ..lens import Floats, Lens, vector, with_vector


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
    def names(self) -> tuple[str, ...]:
        free = self.freedom
        return (
            *(lens_names(self.camera.lens) if free.lens else ()),
            *(("center_x", "center_y") if free.center else ()),
            *(("aspect",) if free.aspect else ()),
            *(("skew",) if free.skew else ()),
        )

    @property
    def values(self) -> Floats:
        free, camera = self.freedom, self.camera
        return np.array(
            [
                *(vector(camera.lens) if free.lens else ()),
                *(camera.center if free.center else ()),
                *((camera.stretch[1, 1],) if free.aspect else ()),
                *((camera.stretch[0, 1],) if free.skew else ()),
            ]
        )

    def camera_of(self, values: Floats) -> Camera:
        """The camera with these values instead of its own."""
        free, lens = self.freedom, self.camera.lens
        left = list(map(float, values))
        if free.lens:
            count = len(vector(lens))
            lens, left = with_vector(lens, left[:count]), left[count:]
        center = (left.pop(0), left.pop(0)) if free.center else self.camera.center
        stretch = self.camera.stretch.copy()
        if free.aspect:
            stretch[1, 1] = left.pop(0)
        if free.skew:
            stretch[0, 1] = left.pop(0)
        return replace(self.camera, lens=lens, center=center, stretch=stretch)


def lens_names(lens: Lens) -> tuple[str, ...]:
    """Names of what `vector` holds; entries of lists are numbered, as in radii_px[2]."""
    names: list[str] = []
    for field in fields(lens):  # type: ignore[arg-type]
        value = getattr(lens, field.name)
        if field.metadata.get("fixed"):
            continue
        if isinstance(value, tuple):
            names += [f"{field.name}[{i}]" for i in range(len(value))]
        else:
            names.append(field.name)
    return tuple(names)


def difference_step(value: float) -> float:
    """For central differences of a projection by one value: exact to 1e-9 of what it changes."""
    return 1e-6 * max(abs(value), 0.1)
