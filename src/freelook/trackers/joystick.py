"""A gamepad, a joystick or a radio as USB joystick (CRSF over HID), at this machine; Linux only.

`joystick:EdgeTX` is the device whose name contains that text, `joystick:/dev/input/event5` the one
of that path. `inputs=x,y,z` are its axes for yaw, pitch and roll (`-`: none), by the kernel's names
without ABS_; `span` is the angle in degrees at their ends. The axes' present values are asked for
`rate` times a second, so that a head that keeps still is not taken for a tracker that fell silent.
`buttons=a,b,c` recentre, switch off and on, and bring eyes front, by the kernel's names without
BTN_ (`-`: none).

On radios pitch grows with its channel; on gamepads y grows downwards: there add `pitch=-pitch`.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

from scipy.spatial.transform import Rotation

from ..axes import AxisMap
from ..clock import NS_PER_S, Clock
from ..errors import TrackerError
from ..types import Counters, Pose
from . import number_option
from ._lines import SKIP
from ._polled import PolledTracker

if TYPE_CHECKING:
    from evdev import InputDevice

KIND = "joystick"
OPTIONS = ("inputs", "span", "rate", "buttons")
ACTIONS = ("recentre", "toggle", "eyes_front")
DEFAULT_BUTTONS = "south,east,west"
AXES = AxisMap()
DEFAULT_INPUTS = "x,y,z"
DEFAULT_RATE_HZ = 250.0
RETRY_NS = NS_PER_S
NO_AXES = ("ABS_MAX", "ABS_CNT", "ABS_RESERVED", "ABS_MT_")


def open(argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock) -> Joystick:
    """Look for the device. It need not be there yet."""
    span_deg = number_option(options, "span", 90.0, 1, 360)
    rate_hz = number_option(options, "rate", DEFAULT_RATE_HZ, 1, 1000)
    if sys.platform != "linux":
        raise TrackerError(
            "it works on Linux only; elsewhere use the page, which reads gamepads itself"
        )
    inputs = parse_inputs(options.get("inputs", DEFAULT_INPUTS))
    buttons = parse_buttons(options.get("buttons", DEFAULT_BUTTONS))
    if not argument:
        here = ", ".join(names_here()) or "none that this user may read (is it in group 'input'?)"
        raise TrackerError(f"which device? write joystick:PART_OF_ITS_NAME; here: {here}")
    return Joystick(AxisSampler(argument, inputs, span_deg, axes, buttons), rate_hz, clock)


def parse_inputs(text: str) -> tuple[int | None, ...]:
    """The kernel's numbers of three axes, None for none. TrackerError lists the known names."""
    from evdev import ecodes

    known = {
        name.removeprefix("ABS_").lower(): number
        for name, number in ecodes.ecodes.items()
        if name.startswith("ABS_") and not name.startswith(NO_AXES)
    }
    names = text.lower().split(",")
    unknown = [name for name in names if name != SKIP and name not in known]
    if len(names) != 3 or unknown:
        raise TrackerError(
            f"inputs={text} must be three axes, for yaw, pitch and roll, such as "
            f"{DEFAULT_INPUTS}; known: {', '.join(known)}, and {SKIP} for none"
        )
    return tuple(known.get(name) for name in names)


def parse_buttons(text: str) -> dict[int, str]:
    """Which action (of ACTIONS) belongs to which of the kernel's buttons. TrackerError for unknown
    names."""
    from evdev import ecodes

    names = text.lower().split(",")
    numbers = [ecodes.ecodes.get(f"BTN_{name.upper()}") for name in names]
    unknown = [
        name for name, number in zip(names, numbers, strict=True) if name != SKIP and number is None
    ]
    if len(names) != len(ACTIONS) or unknown:
        raise TrackerError(
            f"buttons={text} must be three buttons, to recentre, switch off and on, and bring eyes "
            f"front, such as {DEFAULT_BUTTONS} or trigger,thumb,thumb2, and {SKIP} for none"
        )
    return {
        number: action
        for number, action in zip(numbers, ACTIONS, strict=True)
        if number is not None
    }


