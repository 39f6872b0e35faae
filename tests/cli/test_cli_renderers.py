"""`freelook render --renderer --sampling`: the same view, whoever renders it."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from freelook import egl, load_camera
from freelook.cli import main
from freelook.renderers.choice import GlDevice
from freelook.types import Plane

ASKED = ("--lens", "demo", "--size", "96x64", "--hfov", "60", "--yaw", "10")


@pytest.fixture(scope="module")
def picture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Stripes in a picture of the demo lens's size."""
    width, height = load_camera("demo").size
    y, x = np.mgrid[0:height, 0:width]
    path = tmp_path_factory.mktemp("renderers") / "fisheye.png"
    stripes = 127 + 100 * np.sin(x / 21) * np.cos(y / 33)
    cv2.imwrite(str(path), np.dstack([stripes, 0.5 * stripes + 60, 200 - 0.5 * stripes]))
    return path


def rendered(picture: Path, out: Path, *options: str) -> Plane:
    assert main(["render", str(picture), str(out), *ASKED, *options]) == 0
    view = cv2.imread(str(out))
    assert view is not None
    return np.asarray(view, np.uint8)


def test_cpu_and_gl_show_the_same(
    picture: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if egl.best_device() is None:
        pytest.skip("no OpenGL here")
    pytest.importorskip("moderngl")
    gl = rendered(picture, tmp_path / "gl.png", "--renderer", "gl")
    assert "renderer: gl: as asked, on " in capsys.readouterr().out
    cpu = rendered(picture, tmp_path / "cpu.png", "--renderer", "cpu", "--sampling", "bicubic")
    assert "renderer" not in capsys.readouterr().out
    assert cpu.std() > 20
    # stripes of 60 pixels and more: bilinear, bicubic and the mean over a pixel differ by little
    assert np.abs(gl.astype(int) - cpu).max() <= 4


def test_a_gpu_that_is_software_is_not_chosen_and_it_is_said(
    picture: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(egl, "may_have_gpu", lambda: True)
    monkeypatch.setattr(egl, "best_device", lambda: GlDevice(0, "llvmpipe"))
    rendered(picture, tmp_path / "auto.png")
    assert "renderer: cpu: OpenGL is software here (llvmpipe)" in capsys.readouterr().out


def test_opengl_that_is_not_there_is_an_error(
    picture: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(egl, "best_device", lambda: None)
    monkeypatch.setattr("freelook.renderers.choice.has_moderngl", lambda: True)
    out = tmp_path / "none.png"
    assert main(["render", str(picture), str(out), *ASKED, "--renderer", "gl"]) != 0
    assert "no OpenGL without a window here" in capsys.readouterr().err
    assert not out.exists()
