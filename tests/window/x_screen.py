"""A display without a screen (Xvfb): what it shows, and keys and wishes sent to windows on it."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

KEY_PRESS, KEY_RELEASE, BUTTON_PRESS, BUTTON_RELEASE, MOTION, CLIENT_MESSAGE = 2, 3, 4, 5, 6, 33
# what a window must have asked for to be sent it: 0 is sent to its owner in any case
MASKS = {KEY_PRESS: 1, KEY_RELEASE: 2, BUTTON_PRESS: 4, BUTTON_RELEASE: 8, MOTION: 64}
KEYSYMS = {"right": 0xFF53, "left": 0xFF51, "q": 0x71, "f": 0x66}
DEPTH = 24


class XKeyEvent(ctypes.Structure):
    """Those of buttons and of the pointer's motion have the same form; `keycode` is the button."""

    _fields_ = (
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", ctypes.c_void_p),
        ("window", ctypes.c_ulong),
        ("root", ctypes.c_ulong),
        ("subwindow", ctypes.c_ulong),
        ("time", ctypes.c_ulong),
        *((name, ctypes.c_int) for name in ("x", "y", "x_root", "y_root")),
        ("state", ctypes.c_uint),
        ("keycode", ctypes.c_uint),
        ("same_screen", ctypes.c_int),
    )


class XClientMessage(ctypes.Structure):
    _fields_ = (
        ("type", ctypes.c_int),
        ("serial", ctypes.c_ulong),
        ("send_event", ctypes.c_int),
        ("display", ctypes.c_void_p),
        ("window", ctypes.c_ulong),
        ("message_type", ctypes.c_ulong),
        ("format", ctypes.c_int),
        ("data", ctypes.c_long * 5),
    )


class XEvent(ctypes.Union):
    _fields_ = (
        ("key", XKeyEvent),
        ("client", XClientMessage),
        ("pad", ctypes.c_long * 24),
    )


