"""A real window on a display without a screen, with software OpenGL: what the screen shows, keys,
full screen, closing, and a display that goes away."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scene import AHEAD_DEG, CAMERA, HFOV_DEG, OPTICS, SCREEN, frame
from x_screen import XScreen

import video_streams
from freelook.cli import main
from freelook.errors import SinkError
from freelook.rotations import RDF_FROM_FRD, body_from_view
from freelook.viewport import Viewport
from freelook.window.flight import AFTER_DAMAGE
from freelook.window.painting import EyesPainter
from freelook.window.surface import Monitor, choose_monitor
from gl_here import gl_context

pytest.importorskip("glfw")
pytest.importorskip("moderngl")

PATIENCE_S = 150  # a whole flight begins, and ends, on a machine that may be busy


@pytest.fixture
def screen(tmp_path: Path) -> Iterator[XScreen]:
    opened = XScreen(tmp_path, SCREEN)
    yield opened
    opened.kill()


class Program:
    """A process on a screen that says one line at a time, in JSON."""

    def __init__(self, screen: XScreen, *command: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, *command],
            env=screen.environment(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def said(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            pytest.fail(f"it ended: {self.process.communicate()}")
        return dict(json.loads(line))

    def go_on(self) -> None:
        assert self.process.stdin is not None
        print(file=self.process.stdin, flush=True)

    def ended(self) -> tuple[int, str, str]:
        """(exit status, what else it said, errors)"""
        out, err = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, out, err


def off_screen(yaw_deg: float) -> NDArray[np.uint8]:
    """What the screen must show, drawn without one."""
    with gl_context() as context:
        target = context.framebuffer([context.texture(SCREEN, 3)])
        painter = EyesPainter(context, OPTICS)
        painter.load(frame().picture, CAMERA, SCREEN, HFOV_DEG)
        ahead = RDF_FROM_FRD * body_from_view(yaw_deg, AHEAD_DEG[1])
        painter.paint(target, SCREEN, CAMERA, ahead, HFOV_DEG)
        data = np.frombuffer(target.read(components=3, alignment=1), np.uint8)
    return data.reshape(SCREEN[1], SCREEN[0], 3)[::-1]


def test_a_window_shows_the_view(screen: XScreen) -> None:
    """Opened, made to fill the screen, turned by a key, closed as by its X button."""
    program = Program(screen, str(Path(__file__).with_name("shown.py")))
    state = program.said()
    assert state["opened"] == {"size": [320, 240], "full": False}
    assert state["filled"] == {"size": list(SCREEN), "full": True}
    assert "400x300" in state["monitors"][0]

    for view in range(1, AFTER_DAMAGE + 1):  # drawn again until the driver knows the new size
        state = program.said()
        assert (state["views"], state["yaw"]) == (view, AHEAD_DEG[0])
        if view < AFTER_DAMAGE:
            program.go_on()
    shown, expected = screen.picture().astype(int), off_screen(AHEAD_DEG[0])
    assert expected.std() > 30
    # the same programme on the same driver; two contexts may round a code differently
    assert np.abs(shown - expected).max() <= 1

    poses = state["poses"]
    screen.press("right", release=False)
    program.go_on()
    state = program.said()
    assert state["yaw"] > AHEAD_DEG[0]
    assert state["poses"] == poses + 1  # one more pose was measured from hand to screen
    assert np.abs(screen.picture().astype(int) - off_screen(state["yaw"])).max() <= 1

    screen.press("right")
    turned = state["yaw"]
    screen.drag((100, 100), (140, 100))  # the picture follows the mouse: the head turns left
    program.go_on()
    state = program.said()
    while state["yaw"] > turned:  # the key may still have been held for a view
        turned = state["yaw"]
        program.go_on()
        state = program.said()
    half = Viewport((SCREEN[0] // 2, SCREEN[1]), HFOV_DEG)
    dragged_deg = 40 * np.degrees(1 / half.focal_px) / np.cos(np.radians(AHEAD_DEG[1]))
    assert state["yaw"] == pytest.approx(turned - dragged_deg, abs=0.01)

    screen.ask_to_close()
    program.go_on()
    status, out, err = program.ended()
    end = json.loads(out.splitlines()[-1])
    assert (status, err, end["ended"]) == (0, "", True)
    assert len(end["latch_to_swap_ns"]) == end["views"]
    assert all(age > 0 for age in end["pose_to_swap_ns"] + end["latch_to_swap_ns"])
    assert min(end["pose_to_swap_ns"]) < 1e9  # of the hand's last move, not of the clock's start


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("window") / "flight.mp4"
    video_streams.write(str(path), "mp4", size=(240, 240), count=8)
    return path


def flying(screen: XScreen, recording: Path, *options: str) -> Program:
    command = ("-m", "freelook", "fly", str(recording), "--lens", "demo", "--show", "window")
    return Program(screen, *command, "--loop", *options)


@pytest.mark.timeout(2 * PATIENCE_S + 60)
def test_fly_in_a_window_until_q(
    screen: XScreen, recording: Path, wait_until: Callable[..., None]
) -> None:
    program = flying(screen, recording, "--monitor", "1", "--tracker", "wander")
    wait_until(screen.lit, PATIENCE_S, "a picture on the screen")
    screen.press("q")
    status, out, err = program.ended()
    assert (status, err) == (0, "")
    assert "window: drawn by" in out
    assert "source: live" in out
    assert " views, " in out
    assert "none measured" not in out  # of the tracker's poses
    assert (screen.picture() == 0).all()  # the window is gone


@pytest.mark.timeout(2 * PATIENCE_S + 60)
def test_a_display_that_goes_away_ends_the_flight_in_order(
    screen: XScreen, recording: Path, wait_until: Callable[..., None]
) -> None:
    program = flying(screen, recording)
    wait_until(screen.lit, PATIENCE_S, "a picture on the screen")
    screen.kill()
    status, out, err = program.ended()
    assert status == 2
    assert err == "freelook fly: the display went away, and the window with it\n"
    assert " views, " in out  # its figures are still told


def test_without_a_display_it_says_so(
    recording: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert main(["fly", str(recording), "--lens", "demo", "--show", "window"]) == 2
    assert "neither DISPLAY nor WAYLAND_DISPLAY" in capsys.readouterr().err


GOGGLES = [
    Monitor(1, "DP-1", (2560, 1440), 144.0, None),
    Monitor(2, "HDMI-1", (1920, 1080), 60.0, None),
    Monitor(3, "HDMI-2", (1280, 720), 0.0, None),
]


@pytest.mark.parametrize(("wanted", "number"), [("2", 2), ("dp", 1), ("hdmi-2", 3)])
def test_a_monitor_is_chosen_by_number_or_name(wanted: str, number: int) -> None:
    assert choose_monitor(wanted, GOGGLES).number == number


@pytest.mark.parametrize(("wanted", "why"), [("hdmi", "several"), ("4", "no monitor")])
def test_a_monitor_that_is_not_there_is_refused(wanted: str, why: str) -> None:
    with pytest.raises(SinkError, match=rf"{why}.*2: HDMI-1, 1920x1080 at 60 Hz"):
        choose_monitor(wanted, GOGGLES)
