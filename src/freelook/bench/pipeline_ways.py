"""The ways to make a whole reframe, each as the command that a user would start."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..camera import Camera
from ..lens import Equidistant, KannalaBrandt
from ..rotations import FRD_FROM_RDF, head_angles_deg
from ..sinks.videofile import KEY_INTERVAL_S, QUALITY
from ..viewport import Viewport
from .pipeline_clip import Clip

ANGLES = ("yaw", "pitch", "roll")
FIT_DEG = 80.0  # from the axis: as far as ffmpeg's formula is fitted to another lens


class CannotDo(Exception):  # noqa: N818 - an answer, not a failure
    """This way cannot do it; says why."""


@dataclass(frozen=True)
class Job:
    """One reframe, the same for every way.

    lens    the camera's profile, as a file or a name
    poses   body_from_view of every frame, or only one: a view that stands still
    script  the same poses in a file, for a view that moves
    """

    clip: Clip
    lens: str
    camera: Camera
    viewport: Viewport
    poses: Sequence[Rotation]
    script: Path | None
    preset: str

    @property
    def key_interval(self) -> int:
        return max(1, round(KEY_INTERVAL_S * self.clip.fps))

    def x264(self) -> dict[str, str]:
        return {"crf": QUALITY["h264"], "preset": self.preset, "bf": "0"}

    def camera_from_view(self) -> list[Rotation]:
        return [self.camera.camera_from_body * pose for pose in self.poses]


class Way(Protocol):
    """`command` writes what it needs beside `out`; CannotDo says why there is none."""

    @property
    def name(self) -> str: ...

    def command(self, job: Job, out: Path) -> list[str]: ...


@dataclass(frozen=True)
class Ours:
    name: str = "freelook render"

    def command(self, job: Job, out: Path) -> list[str]:
        width, height = job.viewport.size
        command = [sys.executable, "-m", "freelook", "render", str(job.clip.path), str(out)]
        command += ["--overwrite", "--lens", job.lens, "--size", f"{width}x{height}"]
        command += ["--hfov", f"{job.viewport.hfov_deg:g}", "--preset", job.preset]
        if job.script is not None:
            return [*command, "--poses", str(job.script)]
        return command + [
            f"--{angle}={value:.6f}"
            for angle, value in zip(ANGLES, head_angles_deg(job.poses[0]), strict=True)
        ]


@dataclass(frozen=True)
class FfmpegV360:
    name: str = "ffmpeg v360"

    def command(self, job: Job, out: Path) -> list[str]:
        filters = [*_centring(job), v360(job)]
        if len(job.poses) > 1:
            commands = out.with_suffix(".commands")
            commands.write_text(v360_commands(job), "utf-8")
            filters.insert(0, f"sendcmd=f={commands}")
        return _ffmpeg(job, ",".join(filters), out)


@dataclass(frozen=True)
class Floor:
    """Decoding and encoding alone: as large a piece out of the middle, as it is."""

    name: str = "no view: decode, encode"

    def command(self, job: Job, out: Path) -> list[str]:
        (width, height), (most_width, most_height) = job.viewport.size, job.clip.size
        if width > most_width or height > most_height:
            return _ffmpeg(job, f"scale={width}:{height}:flags=fast_bilinear", out)
        return _ffmpeg(job, f"crop={width}:{height}", out)


@dataclass(frozen=True)
class OpenCv:
    name: str = "OpenCV loop"

    def command(self, job: Job, out: Path) -> list[str]:
        k, d = opencv_lens(job.camera)
        (width, height), focal = job.viewport.size, job.viewport.focal_px
        settings = {
            "clip": str(job.clip.path),
            "out": str(out),
            "size": job.viewport.size,
            "k": k.tolist(),
            "d": d,
            "p": [[focal, 0, (width - 1) / 2], [0, focal, (height - 1) / 2], [0, 0, 1]],
            "view_from_camera": [
                turn.inv().as_matrix().tolist() for turn in job.camera_from_view()
            ],
            "options": job.x264(),
            "key_interval": job.key_interval,
            "fps": job.clip.fps,
            "bt601": job.clip.color.matrix == "bt601",
            "full_range": job.clip.color.full_range,
        }
        path = out.with_suffix(".json")
        path.write_text(json.dumps(settings), "utf-8")
        return [sys.executable, "-m", "freelook.bench.opencv_loop", str(path)]


def _ffmpeg(job: Job, filters: str, out: Path) -> list[str]:
    program = shutil.which("ffmpeg")
    if program is None:
        raise CannotDo("ffmpeg is not installed")
    pixels = "yuvj420p" if job.clip.color.full_range else "yuv420p"
    command = [program, "-v", "error", "-nostdin", "-y", "-i", str(job.clip.path), "-an"]
    command += ["-vf", filters, "-pix_fmt", pixels, "-c:v", "libx264", "-g", str(job.key_interval)]
    for key, value in job.x264().items():
        command += [f"-{key}", value]
    return [*command, str(out)]


def v360(job: Job) -> str:
    """The filter for the first pose. It knows one fisheye: equidistant, in the picture's middle."""
    width, height = job.clip.size
    if crop := _crop(job):
        width, height = crop[:2]
    fx, fy = equidistant_focal_px(job.camera)
    angles = zip(ANGLES, _angles_deg(job)[0], strict=True)
    across_deg, down_deg = np.degrees(width / fx), np.degrees(height / fy)
    return (
        f"v360=input=fisheye:ih_fov={across_deg:.4f}:iv_fov={down_deg:.4f}"
        f":output=flat:h_fov={job.viewport.hfov_deg:.4f}:v_fov={job.viewport.vfov_deg:.4f}"
        f":w={job.viewport.size[0]}:h={job.viewport.size[1]}:interp=linear:reset_rot=1:"
        + ":".join(f"{angle}={value}" for angle, value in angles)
    )


