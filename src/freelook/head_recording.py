"""Recordings of heads, as research publishes them: text, a quaternion in every line.

The first line names the columns, separated by blanks or commas; `timestamp` (seconds) and `w x y z`
must be among them. The quaternion turns head axes (x forward, y left, z up) into those of a room.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .errors import TrackerError
from .rotations import FRD_FROM_RDF

COLUMNS = ("timestamp", "w", "x", "y", "z")
LARGEST_BYTES = 200_000_000
LATEST_S = 1e9  # what nanoseconds in 64 bits hold, with room to spare

_FRD_FROM_FLU = Rotation.from_quat([1.0, 0.0, 0.0, 0.0])
_FLU_FROM_RDF = _FRD_FROM_FLU.inv() * FRD_FROM_RDF


def read_lines(path: Path) -> list[str]:
    """The lines of a text file. TrackerError when it is none, too large or cannot be read."""
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise TrackerError(f"{path}: larger than {LARGEST_BYTES} bytes: no recorded head")
        return path.read_text("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise TrackerError(f"{path}: not a text file") from None
    except (OSError, ValueError) as error:
        raise TrackerError(f"{path}: {getattr(error, 'strerror', None) or error}") from None


def columns_of(path: Path, header: str) -> list[int]:
    """The places of `COLUMNS` in the lines below this header; TrackerError for those missing."""
    names = _fields(header)
    if missing := [name for name in COLUMNS if name not in names]:
        raise TrackerError(
            f"{path}: no column {', '.join(missing)}; the first line must name the columns "
            f"{' '.join(COLUMNS)}"
        )
    return [names.index(name) for name in COLUMNS]


def sample_of(line: str, columns: list[int]) -> list[float]:
    """Seconds, w, x, y, z of a line. ValueError says what is wrong with it."""
    texts = _fields(line)
    try:
        row = [float(texts[column]) for column in columns]
    except (ValueError, IndexError):
        row = []
    if not row or not np.isfinite(row).all():
        raise ValueError(f"numbers for {' '.join(COLUMNS)} are needed: {line[:80]!r}")
    if not abs(row[0]) < LATEST_S:
        raise ValueError(f"a time of {row[0]:g} s is none")
    if not 0.5 < float(np.hypot.reduce(row[1:])) < 2.0:
        raise ValueError("the quaternion is not of unit length")
    return row


def body_from_view(wxyz: NDArray[np.float64]) -> Rotation:
    """Where these heads (n, 4) look, the room's x being the vehicle's forward."""
    return _FRD_FROM_FLU * Rotation.from_quat(wxyz[:, [1, 2, 3, 0]]) * _FLU_FROM_RDF


def _fields(line: str) -> list[str]:
    return line.replace(",", " ").split()
