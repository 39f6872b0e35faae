"""A device on a serial port made of a pseudo-terminal, which can be unplugged and plugged in."""

from __future__ import annotations

import contextlib
import os
import pty
import threading
import tty
from pathlib import Path
from types import TracebackType

PERIOD_S = 0.003


class SerialDevice:
    """`path` is the port's name; it stays the same when the device is plugged in again."""

    def __init__(self, folder: Path, name: str = "ttyTEST0") -> None:
        self.path = folder / name
        self._frame = b""
        self._stop = threading.Event()
        self._lock = threading.Lock()
        self._ends: tuple[int, int] | None = None
        self._heard = b""
        self.plug_in()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def __enter__(self) -> SerialDevice:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def repeat(self, frame: bytes) -> None:
        """From now on send this again and again; data that nobody reads is thrown away."""
        with self._lock:
            self._frame = frame

    def heard(self) -> bytes:
        """Everything it was told so far."""
        with self._lock:
            return self._heard

    def plug_in(self) -> None:
        with self._lock:
            device, port = pty.openpty()
            tty.setraw(port)
            os.set_blocking(device, False)
            self._ends = device, port
            self.path.unlink(missing_ok=True)
            self.path.symlink_to(os.ttyname(port))

    def unplug(self) -> None:
        with self._lock:
            self.path.unlink(missing_ok=True)
            for end in self._ends or ():
                os.close(end)
            self._ends = None

    def close(self) -> None:
        self._stop.set()
        self._thread.join(5)
        self.unplug()

    def _run(self) -> None:
        while not self._stop.wait(PERIOD_S):
            with self._lock, contextlib.suppress(OSError):
                if self._ends is not None:
                    self._exchange(self._ends[0])

    def _exchange(self, device: int) -> None:
        if self._frame:
            with contextlib.suppress(BlockingIOError):
                os.write(device, self._frame)
        with contextlib.suppress(BlockingIOError):
            self._heard += os.read(device, 65536)
