"""Which renderer this machine's OpenGL offers without a window: `python -m freelook.egl`.

Asked in a process of its own (`renderer_name`), because a broken graphics driver may take the
asking process down with it.
"""

from __future__ import annotations

import ctypes
import subprocess
import sys

EGL_PLATFORM_SURFACELESS_MESA = 0x31DD
EGL_OPENGL_API = 0x30A2
GL_RENDERER = 0x1F01


def renderer_name(timeout_s: float = 15.0) -> str | None:
    """For example "llvmpipe (LLVM 15.0.6, 256 bits)"; None without EGL or OpenGL."""
    ask = [sys.executable, "-m", "freelook.egl"]
    try:
        answer = subprocess.run(ask, capture_output=True, text=True, timeout=timeout_s, check=False)
    except subprocess.TimeoutExpired:
        return None
    return answer.stdout.strip() or None if answer.returncode == 0 else None


def _ask_driver() -> str:
    """OSError or AttributeError where there is no EGL, or where it refuses."""
    egl = ctypes.CDLL("libEGL.so.1")
    for name in ("eglGetPlatformDisplay", "eglCreateContext", "eglGetProcAddress"):
        getattr(egl, name).restype = ctypes.c_void_p
    nothing = ctypes.c_void_p(None)
    display = ctypes.c_void_p(
        egl.eglGetPlatformDisplay(EGL_PLATFORM_SURFACELESS_MESA, nothing, nothing)
    )
    _require(egl.eglInitialize(display, nothing, nothing), "EGL does not initialise")
    _require(egl.eglBindAPI(EGL_OPENGL_API), "EGL has no OpenGL")
    context = ctypes.c_void_p(egl.eglCreateContext(display, nothing, nothing, nothing))
    _require(egl.eglMakeCurrent(display, nothing, nothing, context), "no OpenGL without a window")
    get_string = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_uint)(
        egl.eglGetProcAddress(b"glGetString")
    )
    return str(get_string(GL_RENDERER).decode())


def _require(done: int, problem: str) -> None:
    if not done:
        raise OSError(problem)


if __name__ == "__main__":
    print(_ask_driver())
