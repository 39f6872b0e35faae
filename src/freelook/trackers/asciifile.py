"""A text file another program keeps rewriting: `roll pitch yaw` in degrees, the 2011 paper's way.

`file:/path/angles.txt` takes the last complete line, split by blanks or commas. The writer may
replace the file (rename over it), rewrite it in place or append to it. Lines that are still being
written are left alone: a line without its newline counts only when the file was found unchanged
once more. A writer that rewrites the same numbers is alive; a file nobody touches gives no pose.

Rawashdeh and Sababha, Computer Technology and Application 2 (2011), section 5.
"""

from __future__ import annotations

import errno
import math
import os
import stat
from collections.abc import Mapping
from pathlib import Path

from scipy.spatial.transform import Rotation

from ..axes import LARGEST_DEG, AxisMap
from ..clock import Clock
from ..errors import TrackerError
from ..types import Counters
from . import number_option
from ._polled import PolledTracker

KIND = "file"
OPTIONS = ("rate",)
AXES = AxisMap()
DEFAULT_RATE_HZ = 200.0
TAIL_BYTES = 4096  # a line is never longer than this


def open(
    argument: str, *, axes: AxisMap, options: Mapping[str, str], clock: Clock
) -> PolledTracker:
    """Watch a file, looking `rate` times a second; it need not exist yet."""
    rate_hz = number_option(options, "rate", DEFAULT_RATE_HZ, 1, 1000)
    if not argument or "\0" in argument:
        raise TrackerError("which file? write file:/path/angles.txt")
    path = Path(os.path.expanduser(argument))
    if os.path.isdir(path):
        raise TrackerError(f"{path} is a directory; name the file with the angles in it")
    return PolledTracker(AngleFile(path, axes), rate_hz, clock)


def parse_line(line: bytes) -> tuple[float, float, float] | None:
    """(roll, pitch, yaw) in degrees, or None for anything but three numbers a head can have."""
    fields = line.replace(b",", b" ").split()
    if len(fields) != 3:
        return None
    try:
        roll, pitch, yaw = (float(field) for field in fields)
    except ValueError:
        return None
    fit = all(math.isfinite(a) and abs(a) <= LARGEST_DEG for a in (roll, pitch, yaw))
    return (roll, pitch, yaw) if fit else None


def last_line(tail: bytes, *, settled: bool) -> bytes | None:
    """The last line that is not blank; without its newline only in a file that has settled."""
    lines = tail.split(b"\n")
    unfinished = lines.pop()
    if settled and unfinished.strip():
        return unfinished.strip()
    return next((line.strip() for line in reversed(lines) if line.strip()), None)


class AngleFile:
    """The file and what was last seen in it; one `sample` is one look.

    After every change the file is read once more, for the line that had no newline yet and for
    a second write within one tick of the file system's clock.
    """

    def __init__(self, path: Path, axes: AxisMap) -> None:
        self._path = path
        self._axes = axes
        self._signature: tuple[int, int, int] | None = None
        self._settled = False
        self._line: bytes | None = None
        self._trouble = ""
        self.counters = Counters()

    @property
    def message(self) -> str:
        return self._trouble or f"waiting for {self._path} to change"

    def sample(self, now_ns: int) -> Rotation | None:
        """`body_from_view` of the newest line, if it was written since the last look."""
        try:
            line = self._look()
        except OSError as error:
            self._trouble = f"waiting for {self._path}: {error.strerror or error}"
            self._signature = None
            return None
        self._trouble = ""
        if line is None:
            return None
        angles = parse_line(line)
        if angles is None:
            self.counters.add("malformed")
            self._trouble = f"{self._path}: {line[:60]!r} is not 'roll pitch yaw' in degrees"
            return None
        roll, pitch, yaw = angles
        return self._axes.body_from_view(yaw, pitch, roll)

    def _look(self) -> bytes | None:
        status = os.stat(self._path)
        if not stat.S_ISREG(status.st_mode):
            raise OSError(errno.EINVAL, "not an ordinary file")
        signature = (status.st_ino, status.st_mtime_ns, status.st_size)
        changed = signature != self._signature
        if not changed and self._settled:
            return None
        line = last_line(_read_tail(self._path), settled=not changed)
        new = line if changed or line != self._line else None
        self._signature, self._settled, self._line = signature, not changed, line
        return new


def _read_tail(path: Path) -> bytes:
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - TAIL_BYTES))
        return file.read(TAIL_BYTES)
