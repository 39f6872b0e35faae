"""Notices that the display went away: an X server that ended, a connection that broke.

Xlib would end the whole programme then, without a word to it. Asked by `XSetIOErrorExitHandler`
(libX11 1.7 and later) it does not, and its calls do nothing from then on.
"""

from __future__ import annotations

import contextlib
import ctypes
from typing import Any

ON_ERROR = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)
ON_EXIT = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


class DisplayLoss:
    """`lost` turns true when it happened."""

    def __init__(self) -> None:
        self.lost = False

    def watch_x11(self, display: Any) -> None:
        """OSError or AttributeError where libX11 is missing or too old."""
        x11 = ctypes.CDLL("libX11.so.6")
        quiet, ended = ON_ERROR(lambda _display: 0), ON_EXIT(lambda _display, _data: self._lose())
        x11.XSetIOErrorExitHandler(ctypes.cast(display, ctypes.c_void_p), ended, None)
        x11.XSetIOErrorHandler(quiet)
        _forever.append((quiet, ended))

    def _lose(self) -> None:
        self.lost = True


_forever: list[tuple[Any, ...]] = []  # Xlib keeps calling them until the process ends


def watch_display(library: Any) -> DisplayLoss:
    """For the display that GLFW has open. Other systems than X11 end a window in their own way."""
    loss = DisplayLoss()
    with contextlib.suppress(OSError, AttributeError):
        if library.get_platform() == library.PLATFORM_X11:
            loss.watch_x11(library.get_x11_display())
    return loss
