"""A window of this machine with OpenGL in it, by GLFW. Everything in here: on the main thread."""

from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from types import TracebackType
from typing import Any

from ..errors import MissingExtra, SinkError
from ..renderers.gl_context import VERSION, moderngl
from .display_loss import watch_display
from .events import Closed, Damaged, Drag, Event, Key, Left, Pad, Wheel

TITLE = "freelook"
KEYS = {
    "KEY_LEFT": "left",
    "KEY_RIGHT": "right",
    "KEY_UP": "up",
    "KEY_DOWN": "down",
    "KEY_ESCAPE": "escape",
    "KEY_EQUAL": "+",
    "KEY_KP_ADD": "+",
    "KEY_MINUS": "-",
    "KEY_KP_SUBTRACT": "-",
}
PAD_BUTTONS = {  # as on the page
    "recentre": ("A", "RIGHT_THUMB"),
    "toggle": ("B", "START"),
    "narrower": ("RIGHT_BUMPER", "DPAD_UP"),
    "wider": ("LEFT_BUMPER", "DPAD_DOWN"),
}


def glfw() -> Any:
    """The library; MissingExtra without it."""
    try:
        import glfw as library
    except ImportError:  # also when the wheel's own library cannot be loaded
        raise MissingExtra("glfw", "window") from None
    library.ERROR_REPORTING = "ignore"  # asked for where it matters
    return library


@dataclass(frozen=True, slots=True)
class Monitor:
    """`number` counts from 1, the main one; sizes in pixels, 0 Hz where it does not say."""

    number: int
    name: str
    size: tuple[int, int]
    refresh_hz: float
    handle: Any

    def __str__(self) -> str:
        width, height = self.size
        rate = f" at {self.refresh_hz:.0f} Hz" if self.refresh_hz else ""
        return f"{self.number}: {self.name}, {width}x{height}{rate}"


def choose_monitor(wanted: str, monitors: list[Monitor]) -> Monitor:
    """By number, or by a part of its name. SinkError lists the known ones."""
    for monitor in monitors:
        if wanted == str(monitor.number):
            return monitor
    named = [m for m in monitors if wanted.lower() in m.name.lower()]
    if len(named) == 1:
        return named[0]
    known = "; ".join(str(monitor) for monitor in monitors) or "none"
    what = "several monitors are" if named else "no monitor is"
    raise SinkError(f"{what} called '{wanted}'; there are: {known}")


