"""Renderers: a picture, a camera, a direction and a viewport in; the view out.

`reference` is the definition in NumPy, one file to read first. `cpu` is the fast one.
"""

from __future__ import annotations

from typing import Protocol

from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..types import Picture
from ..viewport import Viewport


class Renderer(Protocol):
    """What every renderer supplies.

    `camera_from_view` turns rays of the view (x right, y down, z forward) into the camera
    frame. The view has the picture's layout and colour. Where the lens sees nothing it is black.
    RenderError when the picture does not fit the camera.
    """

    def render(
        self, picture: Picture, camera: Camera, camera_from_view: Rotation, viewport: Viewport
    ) -> Picture: ...
