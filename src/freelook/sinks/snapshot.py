"""Single views as PNG that say where they look: `snapshot:view.png`, or a folder: `shots/`."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

import cv2

from ..errors import SinkError
from ..types import Frame
from . import SinkSettings, refuse
from ._rgb import rgb24

KIND = "snapshot"

SUFFIX = ".png"
SIGNATURE_AND_HEADER_BYTES = 8 + 25  # after which text may stand (PNG specification, 5.6)
PREFIX = "freelook:"


def recognises(argument: str) -> bool:
    """A folder; a .png is a single picture, unless it is asked for as snapshot:view.png."""
    return argument.endswith("/") and "://" not in argument


def check(argument: str, settings: SinkSettings) -> None:
    path = Path(argument)
    if path.suffix.lower() != SUFFIX and not path.is_dir():
        raise SinkError(f"{argument} is neither a {SUFFIX} file nor a folder that is there")
    if path.suffix.lower() == SUFFIX and not path.parent.is_dir():
        raise SinkError(f"the folder {path.parent} does not exist; make it first")


def open(argument: str, settings: SinkSettings) -> Snapshots:
    refuse(settings, "a snapshot", "audio_from", "sdp", "bitrate")
    check(argument, settings)
    return Snapshots(Path(argument))


class Snapshots:
    """Every frame becomes a PNG: a file is replaced by the next one, whole; in a folder each has
    its own, named by the date and time (UTC). What `note` said goes into the file as text.
    `written` is the newest file."""

    def __init__(self, path: Path) -> None:
        self.written: Path | None = None
        self._path = path
        self._facts: Mapping[str, str] = {}

    def note(self, facts: Mapping[str, str]) -> None:
        self._facts = {key: value for key, value in facts.items() if key != "state"}

    def write(self, frame: Frame) -> None:
        taken = datetime.now(UTC)
        facts = {**self._facts, "time": taken.isoformat(timespec="milliseconds")}
        data = png(frame, {PREFIX + key: value for key, value in facts.items()})
        name = taken.strftime("%Y%m%d-%H%M%S-%f")[:-3] + SUFFIX
        target = self._path / name if self._path.is_dir() else self._path
        part = target.with_name(target.name + ".part")
        try:
            part.write_bytes(data)
            os.replace(part, target)
            self.written = target
        except OSError as error:
            raise SinkError(f"{target}: {error.strerror}") from None

    def close(self) -> None:
        pass


def png(frame: Frame, texts: Mapping[str, str]) -> bytes:
    """The picture with these texts in it (iTXt: UTF-8, PNG specification, 11.3.4.5)."""
    done, coded = cv2.imencode(SUFFIX, rgb24(frame.picture)[..., ::-1])
    if not done:
        raise SinkError("OpenCV cannot write PNG here")
    data = coded.tobytes()
    head, rest = data[:SIGNATURE_AND_HEADER_BYTES], data[SIGNATURE_AND_HEADER_BYTES:]
    return head + b"".join(_chunk(key, text) for key, text in texts.items()) + rest


def _chunk(keyword: str, text: str) -> bytes:
    """Keyword, end, not compressed, no language, no translation, text."""
    body = b"iTXt" + keyword.encode("latin-1") + b"\0\0\0\0\0" + text.encode()
    return struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
