"""Draws a HUD's shapes into the planes of a picture, for what is recorded with it on purpose.

The same ink as the OpenGL pen's, blended in the planes' own code values, which are linear in red,
green and blue: luma gets what a screen would show; a chroma sample the mean over its four pixels.
"""

from __future__ import annotations

from collections.abc import Iterable

import numba
import numpy as np
from numpy.typing import NDArray

from ..color import yuv_from_rgb_matrix
from ..hud.definition import Theme
from ..hud.ink import Float32s, Ink, Inker
from ..hud.shapes import Shape
from ..types import Picture
from .blank import plane_scales

Bytes = NDArray[np.uint8]
OPAQUE = 255.0


class CpuPen:
    """One theme at `ratio` pixels per point, for one thread at a time."""

    def __init__(self, theme: Theme, ratio: float) -> None:
        self._theme = theme
        self._inker = Inker(theme, ratio)

    def drawn(self, shapes: Iterable[Iterable[Shape]], picture: Picture) -> Picture:
        """A copy of the picture with groups of shapes on it, one over the other."""
        planes = tuple(np.array(plane) for plane in picture.planes)
        inks = [self._inker.ink(group) for group in shapes]
        sheets = self._inker.sheets
        covered = sheets.together() if len(sheets) else np.zeros((1, 1, 2), np.uint8)
        for channels, plane, scale in zip(
            _channels(picture), planes, plane_scales(picture), strict=True
        ):
            deep = plane.reshape(*plane.shape[:2], -1)
            for ink in inks:
                self._draw(ink, covered, picture, deep, scale, channels)
        return Picture(picture.layout, planes, picture.color)

    def _draw(
        self,
        ink: Ink,
        covered: Bytes,
        picture: Picture,
        plane: Bytes,
        scale: int,
        channels: list[int],
    ) -> None:
        colors = _codes(ink.pieces[:, 5:8], picture)[:, channels]
        blend_pieces(plane, scale, ink.pieces, np.ascontiguousarray(colors))
        letters = ink.letters
        rim = np.array([self._theme.rim], np.float32)
        rims = np.repeat(_codes(rim[:, :3], picture)[:, channels], len(letters), axis=0)
        shares = letters[:, 9:10] * np.array([[self._theme.rim[3], 1.0]], np.float32)
        blend_letters(plane, scale, letters, covered, rims, shares[:, 0].copy(), 1)
        colors = np.ascontiguousarray(_codes(letters[:, 6:9], picture)[:, channels])
        blend_letters(plane, scale, letters, covered, colors, shares[:, 1].copy(), 0)


def _channels(picture: Picture) -> list[list[int]]:
    """Which of red, green, blue or Y, U, V each plane has."""
    known = {"i420": [[0], [1], [2]], "nv12": [[0], [1, 2]], "gray": [[0]], "rgb24": [[0, 1, 2]]}
    return known[picture.layout]


def _codes(rgb: Float32s, picture: Picture) -> Float32s:
    """(n, 3): code values of colours."""
    if picture.layout == "rgb24":
        return np.asarray(rgb * np.float32(255))
    matrix, offset = yuv_from_rgb_matrix(picture.color)
    return np.asarray(rgb @ matrix.T + offset, dtype=np.float32)


@numba.njit(cache=True, nogil=True)
def blend_pieces(plane: Bytes, scale: int, pieces: Float32s, colors: Float32s) -> None:
    """As pen.glsl draws them: plane (rows, columns, channels), `scale` times smaller than the view;
    pieces (n, 9) in pixels of the view; colors (n, channels) in code values."""
    for k in range(len(pieces)):
        x0, y0, x1, y1, half = pieces[k, 0], pieces[k, 1], pieces[k, 2], pieces[k, 3], pieces[k, 4]
        length = max(np.hypot(x1 - x0, y1 - y0), 1e-6)
        way_x, way_y = (x1 - x0) / length, (y1 - y0) / length
        joint = min(0.15 * half, 0.5)
        reach = half + 1.0
        top = max(0, int((min(y0, y1) - reach) // scale))
        bottom = min(plane.shape[0], int((max(y0, y1) + reach) // scale) + 1)
        left = max(0, int((min(x0, x1) - reach) // scale))
        right = min(plane.shape[1], int((max(x0, x1) + reach) // scale) + 1)
        for row in range(top, bottom):
            for column in range(left, right):
                covered = 0.0
                for sub in range(scale * scale):
                    x = column * scale + sub % scale + 0.5 - x0
                    y = row * scale + sub // scale + 0.5 - y0
                    along = x * way_x + y * way_y
                    if -joint <= along <= length + joint:
                        across = abs(y * way_x - x * way_y)
                        covered += min(max(half + 0.5 - across, 0.0), 1.0)
                if covered > 0:
                    share = pieces[k, 8] * covered / (scale * scale)
                    for c in range(plane.shape[2]):
                        value = plane[row, column, c] * (1 - share) + colors[k, c] * share
                        plane[row, column, c] = min(max(int(value + 0.5), 0), 255)


@numba.njit(cache=True, nogil=True)
def blend_letters(
    plane: Bytes,
    scale: int,
    letters: Float32s,
    covered: Bytes,
    colors: Float32s,
    shares: Float32s,
    layer: int,
) -> None:
    """Letters (n, 10) of the sheets `covered`: their rims (layer 1) or strokes (layer 0)."""
    for k in range(len(letters)):
        left, top = int(letters[k, 0]), int(letters[k, 1])
        wide, high = int(letters[k, 2]), int(letters[k, 3])
        sheet_x, sheet_y = int(letters[k, 4]), int(letters[k, 5])
        for row in range(max(0, top // scale), min(plane.shape[0], (top + high) // scale + 1)):
            for column in range(
                max(0, left // scale), min(plane.shape[1], (left + wide) // scale + 1)
            ):
                total = 0.0
                for sub in range(scale * scale):
                    x = column * scale + sub % scale - left
                    y = row * scale + sub // scale - top
                    if 0 <= x < wide and 0 <= y < high:
                        total += covered[sheet_y + y, sheet_x + x, layer]
                if total > 0:
                    share = shares[k] * total / (OPAQUE * scale * scale)
                    for c in range(plane.shape[2]):
                        value = plane[row, column, c] * (1 - share) + colors[k, c] * share
                        plane[row, column, c] = min(max(int(value + 0.5), 0), 255)
