"""OpenGL without a window, through EGL; and the words for what goes wrong with it."""

from __future__ import annotations

from typing import Any

from ..errors import MissingExtra, RenderError

VERSION = 330


def moderngl() -> Any:
    """The library; MissingExtra without it."""
    try:
        import moderngl as library
    except ModuleNotFoundError:
        raise MissingExtra("moderngl", "gl") from None
    return library


def open_context(device: int = 0) -> Any:
    """A context of its own on the EGL device of this number, current on no thread.

    RenderError where there is no such device or no OpenGL 3.3.
    """
    library = moderngl()
    try:
        context = library.create_context(
            standalone=True, backend="egl", require=VERSION, device_index=device
        )
    except Exception as error:  # moderngl raises bare Exception, and ValueError for old versions
        raise RenderError(
            f"OpenGL {VERSION // 100}.{VERSION // 10 % 10} without a window cannot be had here "
            f"({error}); render on the CPU, or see what 'freelook doctor' says of graphics"
        ) from None
    context.__exit__(None, None, None)
    return context
