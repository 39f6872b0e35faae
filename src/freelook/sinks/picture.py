"""A single picture: `out.png`, `.jpg`, `.webp`, `.bmp` or `.tiff`."""

from __future__ import annotations

from pathlib import Path

import cv2

from ..errors import SinkError
from ..types import Frame, Picture, Sink
from . import SinkSettings, check_output_file, refuse
from ._rgb import rgb24 as rgb24

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