class Surface:
    """An open window. `monitor` makes it fill that screen at once; `size` is for when it does not.

    SinkError where there is no display, or one without OpenGL 3.3.
    """

    def __init__(
        self, size: tuple[int, int] = (1280, 720), monitor: str | None = None, vsync: bool = True
    ) -> None:
        self._glfw = glfw()
        self._size, self._wanted = size, monitor
        if not self._glfw.init():
            raise SinkError(_why_no_display(self._glfw))
        try:
            self._window = self._open(monitor)
            self.context = self._make_context()
            self._flush = ctypes.CFUNCTYPE(None)(_address(self._glfw, "glFlush"))
        except BaseException:
            self._glfw.terminate()
            raise
        self._loss = watch_display(self._glfw)
        self._glfw.swap_interval(1 if vsync else 0)
        self._events: list[Event] = []
        self._mouse: tuple[float, float] | None = None
        self._listen()

    def __enter__(self) -> Surface:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """The window goes, the screen gets its own picture back. May be called twice."""
        if self._window is not None:
            self._window = None
            self._glfw.terminate()

    @property
    def lost(self) -> bool:
        """Whether the display went away; the window is then of no more use."""
        return self._loss.lost

    @property
    def renderer(self) -> str:
        return str(self.context.info["GL_RENDERER"])

    @property
    def size_px(self) -> tuple[int, int]:
        """Of what is drawn into; the mouse may count in larger points."""
        width, height = self._glfw.get_framebuffer_size(self._window)
        return int(width), int(height)

    @property
    def size_points(self) -> tuple[int, int]:
        """In the unit of `Drag`."""
        width, height = self._glfw.get_window_size(self._window)
        return int(width), int(height)

    @property
    def refresh_hz(self) -> float:
        """Of the monitor that it is on; 0 where that does not say."""
        handle = self._glfw.get_window_monitor(self._window)
        on = [m for m in self.monitors() if handle and _same(m.handle, handle)]
        return (on or self.monitors())[0].refresh_hz if self.monitors() else 0.0

    @property
    def screen(self) -> Any:
        """The framebuffer to draw into."""
        return self.context.screen

    @property
    def full_screen(self) -> bool:
        return bool(self._glfw.get_window_monitor(self._window))

    def monitors(self) -> list[Monitor]:
        return _monitors(self._glfw)

    def toggle_full_screen(self) -> None:
        """On the monitor that was asked for, else the main one; and back to a window."""
        if self.full_screen:
            self._glfw.set_window_monitor(self._window, None, 80, 80, *self._size, 0)
        elif found := self.monitors():
            self._fill(found[0] if self._wanted is None else choose_monitor(self._wanted, found))

    def events(self, wait_s: float = 0.0) -> list[Event]:
        """What happened since the last call; waits for the first so long."""
        if wait_s > 0:
            self._glfw.wait_events_timeout(wait_s)
        else:
            self._glfw.poll_events()
        events, self._events = self._events, []
        return events

    def pad(self) -> Pad | None:
        """The first gamepad, if there is one."""
        for stick in range(self._glfw.JOYSTICK_LAST + 1):
            if self._glfw.joystick_is_gamepad(stick) and (
                state := self._glfw.get_gamepad_state(stick)
            ):
                return _pad(self._glfw, state)
        return None

    def flush(self) -> None:
        """Have what was asked for so far begun, while more is being prepared."""
        self._flush()

    def swap(self) -> None:
        """Show what was drawn; with vsync it waits for the screen."""
        self._glfw.swap_buffers(self._window)

    def _open(self, monitor: str | None) -> Any:
        library = self._glfw
        wanted = None if monitor is None else choose_monitor(monitor, self.monitors())
        hints = {
            "CONTEXT_VERSION_MAJOR": VERSION // 100,
            "CONTEXT_VERSION_MINOR": VERSION // 10 % 10,
            "OPENGL_PROFILE": library.OPENGL_CORE_PROFILE,
            "OPENGL_FORWARD_COMPAT": True,
            "AUTO_ICONIFY": False,  # goggles go on when another window is used
            "DEPTH_BITS": 0,
            "STENCIL_BITS": 0,
        }
        for name, value in hints.items():
            library.window_hint(getattr(library, name), value)
        window = library.create_window(*self._size, TITLE, None, None)
        if not window:
            raise SinkError(
                f"no window with OpenGL {VERSION // 100}.{VERSION // 10 % 10} opens here: "
                f"{_error(library)}; 'freelook doctor' says what graphics there are"
            )
        library.make_context_current(window)
        self._window = window
        if wanted is not None:
            self._fill(wanted)
        return window

    def _make_context(self) -> Any:
        try:
            return moderngl().create_context(require=VERSION, context=_Loader(self._glfw))
        except MissingExtra:
            raise
        except Exception as error:  # moderngl raises bare Exception
            raise SinkError(f"the window's OpenGL cannot be used: {error}") from None

    def _fill(self, monitor: Monitor) -> None:
        rate = round(monitor.refresh_hz) or self._glfw.DONT_CARE
        self._glfw.set_window_monitor(self._window, monitor.handle, 0, 0, *monitor.size, rate)

    def _listen(self) -> None:
        library, window = self._glfw, self._window
        library.set_key_callback(window, self._on_key)
        library.set_cursor_pos_callback(window, self._on_mouse)
        library.set_scroll_callback(window, self._on_wheel)
        library.set_window_focus_callback(window, self._on_focus)
        library.set_framebuffer_size_callback(window, self._on_damage)
        library.set_window_refresh_callback(window, self._on_damage)
        library.set_window_close_callback(window, self._on_close)

    def _on_key(self, _window: Any, key: int, code: int, action: int, mods: int) -> None:
        library = self._glfw
        pressed = action == library.PRESS
        chord = pressed and mods & (library.MOD_CONTROL | library.MOD_ALT)
        if action == library.REPEAT or chord:
            return
        names = {getattr(library, code): name for code, name in KEYS.items()}
        name = library.get_key_name(key, code) or ""  # as the keyboard's layout has it
        name = name if name in ("+", "-") else names.get(key, name.lower())
        if name:
            self._events.append(Key(name, pressed))

    def _on_mouse(self, window: Any, x: float, y: float) -> None:
        library = self._glfw
        before, self._mouse = self._mouse, (x, y)
        held = library.get_mouse_button(window, library.MOUSE_BUTTON_LEFT) == library.PRESS
        if held and before is not None:
            self._events.append(Drag(x - before[0], y - before[1]))

    def _on_wheel(self, _window: Any, _across: float, steps: float) -> None:
        self._events.append(Wheel(max(-3.0, min(3.0, steps))))

    def _on_focus(self, _window: Any, focused: int) -> None:
        if not focused:
            self._events.append(Left())

    def _on_damage(self, _window: Any, *_size: int) -> None:
        self._events.append(Damaged())

    def _on_close(self, _window: Any) -> None:
        self._events.append(Closed())


