"""The simulated world is a smooth function, is the right way up and round, and has no mirror."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from freelook.errors import RenderError
from freelook.rotations import body_from_view
from freelook.simulation.flight import Hover
from freelook.simulation.scene import sun_direction
from freelook.simulation.world import World
from freelook.viewport import Viewport

Floats = NDArray[np.float64]

ABOVE = np.array([0.0, 0.0, -60.0])
UP, DOWN = np.array([0.0, 0, -1]), np.array([0.0, 0, 1])


def random_directions(rng: np.random.Generator, count: int) -> Floats:
    rays = rng.normal(size=(count, 3))
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def look(
    yaw: float,
    pitch: float,
    at: Floats = ABOVE,
    hfov_deg: float = 30.0,
    size: tuple[int, int] = (160, 120),
) -> Floats:
    """What somebody sees who looks `yaw` degrees east of north, in RGB."""
    turn = Hover().at(0).world_from_body * body_from_view(yaw, pitch)
    rays = Viewport(size, hfov_deg).rays() @ turn.as_matrix().T
    return World(0.2).render_rays(rays, at)


def white(rgb: Floats) -> NDArray[np.bool_]:
    """White paint, in the sun or in the shade."""
    return np.asarray((rgb.min(axis=-1) > 0.42) & (np.ptp(rgb, axis=-1) < 0.12))


def test_the_same_ray_has_the_same_colour_in_any_company(rng: np.random.Generator) -> None:
    """Tiles look only at what they think they can meet; they must not miss anything."""
    world = World(0.5)
    position = np.array([40.0, -30, -35])
    # most of them to where things stand
    rays = random_directions(rng, 3000) * (1, 1, 0.25)
    together = world.render_rays(rays, position)
    order = np.lexsort((rays[:, 1], np.arctan2(rays[:, 1], rays[:, 0]) // 0.05))
    sorted_ = world.render_rays(rays[order], position)
    assert sorted_ == pytest.approx(together[order], abs=2e-5)
    alone = np.array([world.render_rays(ray, position) for ray in rays[:100]])
    assert alone == pytest.approx(together[:100], abs=2e-5)


def test_the_length_of_a_ray_does_not_matter(rng: np.random.Generator) -> None:
    rays = random_directions(rng, 500)
    lengths = rng.uniform(0.01, 100, (500, 1))
    world = World(1.0)
    once, again = world.render_rays(rays, ABOVE), world.render_rays(rays * lengths, ABOVE)
    assert again == pytest.approx(once, abs=1e-4)


def test_threads_change_nothing(rng: np.random.Generator) -> None:
    rays = random_directions(rng, 2000)
    one, two = (World().render_rays(rays, ABOVE, threads=n) for n in (1, 2))
    assert np.array_equal(one, two)


@pytest.mark.parametrize("softness_deg", [0.5, 4.0])
def test_colours_change_smoothly(softness_deg: float, rng: np.random.Generator) -> None:
    """No jumps: a hundredth of the softness aside the colour is nearly the same."""
    rays = random_directions(rng, 20_000) * (1, 1, 0.3)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    step = np.radians(softness_deg) / 100
    beside = rays + step * np.cross(rays, random_directions(rng, len(rays)))
    world = World(softness_deg)
    change = np.abs(world.render_rays(beside, ABOVE) - world.render_rays(rays, ABOVE)).max(axis=1)
    assert change.max() < 0.015


def test_nothing_is_finer_than_the_softness(rng: np.random.Generator) -> None:
    """Soft worlds hold less detail, down to next to none."""
    rays = Viewport((200, 120), 60).rays() @ body_from_view(30, -10).as_matrix().T
    fine, soft, softest = (
        np.abs(np.diff(World(s).render_rays(rays, ABOVE), axis=1)).max() for s in (0.1, 2.0, 10.0)
    )
    assert fine > 2 * soft > 4 * softest


def test_sky_above_ground_below() -> None:
    sky, ground = World(1.0).render_rays(np.array([UP, DOWN]), np.array([100.0, -60, -60]))
    assert sky[2] > sky[0] + 0.1
    assert ground[1] > ground[2] + 0.1


def test_the_sun_is_where_it_is_said_to_be(rng: np.random.Generator) -> None:
    sun = sun_direction().astype(float)
    towards, away = World(0.2).render_rays(np.array([sun, sun * (-1, -1, 1)]), ABOVE)
    assert towards.min() > 0.85
    assert towards.sum() > away.sum() + 0.3


# where each board's letter is, seen from over the runway's middle, and how wide to look
BOARDS = {"F": (0.0, 470), "R": (90.0, 300), "7": (180.0, 470), "L": (-90.0, 300)}
LETTER_M = 36.0


def board(letter: str) -> Floats:
    """The square round a board's letter."""
    yaw, away = BOARDS[letter]
    pitch = np.degrees(np.arctan2(29 - 60, away))
    seen = look(yaw, pitch, hfov_deg=10.0, size=(640, 480))
    half = round(LETTER_M / 2 / np.hypot(away, 31) * 320 / np.tan(np.radians(5)))
    return seen[240 - half : 240 + half, 320 - half : 320 + half]


