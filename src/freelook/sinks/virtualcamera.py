"""A camera that other programs on this machine can open (v4l2loopback): `virtual-camera`."""

from __future__ import annotations

from typing import Any

from ..errors import MissingExtra, SinkError
from ..types import Frame, Sink
from . import SinkSettings, refuse
from ._rgb import rgb24

KIND = "virtual-camera"

HINT = (
    "on Linux: sudo apt install v4l2loopback-dkms, then "
    "sudo modprobe v4l2loopback exclusive_caps=1 card_label=freelook"
)


def recognises(argument: str) -> bool:
    return argument == "virtual-camera"


def check(argument: str, settings: SinkSettings) -> None:
    _library()


def open(argument: str, settings: SinkSettings) -> Sink:
    refuse(settings, "a virtual camera", "audio_from", "sdp", "bitrate")
    device = argument if argument.startswith("/") else None
    return VirtualCamera(_library(), settings, device)


class VirtualCamera:
    """Hands each frame to the system's virtual camera at once. SinkError where there is none."""

    def __init__(self, library: Any, settings: SinkSettings, device: str | None) -> None:
        width, height = settings.size
        try:
            self._camera = library.Camera(width, height, settings.fps, device=device)
        except (RuntimeError, OSError, ValueError) as error:
            raise SinkError(f"no virtual camera here ({error}); {HINT}") from None

    def write(self, frame: Frame) -> None:
        try:
            self._camera.send(rgb24(frame.picture))
        except (RuntimeError, OSError) as error:
            raise SinkError(f"the virtual camera went away: {error}") from None

    def close(self) -> None:
        self._camera.close()


def _library() -> Any:
    try:
        import pyvirtualcam
    except ModuleNotFoundError:
        raise MissingExtra("pyvirtualcam", "virtual-camera") from None
    return pyvirtualcam
