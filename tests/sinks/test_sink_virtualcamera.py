"""The virtual camera, with a library that behaves as pyvirtualcam's documentation says."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from freelook.errors import MissingExtra, SinkError
from freelook.sinks import open_sink, virtualcamera
from freelook.types import Frame, Picture, Plane

RGB = Frame(Picture("rgb24", (np.full((48, 64, 3), 77, np.uint8),)), 0)


class Camera:
    """RuntimeError where the system has none."""

    made: ClassVar[list[tuple[Any, ...]]] = []
    there = True

    def __init__(self, width: int, height: int, fps: float, *, device: str | None) -> None:
        if not self.there:
            raise RuntimeError("no v4l2loopback device found")
        self.made.append((width, height, fps, device))
        self.sent: list[Plane] = []

    def send(self, picture: Plane) -> None:
        if not self.there:
            raise RuntimeError("device closed")
        self.sent.append(picture)

    def close(self) -> None:
        self.sent = []


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> type[Camera]:
    class Fresh(Camera):
        made: ClassVar[list[tuple[Any, ...]]] = []

    monkeypatch.setitem(sys.modules, "pyvirtualcam", SimpleNamespace(Camera=Fresh))
    return Fresh


def test_frames_go_to_the_camera(library: type[Camera]) -> None:
    sink = open_sink("virtual-camera:/dev/video9", size=(64, 48), fps=25)
    assert isinstance(sink, virtualcamera.VirtualCamera)
    sink.write(RGB)
    assert library.made == [(64, 48, 25, "/dev/video9")]
    assert (sink._camera.sent[0] == 77).all()
    sink.close()
    open_sink("virtual-camera", size=(64, 48)).close()
    assert library.made[1][3] is None


def test_a_system_without_one_says_how_to_have_one(library: type[Camera]) -> None:
    sink = open_sink("virtual-camera", size=(64, 48))
    library.there = False
    with pytest.raises(SinkError, match="went away"):
        sink.write(RGB)
    with pytest.raises(SinkError, match="modprobe v4l2loopback"):
        open_sink("virtual-camera", size=(64, 48))


def test_without_the_library_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyvirtualcam", None)
    with pytest.raises(MissingExtra, match=r"freelook\[virtual-camera\]"):
        open_sink("virtual-camera", size=(64, 48))
