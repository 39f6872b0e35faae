"""The renderer for GPUs: view.glsl, which the page uses too, on the decoded planes.

The planes go up as they are and come back as they are: each is drawn by itself, with no way
through red, green and blue. Where a CPU plays the GPU (Mesa's llvmpipe) all works the same, but
slower than `cpu`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..types import Picture
from ..viewport import Viewport
from .blank import Sampling, black_of, plane_scales
from .gl_context import open_context
from .gl_painter import Painter
from .gl_picture import UNITS, components
from .gl_shader import Value
from .gl_target import Targets

# From gl_FragCoord to pixels of what is read back with its first row on top.
FROM_TOP = (1.0, 1.0, -0.5, -0.5)


class GlRenderer:
    """Renders views with OpenGL, off-screen, on the EGL device of this number.

    `antialias` takes the mean over every view pixel where the view shrinks the picture. One
    renderer serves one caller at a time, on any thread. RenderError where there is no OpenGL,
    MissingExtra without moderngl.
    """

    def __init__(
        self, device: int = 0, *, sampling: Sampling = "bilinear", antialias: bool = True
    ) -> None:
        self._context = open_context(device)
        self.name = str(self._context.info["GL_RENDERER"])
        with self._context:
            self._painter = Painter(self._context, sampling, antialias)
            self._targets = Targets(self._context)

    def close(self) -> None:
        """Give the GPU's memory back; nothing can be rendered after it."""
        with self._context:
            self._targets.release()
        self._context.release()  # and with it all that it knows

    def render(
        self, picture: Picture, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> Picture:
        with self._context:
            self._painter.load(picture, camera, viewport)
            self._painter.picture.bind()
            drawn = []
            for number, (plane, scale, black) in enumerate(
                zip(picture.planes, plane_scales(picture), black_of(picture), strict=True)
            ):
                drawn.append(
                    self._targets.used(
                        viewport.size, number=number, scale=scale, count=components(plane)
                    )
                )
                uniforms = _of_plane(UNITS[number], scale, black)
                self._painter.paint_plane(camera, camera_from_view, viewport, **uniforms)
            # all are asked for before the first is waited for
            planes = tuple(target.read() for target in drawn)
        return Picture(picture.layout, planes, picture.color)

    def render_rgb(
        self, picture: Picture, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> Picture:
        """The view as a screen shows it, rgb24: the colour is made in the shader."""
        with self._context:
            self._painter.load(picture, camera, viewport)
            target = self._targets.used(viewport.size, count=3)
            more: dict[str, Value] = {"pixel_from_fragment": FROM_TOP}
            self._painter.paint(camera, camera_from_view, viewport, **more)
            return Picture("rgb24", (target.read(),), picture.color)

    def coordinates(
        self, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> NDArray[np.float32]:
        """Where each view pixel looks, as rendered: float32 (2, height, width); NaN where the
        lens does not see. There must be a picture, which says how large pictures are."""
        with self._context:
            target = self._targets.used(viewport.size, count=4, kind="f4")
            more: dict[str, Value] = {"pixel_from_fragment": FROM_TOP}
            self._painter.paint_coordinates(camera, camera_from_view, viewport, **more)
            values = target.read()
        pixels = np.ascontiguousarray(np.moveaxis(values[..., :2], -1, 0))
        pixels[:, values[..., 2] > camera.table.t_max] = np.nan
        return pixels


def _of_plane(unit: int, scale: int, black: int) -> dict[str, Value]:
    return {
        "luma": unit,
        "plane_scale": float(scale),
        "plane_black": (black / 255,) * 4,
        # pixel i of the plane stands in the middle of view pixels scale i to scale i + scale - 1
        "pixel_from_fragment": (scale, scale, -0.5, -0.5),
    }
