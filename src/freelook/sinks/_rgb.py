"""Any picture as red, green and blue, for sinks whose other side wants that."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..color import chroma_planes, rgb_from_yuv, to_codes
from ..types import Picture, Plane


def rgb24(picture: Picture) -> Plane:
    """(height, width, 3) of any picture; chroma is interpolated between its samples."""
    luma = picture.planes[0]
    if picture.layout == "rgb24":
        return luma
    yuv = np.full((*luma.shape, 3), 128.0)
    yuv[..., 0] = luma
    if picture.layout != "gray":
        u, v = chroma_planes(picture)
        yuv[..., 1], yuv[..., 2] = _doubled(u, luma.shape), _doubled(v, luma.shape)
    return to_codes(255 * rgb_from_yuv(yuv, picture.color))


def _doubled(plane: Plane, shape: tuple[int, ...]) -> NDArray[np.float32]:
    wide = (plane.shape[1] * 2, plane.shape[0] * 2)
    doubled = cv2.resize(plane.astype(np.float32), wide, interpolation=cv2.INTER_LINEAR)
    return np.asarray(doubled[: shape[0], : shape[1]])
