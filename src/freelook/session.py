"""The whole programme in one step: the newest frame, the pose for now, one view.

No clock, no thread, no protocol in here: whoever owns them calls `step`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from scipy.spatial.transform import Rotation

from .camera import Camera
from .gimbal import LensLimit
from .mailbox import Mailbox
from .renderers import Renderer
from .rotations import FRD_FROM_RDF
from .types import Frame, Picture
from .viewport import Viewport

Aim = Callable[[int, int], Rotation]
"""`body_from_view` for the time at which a view is displayed, and for that at which the frame it
shows was taken; both in nanoseconds."""


@dataclass(frozen=True, slots=True)
class View:
    """A rendered picture that carries where it looks and its times.

    `redrawn` is true when no new frame came since the view before: the same frame, a new pose.
    """

    picture: Picture
    body_from_view: Rotation
    capture_ns: int
    media_ns: int | None
    display_ns: int
    redrawn: bool


class Session:
    """Points a viewport into the newest frame.

    Frames of another size than the camera's are taken as the camera's whole picture scaled, if
    they have its shape; otherwise `step` raises RenderError, as the renderer does. With `limit`
    the view stays inside the lens; without, what the lens does not see is black.
    """

    def __init__(
        self,
        frames: Mailbox[Frame],
        camera: Camera,
        aim: Aim,
        renderer: Renderer,
        viewport: Viewport,
        limit: LensLimit | None = None,
    ) -> None:
        self.viewport = viewport
        self._limit = limit
        self._frames = frames
        self._camera = camera
        self._aim = aim
        self._renderer = renderer
        self._frame: Frame | None = None

    def step(self, now_ns: int) -> View | None:
        """The view to be displayed at `now_ns`; None before the first frame."""
        fresh = self._frames.take()
        frame = self._frame = fresh or self._frame
        if frame is None:
            return None
        camera = self._camera_for(frame.picture)
        body_from_view = self._aim(now_ns, frame.capture_ns)
        if self._limit is not None:
            body_from_view = self._limit(body_from_view, self.viewport, now_ns)
        picture = self._renderer.render(
            frame.picture, camera, camera.camera_from_body * body_from_view, self.viewport
        )
        return View(
            picture, body_from_view, frame.capture_ns, frame.media_ns, now_ns, fresh is None
        )

    def _camera_for(self, picture: Picture) -> Camera:
        if picture.size != self._camera.size and same_shape(picture.size, self._camera.size):
            self._camera = self._camera.resized(picture.size)
        return self._camera


def same_shape(size: tuple[int, int], other: tuple[int, int]) -> bool:
    """Whether two pictures can be the same one at two sizes: sides in proportion to a pixel."""
    (width, height), (other_width, other_height) = size, other
    return abs(width * other_height - other_width * height) <= max(other)


def camera_from_head(camera: Camera) -> Rotation:
    """From the axes of a head looking straight ahead (x right, y down, z forward) to the
    camera's: what a viewer needs that knows head angles but no vehicle."""
    return camera.camera_from_body * FRD_FROM_RDF
