"""Several views out of one frame, in one picture: a renderer made of another one.

    quad      the view, straight ahead, and 60 degrees to the left and to the right, a quarter each
    pip       the view, and the whole fisheye in its lower right corner
    panorama  a strip of all around above the view

The projection and the field are those of the view that follows the head.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..errors import RenderError
from ..projections import PROJECTIONS
from ..rotations import body_from_view
from ..types import Picture
from ..viewport import Viewport, fitting
from . import Renderer
from .blank import black_of, plane_scales
from .window import rim_px

ASIDE_DEG = 60.0
INSET = 0.3  # of the height
STRIP = 0.25  # of the height, at most
FRAME_PX = 2  # black, around what lies on another view
SMALLEST_PX = 64


@dataclass(frozen=True)
class Part:
    """A view and where its top left pixel goes, both even; `frame_px` of black around it."""

    x: int
    y: int
    viewport: Viewport
    camera_from_view: Rotation
    frame_px: int = 0


class LayoutRenderer:
    """Renders `name` of LAYOUTS with another renderer. RenderError for an unknown name, and for a
    picture too small to be divided."""

    def __init__(self, renderer: Renderer, name: str) -> None:
        if name not in LAYOUTS:
            raise RenderError(f"unknown layout {name!r}; known: {', '.join(LAYOUTS)}")
        self._renderer = renderer
        self._parts = LAYOUTS[name]

    def render(
        self, picture: Picture, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> Picture:
        if min(viewport.size) < SMALLEST_PX:
            width, height = viewport.size
            raise RenderError(
                f"{width} x {height} pixels are too few for several views; "
                f"make both sides at least {SMALLEST_PX}"
            )
        whole = _blank(picture, viewport.size)
        for part in self._parts(camera, camera_from_view, viewport):
            view = self._renderer.render(picture, camera, part.camera_from_view, part.viewport)
            _put(view, part, whole)
        return whole


def _blank(picture: Picture, size: tuple[int, int]) -> Picture:
    """A black one in the same layout and colour."""
    planes = tuple(
        np.full((-(-size[1] // scale), -(-size[0] // scale), *plane.shape[2:]), black, np.uint8)
        for plane, scale, black in zip(
            picture.planes, plane_scales(picture), black_of(picture), strict=True
        )
    )
    return Picture(picture.layout, planes, picture.color)


def _put(view: Picture, part: Part, whole: Picture) -> None:
    width, height = part.viewport.size
    kinds = zip(view.planes, whole.planes, plane_scales(view), black_of(view), strict=True)
    for plane, target, scale, black in kinds:
        left, top, edge = part.x // scale, part.y // scale, part.frame_px // scale
        rows, columns = -(-height // scale), -(-width // scale)
        target[
            max(0, top - edge) : top + rows + edge, max(0, left - edge) : left + columns + edge
        ] = black
        target[top : top + rows, left : left + columns] = plane


def _even(length: float) -> int:
    return int(length) // 2 * 2


def _quad(camera: Camera, camera_from_view: Rotation, viewport: Viewport) -> Iterator[Part]:
    width, height = (_even(side / 2) for side in viewport.size)
    quarter = fitting((width, height), viewport.hfov_deg, viewport.projection)
    yield Part(0, 0, quarter, camera_from_view)
    for x, y, yaw_deg in ((width, 0, 0.0), (0, height, -ASIDE_DEG), (width, height, ASIDE_DEG)):
        yield Part(x, y, quarter, camera.camera_from_body * body_from_view(yaw_deg, 0.0))


def _pip(camera: Camera, camera_from_view: Rotation, viewport: Viewport) -> Iterator[Part]:
    yield Part(0, 0, viewport, camera_from_view)
    side = _even(min(viewport.size) * INSET)
    per_rad = float(camera.table.g[0]) / 2
    field_deg = float(np.degrees(2 * rim_px(camera) / per_rad))
    inset = fitting((side, side), field_deg, "crop")
    x, y = (_even(length) - side - _even(side / 10) for length in viewport.size)
    yield Part(x, y, inset, Rotation.identity(), FRAME_PX)


def _panorama(camera: Camera, camera_from_view: Rotation, viewport: Viewport) -> Iterator[Part]:
    width, height = viewport.size
    strip = PROJECTIONS["strip"]
    assert strip.tallest_deg is not None
    field_deg = max(strip.narrowest_deg, 2 * float(np.degrees(camera.theta_max)))
    high = _even(min(height * STRIP, width * strip.tallest_deg / field_deg))
    around = Viewport((width, high), field_deg, "strip")
    yield Part(0, 0, around, camera.camera_from_body * body_from_view(0.0, 0.0))
    yield Part(0, high, replace(viewport, size=(width, height - high)), camera_from_view)


LAYOUTS: dict[str, Callable[[Camera, Rotation, Viewport], Iterator[Part]]] = {
    "quad": _quad,
    "pip": _pip,
    "panorama": _panorama,
}