class _Loader:
    """GLFW's context for moderngl, whichever of GLX, EGL and the rest it has made it with."""

    def __init__(self, library: Any) -> None:
        self._glfw = library

    def load_opengl_function(self, name: str) -> int:
        return _address(self._glfw, name)

    def __enter__(self) -> _Loader:
        return self

    def __exit__(self, *_error: object) -> None:
        pass

    def release(self) -> None:
        pass


def _address(library: Any, name: str) -> int:
    return ctypes.cast(library.get_proc_address(name), ctypes.c_void_p).value or 0


def _monitors(library: Any) -> list[Monitor]:
    found = []
    for number, handle in enumerate(library.get_monitors() or [], start=1):
        mode, name = library.get_video_mode(handle), library.get_monitor_name(handle)
        text = name.decode(errors="replace") if isinstance(name, bytes) else str(name)
        size = (int(mode.size.width), int(mode.size.height))
        found.append(Monitor(number, text, size, float(mode.refresh_rate), handle))
    return found


def _same(one: Any, other: Any) -> bool:
    pointers = (ctypes.cast(handle, ctypes.c_void_p).value for handle in (one, other))
    return len(set(pointers)) == 1


def _pad(library: Any, state: Any) -> Pad:
    axes, buttons = state.axes, state.buttons
    held = {
        name
        for name, codes in PAD_BUTTONS.items()
        if any(buttons[getattr(library, f"GAMEPAD_BUTTON_{code}")] for code in codes)
    }
    right = (library.GAMEPAD_AXIS_RIGHT_X, library.GAMEPAD_AXIS_RIGHT_Y)
    return Pad(float(axes[right[0]]), float(axes[right[1]]), frozenset(held))


def _error(library: Any) -> str:
    _, text = library.get_error()
    return text.decode(errors="replace") if isinstance(text, bytes) else str(text or "no reason")


def _why_no_display(library: Any) -> str:
    where = os.environ.get("WAYLAND_DISPLAY") or os.environ.get("DISPLAY")
    at = f"the display {where}" if where else "a display (neither DISPLAY nor WAYLAND_DISPLAY)"
    return (
        f"no window can be opened on {at}: {_error(library)}; run it on the screen's own machine, "
        f"or leave --show window out and open the page"
    )
