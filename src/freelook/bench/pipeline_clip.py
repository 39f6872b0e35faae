"""The clips that whole reframes are measured on: cut from a real one, or simulated and so known."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.error import FFmpegError
from av.video.stream import VideoStream
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera, make_camera
from ..clock import NS_PER_S
from ..color import yuv_from_rgb
from ..errors import SourceError
from ..lens import Equidistant
from ..media.planes import picture_from_av
from ..simulation.camera import SimulatedCamera, pixel_deg
from ..simulation.world import World
from ..sinks import open_sink
from ..types import ColorSpace, Plane
from ..viewport import Viewport

Floats = NDArray[np.float64]

FPS = 30.0
FIELD_DEG = 188.0
TICKS_PER_S = 90_000


@dataclass(frozen=True)
class Clip:
    """A recording without sound, its frames evenly spaced from 0, and where nobody has to wait
    for a picture that is shown later."""

    path: Path
    frames: int
    fps: float
    size: tuple[int, int]
    color: ColorSpace

    def time_ns(self, index: int) -> int:
        return round(index * NS_PER_S / self.fps)


def cut(source: str | Path, target: Path, seconds: float | None = None) -> Clip:
    """The first `seconds` of a recording (None: all; 0: its first frame), not encoded anew.

    Real recordings have times that repeat, on which programs differ: here the frames keep their
    order and get evenly spaced times. SourceError if there is no video in it.
    """
    try:
        with av.open(str(source)) as container:
            if not container.streams.video:
                raise SourceError(f"{source}: there is no video in it")
            stream = container.streams.video[0]
            rate = _rate(stream)
            most = None if seconds is None else max(1, round(seconds * rate))
            packets = list(_packets(container.demux(stream), most))
            _write(target, stream, packets, rate)
        with av.open(str(target)) as container:
            picture = picture_from_av(next(container.decode(video=0)))
    except (FFmpegError, OSError, StopIteration) as error:
        why = getattr(error, "strerror", None) or "not one picture of it can be decoded"
        raise SourceError(f"{source}: {why}") from None
    return Clip(target, len(packets), float(rate), picture.size, picture.color)


def _rate(stream: VideoStream) -> Fraction:
    """The average one; 30 where odd times make nonsense of it."""
    rate = Fraction(stream.average_rate or 0).limit_denominator(1001)
    return rate if 1 <= rate <= 1000 else Fraction(30)


def _packets(packets: Iterator[Any], most: int | None) -> Iterator[Any]:
    count = 0
    for packet in packets:
        if packet.size and (most is None or count < most):
            yield packet
            count += 1


def _write(target: Path, stream: VideoStream, packets: Sequence[Any], rate: Fraction) -> None:
    times = [p.pts if p.pts is not None else p.dts or 0 for p in packets]
    shown = np.argsort(np.argsort(times, kind="stable"), kind="stable")  # place in time of each
    late = max((i - int(place) for i, place in enumerate(shown)), default=0)
    tick = TICKS_PER_S / rate
    with av.open(str(target), "w") as container:
        out = container.add_stream_from_template(stream)
        for index, packet in enumerate(packets):
            packet.stream = out
            packet.time_base = Fraction(1, TICKS_PER_S)
            packet.pts, packet.dts = round(int(shown[index]) * tick), round((index - late) * tick)
            container.mux(packet)


def equidistant_camera(size: tuple[int, int]) -> Camera:
    """A lens that FFmpeg's filter has a formula for; its circle fits the picture's height."""
    return make_camera(
        size, Equidistant(size[1] / 2 / np.radians(FIELD_DEG / 2)), field_deg=FIELD_DEG
    )


@dataclass
class Simulated:
    """A simulated flight: a clip whose every view is known exactly."""

    camera: Camera
    threads: int = 1

    def __post_init__(self) -> None:
        self._world = SimulatedCamera(
            self.camera, World(pixel_deg(self.camera)), threads=self.threads
        )

    def record(self, target: Path, frames: int, on_frame: Callable[[], None]) -> Clip:
        sink = open_sink(str(target), size=self.camera.size, fps=FPS, overwrite=True)
        for index in range(frames):
            sink.write(self._world.frame(round(index * NS_PER_S / FPS)))
            on_frame()
        sink.close()
        return Clip(target, frames, FPS, self.camera.size, self._world.color)

    def luma(self, t_ns: int, body_from_view: Rotation, viewport: Viewport) -> Floats:
        """What an ideal camera would have seen: code values (height, width), not rounded."""
        rgb = self._world.exact_rgb(t_ns, body_from_view, viewport)
        return yuv_from_rgb(rgb, self._world.color)[..., 0]


def frames_in(path: Path) -> int:
    """How many pictures a recording has; 0 also where it is none."""
    try:
        with av.open(str(path)) as container:
            return sum(packet.size > 0 for packet in container.demux(video=0))
    except (FFmpegError, OSError, IndexError):
        return 0


def luma_psnr_db(path: Path, exact: dict[int, Floats]) -> float:
    """Of the frames of a recording with these numbers, together; NaN if one of them is missing."""
    errors = []
    with av.open(str(path)) as container:
        container.streams.video[0].thread_type = "AUTO"
        for index, frame in enumerate(container.decode(video=0)):
            if index in exact:
                luma: Plane = picture_from_av(frame).planes[0]
                errors.append(float(((luma - exact[index]) ** 2).mean()))
    if len(errors) < len(exact):
        return float("nan")
    return float(10 * np.log10(255**2 / max(float(np.mean(errors)), 1e-9)))
