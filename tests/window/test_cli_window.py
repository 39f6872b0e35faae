"""What `freelook fly --show window` adds around the flight."""

from __future__ import annotations

import signal
from types import SimpleNamespace
from typing import Any

import pytest

from freelook.cli import _window, main
from freelook.window.ages import Figures
from freelook.window.surface import _pad


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_ask_the_loop_to_stop_and_are_given_back(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    asked_to_stop: Any = vars(_window)["asked_to_stop"]
    with asked_to_stop() as asked:
        assert not asked()
        signal.raise_signal(number)
        assert asked()
    assert signal.getsignal(number) == before


def test_a_flight_without_a_picture_is_told() -> None:
    assert _window.summary(Figures()) == "window: no picture was shown"


@pytest.mark.parametrize("text", ["0.2", "a,b", "1,2,3"])
def test_a_viewers_lens_has_two_numbers(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["fly", "x.mp4", "--lens", "demo", "--show", "window", "--viewer-lens", text])
    assert "is not K1,K2" in capsys.readouterr().err


def test_a_gamepads_right_stick_and_buttons() -> None:
    glfw = pytest.importorskip("glfw")
    buttons = [0] * 15
    buttons[glfw.GAMEPAD_BUTTON_A] = buttons[glfw.GAMEPAD_BUTTON_LEFT_BUMPER] = 1
    state = SimpleNamespace(axes=[0.1, 0.2, 0.3, -0.4, -1.0, -1.0], buttons=buttons)
    pad = _pad(glfw, state)
    assert (pad.x, pad.y, sorted(pad.held)) == (0.3, -0.4, ["recentre", "wider"])
