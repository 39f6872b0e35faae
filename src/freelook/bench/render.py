"""What a moving view costs, beside OpenCV's and ffmpeg's ways and the pure resampling cost.

The ways take turns of `TURN` views each, as they would run in a program of their own, with a new
pose for every view; the order changes from turn to turn. ffmpeg is a process of its own: its time
is the difference between runs with and without the filter, per frame.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera, make_camera
from ..lens import Equidistant
from ..renderers.cpu import CpuRenderer, coordinates
from ..rotations import RDF_FROM_FRD, body_from_view
from ..types import Picture, Plane
from ..viewport import Viewport
from .render_gl import gl_ways

FIELD_DEG = 188.0
TURN = 15

Way = Callable[[Rotation], None]


@dataclass(frozen=True)
class Case:
    """A view of `view_size` at 90 degrees out of a fisheye picture of `picture_size`."""

    name: str
    picture_size: tuple[int, int]
    view_size: tuple[int, int]


CASES = (
    Case("720p view out of 2880x2160", (2880, 2160), (1280, 720)),
    Case("1080p view out of 3840x2160", (3840, 2160), (1920, 1080)),
)
LARGE = Case("4K view out of 7680x4320", (7680, 4320), (3840, 2160))


@dataclass
class Timing:
    """Milliseconds per view of one way; `skipped` says why there are none."""

    way: str
    times_ms: list[float] = field(default_factory=list)
    skipped: str | None = None

    def percentile_ms(self, percent: float) -> float:
        return float(np.percentile(self.times_ms, percent))


@dataclass(frozen=True)
class Scene:
    """What all ways render from."""

    camera: Camera
    viewport: Viewport
    i420: Picture
    bgr: Plane


OURS, FLOOR, OPENCV, FFMPEG = (
    "freelook",
    "floor: cv2.remap alone, map given",
    "OpenCV: map rebuilt for each pose, BGR",
    "ffmpeg v360, yaw and pitch commanded",
)


def run(case: Case, rounds: int, threads: int, on_round: Callable[[], None]) -> list[Timing]:
    """Time every way for about `rounds` poses on `threads` cores; ours first."""
    cv2.setNumThreads(threads)
    scene = make_scene(case)
    ways: list[tuple[Timing, Way]] = [(Timing(OURS), _ours(scene, threads))]
    skipped: list[Timing] = []
    for name, way in gl_ways(scene):
        if isinstance(way, str):
            skipped.append(Timing(name, skipped=way))
        else:
            ways.append((Timing(name), way))
    ways += [(Timing(FLOOR), _floor(scene)), (Timing(OPENCV), _opencv(scene))]
    for turn in range(turns(rounds) + 1):
        for number in range(len(ways)):
            timing, work = ways[(number + turn) % len(ways)]
            for rotation in poses(turn * TURN, TURN):
                start = time.perf_counter()
                work(rotation)
                if turn:  # the first turn compiles and warms up
                    timing.times_ms.append((time.perf_counter() - start) * 1e3)
        on_round()
    return [*(timing for timing, _ in ways), ffmpeg_v360(case, threads), *skipped]


def turns(rounds: int) -> int:
    """How many turns make about so many views."""
    return max(1, round(rounds / TURN))


def make_scene(case: Case) -> Scene:
    """Smooth random pictures and an equidistant lens whose circle fits the picture's height."""
    width, height = case.picture_size
    rng = np.random.default_rng(0)

    def plane(columns: int, rows: int) -> Plane:
        coarse = rng.integers(0, 256, (rows // 16, columns // 16), dtype=np.uint8)
        smooth: Plane = cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_CUBIC)
        return smooth

    half = (width // 2, height // 2)
    i420 = Picture("i420", (plane(width, height), plane(*half), plane(*half)))
    bgr = cv2.merge([i420.planes[0]] * 3)
    lens = Equidistant(height / 2 / np.radians(FIELD_DEG / 2))
    camera = make_camera(case.picture_size, lens, field_deg=FIELD_DEG)
    return Scene(camera, Viewport(case.view_size, 90.0), i420, bgr)


def poses(first: int, count: int) -> Iterator[Rotation]:
    """camera_from_view of a head that looks around smoothly, new in every frame."""
    for i in range(first, first + count):
        yield RDF_FROM_FRD * body_from_view(20 * np.sin(i / 15), 10 * np.cos(i / 15), 0.0)


def _ours(scene: Scene, threads: int) -> Way:
    renderer = CpuRenderer(threads)

    def work(camera_from_view: Rotation) -> None:
        renderer.render(scene.i420, scene.camera, camera_from_view, scene.viewport)

    return work


def _floor(scene: Scene) -> Way:
    """Nothing but sampling: a map that never changes lies ready."""
    luma = coordinates(scene.camera, next(poses(0, 1)), scene.viewport)
    chroma = np.ascontiguousarray(luma[:, ::2, ::2] / 2)

    def work(_camera_from_view: Rotation) -> None:
        for index, plane in enumerate(scene.i420.planes):
            maps = chroma if index else luma
            cv2.remap(plane, maps[0], maps[1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)

    return work


def _opencv(scene: Scene) -> Way:
    """The documented way: initUndistortRectifyMap for the pose, then remap the BGR picture."""
    width, height = scene.viewport.size
    f = getattr(scene.camera.lens, "f")  # noqa: B009 - the bench's lens has one
    (cx, cy), focal = scene.camera.center, scene.viewport.focal_px
    k = np.array([[f, 0, cx], [0, f, cy], [0, 0, 1.0]])
    p = np.array([[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1.0]])

    def work(camera_from_view: Rotation) -> None:
        view_from_camera = camera_from_view.inv().as_matrix()
        x, y = cv2.fisheye.initUndistortRectifyMap(
            k, np.zeros(4), view_from_camera, p, (width, height), cv2.CV_16SC2
        )
        cv2.remap(scene.bgr, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)

    return work


def ffmpeg_v360(case: Case, threads: int, frames: int = 12, repeats: int = 3) -> Timing:
    """ffmpeg's filter on the same sizes; yaw and pitch change with every frame."""
    timing = Timing(FFMPEG)
    program = shutil.which("ffmpeg")
    if program is None:
        timing.skipped = "ffmpeg is not installed"
        return timing
    with tempfile.TemporaryDirectory() as folder:
        commands = Path(folder) / "commands"
        commands.write_text(_v360_commands(frames))
        width, height = case.view_size
        v360 = (
            f"sendcmd=f={commands},v360=input=fisheye:ih_fov={FIELD_DEG}:iv_fov={FIELD_DEG}"
            f":output=flat:h_fov=90:v_fov=58.7:w={width}:h={height}:interp=linear"
        )
        for _ in range(repeats):
            try:
                with_filter = _ffmpeg_seconds(program, case, frames, threads, v360)
                without = _ffmpeg_seconds(program, case, frames, threads, "null")
            except (subprocess.SubprocessError, OSError) as error:
                timing.skipped = f"ffmpeg failed: {error}"
                return timing
            timing.times_ms.append((with_filter - without) / frames * 1e3)
    return timing


def _v360_commands(frames: int) -> str:
    lines = (
        f"{i / 30:.4f} v360 yaw {20 * np.sin(i / 15):.3f}, v360 pitch {10 * np.cos(i / 15):.3f};"
        for i in range(frames)
    )
    return "\n".join(lines)


def _ffmpeg_seconds(program: str, case: Case, frames: int, threads: int, filters: str) -> float:
    side = case.picture_size[1]  # v360 wants the circle to fill the picture
    source = f"testsrc2=size={side}x{side}:rate=30"
    command = [program, "-v", "error", "-nostdin", "-filter_threads", str(threads)]
    command += ["-f", "lavfi", "-i", source, "-frames:v", str(frames)]
    command += ["-vf", f"format=yuv420p,{filters}", "-f", "null", "-"]
    start = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, timeout=300)
    return time.perf_counter() - start
