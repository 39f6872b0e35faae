"""A picture on the GPU: its planes as they are, one texture each, and the camera's table."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..camera import Camera
from ..types import Picture, Plane
from .gl_shader import Value
from .gl_uniforms import LENS_UNIT, LUMA_UNIT, OFFSETS_UNIT, U_UNIT, V_UNIT, color_uniforms

UNITS = (LUMA_UNIT, U_UNIT, V_UNIT)
DEFINES: dict[str, set[str]] = {
    "i420": {"PLANES"},
    "gray": {"PLANES"},
    "nv12": {"NV12"},
    "rgb24": set(),
}


def components(plane: Plane) -> int:
    return plane.shape[2] if plane.ndim == 3 else 1


class PictureTextures:
    """Textures for pictures, kept while their size and layout stay.

    `levels` is how many times a plane may be halved for `ANTIALIAS`; making the smaller levels
    takes a GPU little time, and a CPU that plays one a lot.
    """

    def __init__(self, context: Any) -> None:
        self._context = context
        self._linear = (context.LINEAR, context.LINEAR)
        self._textures: list[Any] = []
        self._picture: Picture | None = None
        self._levels = 0
        self._no_color = context.texture((1, 1), 1, b"\x80", alignment=1)

    def load(self, picture: Picture, levels: int = 0) -> None:
        """Take over the planes; a picture that is there already is left alone."""
        if picture is not self._picture:
            self._write(picture)
            self._picture, self._levels = picture, 0
        if levels > self._levels:
            for texture in self._textures:
                texture.build_mipmaps(0, levels)
            self._levels = levels

    @property
    def planes(self) -> list[Any]:
        """The texture of each plane."""
        return self._textures

    def defines(self) -> set[str]:
        return DEFINES[self._loaded.layout]

    def bind(self) -> dict[str, Value]:
        """Put the planes into their units; the uniforms that say so."""
        picture = self._loaded
        for unit, texture in zip(UNITS, self._textures, strict=False):
            texture.use(unit)
        uniforms: dict[str, Value] = {"luma": LUMA_UNIT, "chroma_u": U_UNIT, "chroma_v": V_UNIT}
        if picture.layout == "gray":
            self._no_color.use(U_UNIT)
            uniforms["chroma_v"] = U_UNIT
        return uniforms if picture.layout == "rgb24" else uniforms | color_uniforms(picture.color)

    @property
    def _loaded(self) -> Picture:
        assert self._picture is not None, "nothing was loaded"
        return self._picture

    def _write(self, picture: Picture) -> None:
        shapes = [((p.shape[1], p.shape[0]), components(p)) for p in picture.planes]
        if shapes != [(t.size, t.components) for t in self._textures]:
            for texture in self._textures:
                texture.release()
            self._textures = [
                self._context.texture(size, count, alignment=1) for size, count in shapes
            ]
            for texture in self._textures:
                texture.repeat_x = texture.repeat_y = False
        for texture, plane in zip(self._textures, picture.planes, strict=True):
            texture.filter = self._linear
            texture.write(np.ascontiguousarray(plane))


class CameraTextures:
    """The table, and the grid of a lens that is not round, of the camera last used."""

    def __init__(self, context: Any) -> None:
        self._context = context
        self._camera: Camera | None = None
        self._textures: list[tuple[int, Any]] = []

    def bind(self, camera: Camera) -> None:
        if camera is not self._camera:
            for _, texture in self._textures:
                texture.release()
            self._textures = self._make(camera)
            self._camera = camera
        for unit, texture in self._textures:
            texture.use(unit)

    def _make(self, camera: Camera) -> list[tuple[int, Any]]:
        g = camera.table.g
        made = [(LENS_UNIT, self._context.texture((len(g), 1), 1, g.tobytes(), dtype="f4"))]
        if camera.grid:
            offsets = np.ascontiguousarray(camera.grid.offsets)
            size = (offsets.shape[1], offsets.shape[0])
            texture = self._context.texture(size, 2, offsets.tobytes(), dtype="f4")
            made.append((OFFSETS_UNIT, texture))
        return made
