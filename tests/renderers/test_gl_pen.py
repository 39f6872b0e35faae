"""The pen that draws HUDs: where lines and letters land, legible over white and over black, seen
through a viewer's lens where the view is."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from freelook.hud import THEMES, Box, Lines, Shape, Text, theme_named
from freelook.hud.place import Rect
from freelook.renderers.gl_pen import GlPen
from gl_here import gl_context

WIDTH, HEIGHT = SIZE = (96, 64)
Picture = NDArray[np.uint8]
Draw = Callable[..., Picture]


@pytest.fixture(scope="module")
def context() -> Iterator[Any]:
    with gl_context() as opened:
        yield opened


@pytest.fixture(scope="module")
def draw(context: Any) -> Draw:
    """(rows from the top, columns, 3) of shapes over one level of grey."""
    frame = context.framebuffer([context.texture(SIZE, 3)])

    def drawn(
        shapes: Sequence[Shape],
        theme: str = "plain",
        ratio: float = 1.0,
        over: int = 0,
        **lens: Any,
    ) -> Picture:
        frame.use()
        context.clear(over / 255, over / 255, over / 255)
        pen = GlPen(context, theme_named(theme), ratio)
        pen.draw([pen.ink(shapes)], SIZE, **lens)
        pen.release()
        data = np.frombuffer(frame.read(components=3, alignment=1), np.uint8)
        return data.reshape(HEIGHT, WIDTH, 3)[::-1]

    return drawn


def line(*ends: float, width: float = 2.0, role: str = "line") -> Lines:
    return Lines(np.array([ends]), width, role)


def test_a_line_covers_the_pixels_that_it_should(draw: Draw) -> None:
    """The theme's lines are 0.9 as wide: 1.8 pixels round y = 20 and 40.25."""
    picture = draw([line(10, 20, 80, 20), line(10, 40.25, 80, 40.25)])[..., 0].astype(float) / 255
    assert picture[18:22, 45] == pytest.approx([0, 0.9, 0.9, 0], abs=0.02)
    assert picture[38:43, 45] == pytest.approx([0, 0.65, 1, 0.15, 0], abs=0.02)
    assert picture[19, 12:78] == pytest.approx(0.9, abs=0.02)
    assert picture[:, :8].max() == picture[:, 83:].max() == 0


def test_a_box_lets_a_little_through(draw: Draw) -> None:
    picture = draw([Box(Rect(20, 10, 30, 20))], over=255).astype(float) / 255
    assert picture[11:29, 22:48] == pytest.approx(0.4, abs=0.01)  # opacity 0.6
    assert picture[:9].min() == picture[31:].min() == picture[:, :18].min() == 1


def test_what_comes_later_lies_on_top(draw: Draw) -> None:
    shapes = [line(10, 20, 80, 20, role="alert"), Box(Rect(30, 10, 20, 20)), line(10, 20, 80, 20)]
    picture = draw(shapes)
    assert (picture[20, 40] > 220).all()


def test_text_stands_where_its_anchor_says(draw: Draw) -> None:
    def columns(text: Text) -> tuple[int, int]:
        lit = np.flatnonzero((draw([text])[..., 0] > 100).any(axis=0))
        return int(lit.min()), int(lit.max())

    left = columns(Text("HH", 20, 30, 12, anchor="left"))
    middle = columns(Text("HH", 50, 30, 12))
    right = columns(Text("HH", 80, 30, 12, anchor="right"))
    step = 12 * 0.64
    # letters are as wide as their step with a gap, and lie on whole pixels
    assert left[0] == pytest.approx(20 + 1.3, abs=1)
    assert left[1] == pytest.approx(20 + 2 * step - 1.3, abs=1.5)
    assert sum(middle) / 2 == pytest.approx(49.5, abs=1)
    assert right[1] == pytest.approx(80 - 1.3, abs=1.5)
    rows = np.flatnonzero((draw([Text("H", 50, 30, 12)])[..., 0] > 100).any(axis=1))
    assert (rows.min() + rows.max()) / 2 == pytest.approx(29.5, abs=1)
    assert len(rows) == 9


def test_a_letters_rim_does_not_eat_its_neighbour(draw: Draw) -> None:
    one, two = draw([Text("0", 30, 30, 12)])[..., 0], draw([Text("0R", 34, 30, 12)])[..., 0]
    shifted = np.argmax((two > 128).any(axis=0)) - np.argmax((one > 128).any(axis=0))
    columns = np.flatnonzero((one > 128).any(axis=0))
    alone = one[:, columns]
    assert (two[:, columns + shifted] > 128)[alone > 128].all()


def luminance(picture: Picture) -> NDArray[np.float64]:
    """Relative, as WCAG 2 has it."""
    value = picture / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    return np.asarray(linear @ [0.2126, 0.7152, 0.0722])


# the least contrast between a line or letter and what is next to it: over white that is its rim
LEGIBLE = {"day": 9.0, "night": 4.0, "plain": 7.0}


@pytest.mark.parametrize("over", [0, 255])
@pytest.mark.parametrize("role", ["line", "bright", "chosen", "alert"])
@pytest.mark.parametrize("theme", THEMES)
def test_themes_are_legible_over_white_and_over_black(
    draw: Draw, theme: str, role: str, over: int
) -> None:
    shapes = [line(10, 16.5, 90, 16.5, role=role), Text("H", 48, 44, 14, role)]
    black, seen = luminance(draw(shapes, theme)), luminance(draw(shapes, theme, over=over))
    for part in (np.s_[10:24, 45:46], np.s_[34:54, 38:60]):
        brightest = np.unravel_index(black[part].argmax(), black[part].shape)
        contrast = (seen[part][brightest] + 0.05) / (seen[part].min() + 0.05)
        assert contrast >= LEGIBLE[theme] * (
            0.55 if role == "alert" else 1.0
        )  # red is a dark colour


def test_through_a_viewers_lens_it_lies_on_the_view(draw: Draw) -> None:
    """A place r focal lengths from the middle is shown at s, where s (1 + k1 s^2 + k2 s^4) = r."""
    k, focal, shift = (0.22, 0.24), 40.0, 3.0
    picture = draw([line(78, 31, 78, 33)], viewer_k=k, focal_px=focal, shift_px=shift)[..., 0]
    row = picture[HEIGHT // 2 - 1 : HEIGHT // 2 + 1].astype(float).mean(axis=0)
    x = float((row * (np.arange(WIDTH) + 0.5)).sum() / row.sum())
    assert x == pytest.approx(WIDTH / 2 + shift + focal * _solved(30 / focal, k), abs=0.05)


def _solved(r: float, k: tuple[float, float]) -> float:
    grid = np.linspace(0, r, 100001)
    return float(np.interp(r, grid * (1 + k[0] * grid**2 + k[1] * grid**4), grid))
