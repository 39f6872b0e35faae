"""ArduPilot's log: `flight.bin` or `flight.log`, the autopilot's own attitude (ATT).

Beside the angles of ATT, rounded to hundredths of a degree, a log may have quaternions (VSTB, XKQ,
NKQ, NKQ1); what was logged most often is taken. Times are microseconds since boot. Read
with pymavlink, ArduPilot's own.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..clock import Clock
from ..errors import AttitudeError, MissingExtra
from ._log import LogSource, log_of_quaternions, readable

KIND = "dataflash"
OPTIONS: tuple[str, ...] = ()
BINARY, TEXT = b"\xa3\x95\x80", b"FMT"  # how the two kinds of file begin
ANGLES = "ATT"
# of the fast log for stabilising video, of EKF3, of EKF2
QUATERNIONS = ("VSTB", "XKQ", "NKQ", "NKQ1")


def recognises(argument: str) -> bool:
    return argument.lower().endswith((".bin", ".log"))


def open(argument: str, *, options: Mapping[str, str], clock: Clock) -> LogSource:
    """Read the log now. AttitudeError says what is wrong with it."""
    path = readable(argument)
    with path.open("rb") as file:
        start = file.read(3)
    if start not in (BINARY, TEXT):
        raise AttitudeError(f"{argument}: not a dataflash log; those begin with a format message")
    try:
        from pymavlink import DFReader
    except ImportError:
        raise MissingExtra("pymavlink", "ardupilot") from None
    kind = DFReader.DFReader_binary if start == BINARY else DFReader.DFReader_text
    reader = kind.__new__(kind)  # so that it can be closed when it fails half-way
    talk = io.StringIO()  # about every damaged byte
    try:
        with contextlib.redirect_stderr(talk), contextlib.redirect_stdout(talk):
            reader.__init__(str(path))
            messages = _messages(reader)
    except Exception as error:  # what its parser stumbles over in a file that is none is open-ended
        raise AttitudeError(f"{argument}: not a dataflash log that can be read ({error})") from None
    finally:
        if hasattr(reader, "filehandle"):
            reader.filehandle.close()  # the mapping goes with the reader
    if not messages:
        known = ", ".join((ANGLES, *QUATERNIONS))
        raise AttitudeError(f"{argument}: there is none of {known} in the log")
    # where they are equally often, the quaternion, which comes first
    most = max((*QUATERNIONS, ANGLES), key=lambda kind: len(messages.get(kind, ())))
    times_us, *values = np.array(messages[most], float).T
    times_ns = np.round(times_us * 1000).astype(np.int64)
    return log_of_quaternions(argument, times_ns, np.stack(values, axis=-1))


def _messages(reader: Any) -> dict[str, list[list[float]]]:
    """Rows of time in microseconds and (w, x, y, z), by the name of the message."""
    found: dict[str, list[list[float]]] = {}
    while (message := reader.recv_match(type=[ANGLES, *QUATERNIONS])) is not None:
        kind = message.get_type()
        fields = message.to_dict()
        if fields.get("C", 0) != 0:  # a second estimator's, beside the first
            continue
        try:
            time_us = float(fields["TimeUS"])
            wxyz = _wxyz(fields, kind)
        except (KeyError, TypeError, ValueError):
            continue
        found.setdefault(kind, []).append([time_us, *wxyz])
    return found


def _wxyz(fields: dict[str, Any], kind: str) -> list[float]:
    if kind != ANGLES:
        return [float(fields[f"Q{i}"]) for i in (1, 2, 3, 4)]
    angles = [float(fields[name]) for name in ("Yaw", "Pitch", "Roll")]
    x, y, z, w = Rotation.from_euler("ZYX", angles, degrees=True).as_quat()
    return [w, x, y, z]