class Joystick(PolledTracker):
    """The sampler on the clock; lets go of the device at the end.

    `on_action`, if set, hears what buttons ask for (ACTIONS), on the tracker's thread.
    """

    def __init__(self, sampler: AxisSampler, rate_hz: float, clock: Clock) -> None:
        super().__init__(sampler, rate_hz, clock)
        self._axis_sampler = sampler

    @property
    def on_action(self) -> Callable[[str], None] | None:
        return self._axis_sampler.on_action

    @on_action.setter
    def on_action(self, hear: Callable[[str], None] | None) -> None:
        self._axis_sampler.on_action = hear

    def poses(self) -> Iterator[Pose]:
        try:
            yield from super().poses()
        finally:
            self._axis_sampler.let_go()


class AxisSampler:
    """Asks a device where its axes are; looks for it once a second while it is not there."""

    def __init__(
        self,
        wanted: str,
        inputs: tuple[int | None, ...],
        span_deg: float,
        axes: AxisMap,
        buttons: Mapping[int, str] | None = None,
    ) -> None:
        self.counters = Counters()
        self.on_action: Callable[[str], None] | None = None
        self._buttons = buttons or {}
        self._pressed: set[int] | None = None
        self._wanted = wanted
        self._inputs = inputs
        self._span_deg = span_deg
        self._axes = axes
        self._device: InputDevice[str] | None = None
        self._tried_ns: int | None = None
        self._found_before = False
        self._message = f"looking for {wanted}"

    @property
    def message(self) -> str:
        return self._message

    def sample(self, now_ns: int) -> Rotation | None:
        """`body_from_view`, or None while the device is not there."""
        try:
            device = self._device or self._find(now_ns)
            if device is None:
                return None
            angles = [self._angle_deg(device, number) for number in self._inputs]
            self._press(device)
        except (OSError, ValueError) as error:  # ValueError: text that cannot be a path
            self._lose(error)
            return None
        return self._axes.body_from_view(*angles)

    def _press(self, device: InputDevice[str]) -> None:
        """Tell what was pressed since the last look; not what was held when we came."""
        if self.on_action is None or not self._buttons:
            return
        pressed = set(device.active_keys()) & set(self._buttons)
        for number in sorted(pressed - (pressed if self._pressed is None else self._pressed)):
            self.on_action(self._buttons[number])
        self._pressed = pressed

    def let_go(self) -> None:
        self._pressed = None
        if self._device is not None:
            self._device.close()
        self._device = None

    def _angle_deg(self, device: InputDevice[str], number: int | None) -> float:
        if number is None:
            return 0.0
        info = device.absinfo(number)
        half = (info.max - info.min) / 2
        if half <= 0:  # the device has no such axis
            raise OSError(errno.EINVAL, "it lacks one of the axes; choose others with inputs=")
        share = (info.value - info.min) / half - 1
        return max(-1.0, min(1.0, share)) * self._span_deg

    def _find(self, now_ns: int) -> InputDevice[str] | None:
        if self._tried_ns is not None and now_ns - self._tried_ns < RETRY_NS:
            return None
        self._tried_ns = now_ns
        self._device = open_device(self._wanted)
        if self._found_before:
            self.counters.add("reconnects")
        self._found_before = True
        self._message = f"{self._wanted} is open"
        return self._device

    def _lose(self, error: OSError | ValueError) -> None:
        self.let_go()
        reason = getattr(error, "strerror", None) or str(error)
        if getattr(error, "errno", None) == errno.ENODEV:
            reason = "it was pulled out"
        self._message = f"joystick {self._wanted}: {reason}; looking for it"


def open_device(wanted: str) -> InputDevice[str]:
    """The device of that path or with that in its name. OSError when there is none, or several."""
    import evdev

    if wanted.startswith("/"):
        return evdev.InputDevice(wanted)
    devices = [evdev.InputDevice(path) for path in evdev.list_devices()]
    fitting = [device for device in devices if wanted.lower() in device.name.lower()]
    chosen = fitting[0] if len(fitting) == 1 else None
    for device in devices:
        if device is not chosen:
            device.close()
    if chosen is None:
        names = ", ".join(device.name for device in fitting or devices) or "nothing"
        count = "several of that name" if fitting else "no device of that name"
        raise OSError(errno.ENOENT, f"{count} (readable here: {names})")
    return chosen


def names_here() -> list[str]:
    """Names of the input devices that this user may read."""
    import evdev

    names = []
    for path in evdev.list_devices():
        device = evdev.InputDevice(os.fspath(path))
        names.append(device.name)
        device.close()
    return names
