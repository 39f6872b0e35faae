"""Logs as other programs write them, from given attitudes: ULog, dataflash, gcsv, CSV.

Formats: docs.px4.io "ULog File Format"; ArduPilot's AP_Logger LogStructure.h; docs.gyroflow.xyz
"GCSV Format".
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]


def wxyz(rotations: Rotation) -> Floats:
    return np.asarray(rotations.as_quat()[:, [3, 0, 1, 2]])


def ulog(topic: str, fields: str, times_us: NDArray[np.int64], values: Floats) -> bytes:
    """One topic: a uint64 timestamp and float fields, such as "float[4] q"."""

    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    header = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", int(times_us[0]))
    text = [header, message("B", bytes(40))]
    text.append(message("F", f"{topic}:uint64_t timestamp;{fields};".encode()))
    text.append(message("A", struct.pack("<BH", 0, 0) + topic.encode()))
    for time_us, row in zip(times_us.tolist(), values, strict=True):
        body = struct.pack("<HQ", 0, time_us) + row.astype("<f4").tobytes()
        text.append(message("D", body))
    return b"".join(text)


def dataflash(
    name: str, columns: str, types: str, rows: Sequence[tuple[float, ...]], number: int = 200
) -> bytes:
    """One message of ArduPilot's: `types` are the letters of its format (Q, f, c, C, B)."""
    packing = {"Q": "Q", "f": "f", "c": "h", "C": "H", "B": "B", "h": "h"}
    layout = "<" + "".join(packing[letter] for letter in types)
    text = []
    for code, length, label, form, names in (
        (128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
        (number, 3 + struct.calcsize(layout), name, types, columns),
    ):
        body = struct.pack(
            "<BB4s16s64s", code, length, label.encode(), form.encode(), names.encode()
        )
        text.append(b"\xa3\x95\x80" + body)
    for row in rows:
        whole = [v if t == "f" else round(v) for v, t in zip(row, types, strict=True)]
        text.append(b"\xa3\x95" + bytes([number]) + struct.pack(layout, *whole))
    return b"".join(text)


def gcsv(times_ms: Floats, rates: Floats, felt_g: Floats, orientation: str) -> str:
    """Rates in rad/s and accelerations in g, in axes that `orientation` maps to Gyroflow's."""
    lines = [
        "GYROFLOW IMU LOG",
        "version,1.3",
        "id,test",
        f"orientation,{orientation}",
        "tscale,0.001",
        "gscale,0.0001",
        "ascale,0.0001",
        "t,gx,gy,gz,ax,ay,az",
    ]
    for time_ms, gyro, acceleration in zip(times_ms, rates, felt_g, strict=True):
        numbers = np.round(np.concatenate([gyro, acceleration]) * 1e4).astype(int)
        lines.append(",".join(map(str, [round(time_ms), *numbers.tolist()])))
    return "\n".join(lines) + "\n"
