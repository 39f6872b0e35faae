"""`freelook render --projection` and `--layout`, on a picture."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.cli import main
from freelook.formats import load_camera
from freelook.media.pictures import read_picture
from freelook.renderers import Renderer
from freelook.renderers.cpu import CpuRenderer
from freelook.renderers.layout import LayoutRenderer
from freelook.rotations import body_from_view
from freelook.viewport import Viewport

RENDERED = ["--lens", "demo", "--renderer", "cpu", "--yaw", "-20", "--size", "240x120"]


@pytest.fixture
def shot(tmp_path: Path) -> Path:
    y, x = np.mgrid[:960, :960]
    pixels = np.stack([x // 4, y // 4, np.full_like(x, 90)], axis=-1).astype(np.uint8)
    cv2.imwrite(str(tmp_path / "shot.png"), pixels)
    return tmp_path / "shot.png"


def expected(shot: Path, renderer: Renderer, viewport: Viewport) -> np.ndarray:
    camera = load_camera("demo")
    turn: Rotation = camera.camera_from_body * body_from_view(-20, 0)
    return renderer.render(read_picture(str(shot)).picture, camera, turn, viewport).planes[0]


def test_a_projection_and_a_layout(shot: Path) -> None:
    """As many threads as there are cores make other bands: on the rim, that is a code or two."""
    out = shot.with_name("view.png")
    options = ["--projection", "stereographic", "--hfov", "170", "--layout", "pip"]
    assert main(["render", str(shot), str(out), *RENDERED, *options]) == 0
    viewport = Viewport((240, 120), 170.0, "stereographic")
    view = expected(shot, LayoutRenderer(CpuRenderer(1), "pip"), viewport)
    written = read_picture(str(out)).picture.planes[0]
    assert np.abs(written.astype(int) - view).max() <= 3
    alone = expected(shot, CpuRenderer(1), viewport)
    assert np.abs(alone.astype(int) - view).max() > 50


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--projection", "pannini", "--hfov", "250"], "pannini views must be 10 to 240 degrees"),
        (["--projection", "strip", "--hfov", "200"], "at most 108 pixels high"),
        (["--layout", "quad", "--size", "80x40"], "at least 64"),
    ],
)
def test_impossible_views_are_explained(
    shot: Path, options: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["render", str(shot), str(shot.with_name("view.png")), *RENDERED, *options]) == 2
    assert says in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--projection", "--layout"])
def test_unknown_names_are_told_the_known_ones(
    shot: Path, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["render", str(shot), "view.png", *RENDERED, option, "fishy"])
    known = {"--projection": "'perspective', 'pannini'", "--layout": "'single', 'quad', 'pip'"}
    assert known[option] in capsys.readouterr().err
