"""What trackers on a serial port have in common: opening, reading, losing it and finding it again.

A tracker of this kind only brings a `Decoder`: bytes in, rotations out.
"""

from __future__ import annotations

import contextlib
import errno
import os
import threading
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Protocol

from scipy.spatial.transform import Rotation

from ..clock import Clock
from ..errors import TrackerError
from ..types import Counters, Pose
from . import number_option

if TYPE_CHECKING:
    from serial import Serial

OPTIONS = ("baud",)
DEFAULT_BAUD = 115200
READ_TIMEOUT_S = 0.25
FIRST_WAIT_S = 0.25
LONGEST_WAIT_S = 2.0
SILLY_BYTES = 2000  # so much without a pose is not a start half-way through a frame


class Decoder(Protocol):
    """From a port's bytes to rotations; what it cannot use it counts. It never raises."""

    counters: Counters

    @property
    def note(self) -> str:
        """Why there is no pose although everything is well, or nothing."""

    def begin(self) -> bytes:
        """The port was just opened: forget everything; what to tell the device, if anything."""

    def feed(self, data: bytes, now_ns: int) -> list[Rotation]:
        """Some more bytes, cut anywhere: every `body_from_view` they complete, oldest first."""

    def reply(self, now_ns: int) -> bytes:
        """What to tell the device now, if anything; asked after every read."""


class QuietDecoder:
    """A decoder's `begin` and `reply` for devices that need not be told anything."""

    @property
    def note(self) -> str:
        return ""

    def begin(self) -> bytes:
        return b""

    def reply(self, now_ns: int) -> bytes:
        return b""


def open_port(
    kind: str, argument: str, options: Mapping[str, str], decoder: Decoder, clock: Clock
) -> SerialTracker:
    """A tracker on the port called `argument`. It need not be there yet.

    TrackerError when no port is named; ModuleNotFoundError without pyserial.
    """
    import serial  # noqa: F401 - so that a missing library shows at once

    baud = round(number_option(options, "baud", DEFAULT_BAUD, 50, 4_000_000))
    if not argument:
        raise TrackerError(f"which serial port? write {kind}:/dev/ttyACM0; {_ports_here()}")
    return SerialTracker(os.path.expanduser(argument), baud, decoder, clock)


class SerialTracker:
    """A `Tracker` on a serial port; the newest pose of every read counts.

    Counts `received` poses, `dropped` ones that a newer one in the same read overtook, `bytes`, and
    `reconnects`; and what the decoder counts. A port that is lost is tried again, after 0.25 s at
    first and 2 s at most.
    """

    def __init__(self, port: str, baud: int, decoder: Decoder, clock: Clock) -> None:
        self._name = port
        self._baud = baud
        self._decoder = decoder
        self._clock = clock
        self._closed = threading.Event()
        self._port: Serial | None = None
        self._message = f"opening {port}"
        self._bytes_since_pose = 0
        self._heard = False
        self.counters = decoder.counters

    @property
    def message(self) -> str:
        if self._port is None:
            return self._message
        connected = f"{self._name} is open at {self._baud} baud"
        if not self._heard:
            return f"{connected}, but it sends nothing"
        if self._decoder.note:
            return f"{connected}; {self._decoder.note}"
        if self._bytes_since_pose > SILLY_BYTES:
            return (
                f"{connected}, but what it sends is not understood: is the baud rate right "
                "(option baud), and is this its protocol?"
            )
        return f"{connected}; no pose yet"

    def poses(self) -> Iterator[Pose]:
        wait_s = FIRST_WAIT_S
        opened = False
        while not self._closed.is_set():
            self._heard = False
            try:
                with self._open() as port:
                    self.counters.add("reconnects", int(opened))
                    opened = True
                    yield from self._read(port)
            except (OSError, ValueError) as error:
                self._message = self._explain(error, was_open=self._port is not None)
            finally:
                self._port = None
            wait_s = FIRST_WAIT_S if self._heard else min(2 * wait_s, LONGEST_WAIT_S)
            self._closed.wait(wait_s)

    def close(self) -> None:
        self._closed.set()
        port = self._port
        if port is not None:
            # the reading thread may be closing it at this very moment
            with contextlib.suppress(OSError, TypeError, AttributeError):
                port.cancel_read()

    def _open(self) -> Serial:
        from serial import Serial

        port = Serial(
            self._name, self._baud, timeout=READ_TIMEOUT_S, write_timeout=1.0, exclusive=True
        )
        self._port = port
        return port

    def _read(self, port: Serial) -> Iterator[Pose]:
        self._bytes_since_pose = 0
        _say(port, self._decoder.begin())
        while not self._closed.is_set():
            data = port.read(1)
            now_ns = self._clock()
            if data:
                data += port.read(port.in_waiting)
                pose = self._newest(data, now_ns)
                if pose is not None:
                    yield pose
            _say(port, self._decoder.reply(now_ns))

    def _newest(self, data: bytes, now_ns: int) -> Pose | None:
        self._heard = True
        self._bytes_since_pose += len(data)
        self.counters.add("bytes", len(data))
        rotations = self._decoder.feed(data, now_ns)
        if not rotations:
            return None
        self._bytes_since_pose = 0
        self.counters.add("received", len(rotations))
        if len(rotations) > 1:
            self.counters.add("dropped", len(rotations) - 1)
        return Pose(rotations[-1], now_ns)

    def _explain(self, error: Exception, *, was_open: bool) -> str:
        number = getattr(error, "errno", None)
        reason = os.strerror(number) if number else str(error)
        if was_open:
            return f"{self._name} was lost ({reason}); waiting for it to come back"
        hint = _ports_here()
        if number == errno.EACCES:
            hint = "may this user open it? (sudo usermod -aG dialout $USER, then log in again)"
        return f"{self._name} cannot be opened: {reason}; {hint}"


def _say(port: Serial, data: bytes) -> None:
    if data:
        port.write(data)


def _ports_here() -> str:
    from serial.tools.list_ports import comports

    names = sorted(port.device for port in comports())
    return f"ports here: {', '.join(names)}" if names else "no serial port is here"
