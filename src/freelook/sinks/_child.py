"""A program beside us that is fed coded pictures through a pipe: it may block, hang or die, and
the flight goes on.

Each access unit is sent as its capture time in nanoseconds (8 bytes), 1 for a key picture or 0 (1
byte), its length (4 bytes), big-endian, and its bytes. The program answers in lines: `ready` once,
`key` to ask for a key picture, `clients N`. It ends when the pipe does.
"""

from __future__ import annotations

import contextlib
import os
import select
import struct
import subprocess
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence

from ..errors import SinkError
from ..types import AccessUnit

PROCESSES = "freelook.processes"  # the package of those that are ours
ADDRESS = "FREELOOK_ADDRESS"  # in the environment of those that need one
HEADER = struct.Struct(">QBI")
READY_S = 10.0
FULL_S = 1.0  # a pipe that stays full so long belongs to a program that hangs
LAST_S = 2.0
LAST_LINES = 4


class Child:
    """Started at once; `wait_ready` before the first `send`. SinkError, with the program's last
    words, when it ended or takes nothing any more; it begins with `argument`, which has no password
    in it. `secrets` go by the environment, which other users of the machine cannot see, as they do
    a command."""

    def __init__(
        self,
        argument: str,
        command: Sequence[str],
        heard: Callable[[str], None] = lambda _: None,
        secrets: Mapping[str, str] | None = None,
    ) -> None:
        self._argument = argument
        self._heard = heard
        self._ready = False
        self._spoke = threading.Event()
        self._words: deque[str] = deque(maxlen=LAST_LINES)
        pipe = subprocess.PIPE
        try:
            self._process = subprocess.Popen(
                command,
                stdin=pipe,
                stdout=pipe,
                stderr=pipe,
                start_new_session=True,
                env={**os.environ, **(secrets or {})},
            )
        except OSError as error:
            raise SinkError(f"{argument}: {command[0]}: {error.strerror}") from None
        assert self._process.stdin is not None
        self._pipe = self._process.stdin.fileno()
        os.set_blocking(self._pipe, False)
        self._threads = [
            threading.Thread(target=read, name=f"{argument} {what}", daemon=True)
            for what, read in (("answers", self._listen), ("words", self._remember))
        ]
        for thread in self._threads:
            thread.start()

    @property
    def pid(self) -> int:
        return self._process.pid

    def wait_ready(self, seconds: float = READY_S) -> None:
        """Until it says so."""
        self._spoke.wait(seconds)  # also when it ended
        if self._process.poll() is not None or not self._ready:
            raise SinkError(f"{self._argument}: {self._why()}")

    def send(self, unit: AccessUnit) -> None:
        header = HEADER.pack(unit.capture_ns, unit.key, len(unit.data))
        left = memoryview(header + unit.data)
        until_s = time.monotonic() + FULL_S
        while left:
            try:
                left = left[os.write(self._pipe, left) :]
            except BlockingIOError:
                if not select.select([], [self._pipe], [], max(0, until_s - time.monotonic()))[1]:
                    raise SinkError(f"{self._argument}: takes no more pictures") from None
            except OSError:
                raise SinkError(f"{self._argument}: {self._why()}") from None

    def close(self) -> None:
        """Ends the program: by the end of its pipe, or by force."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(LAST_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        for thread in self._threads:
            thread.join(LAST_S)
        for stream in (self._process.stdout, self._process.stderr):
            assert stream is not None
            stream.close()

    def _why(self) -> str:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(LAST_S / 10)
        if self._process.poll() is None:
            return "the other end does not answer"
        self._threads[1].join(LAST_S)
        return "; ".join(self._words) or f"ended with status {self._process.returncode}"

    def _listen(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            words = line.decode(errors="replace").strip()
            if words == "ready":
                self._ready = True
                self._spoke.set()
            else:
                self._heard(words)
        self._spoke.set()

    def _remember(self) -> None:
        assert self._process.stderr is not None
        for line in self._process.stderr:
            if words := line.decode(errors="replace").strip():
                self._words.append(words)
