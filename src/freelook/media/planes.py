"""Between PyAV's frames and our pictures, without copying or converting where possible."""

from __future__ import annotations

import av
import numpy as np
from av.video.reformatter import ColorRange, Colorspace

from ..types import ColorSpace, Layout, Matrix, Picture, Plane

LAYOUTS: dict[str, Layout] = {
    "yuv420p": "i420",
    "yuvj420p": "i420",
    "nv12": "nv12",
    "gray": "gray",
    "rgb24": "rgb24",
}
PIXEL_FORMATS: dict[Layout, str] = {
    "i420": "yuv420p",
    "nv12": "nv12",
    "gray": "gray",
    "rgb24": "rgb24",
}


def picture_from_av(frame: av.VideoFrame) -> Picture:
    """The planes of a decoded frame, as views that keep the frame alive.

    Pixel formats that are not one of ours (4:2:2, 10 bit, ...) are converted to i420, which
    costs a pass over the picture. Colour that the stream does not state is taken as BT.709 from
    720 lines up and BT.601 below, the usual assumption of players.
    """
    color = _color(frame)
    if frame.format.name not in LAYOUTS:
        frame = frame.reformat(format="yuv420p")
    layout = LAYOUTS[frame.format.name]
    channels = {"rgb24": (3,), "nv12": (1, 2)}.get(layout, (1, 1, 1))
    planes = tuple(
        _plane(plane, count) for plane, count in zip(frame.planes, channels, strict=False)
    )
    return Picture(layout, planes, color)


def av_from_picture(picture: Picture) -> av.VideoFrame:
    """A frame ready for an encoder, with its colour stated; the planes are copied."""
    width, height = picture.size
    frame = av.VideoFrame(width, height, PIXEL_FORMATS[picture.layout])
    for target, plane in zip(frame.planes, picture.planes, strict=True):
        rows = _plane(target, plane.shape[2] if plane.ndim == 3 else 1)
        np.copyto(rows, plane)
    frame.color_range = ColorRange.JPEG if picture.color.full_range else ColorRange.MPEG
    bt601 = picture.color.matrix == "bt601"
    frame.colorspace = Colorspace.ITU601 if bt601 else Colorspace.ITU709
    return frame


def _plane(plane: av.video.plane.VideoPlane, channels: int) -> Plane:
    rows: Plane = np.frombuffer(plane, np.uint8)  # type: ignore[call-overload]
    rows = rows.reshape(plane.height, plane.line_size)
    rows = rows[:, : plane.width * channels]
    return rows.reshape(plane.height, plane.width, channels) if channels > 1 else rows


def _color(frame: av.VideoFrame) -> ColorSpace:
    if frame.colorspace == Colorspace.ITU709:
        matrix: Matrix = "bt709"
    elif frame.colorspace in (Colorspace.ITU601, Colorspace.SMPTE170M, Colorspace.FCC):
        matrix = "bt601"
    else:
        matrix = "bt709" if frame.height >= 720 else "bt601"
    full = frame.color_range == ColorRange.JPEG or frame.format.name.startswith("yuvj")
    return ColorSpace(matrix, full)
