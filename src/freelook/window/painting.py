"""All eyes' views into one framebuffer, that of a window or one in memory."""

from __future__ import annotations

from typing import Any

from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..renderers.blank import Sampling
from ..renderers.gl_painter import Painter
from ..types import Picture
from ..viewport import Viewport, fitting
from .eyes import Eye, Optics, eyes


class EyesPainter:
    """Draws the newest picture in one direction for every eye. Its context must be current.

    `projection` may change from view to view.
    """

    def __init__(
        self,
        context: Any,
        optics: Optics | None = None,
        sampling: Sampling = "bilinear",
        projection: str = "perspective",
    ) -> None:
        self._context = context
        self.projection = projection
        self._optics = Optics() if optics is None else optics
        self._painter = Painter(context, sampling)
        self._viewport = Viewport((4, 4))

    def viewport(self, size: tuple[int, int], hfov_deg: float) -> Viewport:
        """Of each eye, in a window of this size; no wider than its projection allows there."""
        eye = eyes(self._optics, size)[0]
        wanted = fitting((eye.width, eye.height), hfov_deg, self.projection)
        if wanted != self._viewport:  # else the same one: what is known of it is kept
            self._viewport = wanted
        return self._viewport

    def load(
        self, picture: Picture, camera: Camera, size: tuple[int, int], hfov_deg: float
    ) -> None:
        """Bring a picture to the GPU. RenderError when it does not fit the camera."""
        self._painter.load(picture, camera, self.viewport(size, hfov_deg))

    def paint(
        self,
        target: Any,
        size: tuple[int, int],
        camera: Camera,
        camera_from_view: Rotation,
        hfov_deg: float,
        grey: float = 0.0,
    ) -> None:
        """Into `target` of `size`; `grey` 0 is live, 1 says that the video is lost."""
        target.use()
        target.viewport = (0, 0, *size)
        self._context.clear(0.0, 0.0, 0.0, 1.0)
        viewport = self.viewport(size, hfov_deg)
        lens = {"viewer_k": self._optics.k} if any(self._optics.k) else {}
        for eye in eyes(self._optics, size):
            target.viewport = (eye.x, size[1] - eye.y - eye.height, eye.width, eye.height)
            self._painter.paint(
                camera,
                camera_from_view,
                viewport,
                grey=grey,
                pixel_from_fragment=_pixel_from_fragment(eye, size),
                **lens,
            )


def _pixel_from_fragment(eye: Eye, size: tuple[int, int]) -> tuple[float, float, float, float]:
    """OpenGL counts from the bottom left, and the middle of its first pixel is (0.5, 0.5)."""
    return (1.0, -1.0, -eye.x - 0.5 - eye.shift_px, size[1] - eye.y - 0.5)
