"""Whole reframes, from a recording to a recording: freelook, FFmpeg's filter, an OpenCV loop.

Every way is a program of its own with everything that belongs to it: starting, reading, decoding,
sampling, x264 with the same settings, writing. They take turns, in another order every time; what
is told are medians. How long a program takes to start is what it needs for a clip of one frame.
"""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..clock import NS_PER_S
from ..errors import FreelookError
from ..pose_script import PoseScript
from ..rotations import body_from_view, head_angles_deg
from ..session import same_shape
from ..viewport import Viewport
from .pipeline_clip import Clip, Floats, Simulated, cut, frames_in, luma_psnr_db
from .pipeline_ways import WAYS, CannotDo, Job, Way

MOVING, TURNING, FIXED = "moving, yaw and pitch", "moving, yaw alone", "fixed"
PITCH_DEG = -15.0
COMPARED = 10  # pictures of every output beside the exact ones
LONGEST_S = 3600.0  # for one run of one way


@dataclass(frozen=True)
class Course:
    """Where to look: (yaw, pitch, roll) in degrees at a time in seconds from the first frame."""

    name: str
    at: Callable[[float], tuple[float, float, float]]
    moves: bool = True


def _yaw_deg(t_s: float) -> float:
    """To both sides, now slow, now fast (up to 66 degrees a second)."""
    return float(30 * np.sin(1.2 * t_s + np.sin(t_s)))


COURSES = (
    Course(MOVING, lambda t_s: (_yaw_deg(t_s), float(PITCH_DEG + 12 * np.sin(1.7 * t_s)), 0.0)),
    Course(TURNING, lambda t_s: (_yaw_deg(t_s), PITCH_DEG, 0.0)),
    Course(FIXED, lambda _t_s: (20.0, PITCH_DEG, 0.0), moves=False),
)


def scripted(script: PoseScript) -> tuple[Course, Course]:
    """The course of a script, and its first pose for a view that stands still."""

    def at(t_s: float) -> tuple[float, float, float]:
        return head_angles_deg(script.pose_at(round(t_s * NS_PER_S)))

    start = at(0.0)
    return Course("moving, as the script says", at), Course(FIXED, lambda _t_s: start, moves=False)


@dataclass(frozen=True)
class Plan:
    """What is measured. `simulated` is the clip's world, where it is known."""

    clip: Clip
    lens: str
    camera: Camera
    viewport: Viewport
    courses: Sequence[Course] = COURSES
    presets: Sequence[str] = ("veryfast",)
    repeats: int = 3
    ways: Sequence[Way] = WAYS
    simulated: Simulated | None = None

    @property
    def steps(self) -> int:
        """How often `run` calls `on_step`."""
        return len(self.courses) * len(self.presets) * len(self.ways) * self.repeats


@dataclass
class Row:
    """What one way took for one course. `skipped` says why there is nothing.

    frames           that it wrote; fewer than the clip has are told beside its name
    wall_s, cpu_s    of each run, all its threads and processes together
    start_s          of each run with one frame alone
    psnr_db          luma against the exact views; NaN where they are not known
    """

    course: str
    preset: str
    way: str
    frames: int
    wall_s: list[float] = field(default_factory=list)
    cpu_s: list[float] = field(default_factory=list)
    start_s: list[float] = field(default_factory=list)
    start_cpu_s: list[float] = field(default_factory=list)
    psnr_db: float = float("nan")
    skipped: str = ""

    @property
    def frames_per_s(self) -> float:
        """Of the whole command."""
        return self.frames / float(np.median(self.wall_s))

    @property
    def running_frames_per_s(self) -> float:
        """Without the start: what a long recording comes to. NaN where the clip is too short to
        tell."""
        running = float(np.median(self.wall_s) - np.median(self.start_s))
        return (self.frames - 1) / running if running > 0 and self.frames > 1 else float("nan")

    @property
    def cpu_ms(self) -> float:
        """Processor time of a frame, without the start. NaN as above."""
        running = float(np.median(self.cpu_s) - np.median(self.start_cpu_s))
        return (
            1e3 * running / (self.frames - 1) if running > 0 and self.frames > 1 else float("nan")
        )


def run(plan: Plan, folder: Path, on_step: Callable[[], None] = lambda: None) -> Iterator[Row]:
    """The rows of each course and preset as soon as they are there; outputs go into `folder`."""
    plan = _fitted(plan)
    one = cut(plan.clip.path, folder / "one.mp4", 0)
    for course in plan.courses:
        exact = _exact(plan, course)
        for preset in plan.presets:
            yield from _measured(plan, course, preset, one, exact, folder, on_step)


