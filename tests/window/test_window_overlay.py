"""The HUD over a window's views, drawn off-screen: off it changes nothing, both eyes get the same,
what it tells, its keys, and that a command may choose it."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scene import CAMERA, frame

from freelook.cli import main
from freelook.errors import RenderError
from freelook.gimbal import Stabiliser
from freelook.hud import THEMES, Dial, HudState, LensField, Situation
from freelook.mailbox import Mailbox
from freelook.rotations import body_from_view
from freelook.types import Attitude, Frame
from freelook.window.events import Event, Key
from freelook.window.eyes import Optics
from freelook.window.flight import AFTER_DAMAGE, Flight, Outside
from freelook.window.overlay import Overlay, RecentAges, Told
from freelook.window.pilot import Pilot
from gl_here import gl_context

pytest.importorskip("moderngl")

WIDTH, HEIGHT = SIZE = (640, 360)
STATE = HudState(body_from_view(10, 5), 80.0, lens=LensField.of(CAMERA))
FOCAL_PX = 300.0
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def context() -> Iterator[Any]:
    with gl_context() as opened:
        yield opened


def drawn(context: Any, overlay: Overlay) -> NDArray[np.uint8]:
    frame = context.framebuffer([context.texture(SIZE, 3)])
    frame.use()
    context.clear(0.2, 0.4, 0.8)
    overlay.draw(STATE, SIZE, frame, FOCAL_PX)
    picture = pixels(frame)
    frame.release()
    return picture


def pixels(frame: Any) -> NDArray[np.uint8]:
    """(rows from the top, columns, 3)."""
    data = np.frombuffer(frame.read(components=3, alignment=1), np.uint8)
    return data.reshape(HEIGHT, WIDTH, 3)[::-1]


def test_off_nothing_is_drawn_and_one_key_switches(context: Any) -> None:
    overlay = Overlay(context, theme="off")
    assert not overlay.is_due(10 * SECOND)
    assert np.ptp(drawn(context, overlay).reshape(-1, 3), axis=0).max() == 0
    version = overlay.version
    overlay.toggle()
    assert overlay.version > version  # a view that else would be the same is drawn anew
    on = drawn(context, overlay)
    assert (on != on[0, 0]).any(axis=2).mean() > 0.01
    before = overlay.theme
    overlay.next_theme()
    assert overlay.theme == THEMES[1] != before
    assert (drawn(context, overlay) != on).any()


def test_what_rests_is_made_anew_only_when_it_changes(context: Any) -> None:
    overlay = Overlay(context)
    assert overlay.is_due(SECOND)
    told = Told(Situation(video_age_s=0.1))
    overlay.rest(told, STATE, SIZE, SECOND)
    quiet, version = drawn(context, overlay), overlay.version
    assert not overlay.is_due(SECOND + SECOND // 10)
    overlay.rest(told, STATE, SIZE, 2 * SECOND)
    assert overlay.version == version
    overlay.rest(Told(Situation(video_age_s=4.0)), STATE, SIZE, 3 * SECOND)
    assert overlay.version > version
    lost = drawn(context, overlay)
    changed = np.flatnonzero((lost != quiet).any(axis=(1, 2)))
    assert changed.min() >= 88  # below the tape
    assert changed.max() <= 88 + 40


def test_both_eyes_see_the_same_lines_each_with_its_shift(context: Any) -> None:
    overlay = Overlay(context, Optics("side-by-side", 6.0))
    both = drawn(context, overlay)
    left, right = both[:, : WIDTH // 2], both[:, WIDTH // 2 :]
    inner = slice(40, WIDTH // 2 - 40)
    shifted = np.roll(right, 12, axis=1)  # each six pixels towards the nose
    assert np.abs(left[:, inner].astype(int) - shifted[:, inner]).max() <= 1
    assert (left != left[0, 0]).any()


class OffScreen:
    """A surface without a window, on which one key after the other is pressed."""

    refresh_hz, lost = 0.0, False
    size_px = size_points = SIZE

    def __init__(self, context: Any, keys: Iterable[str]) -> None:
        self.context = context
        self.screen = context.framebuffer([context.texture(SIZE, 3)])
        self._keys = iter(keys)
        self.swapped = 0

    def events(self, wait_s: float = 0.0) -> list[Event]:
        return [Key(key, True) for key in itertools.islice(self._keys, 1)]

    def pad(self) -> None:
        return None

    def flush(self) -> None:
        self.context.finish()

    def swap(self) -> None:
        self.swapped += 1


def test_the_lines_have_the_field_of_the_picture(
    context: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where that is narrower than was wanted, as a map in a window that is too high for it;
    O takes another projection, for both."""
    said: list[tuple[str, float, float]] = []

    def note(_overlay: Overlay, state: HudState, size: Any, _target: Any, focal_px: float) -> None:
        said.append((state.projection, state.hfov_deg, focal_px))

    monkeypatch.setattr(Overlay, "draw", note)
    frames: Mailbox[Frame] = Mailbox()
    frames.put(frame())
    surface = OffScreen(context, ["", "", "", "o", "", "", "", "o", "", "", "", "q"])
    pilot = Pilot({}, 360.0, projection="equirectangular")
    flight = Flight(
        surface,  # type: ignore[arg-type]
        frames,
        CAMERA,
        pilot,
        Outside(itertools.count(0, SECOND // 100).__next__, lambda: False),
        hud="day",
    )
    flight.run()
    assert surface.swapped == len(said)
    (map_, _crop, flat) = dict.fromkeys(said)
    assert (map_[0], flat[0]) == ("equirectangular", "perspective")
    assert map_[1:] == pytest.approx((320, 640 / np.radians(320)))
    assert flat[1:] == pytest.approx((150, 320 / np.tan(np.radians(75))))


def test_before_the_first_picture_there_are_words(context: Any) -> None:
    """Until they are switched off; nothing is drawn that says the same as before."""
    surface = OffScreen(context, [*[""] * 12, "i", *[""] * 12, "q"])
    pictures = []
    surface.swap = lambda: pictures.append(pixels(surface.screen))  # type: ignore[method-assign]
    flight = Flight(
        surface,  # type: ignore[arg-type]
        Mailbox(),
        CAMERA,
        Pilot({}, 90.0),
        Outside(itertools.count(0, SECOND // 100).__next__, lambda: False),
        hud="day",
    )
    assert flight.run().views == 0
    assert len(pictures) == AFTER_DAMAGE + 1
    assert pictures[0][100:130].max() > 100  # under the place of the tape, which is not drawn
    assert pictures[0][:88, 200:440].max() == 0
    assert pictures[-1].max() == 0


def test_dials_tell_of_the_last_moments() -> None:
    ages = RecentAges()
    assert ages.dial(0) == Dial()
    for k in range(20):
        ages.add(k * SECOND // 20, (k + 1) * 1_000_000)
    assert ages.dial(SECOND) == Dial(10.0, 19.0)
    ages.add(3 * SECOND, 50_000_000)
    assert ages.dial(3 * SECOND) == Dial(50.0, 50.0)


def test_the_pilots_keys_and_who_is_in_command() -> None:
    pilot = Pilot({}, 90.0)
    keys = [Key("i", True), Key("i", False), Key("u", True)]
    assert pilot.take(keys, 0, SIZE) == ["lines", "theme"]
    assert pilot.command(0) == ("hand", "tracking", None)
    pilot.toggle(0)
    assert pilot.command(0) == ("hand", "front", None)


def test_the_vehicles_attitude_is_known_in_any_mode() -> None:
    stabiliser = Stabiliser()
    pilot = Pilot({}, 90.0, stabiliser)
    assert pilot.attitude(0) is None
    turned = body_from_view(30, 0)
    for t_ns in (0, SECOND // 10):
        stabiliser.push(Attitude(t_ns, turned))
    found = pilot.attitude(SECOND // 20)
    assert found is not None
    assert (found.inv() * turned).magnitude() == pytest.approx(0, abs=1e-9)


def test_an_unknown_theme_is_refused(context: Any, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(RenderError, match="unknown HUD theme 'dusk'"):
        Overlay(context, theme="dusk")
    with pytest.raises(SystemExit):
        main(["fly", "x.mp4", "--lens", "demo", "--hud", "dusk"])
    assert "'day', 'night', 'plain', 'off'" in capsys.readouterr().err
