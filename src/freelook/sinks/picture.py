"""A single picture: `out.png`, `.jpg`, `.webp`, `.bmp` or `.tiff`."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ..color import chroma_planes, rgb_from_yuv, to_codes
from ..errors import SinkError
from ..types import Frame, Picture, Plane, Sink
from . import SinkSettings, check_output_file, refuse

KIND = "picture"

SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff")
JPEG_QUALITY = 95


def recognises(argument: str) -> bool:
    return "://" not in argument and argument.lower().endswith(SUFFIXES)


def open(argument: str, settings: SinkSettings) -> Sink:
    refuse(settings, "a picture", "sdp", "bitrate")
    return PictureFile(argument, check_output_file(argument, overwrite=settings.overwrite))


class PictureFile:
    """Writes the first frame; SinkError for a second one."""

    def __init__(self, argument: str, path: Path) -> None:
        self._argument, self._path = argument, path
        self._written = False

    def write(self, frame: Frame) -> None:
        if self._written:
            raise SinkError(f"{self._argument} holds one picture; write a video file instead")
        write_picture(self._path, frame.picture)
        self._written = True

    def close(self) -> None:
        pass


def write_picture(path: Path, picture: Picture) -> None:
    """Encode by the file's suffix, with the picture's own colour matrix and range. SinkError."""
    options = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY] if path.suffix in (".jpg", ".jpeg") else []
    done, data = cv2.imencode(path.suffix.lower(), rgb24(picture)[..., ::-1], options)
    if not done:
        raise SinkError(f"{path}: OpenCV cannot write this kind of picture")
    try:
        path.write_bytes(data.tobytes())
    except OSError as error:
        raise SinkError(f"{path}: {error.strerror}") from None


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
