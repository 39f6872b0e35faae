"""Which renderer to take on this machine, and why."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Literal

from ..errors import MissingExtra, RenderError
from . import Renderer
from .blank import Sampling

Wanted = Literal["auto", "cpu", "gl"]
WANTED: tuple[Wanted, ...] = ("auto", "cpu", "gl")

SOFTWARE = re.compile(r"llvmpipe|softpipe|swrast|swiftshader|software", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class GlDevice:
    """An EGL device by its number, and what draws there: "llvmpipe (LLVM 15.0.6, 256 bits)"."""

    number: int
    renderer: str

    @property
    def software(self) -> bool:
        """Whether a CPU plays the GPU."""
        return SOFTWARE.search(self.renderer) is not None


@dataclass(frozen=True, slots=True)
class Choice:
    """`kind` of renderer, for people `why`, and the EGL device it draws on (cpu: None)."""

    kind: Literal["cpu", "gl"]
    why: str
    device: GlDevice | None = None

    def __str__(self) -> str:
        return f"{self.kind}: {self.why}"


def has_moderngl() -> bool:
    return find_spec("moderngl") is not None


def choose(wanted: Wanted, device: GlDevice | None, library: bool) -> Choice:
    """What is wanted, or by itself (`auto`) OpenGL on a real GPU and else the CPU.

    `device` is the best there is, `library` whether moderngl is installed. RenderError and
    MissingExtra where OpenGL is wanted and cannot be had.
    """
    if wanted == "cpu":
        return Choice("cpu", "as asked")
    if wanted == "gl":
        return _gl_as_asked(device, library)
    if device is None:
        return Choice("cpu", "there is no GPU that OpenGL can use without a window")
    if device.software:
        return Choice("cpu", f"OpenGL is software here ({device.renderer}), slower than this")
    if not library:
        return Choice("cpu", f"{device.renderer} needs pip install 'freelook[gl]'")
    return Choice("gl", f"on {device.renderer}", device)


def _gl_as_asked(device: GlDevice | None, library: bool) -> Choice:
    if not library:
        raise MissingExtra("moderngl", "gl")
    if device is None:
        raise RenderError(
            "no OpenGL without a window here; render on the CPU, or install a driver "
            "(for software: libegl1 and libgl1-mesa-dri)"
        )
    slow = ", software: slower than the CPU renderer" if device.software else ""
    return Choice("gl", f"as asked, on {device.renderer}{slow}", device)


def open_renderer(choice: Choice, sampling: Sampling = "bilinear") -> Renderer:
    """RenderError where its OpenGL does not start after all."""
    if choice.device is not None:
        from .gl import GlRenderer

        return GlRenderer(choice.device.number, sampling=sampling)
    from .cpu import CpuRenderer

    return CpuRenderer(sampling=sampling)
