"""What renderers share: plane scales, black, kinds of sampling, whether a picture fits."""

from __future__ import annotations

from typing import Literal

from ..camera import Camera
from ..errors import RenderError
from ..types import Picture

Sampling = Literal["bilinear", "bicubic"]
SAMPLINGS: tuple[Sampling, ...] = ("bilinear", "bicubic")
"""Between pixels: bilinear, or Keys' cubic with a = -0.75 (as OpenCV), sharper where enlarged."""


def plane_scales(picture: Picture) -> tuple[int, ...]:
    """How many times smaller than luma each plane is."""
    return {"i420": (1, 2, 2), "nv12": (1, 2), "gray": (1,), "rgb24": (1,)}[picture.layout]


def black_of(picture: Picture) -> tuple[int, ...]:
    """The value of black in each plane."""
    if picture.layout == "rgb24":
        return (0,)
    luma = 0 if picture.color.full_range else 16
    return (luma, *[128] * (len(picture.planes) - 1))


def check_fits(picture: Picture, camera: Camera) -> None:
    """RenderError when the picture does not have the camera's size."""
    if picture.size != camera.size:
        width, height = picture.size
        raise RenderError(
            f"the picture is {width} x {height}, but the lens profile is for "
            f"{camera.size[0]} x {camera.size[1]}; use the profile that belongs to this video, "
            f"or camera.resized(picture.size) if the camera scales its whole picture"
        )
