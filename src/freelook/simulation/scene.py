"""What stands on the airfield, as rows of numbers for the shading code.

Places are metres north and east of the middle of the runway; heights are metres above ground.
Landmarks tell the directions apart: red and white things stand in the north, blue ones in the
east, yellow ones in the south, green ones in the west. On boards that face the runway, and
painted on the ground, stand F (north), R (east), 7 (south) and L (west): front, right, behind
and left for whoever flies north, none of them its own mirror image.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import glyphs
from .pyramid import Float32s

Color = tuple[float, float, float]
Row = list[float]

RECT, GLYPH, SHADOW, DISC, BOX, BALL = range(6)
COLUMNS = 20
PLAIN, WINDOWS, BANDS = 0.0, 1.0, 2.0
FACES = {"": -1.0, "north": 0.0, "south": 1.0, "east": 2.0, "west": 3.0}

SUN_AZIMUTH_DEG, SUN_ELEVATION_DEG = 292.0, 34.0
WHITE, ASPHALT, CONCRETE = (0.95, 0.95, 0.93), (0.31, 0.31, 0.33), (0.62, 0.61, 0.58)
RED, BLUE = (0.83, 0.13, 0.12), (0.13, 0.33, 0.75)
YELLOW, GREEN = (0.95, 0.76, 0.12), (0.10, 0.50, 0.25)
WOOD, BRICK, STEEL = (0.45, 0.33, 0.22), (0.66, 0.36, 0.26), (0.74, 0.77, 0.80)


class Scene(NamedTuple):
    """Things on the ground first, then solid ones; `rows` (n, COLUMNS), layouts in the makers.

    Columns 0 to 3 say where to look for it: bounds on the ground (north from, to, east from, to)
    of what lies there, a ball (north, east, down, radius) round what stands. Metres.
    """

    kinds: NDArray[np.int32]
    rows: Float32s
    flat: int  # how many of them lie on the ground
    glyphs: glyphs.Glyphs
    sun: Float32s  # unit vector towards the sun, north east down


@cache
def airfield() -> Scene:
    """The one scene there is."""
    solid = [*_boards(), *_landmarks(), *_buildings(), *_aircraft(), *_village(), *_trees()]
    flat = [*_runway(), *_ground_letters(), *(_shadow(kind, row) for kind, row in solid)]
    both = flat + solid
    rows = np.array([row + [0.0] * (COLUMNS - len(row)) for _, row in both], dtype=np.float32)
    kinds = np.array([kind for kind, _ in both], dtype=np.int32)
    return Scene(kinds, rows, len(flat), glyphs.make_glyphs(), sun_direction())


def sun_direction() -> Float32s:
    azimuth, elevation = np.radians([SUN_AZIMUTH_DEG, SUN_ELEVATION_DEG])
    level = np.cos(elevation)
    towards = [level * np.cos(azimuth), level * np.sin(azimuth), -np.sin(elevation)]
    return np.array(towards, dtype=np.float32)


def rect(
    north: tuple[float, float],
    east: tuple[float, float],
    color: Color,
    *,
    every: tuple[float, float] = (0.0, 0.0),
) -> tuple[int, Row]:
    """Paint on the ground; `every` (north, east) makes half-filled dashes of that period."""
    return RECT, [*north, *east, *north, *east, *color, *every]


def letter(
    name: str, north: float, east: float, up_deg: float, height: float, color: Color
) -> tuple[int, Row]:
    """A letter painted on the ground, upright for whoever flies at azimuth `up_deg`."""
    up = [float(np.cos(np.radians(up_deg))), float(np.sin(np.radians(up_deg)))]
    index = float(glyphs.NAMES.index(name))
    return GLYPH, [*_square(north, east, height * 0.75), *up, height, 0.085, *color, index]


def box(
    north: float,
    east: float,
    size: tuple[float, float, float],
    color: Color,
    roof: Color,
    *,
    base: float = 0.0,
    style: float = PLAIN,
    glyph: str = "",
    face: str = "",
) -> tuple[int, Row]:
    """A block: `size` is (along north, along east, height); a letter on one face."""
    deep, wide, high = size
    bounds = [north - deep / 2, north + deep / 2, east - wide / 2, east + wide / 2]
    radius = float(np.linalg.norm(size)) / 2
    index = float(glyphs.NAMES.index(glyph)) if glyph else -1.0
    middle = [north, east, -base - high / 2, radius]
    return BOX, [*middle, *bounds, -base - high, -base, *color, *roof, style, index, FACES[face]]


def ball(
    north: float, east: float, height: float, radius: float, color: Color, other: Color, gores: int
) -> tuple[int, Row]:
    """A ball with its middle at `height`; `gores` pairs of stripes in two colours, or none."""
    return BALL, [north, east, -height, radius, radius, *color, *other, float(gores)]


def _shadow(kind: int, row: Row) -> tuple[int, Row]:
    sun = sun_direction().astype(float)
    per_m = -sun[:2] / -sun[2]  # how far one metre of height throws its shadow
    return _box_shadow(row, per_m) if kind == BOX else _ball_shadow(row, per_m)


def _box_shadow(row: Row, per_m: NDArray[np.float64]) -> tuple[int, Row]:
    """The ground swept by the base as it slides away from the sun: three pairs of edges.

    Columns 4 to 7: range north, range east; 8, 9: direction across the sun; 10, 11: range there.
    """
    n0, n1, e0, e1, top, bottom = row[4:10]
    throws = [-bottom * per_m, -top * per_m]
    points = np.array([(n + t[0], e + t[1]) for n in (n0, n1) for e in (e0, e1) for t in throws])
    across = np.array([-per_m[1], per_m[0]]) / np.hypot(*per_m)
    along_across = points @ across
    low, high = points.min(axis=0), points.max(axis=0)
    bounds = [low[0], high[0], low[1], high[1]]
    ranges = [*bounds, *bounds, *across, along_across.min(), along_across.max()]
    return SHADOW, list(map(float, ranges))


def _ball_shadow(row: Row, per_m: NDArray[np.float64]) -> tuple[int, Row]:
    """An ellipse. Columns 4, 5: its long direction; 6, 7: half axes."""
    north, east, down, _, radius = row[:5]
    middle = np.array([north, east]) - down * per_m
    length = float(np.hypot(*per_m))
    long = radius * float(np.hypot(1.0, length))
    square = _square(float(middle[0]), float(middle[1]), long)
    return DISC, [*square, *map(float, per_m / length), long, radius]


def _square(north: float, east: float, reach: float) -> Row:
    return [north - reach, north + reach, east - reach, east + reach]


def _runway() -> Iterator[tuple[int, Row]]:
    yield rect((-330, 330), (-13, 13), ASPHALT)
    yield rect((-200, 200), (58, 68), ASPHALT)  # taxiway and its links
    for north in (-180.0, 0.0, 180.0):
        yield rect((north - 6, north + 6), (13, 58), ASPHALT)
    yield rect((-70, 110), (68, 112), CONCRETE)
    yield rect((-270, 270), (-0.45, 0.45), WHITE, every=(36, 0))
    for side in (-1, 1):
        yield rect((-330, 330), (side * 12.0 - 0.3, side * 12.0 + 0.3), WHITE)
        yield rect((side * 312 - 13, side * 312 + 13), (-10.8, -1.2), WHITE, every=(0, 2.4))
        yield rect((side * 312 - 13, side * 312 + 13), (1.2, 10.8), WHITE, every=(0, 2.4))
        for east in (-6.0, 6.0):
            yield rect((side * 190 - 22, side * 190 + 22), (east - 1.8, east + 1.8), WHITE)
    yield rect((-200, 200), (62.8, 63.2), YELLOW)
    for name, east in (("3", -4.5), ("6", 4.5)):
        yield letter(name, -280, east, 0, 16, WHITE)
    for name, east in (("1", 4.5), ("8", -4.5)):
        yield letter(name, 280, east, 180, 16, WHITE)
    yield rect((18, 48), (76, 106), ASPHALT)
    yield letter("H", 33, 91, 0, 20, WHITE)


def _ground_letters() -> Iterator[tuple[int, Row]]:
    for name, north, east in (("F", 395, 0), ("R", -40, 205), ("7", -395, 0), ("L", 0, -75)):
        yield letter(name, north, east, 0, 60, WHITE)


def _boards() -> Iterator[tuple[int, Row]]:
    boards: Sequence[tuple[str, float, float, str, Color]] = (
        ("F", 470, 0, "south", RED),
        ("R", 0, 300, "west", BLUE),
        ("7", -470, 0, "north", YELLOW),
        ("L", 0, -300, "east", GREEN),
    )
    for name, north, east, face, color in boards:
        across_north = face in ("east", "west")
        size = (42.0, 3.0, 42.0) if across_north else (3.0, 42.0, 42.0)
        for leg in (-15, 15):
            place = (north + leg, east) if across_north else (north, east + leg)
            yield box(*place, (2, 2, 8), STEEL, STEEL)
        yield box(north, east, size, color, STEEL, base=8, glyph=name, face=face)


def _landmarks() -> Iterator[tuple[int, Row]]:
    for east in (-120.0, -165.0):
        yield box(520, east, (11, 11, 92), RED, STEEL, style=BANDS)
    yield box(505, -142, (40, 90, 18), BRICK, CONCRETE, style=WINDOWS)
    for north in (-150.0, -118.0, -86.0):
        yield box(north, 330, (26, 44, 16), BLUE, STEEL)
    for east in (90.0, 108.0, 126.0, 144.0):
        yield box(-500, east, (14, 14, 34), YELLOW, WHITE)
    yield box(-500, 160, (20, 16, 46), CONCRETE, YELLOW, style=WINDOWS)
    yield box(150, -330, (14, 14, 44), WHITE, GREEN, style=WINDOWS)
    yield box(150, -330, (9, 9, 14), GREEN, GREEN, base=44)
    yield box(150, -350, (16, 30, 16), WHITE, GREEN)
    balloons = (
        (330.0, 130.0, 115.0, RED, WHITE),
        (40.0, 420.0, 140.0, BLUE, YELLOW),
        (-260.0, 190.0, 105.0, YELLOW, (0.85, 0.35, 0.1)),
        (130.0, -250.0, 120.0, GREEN, WHITE),
    )
    for north, east, height, color, other in balloons:
        yield ball(north, east, height, 16, color, other, 8)
        yield box(north, east, (3.4, 3.4, 3.2), WOOD, WOOD, base=height - 25)


def _buildings() -> Iterator[tuple[int, Row]]:
    yield box(60, 128, (9, 9, 26), WHITE, CONCRETE, style=BANDS)
    yield box(60, 128, (13, 13, 5), (0.20, 0.30, 0.38), WHITE, base=26)
    yield box(20, 130, (44, 18, 10), WHITE, STEEL, style=WINDOWS)
    for north, roof in ((-40.0, BLUE), (-80.0, RED), (-120.0, GREEN)):
        yield box(north, 136, (32, 30, 12), STEEL, roof)
        yield box(north, 120.6, (22, 1, 9), (0.35, 0.38, 0.42), STEEL)


def _aircraft() -> Iterator[tuple[int, Row]]:
    for north, color in ((-50.0, RED), (-25.0, BLUE), (75.0, YELLOW)):
        yield box(north, 90, (1.4, 9.5, 1.6), WHITE, WHITE, base=1.0)
        yield box(north, 87.5, (12, 1.9, 0.4), color, color, base=2.5)
        yield box(north, 94.2, (4.2, 1.2, 0.3), color, color, base=2.4)
        yield box(north, 94.4, (0.35, 1.3, 1.8), color, color, base=2.6)


def _village() -> Iterator[tuple[int, Row]]:
    rng = np.random.default_rng(11)
    roofs: Sequence[Color] = (BRICK, (0.55, 0.25, 0.18), (0.42, 0.36, 0.34))
    walls: Sequence[Color] = (WHITE, (0.90, 0.85, 0.72), (0.80, 0.72, 0.62))
    for index in range(22):
        north = 190 + 26 * (index // 4) + rng.uniform(-5, 5)
        east = 190 + 30 * (index % 4) + rng.uniform(-6, 6)
        size = (rng.uniform(9, 14), rng.uniform(9, 15), rng.uniform(6, 10))
        yield box(north, east, size, walls[index % 3], roofs[index * 7 % 3], style=WINDOWS)


def _trees() -> Iterator[tuple[int, Row]]:
    rng = np.random.default_rng(4)
    rows = [(north, -118.0) for north in np.arange(-300.0, 320.0, 26.0)]
    rows += [(-340.0 + rng.uniform(-70, 70), rng.uniform(60, 170)) for _ in range(16)]
    rows += [(rng.uniform(180, 330), rng.uniform(175, 310)) for _ in range(14)]
    rows += [(rng.uniform(-60, 320), rng.uniform(-290, -150)) for _ in range(18)]
    for north, east in rows:
        radius = rng.uniform(3.5, 6.5)
        green = rng.uniform(0.85, 1.15)
        color = (0.22 * green, 0.38 * green, 0.15 * green)
        yield ball(north + rng.uniform(-3, 3), east, radius * 1.15, radius, color, color, 0)