@pytest.mark.parametrize(
    ("letter", "high", "low"), [("F", 0, 2), ("R", 2, 0), ("7", 1, 2), ("L", 1, 0)]
)
def test_landmarks_tell_the_directions_apart(letter: str, high: int, low: int) -> None:
    """Red in the north, blue in the east, yellow (red and green) south, green west."""
    middle = board(letter)
    color = np.median(middle[~white(middle)], axis=0)
    assert color[high] > color[low] + 0.15
    assert (color[0] > color[1] - 0.1) == (letter in "F7")


SHAPES = {
    "F": ["#####", "#....", "#....", "####.", "#....", "#....", "#...."],
    "R": ["####.", "#...#", "#...#", "####.", "#.#..", "#..#.", "#...#"],
    "7": ["#####", "....#", "...#.", "...#.", "..#..", "..#..", "..#.."],
    "L": ["#....", "#....", "#....", "#....", "#....", "#....", "#####"],
}


def likeness(painted: NDArray[np.bool_], shape: NDArray[np.bool_]) -> float:
    """Correlation of what is painted with a letter of 5 x 7 cells, from edge to edge."""
    rows, columns = (np.flatnonzero(painted.any(axis=axis)) for axis in (1, 0))
    y = np.linspace(0, 6.999, rows[-1] - rows[0] + 1).astype(int)
    x = np.linspace(0, 4.999, columns[-1] - columns[0] + 1).astype(int)
    cut = painted[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return float(np.corrcoef(cut.ravel(), shape[np.ix_(y, x)].ravel())[0, 1])


def assert_reads(painted: NDArray[np.bool_], letter: str) -> None:
    """It is this letter, and not its mirror image, nor upside down, nor turned round."""
    shape = np.array([[cell == "#" for cell in row] for row in SHAPES[letter]])
    assert painted.sum() > 300
    right = likeness(painted, shape)
    assert right > 0.45
    for wrong in (shape[:, ::-1], shape[::-1], shape[::-1, ::-1]):
        assert right > likeness(painted, wrong) + 0.2


@pytest.mark.parametrize("letter", BOARDS)
def test_letters_on_boards_read_right(letter: str) -> None:
    assert_reads(white(board(letter)), letter)


@pytest.mark.parametrize(
    ("letter", "north", "east"), [("F", 395, 0), ("R", -40, 205), ("7", -395, 0), ("L", 0, -75)]
)
def test_letters_on_the_ground_read_right(letter: str, north: int, east: int) -> None:
    """Seen from above with north up."""
    seen = look(0, -90, np.array([north, east, -120.0]), 40.0)
    assert_reads(white(seen)[5:115, 40:120], letter)


def test_what_cannot_be_rendered() -> None:
    with pytest.raises(RenderError, match="above ground"):
        World().render_rays(UP, np.array([0.0, 0, 5]))
    with pytest.raises(RenderError, match="position"):
        World().render_rays(UP, np.array([0.0, np.nan, -5]))
    with pytest.raises(RenderError, match="softness"):
        World(0.0)
    black = World().render_rays(np.array([[np.nan, 0, 1], [0, 0, 0], [0, 0, -1]]), ABOVE)
    assert not black[:2].any()
    assert black[2].all()
