"""The rows of `bench render` for OpenGL: with the planes read back, and drawn only, as in a window.

Every view gets its picture anew: that it goes to the GPU is part of the price.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scipy.spatial.transform import Rotation

from ..egl import best_device
from ..errors import FreelookError
from ..renderers.choice import GlDevice, choose, has_moderngl

if TYPE_CHECKING:
    from .render import Scene, Way

READ_BACK, DRAWN = "freelook, OpenGL, planes read back", "freelook, OpenGL, drawn only"


def gl_ways(scene: Scene) -> list[tuple[str, Way | str]]:
    """(row's name, what to time), or (row's name, why it is skipped).

    Named after what draws, so that nobody takes software for a GPU.
    """
    try:
        device = choose("gl", best_device(), has_moderngl()).device
        assert device is not None
        name = f"{'software: ' if device.software else ''}{device.renderer}"
        return [
            (f"{READ_BACK}\n  {name}", _read_back(scene, device)),
            (f"{DRAWN}\n  {name}", _drawn(scene, device)),
        ]
    except FreelookError as error:
        return [(READ_BACK, str(error)), (DRAWN, str(error))]


def _read_back(scene: Scene, device: GlDevice) -> Way:
    from ..renderers.gl import GlRenderer

    renderer = GlRenderer(device.number)

    def work(camera_from_view: Rotation) -> None:
        renderer.render(replace(scene.i420), scene.camera, camera_from_view, scene.viewport)

    return work


def _drawn(scene: Scene, device: GlDevice) -> Way:
    from ..renderers.gl_context import open_context
    from ..renderers.gl_painter import Painter

    context = open_context(device.number)
    with context:
        painter = Painter(context)
        target = context.framebuffer([context.texture(scene.viewport.size, 4)])

    def work(camera_from_view: Rotation) -> None:
        with context:
            painter.load(replace(scene.i420), scene.camera, scene.viewport)
            target.use()
            from_top = (1.0, 1.0, -0.5, -0.5)
            painter.paint(
                scene.camera, camera_from_view, scene.viewport, pixel_from_fragment=from_top
            )
            context.finish()  # or only the asking would be timed

    return work
