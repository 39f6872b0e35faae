"""Which renderer is taken, and that people are told why."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from freelook import doctor, egl
from freelook.errors import MissingExtra, RenderError
from freelook.renderers.choice import Choice, GlDevice, Wanted, choose, open_renderer
from freelook.renderers.cpu import CpuRenderer
from freelook.renderers.gl import GlRenderer
from gl_here import gl_renderer

REAL = GlDevice(1, "NVIDIA H100 80GB HBM3/PCIe/SSE2")
SOFTWARE = GlDevice(0, "llvmpipe (LLVM 15.0.6, 256 bits)")


@pytest.mark.parametrize(
    ("wanted", "device", "library", "kind", "why"),
    [
        ("auto", REAL, True, "gl", "H100"),
        ("auto", SOFTWARE, True, "cpu", "software here (llvmpipe"),
        ("auto", None, True, "cpu", "no GPU"),
        ("auto", REAL, False, "cpu", "pip install 'freelook[gl]'"),
        ("cpu", REAL, True, "cpu", "as asked"),
        ("gl", REAL, True, "gl", "H100"),
        ("gl", SOFTWARE, True, "gl", "slower than the CPU"),
    ],
)
def test_choice(
    wanted: Wanted, device: GlDevice | None, library: bool, kind: str, why: str
) -> None:
    choice = choose(wanted, device, library)
    assert choice.kind == kind
    assert why in choice.why
    assert choice.device == (device if kind == "gl" else None)


def test_opengl_that_is_wanted_and_cannot_be_had_is_an_error() -> None:
    with pytest.raises(MissingExtra, match=r"freelook\[gl\]"):
        choose("gl", REAL, False)
    with pytest.raises(RenderError, match="libegl1"):
        choose("gl", None, True)


def test_the_choice_is_opened() -> None:
    assert isinstance(open_renderer(Choice("cpu", "")), CpuRenderer)
    gl_renderer().close()  # skips where there is none
    opened = open_renderer(choose("gl", egl.best_device(), True))
    assert isinstance(opened, GlRenderer)
    opened.close()


@pytest.mark.parametrize(
    ("device", "library", "what", "todo"),
    [
        (SOFTWARE, True, "cpu: OpenGL is software here", ""),
        (REAL, True, "gl: on NVIDIA", ""),
        (REAL, False, "cpu: ", "freelook[gl]"),
        (None, True, "cpu: there is no GPU", ""),
    ],
)
def test_doctor_says_which_renderer_and_why(
    device: GlDevice | None, library: bool, what: str, todo: str
) -> None:
    graphics, renderer = doctor.graphics_lines(device, library)
    assert device is None or device.renderer in graphics.what
    assert renderer.what.startswith(what)
    assert todo in renderer.todo


def answer(text: str) -> subprocess.CompletedProcess[str]:
    return subprocess.CompletedProcess([], 0, text, "")


def test_a_real_gpu_is_preferred_to_software(monkeypatch: pytest.MonkeyPatch) -> None:
    listed = f"0\t{SOFTWARE.renderer}\n1\t{REAL.renderer}\n"
    monkeypatch.setattr(subprocess, "run", lambda *_args, **_kwargs: answer(listed))
    assert egl.devices() == [SOFTWARE, REAL]
    assert egl.best_device() == REAL


def test_a_driver_that_crashes_or_hangs_is_no_device(monkeypatch: pytest.MonkeyPatch) -> None:
    def hangs(*_args: object, **_kwargs: object) -> None:
        raise subprocess.TimeoutExpired("freelook.egl", 1.0)

    monkeypatch.setattr(subprocess, "run", lambda *_args, **_kwargs: answer(""))
    assert egl.best_device() is None
    monkeypatch.setattr(subprocess, "run", hangs)
    assert egl.best_device() is None


def test_gpus_are_seen_by_their_nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    assert not egl.may_have_gpu(tmp_path)
    (tmp_path / "dri").mkdir()
    (tmp_path / "dri" / "renderD128").touch()
    assert egl.may_have_gpu(tmp_path)
    monkeypatch.setattr("sys.platform", "darwin")
    assert egl.may_have_gpu(tmp_path / "none")
