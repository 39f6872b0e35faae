"""Lines and pictures for `freelook calibrate lines`."""

from __future__ import annotations

import csv
import itertools
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import CalibrationError, FreelookError
from ..types import Frame, Plane

if TYPE_CHECKING:
    from ..calibration.lines import Line

NEEDED = ("line", "x", "y")
PICTURES, FEWEST_KEYS, MOST_DECODED = 12, 4, 300
MOST_SEARCHED = 6
SAME_LEVELS = 6.0  # mean difference, of 255, up to which two pictures show the same


def read_lines(name: str) -> list[Line]:
    """The lines of a CSV with the columns line, x, y, and perhaps name (of the picture), along.

    FreelookError says which line of the file is wrong.
    """
    from ..calibration.lines import Line

    try:
        text = Path(name).read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FreelookError(f"{name}: {getattr(error, 'strerror', 'not a text file')}") from None
    rows = csv.DictReader(text.splitlines(), skipinitialspace=True)
    if not set(rows.fieldnames or ()).issuperset(NEEDED):
        there = ", ".join(rows.fieldnames or ()) or "none"
        raise FreelookError(
            f"{name}: a first line with the columns name, line, x, y is needed (and along, where "
            f"known); there are: {there}"
        )
    points: dict[tuple[str, str], list[tuple[float, float]]] = {}
    along: dict[tuple[str, str], str] = {}
    for number, row in enumerate(rows, 2):
        key = (row.get("name") or "", row["line"] or "")
        try:
            pixel = float(row["x"]), float(row["y"])
        except (TypeError, ValueError):
            raise FreelookError(f"{name}, line {number}: x and y are no numbers") from None
        if not np.isfinite(pixel).all():
            raise FreelookError(f"{name}, line {number}: x and y are no numbers")
        points.setdefault(key, []).append(pixel)
        if along.setdefault(key, row.get("along") or "") != (row.get("along") or ""):
            raise FreelookError(f"{name}, line {number}: line {key[1]} runs along two directions")
    return [
        Line(f"{picture} {line}".strip(), np.array(pixels), picture, along[picture, line])
        for (picture, line), pixels in points.items()
    ]


def read_pictures(inputs: Sequence[str]) -> list[tuple[str, Frame]]:
    """(name, frame) of picture files, and of some frames of recordings."""
    from ..media.pictures import is_picture, read_picture

    found: list[tuple[str, Frame]] = []
    for name in inputs:
        if is_picture(name):
            found.append((Path(name).name, read_picture(name)))
        else:
            frames = list(_frames(name))
            if not frames:
                raise CalibrationError(f"{name}: not a single picture in it can be decoded")
            found += [(f"{Path(name).name} #{k}", frame) for k, frame in enumerate(frames, 1)]
    return found


def _frames(name: str) -> Iterator[Frame]:
    """Key pictures throughout a recording; where it has few, from its beginning."""
    from ..media.decoder import Decoder
    from ..offline import decoded
    from ..sources.file import FileSource

    source = FileSource(name, loop=False, pace=False, clock=lambda: 0)
    decoder = Decoder(low_delay=False)
    keys = [
        frame
        for unit in source.key_units(PICTURES)
        for frame in [*decoder.decode(unit), *decoder.flush()][:1]
    ]
    if len(keys) >= FEWEST_KEYS:
        return iter(keys)
    source = FileSource(name, loop=False, pace=False, clock=lambda: 0)
    there = min(source.expected_frames or MOST_DECODED, MOST_DECODED)
    frames = decoded(source.units(), Decoder(low_delay=False))
    return itertools.islice(frames, 0, MOST_DECODED, max(1, there // PICTURES))


def differing(pictures: Sequence[tuple[str, Plane]]) -> list[tuple[str, Plane]]:
    """Without those (name, (rows, columns)) that show what one before them shows already."""
    kept: list[tuple[str, Plane]] = []
    for name, luma in pictures:
        small = luma[::4, ::4].astype(np.float64)
        if all(
            luma.shape != other.shape or np.abs(small - other[::4, ::4]).mean() > SAME_LEVELS
            for _, other in kept
        ):
            kept.append((name, luma))
    return kept[:MOST_SEARCHED]
