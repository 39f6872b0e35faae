"""Between RGB and the planes of video, in float64: the reference for every renderer.

    Y = kr R + kg G + kb B;  Cb = (B - Y) / (2 (1 - kb));  Cr = (R - Y) / (2 (1 - kr))

with (kr, kb) of ITU-R BT.601 or BT.709. Limited range puts Y in 16..235 and chroma in 16..240,
full range uses 0..255; chroma is centred on 128 in both. RGB means gamma-encoded R'G'B' in 0..1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .types import ColorSpace, Picture, Plane

Floats = NDArray[np.float64]

LUMA_WEIGHTS = {"bt601": (0.299, 0.114), "bt709": (0.2126, 0.0722)}  # kr, kb


def yuv_from_rgb_matrix(color: ColorSpace) -> tuple[Floats, Floats]:
    """(3x3, offset): code values (Y, Cb, Cr) = matrix @ RGB + offset, RGB in 0..1."""
    kr, kb = LUMA_WEIGHTS[color.matrix]
    luma = np.array([kr, 1 - kr - kb, kb])
    blue = (np.array([0.0, 0.0, 1.0]) - luma) / (2 * (1 - kb))
    red = (np.array([1.0, 0.0, 0.0]) - luma) / (2 * (1 - kr))
    y_scale, c_scale, y_zero = (255.0, 255.0, 0.0) if color.full_range else (219.0, 224.0, 16.0)
    matrix = np.array([luma * y_scale, blue * c_scale, red * c_scale])
    return matrix, np.array([y_zero, 128.0, 128.0])


def yuv_from_rgb(rgb: Floats, color: ColorSpace) -> Floats:
    """Code values (..., 3) of RGB (..., 3) in 0..1; not rounded, not clipped."""
    matrix, offset = yuv_from_rgb_matrix(color)
    return np.asarray(rgb @ matrix.T + offset)


def rgb_from_yuv(yuv: Floats, color: ColorSpace) -> Floats:
    """RGB (..., 3) of code values (..., 3); below 0 or above 1 where no screen can show it."""
    matrix, offset = yuv_from_rgb_matrix(color)
    return np.asarray((np.asarray(yuv, dtype=np.float64) - offset) @ np.linalg.inv(matrix).T)


def i420_from_rgb(rgb: Floats, color: ColorSpace) -> Picture:
    """An i420 picture of RGB (height, width, 3) in 0..1; chroma is the mean of its 2x2 pixels.

    At an odd border the last column or row counts twice.
    """
    yuv = yuv_from_rgb(np.asarray(rgb, dtype=np.float64), color)
    rows, columns = yuv.shape[:2]
    even = np.pad(yuv[..., 1:], ((0, rows % 2), (0, columns % 2), (0, 0)), mode="edge")
    chroma = (even[::2, ::2] + even[1::2, ::2] + even[::2, 1::2] + even[1::2, 1::2]) / 4
    planes = (to_codes(yuv[..., 0]), to_codes(chroma[..., 0]), to_codes(chroma[..., 1]))
    return Picture("i420", planes, color)


def rgb_from_picture(picture: Picture) -> Floats:
    """RGB (height, width, 3) of any picture, clipped to 0..1; chroma is repeated, not smoothed."""
    if picture.layout == "rgb24":
        return np.asarray(picture.planes[0] / 255.0)
    luma = picture.planes[0].astype(np.float64)
    yuv = np.full((*luma.shape, 3), 128.0)
    yuv[..., 0] = luma
    if picture.layout != "gray":
        u, v = chroma_planes(picture)
        rows, columns = luma.shape
        for channel, plane in ((1, u), (2, v)):
            yuv[..., channel] = plane.repeat(2, axis=0).repeat(2, axis=1)[:rows, :columns]
    return np.clip(rgb_from_yuv(yuv, picture.color), 0.0, 1.0)


def chroma_planes(picture: Picture) -> tuple[Plane, Plane]:
    """(U, V) of an i420 or nv12 picture, as views."""
    if picture.layout == "nv12":
        return picture.planes[1][..., 0], picture.planes[1][..., 1]
    return picture.planes[1], picture.planes[2]


def rgb24_from_rgb(rgb: Floats) -> Picture:
    """An rgb24 picture of RGB (height, width, 3) in 0..1."""
    return Picture("rgb24", (to_codes(np.asarray(rgb, dtype=np.float64) * 255.0),))


def to_codes(values: Floats) -> Plane:
    """Rounded and clipped to 0..255."""
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)