def _fitted(plan: Plan) -> Plan:
    size = plan.clip.size
    if plan.camera.size == size:
        return plan
    if not same_shape(size, plan.camera.size):
        raise FreelookError(
            f"the lens profile is for pictures of {plan.camera.size[0]} x {plan.camera.size[1]} "
            f"pixels, but this clip has {size[0]} x {size[1]}; give the profile of this camera"
        )
    return replace(plan, camera=plan.camera.resized(size))


def _measured(
    plan: Plan,
    course: Course,
    preset: str,
    one: Clip,
    exact: dict[int, Floats],
    folder: Path,
    on_step: Callable[[], None],
) -> Iterator[Row]:
    jobs = [_job(plan, clip, course, preset, folder) for clip in (plan.clip, one)]
    rows = [Row(course.name, preset, way.name, plan.clip.frames) for way in plan.ways]
    for repeat in range(plan.repeats):
        for number in range(len(rows)):
            place = (number + repeat) % len(rows)
            if not rows[place].skipped:
                _take(rows[place], plan.ways[place], jobs, folder / f"{place}.mp4")
            on_step()
    for place, row in enumerate(rows):
        if not row.skipped:
            _look_at(row, folder / f"{place}.mp4", exact)
    yield from rows


def _look_at(row: Row, out: Path, exact: dict[int, Floats]) -> None:
    """What a way wrote: who leaves out pictures is not the faster for it."""
    row.frames = frames_in(out)
    if not row.frames:
        row.skipped = "it wrote no picture"
    elif exact and "no view" not in row.way:
        row.psnr_db = luma_psnr_db(out, exact)


def _take(row: Row, way: Way, jobs: Sequence[Job], out: Path) -> None:
    """One run with one frame and one with all, whose output stays."""
    try:
        start = _timed(way.command(jobs[1], out.with_name(f"one-{out.name}")))
        whole = _timed(way.command(jobs[0], out))
    except CannotDo as why:
        row.skipped = str(why)
        return
    row.start_s.append(start[0])
    row.start_cpu_s.append(start[1])
    row.wall_s.append(whole[0])
    row.cpu_s.append(whole[1])


def _timed(command: Sequence[str]) -> tuple[float, float]:
    """(wall, processor) seconds. CannotDo where the command fails."""
    before, start = _children_s(), time.perf_counter()
    try:
        subprocess.run(
            command, check=True, stdin=subprocess.DEVNULL, capture_output=True, timeout=LONGEST_S
        )
    except subprocess.CalledProcessError as error:
        said = error.stderr.decode("utf-8", "replace").strip().splitlines() or [str(error)]
        raise CannotDo(f"it failed: {said[-1]}") from None
    except (subprocess.SubprocessError, OSError) as error:
        raise CannotDo(f"it failed: {error}") from None
    return time.perf_counter() - start, _children_s() - before


def _children_s() -> float:
    """Processor time of all processes waited for so far."""
    spent = os.times()
    return spent.children_user + spent.children_system


def _job(plan: Plan, clip: Clip, course: Course, preset: str, folder: Path) -> Job:
    frames = clip.frames if course.moves else 1
    angles = [course.at(clip.time_ns(index) / NS_PER_S) for index in range(frames)]
    script = None
    if course.moves:
        script = folder / f"{clip.path.stem}.csv"
        rows = (
            f"{clip.time_ns(index) / NS_PER_S:.9f},{yaw:.6f},{pitch:.6f},{roll:.6f}"
            for index, (yaw, pitch, roll) in enumerate(angles)
        )
        script.write_text("\n".join(["t_s,yaw_deg,pitch_deg,roll_deg", *rows]) + "\n", "utf-8")
    poses = [body_from_view(*turn) for turn in angles]
    return Job(clip, plan.lens, plan.camera, plan.viewport, poses, script, preset)


def _exact(plan: Plan, course: Course) -> dict[int, Floats]:
    """Exact luma of some of the frames, by their numbers."""
    if plan.simulated is None:
        return {}
    chosen = np.unique(np.linspace(0, plan.clip.frames - 1, COMPARED).round().astype(int))
    return {
        int(index): plan.simulated.luma(t_ns, _pose(course, t_ns), plan.viewport)
        for index, t_ns in ((index, plan.clip.time_ns(int(index))) for index in chosen)
    }


def _pose(course: Course, t_ns: int) -> Rotation:
    return body_from_view(*course.at(t_ns / NS_PER_S))