class XScreen:
    """A server of its own; `name` is for DISPLAY."""

    def __init__(self, folder: Path, size: tuple[int, int]) -> None:
        program = shutil.which("Xvfb")
        if program is None:
            pytest.skip("Xvfb is not installed")
        self.size = size
        self._file = folder / "Xvfb_screen0"
        reading, writing = os.pipe()
        self._server = subprocess.Popen(
            [
                *(program, "-displayfd", str(writing), "-nolisten", "tcp", "+extension", "GLX"),
                *("-screen", "0", f"{size[0]}x{size[1]}x{DEPTH}", "-fbdir", str(folder)),
            ],
            pass_fds=[writing],
            stderr=subprocess.DEVNULL,
        )
        os.close(writing)
        with os.fdopen(reading) as answer:
            number = answer.readline().strip()  # once it can be connected to
        if not number:
            pytest.skip("Xvfb does not start here")
        self.name = f":{number}"

    def environment(self) -> dict[str, str]:
        """For programs that are to open their window here."""
        kept = {k: v for k, v in os.environ.items() if k != "WAYLAND_DISPLAY"}
        return {**kept, "DISPLAY": self.name}

    def picture(self) -> NDArray[np.uint8]:
        """What the screen shows now, (rows, columns, 3): the server's memory, an XWD file."""
        data = self._file.read_bytes()
        header = np.frombuffer(data, ">u4", 25)
        start = int(header[0]) + 12 * int(header[19])  # its colour map stands between
        rows, row_bytes = int(header[5]), int(header[12])
        pixels = np.frombuffer(data, np.uint8, rows * row_bytes, start).reshape(rows, row_bytes)
        bgrx = pixels[:, : 4 * int(header[4])].reshape(rows, -1, 4)
        return bgrx[..., 2::-1]

    def lit(self) -> bool:
        """Whether anything but black is in the middle of the screen; cheaper than a picture."""
        with self._file.open("rb") as file:
            file.seek(self._file.stat().st_size // 8 * 4)
            bgrx = np.frombuffer(file.read(2048), np.uint8).reshape(-1, 4)
            return bool(bgrx[:, :3].max() > 50)  # the fourth byte is 255 in a black window too

    def press(self, key: str, *, release: bool = True) -> None:
        """On the window, as the server would tell it of a keyboard's."""
        for kind in (KEY_PRESS, KEY_RELEASE) if release else (KEY_PRESS,):
            self._send(partial(_key, kind=kind, key=key))

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        """With the left button held, over the window."""
        for kind, at in ((MOTION, start), (BUTTON_PRESS, start), (MOTION, end)):
            self._send(partial(_pointer, kind=kind, at=at))
        self._send(partial(_pointer, kind=BUTTON_RELEASE, at=end))

    def ask_to_close(self) -> None:
        """As a window manager does for its X button."""
        self._send(_closing)

    def kill(self) -> None:
        self._server.kill()
        self._server.wait()

    def _send(self, make: Any) -> None:
        """On a connection of its own, to the only window there is."""
        x11 = _x11()
        display = x11.XOpenDisplay(self.name.encode())
        assert display
        window = _only_window(x11, display)
        event = make(x11, display, window)
        mask = MASKS.get(event.key.type, 0)
        assert x11.XSendEvent(display, window, 1, mask, ctypes.byref(event))
        x11.XSync(display, 0)
        x11.XCloseDisplay(display)


def _x11() -> Any:
    x11 = ctypes.CDLL("libX11.so.6")
    pointer, number, window = ctypes.c_void_p, ctypes.c_int, ctypes.c_ulong
    for name, result, arguments in (
        ("XOpenDisplay", pointer, (ctypes.c_char_p,)),
        ("XDefaultRootWindow", window, (pointer,)),
        ("XQueryTree", number, (pointer, window, *(pointer,) * 4)),
        ("XSendEvent", number, (pointer, window, number, ctypes.c_long, pointer)),
        ("XKeysymToKeycode", ctypes.c_ubyte, (pointer, window)),
        ("XInternAtom", window, (pointer, ctypes.c_char_p, number)),
        ("XSync", number, (pointer, number)),
        ("XCloseDisplay", number, (pointer,)),
        ("XFree", number, (pointer,)),
        (
            "XGetWindowProperty",
            number,
            (
                pointer,
                window,
                window,
                ctypes.c_long,
                ctypes.c_long,
                number,
                window,
                *(pointer,) * 5,
            ),
        ),
    ):
        function = getattr(x11, name)
        function.restype, function.argtypes = result, arguments
    return x11


def _only_window(x11: Any, display: int) -> int:
    """The child of the root that has WM_PROTOCOLS: a window for people, not a helper's."""
    root, parent, count = ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_uint()
    children = ctypes.POINTER(ctypes.c_ulong)()
    top = x11.XDefaultRootWindow(display)
    assert x11.XQueryTree(display, top, *map(ctypes.byref, (root, parent, children, count)))
    found = [window for window in children[: count.value] if _has_protocols(x11, display, window)]
    assert len(found) == 1, found
    return int(found[0])


def _has_protocols(x11: Any, display: int, window: int) -> bool:
    kind, form = ctypes.c_ulong(), ctypes.c_int()
    items, left, data = ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_void_p()
    atom = x11.XInternAtom(display, b"WM_PROTOCOLS", 0)
    results = map(ctypes.byref, (kind, form, items, left, data))
    x11.XGetWindowProperty(display, window, atom, 0, 4, 0, 0, *results)
    if data:
        x11.XFree(data)
    return items.value > 0


def _key(x11: Any, display: int, window: int, kind: int, key: str) -> XEvent:
    event = XEvent()
    event.key = XKeyEvent(
        type=kind,
        send_event=1,
        display=display,
        window=window,
        root=x11.XDefaultRootWindow(display),
        time=0,
        keycode=x11.XKeysymToKeycode(display, KEYSYMS[key]),
        same_screen=1,
    )
    return event


def _pointer(x11: Any, display: int, window: int, kind: int, at: tuple[int, int]) -> XEvent:
    event = XEvent()
    event.key = XKeyEvent(
        type=kind,
        send_event=1,
        display=display,
        window=window,
        root=x11.XDefaultRootWindow(display),
        x=at[0],
        y=at[1],
        keycode=0 if kind == MOTION else 1,
        same_screen=1,
    )
    return event


def _closing(x11: Any, display: int, window: int) -> XEvent:
    event = XEvent()
    event.client = XClientMessage(
        type=CLIENT_MESSAGE,
        send_event=1,
        display=display,
        window=window,
        message_type=x11.XInternAtom(display, b"WM_PROTOCOLS", 0),
        format=32,
    )
    event.client.data[0] = x11.XInternAtom(display, b"WM_DELETE_WINDOW", 0)
    return event
