"""Both pilots' views: the right thing at the right place, filmed when it was, marked where due."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import pytest

from freelook.camera import Camera
from freelook.duel.contest import Duel, fight
from freelook.duel.figures import Settings, figures, ideal, settings_of
from freelook.duel.head import HeadMotion, body_from_angles, synthetic_head
from freelook.duel.views import CAPTION_PX, CROSS_PX, SideBySide, cross_px, times_ns
from freelook.formats import load_camera
from freelook.plots.duel import COLOR_OF, duel_figure, liveliest_s
from freelook.rotations import body_from_view
from freelook.simulation.flight import Hover, State
from freelook.viewport import Viewport

VIEW = Viewport((320, 240), 80)
BOARD = (470.0, 0.0, -29.0)  # the red board with the F, its middle: north, east, down
LABELS = ("freelook", "gimbal: hobby-servo")


def settings() -> Settings:
    return settings_of(figures("hobby-servo", "analogue"))


@pytest.fixture(scope="module")
def camera() -> Camera:
    return load_camera("demo").resized((640, 640))


def still(yaw_deg: float, pitch_deg: float, seconds: float = 4) -> HeadMotion:
    times = np.arange(round(seconds * 100) + 1) * 10_000_000
    flat = np.ones(len(times))
    angles = np.stack([yaw_deg * flat, pitch_deg * flat, 0 * flat])
    return HeadMotion("still", times, body_from_angles(angles))


def halves(views: SideBySide, t_ns: int) -> list[np.ndarray]:
    pixels = views.frame(t_ns).picture.planes[0]
    assert pixels.shape[1::-1] == views.size
    width = VIEW.size[0]
    return [pixels[CAPTION_PX:, :width], pixels[CAPTION_PX:, width:]]


def red_middle(pixels: np.ndarray) -> tuple[float, float]:
    """The middle of the bounds of the largest red thing, in pixels."""
    red, green, blue = np.moveaxis(pixels.astype(float), -1, 0)
    mask = ((red > 110) & (green < 0.45 * red) & (blue < 0.45 * red)).astype(np.uint8)
    _count, _labels, stats, _middles = cv2.connectedComponentsWithStats(mask)
    x, y, width, height, _area = stats[1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))]
    return x + (width - 1) / 2, y + (height - 1) / 2


def test_a_landmark_is_where_geometry_puts_it_in_both_halves(camera: Camera) -> None:
    """Standing 220 m south of the board, looking up and to the left of it: it is below, right."""
    place = (250.0, 0.0, -29.0)
    duel = fight(still(-14, 9), ideal(settings()))
    views = SideBySide(duel, camera, VIEW, LABELS, flight=Hover(place))
    ray = body_from_view(-14, 9).inv().apply(np.subtract(BOARD, place))
    expected = VIEW.focal_px * ray[:2] / ray[2] + (np.array(VIEW.size) - 1) / 2
    assert expected[0] > 190  # far from the middle, and from the marks
    assert expected[1] > 140
    for half in halves(views, 2_000_000_000):
        # a pixel of the fisheye is 1.3 of the view; the board's edges are soft
        assert red_middle(half) == pytest.approx(expected, abs=2.0)


@dataclass(frozen=True)
class Moved:
    """Looks north until a time, then south."""

    moved_ns: int

    def at(self, t_ns: int) -> State:
        return Hover((250, 0, -29), 0.0 if t_ns < self.moved_ns else 180.0).at(t_ns)


def test_each_half_is_as_old_as_its_video(camera: Camera) -> None:
    """100 ms after the vehicle has turned round, the gimbal's picture shows it (37 ms), that of
    freelook's, which comes through a digitiser (137 ms), does not yet."""
    duel = fight(still(0, 0), ideal(settings()))
    views = SideBySide(duel, camera, VIEW, LABELS, flight=Moved(1_500_000_000))
    north, south = halves(views, 1_400_000_000), halves(views, 1_900_000_000)
    between = halves(views, 1_600_000_000)
    for which, known in ((0, north), (1, south)):
        assert (between[which] == known[which]).all()
        assert (north[which] != south[which]).any()


def test_the_cross_is_where_the_head_looks() -> None:
    shown = body_from_view(10, 5)
    assert cross_px(VIEW, shown, shown) == pytest.approx((159.5, 119.5))
    x, y = cross_px(VIEW, body_from_view(10, 0), body_from_view(20, 0))
    assert x == pytest.approx(159.5 + VIEW.focal_px * np.tan(np.radians(10)))
    assert y == pytest.approx(119.5)
    x, y = cross_px(VIEW, body_from_view(0, 0), body_from_view(0, 8))
    assert y == pytest.approx(119.5 - VIEW.focal_px * np.tan(np.radians(8)))


@pytest.mark.parametrize(("yaw", "side"), [(75, 1), (120, 1), (-75, -1), (-160, -1)])
def test_a_cross_beyond_the_border_is_held_at_it(yaw: float, side: int) -> None:
    x, y = cross_px(VIEW, body_from_view(0, 0), body_from_view(yaw, 0))
    assert x == pytest.approx(159.5 + side * (159.5 - CROSS_PX))
    assert y == pytest.approx(119.5)


def test_the_marks_are_drawn(camera: Camera) -> None:
    duel = fight(still(0, 0), ideal(settings()))
    views = SideBySide(duel, camera, VIEW, LABELS, flight=Hover())
    for half in halves(views, 2_000_000_000):
        green = (half == (40, 220, 60)).all(axis=-1)
        rows, columns = np.nonzero(green)
        assert rows.mean() == pytest.approx(120, abs=1)
        assert columns.mean() == pytest.approx(160, abs=1)


def test_times_of_a_video() -> None:
    duel = fight(still(0, 0), ideal(settings()))
    assert times_ns(duel, 10)[:3] == [1_000_000_000, 1_100_000_000, 1_200_000_000]
    assert len(times_ns(duel, 10)) == 30


@pytest.fixture(scope="module")
def lively() -> Duel:
    return fight(synthetic_head(12), settings())


def test_the_figure_shows_both_sides_numbers(lively: Duel) -> None:
    figure = duel_figure(lively, "a title")
    stretch, errors, distribution, turn = figure.axes
    for axes in (stretch, errors, distribution, turn):
        colors = [line.get_color() for line in axes.get_lines()]
        assert set(COLOR_OF.values()) <= set(colors)
    seconds, values = lively.errors_deg()
    first_s = liveliest_s(seconds, values["gimbal"])
    (line,) = [each for each in errors.get_lines() if each.get_color() == COLOR_OF["gimbal"]]
    x, y = np.asarray(line.get_data())
    assert x[0] == pytest.approx(first_s)
    assert y == pytest.approx(values["gimbal"][np.searchsorted(seconds, x)])
    legend = distribution.get_legend()
    assert legend is not None
    labels = [text.get_text() for text in legend.get_texts()]
    assert f"gimbal: 5 % above {lively.gimbal.direction.p95:.2g}°" in labels


def test_the_liveliest_stretch_has_the_largest_mean_square() -> None:
    seconds = np.arange(1.0, 31.0, 0.001)
    error = np.where((seconds > 12) & (seconds < 18), 5.0, 1.0)
    assert liveliest_s(seconds, error) == pytest.approx(12, abs=0.01)
    assert liveliest_s(seconds[:100], error[:100]) == 1.0  # shorter than the window: all of it
