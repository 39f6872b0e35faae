"""Single pictures from files."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from ..errors import SourceError
from ..types import ColorSpace, Frame, Picture

SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff")


def is_picture(path: str) -> bool:
    """By its name."""
    return path.lower().endswith(SUFFIXES)


def read_picture(path: str) -> Frame:
    """The picture in a file as rgb24, turned as its EXIF data say. SourceError if it is none."""
    try:
        data = np.frombuffer(Path(path).read_bytes(), np.uint8)
    except OSError as error:
        raise SourceError(f"{path}: {error.strerror}") from None
    try:
        bgr = cv2.imdecode(data, cv2.IMREAD_COLOR) if data.size else None
    except cv2.error:
        bgr = None
    if bgr is None:
        raise SourceError(f"{path}: not a picture that OpenCV can read")
    rgb = np.ascontiguousarray(bgr[..., ::-1], dtype=np.uint8)
    return Frame(Picture("rgb24", (rgb,), ColorSpace(full_range=True)), 0, 0)
