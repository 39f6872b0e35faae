"""Draws what is seen of a picture into the framebuffer in use: off-screen and in windows."""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil, log2
from typing import Any

from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..types import Picture
from ..viewport import Viewport
from .blank import Sampling, check_fits
from .gl_picture import CameraTextures, PictureTextures
from .gl_shader import Shaders, Value
from .gl_uniforms import (
    camera_defines,
    camera_uniforms,
    most_shrunk,
    view_defines,
    view_uniforms,
)

TAPS = 4  # samples side by side that the shader takes before it wants a smaller picture


class Painter:
    """One context's shaders and textures. The context must be current in all that is called."""

    def __init__(
        self, context: Any, sampling: Sampling = "bilinear", antialias: bool = True
    ) -> None:
        self._shaders = Shaders(context)
        self._picture = PictureTextures(context)
        self._camera = CameraTextures(context)
        self._antialias = antialias
        self._defines = {"BICUBIC"} if sampling == "bicubic" else set()
        self._defines |= {"ANTIALIAS"} if antialias else set()
        self._made_for: tuple[Camera | None, Viewport | None] = (None, None)
        self._levels = 0

    @property
    def picture(self) -> PictureTextures:
        return self._picture

    def load(self, picture: Picture, camera: Camera, viewport: Viewport) -> None:
        """Bring a picture up, ready for views like this one. RenderError when it does not fit."""
        check_fits(picture, camera)
        if self._antialias:
            self._count_levels(camera, viewport)
        self._picture.load(picture, self._levels)

    def _count_levels(self, camera: Camera, viewport: Viewport) -> None:
        """How often to halve the picture; kept from view to view."""
        if self._made_for[0] is not camera or self._made_for[1] is not viewport:
            self._made_for = (camera, viewport)
            self._levels = max(0, ceil(log2(most_shrunk(camera, viewport) / TAPS)))

    def paint(
        self, camera: Camera, camera_from_view: Rotation, viewport: Viewport, **more: Value
    ) -> None:
        """The view in colour, of the picture loaded last; `more` are other uniforms.

        With `viewer_k` among them it is shrunk for the lens of a viewer.
        """
        uniforms = self._picture.bind() | {"grey": 0.0} | more
        defines = self._picture.defines() | self._defines
        defines |= {"VIEWER"} if "viewer_k" in more else set()
        self._draw(defines, uniforms, camera, camera_from_view, viewport)

    def paint_plane(
        self, camera: Camera, camera_from_view: Rotation, viewport: Viewport, **more: Value
    ) -> None:
        """One plane as it is: `more` has `plane_scale` and `plane_black`, and `luma`, its unit."""
        self._draw(self._defines | {"PLANE"}, more, camera, camera_from_view, viewport)

    def paint_coordinates(
        self, camera: Camera, camera_from_view: Rotation, viewport: Viewport, **more: Value
    ) -> None:
        """Where each pixel looks: x, y, t and how much is seen of it."""
        self._draw({"COORDINATES"}, more, camera, camera_from_view, viewport)

    def _draw(
        self,
        defines: set[str],
        uniforms: Mapping[str, Value],
        camera: Camera,
        camera_from_view: Rotation,
        viewport: Viewport,
    ) -> None:
        self._camera.bind(camera)
        self._shaders.draw(
            defines | camera_defines(camera) | view_defines(viewport),
            {**camera_uniforms(camera), **view_uniforms(viewport, camera_from_view), **uniforms},
        )
