"""Pictures as the calibration page gets them, and as the search for the target does."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..color import chroma_planes, yuv_from_rgb_matrix
from ..types import Picture

LONGEST_PX = 1280
QUALITY = 75


def luma(picture: Picture) -> NDArray[np.uint8]:
    """(rows, columns) of any picture."""
    if picture.layout == "rgb24":
        return np.asarray(cv2.cvtColor(picture.planes[0], cv2.COLOR_RGB2GRAY), np.uint8)
    return picture.planes[0]


def jpeg(picture: Picture, longest_px: int = LONGEST_PX) -> bytes:
    """The whole picture in colour, made smaller if it is larger than that."""
    width, height = picture.size
    scale = min(1.0, longest_px / max(width, height))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    parameters = [cv2.IMWRITE_JPEG_QUALITY, QUALITY]
    _, data = cv2.imencode(".jpg", _bgr(picture, size), parameters)
    return bytes(data)


def _bgr(picture: Picture, size: tuple[int, int]) -> NDArray[np.uint8]:
    first = _resized(picture.planes[0], size)
    if picture.layout == "gray":
        return first
    if picture.layout == "rgb24":
        return np.asarray(cv2.cvtColor(first, cv2.COLOR_RGB2BGR), np.uint8)
    yuv = cv2.merge([first, *(_resized(plane, size) for plane in chroma_planes(picture))])
    matrix, offset = yuv_from_rgb_matrix(picture.color)
    to_rgb = 255 * np.linalg.inv(matrix)
    affine = np.column_stack([to_rgb, -to_rgb @ offset])[::-1]
    return np.asarray(cv2.transform(yuv, affine), np.uint8)


def _resized(plane: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    larger = size[0] > plane.shape[1] or size[1] > plane.shape[0]
    way = cv2.INTER_LINEAR if larger else cv2.INTER_AREA
    return np.asarray(cv2.resize(np.ascontiguousarray(plane), size, interpolation=way), np.uint8)
