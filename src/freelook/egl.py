"""Which renderers this machine's OpenGL offers without a window: `python -m freelook.egl`.

Asked in a process of its own (`devices`), because a broken graphics driver may take the asking
process down with it.
"""

from __future__ import annotations

import ctypes
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # what would slow down the process that asks
    from .renderers.choice import GlDevice

EGL_PLATFORM_DEVICE = 0x313F
EGL_PLATFORM_SURFACELESS_MESA = 0x31DD
EGL_OPENGL_API = 0x30A2
GL_RENDERER = 0x1F01
MOST_DEVICES = 16

# where Linux shows that there may be a GPU; "dxg" is that of Windows underneath
GPU_NODES = ("dri/renderD*", "nvidia[0-9]*", "dxg")


def best_device(timeout_s: float = 15.0) -> GlDevice | None:
    """The first real GPU, else software; None without EGL or OpenGL."""
    found = devices(timeout_s)
    real = [device for device in found if not device.software]
    return next(iter(real or found), None)


def may_have_gpu(nodes: Path = Path("/dev")) -> bool:
    """False where asking the drivers, which takes a moment, would only find software."""
    return sys.platform != "linux" or any(next(nodes.glob(name), None) for name in GPU_NODES)


def devices(timeout_s: float = 15.0) -> list[GlDevice]:
    """Every device that gives an OpenGL context without a window."""
    from .renderers.choice import GlDevice

    ask = [sys.executable, "-m", "freelook.egl"]
    try:
        answer = subprocess.run(ask, capture_output=True, text=True, timeout=timeout_s, check=False)
    except subprocess.TimeoutExpired:
        return []
    lines = (line.partition("\t") for line in answer.stdout.splitlines())
    return [GlDevice(int(number), name) for number, _, name in lines if number.isdigit()]


def _ask_drivers() -> Iterator[tuple[int, str]]:
    """(number, renderer) of every device that works; OSError or AttributeError without EGL."""
    egl = ctypes.CDLL("libEGL.so.1")
    for name in ("eglGetPlatformDisplay", "eglCreateContext", "eglGetProcAddress"):
        getattr(egl, name).restype = ctypes.c_void_p
    listed = _device_list(egl)
    for number, device in enumerate(listed):
        try:
            yield number, _renderer(egl, EGL_PLATFORM_DEVICE, device)
        except OSError:
            continue  # a GPU that this user may not use, for one
    if not listed:
        yield 0, _renderer(egl, EGL_PLATFORM_SURFACELESS_MESA, None)


def _device_list(egl: ctypes.CDLL) -> list[int | None]:
    address = egl.eglGetProcAddress(b"eglQueryDevicesEXT")
    if not address:
        return []
    found = (ctypes.c_void_p * MOST_DEVICES)()
    count = ctypes.c_int(0)
    query = ctypes.CFUNCTYPE(
        ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.POINTER(ctypes.c_int)
    )(address)
    if not query(MOST_DEVICES, ctypes.cast(found, ctypes.c_void_p), ctypes.byref(count)):
        return []
    return list(found[: count.value])


def _renderer(egl: ctypes.CDLL, platform: int, native: int | None) -> str:
    nothing = ctypes.c_void_p(None)
    display = ctypes.c_void_p(egl.eglGetPlatformDisplay(platform, ctypes.c_void_p(native), nothing))
    _require(egl.eglInitialize(display, nothing, nothing), "EGL does not initialise")
    _require(egl.eglBindAPI(EGL_OPENGL_API), "EGL has no OpenGL")
    context = ctypes.c_void_p(egl.eglCreateContext(display, nothing, nothing, nothing))
    _require(egl.eglMakeCurrent(display, nothing, nothing, context), "no OpenGL without a window")
    get_string = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_uint)(
        egl.eglGetProcAddress(b"glGetString")
    )
    name = str(get_string(GL_RENDERER).decode())
    egl.eglMakeCurrent(display, nothing, nothing, nothing)
    return name


def _require(done: int, problem: str) -> None:
    if not done:
        raise OSError(problem)


if __name__ == "__main__":
    for number, name in _ask_drivers():
        print(f"{number}\t{name}", flush=True)
