"""Where on the window each eye's view lies: one, or two for stereo goggles and cheap viewers.

There is one camera, so both eyes get the same view; what differs is where its middle lies.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..errors import SinkError

Layout = Literal["mono", "side-by-side", "top-bottom"]
LAYOUTS: tuple[Layout, ...] = ("mono", "side-by-side", "top-bottom")


@dataclass(frozen=True)
class Optics:
    """What the viewer's optics want.

    `offset_px` moves each eye's view towards the nose, in pixels of the window (away from it
    where negative); `k` are the coefficients of r^2 and r^4 by which a viewer's lens enlarges
    at r focal lengths of the view from the middle; the view is shrunk there as much before.
    """

    layout: Layout = "mono"
    offset_px: float = 0.0
    k: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if self.layout not in LAYOUTS:
            raise SinkError(f"no such layout of eyes: {self.layout}; known: {', '.join(LAYOUTS)}")
        if self.layout == "mono" and self.offset_px:
            raise SinkError("an offset of the eyes needs two of them: side-by-side or top-bottom")


@dataclass(frozen=True)
class Eye:
    """A rectangle of the window in pixels from its top left; its view's middle lies `shift_px` to
    the right of the rectangle's."""

    x: int
    y: int
    width: int
    height: int
    shift_px: float = 0.0


def eyes(optics: Optics, size: tuple[int, int]) -> list[Eye]:
    """The left eye first (top-bottom: on top). A window of an odd size has a black line."""
    width, height = max(size[0], 4), max(size[1], 4)
    if optics.layout == "mono":
        return [Eye(0, 0, width, height)]
    half = (width // 2, height) if optics.layout == "side-by-side" else (width, height // 2)
    second = (width - half[0], 0) if optics.layout == "side-by-side" else (0, height - half[1])
    return [Eye(0, 0, *half, optics.offset_px), Eye(*second, *half, -optics.offset_px)]
