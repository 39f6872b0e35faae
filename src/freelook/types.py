"""The values that travel between the parts, and what the parts must supply.

All times are integer nanoseconds of one monotonic clock (`freelook.clock`); an unknown time is
None, never 0. Sizes are (width, height); only array shapes are (rows, columns).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Layout = Literal["i420", "nv12", "gray", "rgb24"]
Matrix = Literal["bt601", "bt709"]
Plane = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class ColorSpace:
    """How Y, U, V mean colour. Full range uses 0..255, limited range 16..235 (luma)."""

    matrix: Matrix = "bt709"
    full_range: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    """One decoded picture, as the planes the decoder made.

    i420: Y (h, w), U and V ((h+1)//2, (w+1)//2). nv12: Y (h, w), UV ((h+1)//2, (w+1)//2, 2).
    gray: Y (h, w). rgb24: one array (h, w, 3). All uint8; rows may be strided. Chroma samples
    sit in the middle of their four luma pixels.
    """

    layout: Layout
    planes: tuple[Plane, ...]
    color: ColorSpace = ColorSpace()

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in luma pixels."""
        rows, columns = self.planes[0].shape[:2]
        return columns, rows


@dataclass(frozen=True, slots=True)
class Frame:
    """A decoded picture and its times.

    `capture_ns` is when it was taken or, where the source cannot know, when it arrived.
    `media_ns` is its place in the recording (None for live sources that have none).
    """

    picture: Picture
    capture_ns: int
    media_ns: int | None = None


@dataclass(frozen=True, slots=True)
class StreamInfo:
    """What a source learned about its video stream; sizes are 0 until known.

    `codec` is FFmpeg's name: h264, hevc, mjpeg, rawvideo, ... `pixel_format` likewise.
    """

    codec: str
    width: int = 0
    height: int = 0
    pixel_format: str | None = None
    extradata: bytes | None = None


@dataclass(frozen=True, slots=True)
class AccessUnit:
    """One coded picture. H.264 and H.265 are Annex B; a key unit carries its parameter sets
    whenever the source knows them."""

    stream: StreamInfo
    data: bytes
    key: bool
    capture_ns: int
    media_ns: int | None = None


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a head looks at one instant: one value, one time."""

    body_from_view: Rotation
    t_ns: int


@dataclass(frozen=True, slots=True)
class Attitude:
    """How the vehicle is turned at one instant: body (forward, right, down) axes to north, east,
    down."""

    t_ns: int
    world_from_body: Rotation


@dataclass(slots=True)
class Counters:
    """What went by and what went wrong; shown to the user. Names are free, values only grow."""

    values: dict[str, int] = field(default_factory=dict)

    def add(self, name: str, amount: int = 1) -> None:
        self.values[name] = self.values.get(name, 0) + amount

    def __getitem__(self, name: str) -> int:
        return self.values.get(name, 0)


class Source(Protocol):
    """A camera, a stream or a file.

    `units` blocks, yields coded pictures in decoding order, and ends at the end of the
    recording or after `close`. It raises `SourceError` when the stream breaks; reconnecting is
    the caller's business (`freelook.ingest`). `close` may be called from any thread.
    """

    counters: Counters

    def units(self) -> Iterator[AccessUnit]: ...

    def close(self) -> None: ...


class Tracker(Protocol):
    """Something that knows where a head looks.

    `poses` blocks and yields the newest pose each time there is one, and ends after `close`
    (which may be called from any thread). Bad input is counted, never raised. `message` says
    what it is waiting for, to be shown while no pose comes.
    """

    counters: Counters

    @property
    def message(self) -> str: ...

    def poses(self) -> Iterator[Pose]: ...

    def close(self) -> None: ...


class AttitudeSource(Protocol):
    """Something that knows how the vehicle is turned.

    `attitudes` blocks and yields every attitude there is, none left out (they are interpolated,
    `freelook.attitude`), times growing; it ends at the end of a log or after `close`, which may
    be called from any thread. A log's times are those of its own clock, a live source's those of
    the local one, of the measurement as far as the source can know. Bad input is counted, never
    raised. `message` says what it is waiting for, to be shown while no attitude comes.
    """

    counters: Counters

    @property
    def message(self) -> str: ...

    def attitudes(self) -> Iterator[Attitude]: ...

    def close(self) -> None: ...


class Sink(Protocol):
    """Where rendered views go. `write` raises `SinkError`; `close` finishes the output."""

    def write(self, frame: Frame) -> None: ...

    def close(self) -> None: ...
