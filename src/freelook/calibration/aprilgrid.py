"""AprilGrids: tags of the family 36h11 with small dark squares between their corners (Kalibr's).

Tags are numbered row by row from the bottom left, and the target's y points up, as in Kalibr. Each
corner of a tag touches the corner of a small square, so that it can be placed like a chessboard's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import CalibrationError
from ..lens import Floats
from ._markers import Plan, dictionary, find_corners, find_markers, marker_bits
from ._saddles import Gray
from .drawing import Drawing, squares
from .views import FEWEST_POINTS, View

FAMILY = "apriltag_36h11"
SEARCH = 0.65  # of the space between tags; the next corner is of the other kind
CLEAR = 0.85  # of that space: beyond, blur mixes in what the next corner's edges are like
BORDERS = (2, 1)  # dark bits around a tag: Kalibr's, and those of other programs


@dataclass(frozen=True)
class AprilGrid:
    """`tags` across and up, side of a tag, space between tags as a share of that side."""

    tags: tuple[int, int]
    tag: float
    spacing: float = 0.3

    def __post_init__(self) -> None:
        columns, rows = self.tags
        there = len(dictionary(FAMILY).bytesList)
        if not 1 <= columns * rows <= there or columns < 1:
            raise CalibrationError(f"{columns} x {rows} tags: there are 1 to {there} of 36h11")
        if not (0 < self.tag < np.inf and 0 < self.spacing <= 1):
            raise CalibrationError(
                f"tags of {self.tag:g} with {self.spacing:g} of that between them: the side must "
                "be positive, the space 0 to 1"
            )

    named = True

    @property
    def text(self) -> str:
        return f"aprilgrid:{self.tags[0]}x{self.tags[1]}:{self.tag:g}:{self.spacing:g}"

    @cached_property
    def points(self) -> Floats:
        """(n, 3): the tags' corners, row by row from the bottom left, y up; Kalibr's order."""
        (columns, rows), pitch = self.tags, self.tag * (1 + self.spacing)
        x = (np.arange(columns)[:, None] * pitch + [0, self.tag]).ravel()
        y = (np.arange(rows)[:, None] * pitch + [0, self.tag]).ravel()
        across, up = np.meshgrid(x, y)
        return np.stack([across.ravel(), up.ravel(), np.zeros(across.size)], axis=-1)

    def find(self, gray: Gray, name: str) -> View | None:
        best: View | None = None
        for border in BORDERS:
            numbers, seen = find_markers(gray, FAMILY, self.tags[0] * self.tags[1], border)
            which, pixels = find_corners(gray, self._plan, numbers, seen)
            if len(which) >= FEWEST_POINTS and (best is None or len(which) > len(best.pixels)):
                best = View(name, self.points[which], pixels)
            if len(numbers):
                break
        return best

    @property
    def drawing(self) -> Drawing:
        (columns, rows), gap = self.tags, self.tag * self.spacing
        pitch, margin = self.tag + gap, 2 * gap
        width, height = (n * pitch - gap + 2 * margin for n in (columns, rows))
        shapes = []
        for number in range(columns * rows):
            x = margin + number % columns * pitch
            y = height - margin - self.tag - number // columns * pitch
            bits = marker_bits(FAMILY, number, BORDERS[0])[::-1, ::-1]  # Kalibr's are upside down
            shapes.append(squares(bits, self.tag / len(bits), x, y))
        across = margin - gap + np.arange(columns + 1) * pitch
        down = margin - gap + np.arange(rows + 1) * pitch
        corners = np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 2)
        between = np.column_stack([corners, np.full_like(corners, gap)])
        return Drawing((width, height), np.concatenate([*shapes, between]))

    @cached_property
    def _plan(self) -> Plan:
        columns, rows = self.tags
        flat = self.points[:, :2].reshape(2 * rows, 2 * columns, 2) / self.tag
        tags = flat.reshape(rows, 2, columns, 2, 2).swapaxes(1, 2).reshape(-1, 2, 2, 2)
        bottom, top = tags[:, 0], tags[:, 1]
        # OpenCV's first corner is its own top left, which is the bottom right of Kalibr's tag
        markers = np.stack([bottom[:, 1], bottom[:, 0], top[:, 0], top[:, 1]], axis=1)
        # at the bottom left of a tag it is the squares on the diagonal that are dark
        signs = np.where(np.indices((2 * rows, 2 * columns)).sum(axis=0) % 2 == 0, -1.0, 1.0)
        clear, search = CLEAR * self.spacing, SEARCH * self.spacing
        return Plan(markers, self.points[:, :2] / self.tag, signs.ravel(), clear, search)