def v360_commands(job: Job) -> str:
    """For sendcmd: the angles that changed, just before their frame. Each of them makes the filter
    compute its map anew."""
    lines = []
    angles = _angles_deg(job)
    for index in range(1, len(angles)):
        changed = [
            f"v360 {angle} {new}"
            for angle, old, new in zip(ANGLES, angles[index - 1], angles[index], strict=True)
            if new != old
        ]
        if changed:
            lines.append(f"{(index - 0.5) / job.clip.fps:.6f} {', '.join(changed)};")
    return "\n".join(lines) + "\n"


def _angles_deg(job: Job) -> list[list[str]]:
    """Yaw, pitch and roll from the camera's axis, as text."""
    turns = [head_angles_deg(FRD_FROM_RDF * turn) for turn in job.camera_from_view()]
    return [[f"{round(angle, 4) + 0.0:.4f}" for angle in angles] for angles in turns]


def equidistant_focal_px(camera: Camera) -> tuple[float, float]:
    """(across, down) of the equidistant lens that is nearest to this one; itself, if it is one."""
    theta = np.linspace(0.01, min(camera.theta_max, np.radians(FIT_DEG)), 200)
    f = float((camera.lens.radius(theta) @ theta) / (theta @ theta))
    return f * float(camera.stretch[0, 0]), f * float(camera.stretch[1, 1])


def approximation_px(camera: Camera) -> float:
    """How far the lens as ffmpeg's filter knows it is off, at most; within 80 degrees."""
    theta = np.linspace(0.01, min(camera.theta_max, np.radians(FIT_DEG)), 200)
    f = equidistant_focal_px(camera)[0] / float(camera.stretch[0, 0])
    return float(np.abs(camera.lens.radius(theta) - f * theta).max())


def _crop(job: Job) -> tuple[int, int, int, int] | None:
    """Width, height, x, y of the largest even piece whose middle is the lens's; None for all."""
    sides = list(zip(job.camera.center, job.clip.size, strict=True))
    if all(abs(center - (size - 1) / 2) < 1 for center, size in sides):
        return None
    starts, sizes = [], []
    for center, size in sides:
        before, after = center + 0.5, size - 0.5 - center
        half = int(min(before, after))
        starts.append(max(0, round(before - half)) // 2 * 2)
        sizes.append(min(2 * half, size - starts[-1]) // 2 * 2)
    return sizes[0], sizes[1], starts[0], starts[1]


def _centring(job: Job) -> list[str]:
    crop = _crop(job)
    return [] if crop is None else ["crop={}:{}:{}:{}".format(*crop)]


def opencv_lens(camera: Camera) -> tuple[NDArray[np.float64], list[float]]:
    """K and D of OpenCV's fisheye model; CannotDo where it cannot be this camera."""
    lens: Any = camera.lens
    if isinstance(lens, Equidistant):
        terms = [0.0] * 4
    elif isinstance(lens, KannalaBrandt):
        terms = [lens.k1, lens.k2, lens.k3, lens.k4]
    else:
        raise CannotDo(f"OpenCV's fisheye model is no {type(lens).__name__} lens")
    (cx, cy), (fx, fy) = camera.center, lens.f * np.diag(camera.stretch)
    if np.abs(camera.stretch - np.diag(np.diag(camera.stretch))).max() > 1e-12:
        raise CannotDo("OpenCV's fisheye model has no skew")
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), terms


WAYS: tuple[Way, ...] = (Ours(), FfmpegV360(), OpenCv(), Floor())
