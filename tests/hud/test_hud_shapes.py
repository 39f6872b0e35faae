"""What a HUD draws of its numbers: where the horizon lies, which way it tilts, where the nose is,
what is said, and that nothing lies on anything else."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from freelook.errors import RenderError
from freelook.hud import (
    Box,
    Dial,
    HudState,
    LensField,
    Lines,
    Shape,
    Situation,
    Text,
    conditions,
    definition,
    place_of,
    shapes,
    theme_named,
)
from freelook.hud.letters import make_sheet, numbers
from freelook.hud.place import RESTING, pixels_per_point
from freelook.hud.shapes import level
from freelook.hud.words import bearing, capitals, compass, shortened, tenths
from freelook.lens import Floats
from freelook.rotations import FRD_FROM_RDF, body_from_view
from freelook.viewport import Viewport
from hud_states import CAMERA, FULL, STATES, attitude

SIZE = (640, 360)


def drawn(state: HudState, *parts: str, size: tuple[float, float] = SIZE) -> list[Shape]:
    return shapes(state, place_of(*size, parts))


def horizon(state: HudState) -> Floats:
    """The level line's pieces, without its ticks."""
    lines = [shape for shape in drawn(state, "horizon") if isinstance(shape, Lines)]
    pieces = lines[1].pieces
    across = np.abs(pieces[:, 2] - pieces[:, 0])
    return pieces[across > 10]


def texts(state: HudState, *parts: str) -> dict[str, Text]:
    return {s.text: s for s in drawn(state, *parts) if isinstance(s, Text)}


def distance(pieces: Floats, x: float, y: float) -> float:
    """From the nearest piece, as an endless line."""
    start, along = pieces[:, :2], pieces[:, 2:] - pieces[:, :2]
    share = ((np.array([x, y]) - start) * along).sum(1) / (along**2).sum(1)
    inside = (share >= 0) & (share <= 1)
    assert inside.any()
    away = along[:, 0] * (y - start[:, 1]) - along[:, 1] * (x - start[:, 0])
    return float((np.abs(away) / np.hypot(*along.T))[inside].min())


@pytest.mark.parametrize("known", [True, False])
def test_the_horizon_lies_where_level_rays_are_seen(known: bool) -> None:
    """World-level rays where the attitude is known, else those level in the vehicle."""
    vehicle = attitude(70, 12, -25)
    state = replace(FULL, world_from_body=vehicle if known else None)
    viewport = Viewport(SIZE, state.hfov_deg)
    world_from_view = (vehicle if known else attitude(0, 0, 0)) * state.body_from_view
    seen = 0
    for azimuth in np.radians(np.arange(0.0, 360.0, 7.0)):
        ray = world_from_view.inv().apply([np.cos(azimuth), np.sin(azimuth), 0.0])
        if ray[2] < 0.3:
            continue
        pixel = viewport.kind.place(ray) * viewport.focal_px + (np.array(SIZE) - 1) / 2
        x, y = pixel + 0.5  # shapes count from the view's outer edge
        if 0 < x < SIZE[0] and 0 < y < SIZE[1]:
            assert distance(horizon(state), x, y) < 1e-6  # great circles are straight here
            seen += 1
    assert seen >= 3


def test_a_vehicle_that_rolls_right_tilts_the_horizon_anticlockwise() -> None:
    state = replace(
        FULL, body_from_view=FRD_FROM_RDF, world_from_body=attitude(0, 0, 30), lens=None
    )
    pieces = horizon(state)
    slope = (pieces[:, 3] - pieces[:, 1]) / (pieces[:, 2] - pieces[:, 0])
    assert slope == pytest.approx(-np.tan(np.radians(30)))  # up to the right: y counts down
    assert "WORLD  PITCH 0°  ROLL +30°" in texts(state, "tape")


def nose_x(state: HudState) -> float:
    lines = [s for s in drawn(state, "horizon") if isinstance(s, Lines)]
    return float(lines[-1].pieces[:, 0].mean())


def caret_x(state: HudState) -> float:
    lines = [s for s in drawn(state, "tape") if isinstance(s, Lines) and s.role == "chosen"]
    return float(lines[0].pieces[:, [0, 2]].mean())


@pytest.mark.parametrize("world", [None, attitude(200, 0, 0)])
def test_head_left_puts_the_nose_on_the_right(world: object) -> None:
    state = replace(FULL, body_from_view=body_from_view(-20, 0), world_from_body=world)
    focal = Viewport(SIZE, 90.0).focal_px
    assert nose_x(state) == pytest.approx(320 + focal * np.tan(np.radians(20)), abs=2)
    assert caret_x(state) == pytest.approx(320 + 20 / 120 * place_of(*SIZE).tape.width)
    back = replace(state, body_from_view=body_from_view(150, 0))
    assert caret_x(back) == pytest.approx(place_of(*SIZE).tape.x, abs=6)  # beyond: at the end


def test_what_is_not_known_is_the_vehicles_and_said_so() -> None:
    vehicle, world = texts(FULL, "horizon", "tape"), texts(STATES["rolled"], "horizon", "tape")
    assert "VEHICLE  PITCH −6°  ROLL +8°" in vehicle
    assert {"25°R", "30R"} <= set(vehicle)
    assert not {"N", "E", "S", "W"} & set(vehicle)
    assert any(text.startswith("WORLD") for text in world)
    assert "HEAD 25°R  −6°" in world
    assert "E" in world
    north = replace(STATES["rolled"], world_from_body=attitude(335, 0, 0))
    assert "000°" in texts(north, "tape")


def test_the_views_border_in_the_ring_of_the_lens() -> None:
    """Looking right, it lies on the right; beyond the lens, on the ring and a little outside."""
    state = replace(FULL, body_from_view=body_from_view(40, 0))
    ring, border = [s.pieces for s in drawn(state, "field") if isinstance(s, Lines)]
    x, y = 12 + 30, 360 - 12 - 30
    assert np.hypot(ring[:36, 0] - x, ring[:36, 1] - y) == pytest.approx(30.0)
    assert np.mean(border[:, 0]) > x + 5
    assert np.hypot(border[:, 0] - x, border[:, 1] - y).max() <= 1.2 * 30 + 1e-9
    assert "90°" in texts(state, "field")


def test_the_lenss_edge_is_drawn_where_it_is_seen() -> None:
    lens = LensField.of(CAMERA)
    state = replace(FULL, body_from_view=body_from_view(90, 0), lens=lens)
    (edge,) = drawn(state, "edge")
    assert isinstance(edge, Lines)
    x = 320 + Viewport(SIZE, 90.0).focal_px * np.tan(lens.theta_max - np.pi / 2)
    near = edge.pieces[np.abs(edge.pieces[:, 1] - 180) < 60]
    assert near[:, 0] == pytest.approx(x, abs=3)
    assert drawn(replace(state, body_from_view=body_from_view(0, 0)), "edge") == []


OVERLAPPING = [(640, 360), (960, 540), (390, 844), (1600, 540)]


@pytest.mark.parametrize("size", OVERLAPPING)
@pytest.mark.parametrize("inset", [(0.0, 0.0), (40.0, 30.0)])
def test_nothing_lies_on_anything_else(size: tuple[int, int], inset: tuple[float, float]) -> None:
    advance = definition()["text"]["advance"]
    frames = []
    for part in ("tape", "field", *RESTING):
        for shape in shapes(STATES["rolled"], place_of(*size, (part,), inset)):
            if isinstance(shape, Text):
                half = len(shape.text) * shape.size * advance / 2
                x = shape.x + {"left": half, "middle": 0.0, "right": -half}[shape.anchor]
                high = shape.size * 0.8
                frames.append((part, x - half, shape.y - high / 2, x + half, shape.y + high / 2))
            elif isinstance(shape, Box):
                r = shape.rect
                frames.append((part, r.x, r.y, r.x + r.width, r.y + r.height))
    for part, left, top, right, bottom in frames:
        assert left >= inset[0] - 1, part
        assert top >= inset[1], part
        assert right <= size[0] - inset[0] + 1, part
        assert bottom <= size[1] - inset[1], part
    for one, other in combinations(frames, 2):
        if one[0] != other[0]:
            apart = one[3] <= other[1] or other[3] <= one[1] or one[4] <= other[2]
            assert apart or other[4] <= one[2], (one, other)


def test_larger_views_get_larger_letters() -> None:
    assert pixels_per_point((640, 360)) == 1
    assert pixels_per_point((1920, 1080)) == 2
    assert pixels_per_point((1080, 1920)) == 2
    assert len({pixels_per_point((1920, height)) for height in range(540, 1081)}) == 9


def test_letters_differ_and_are_where_they_should_be() -> None:
    sheet = make_sheet(12.0, 1.6, 1.0)
    wide = sheet.cell[0]
    strokes = {
        letter: sheet.covered[:, wide * i : wide * (i + 1), 0] for letter, i in numbers().items()
    }
    alike = {frozenset("O0"), frozenset("−–"), frozenset("'’")}
    for one, other in combinations(strokes, 2):
        if frozenset((one, other)) not in alike:
            different = np.abs(strokes[one].astype(int) - strokes[other]) > 128
            assert different.sum() >= 2, (one, other)
    for letter, covered in strokes.items():
        assert covered.max() > 120, letter  # a dot may lie between two pixels
        assert covered[0].max() == covered[-1].max() == 0, letter  # room for the rim
    rim = sheet.covered[..., 1].astype(int) - sheet.covered[..., 0]
    assert rim.min() >= 0
    assert (rim > 128).any()


@pytest.mark.parametrize(
    ("made", "expected"),
    [
        (bearing(-30.4), "30L"),
        (bearing(0.4), "0"),
        (bearing(-540), "180"),
        (bearing(390, "°"), "30°R"),
        (compass(270), "W"),
        (compass(-30), "330"),
        (tenths(4.25), "4.3"),
        (tenths(99.5), "100"),
        (tenths(1500), "1.5S"),
        (tenths(-0.4), "0.0"),
        (capitals("Tür µ"), "T?R ?"),
        (shortened("A LONG ONE", 7), "A LONG…"),
    ],
)
def test_numbers_and_words(made: str, expected: str) -> None:
    assert made == expected


@pytest.mark.parametrize(
    ("dial", "expected"),
    [
        (Dial(), "none"),
        (Dial(20, 35), "good"),
        (Dial(20, 36), "fair"),
        (Dial(71, 80), "poor"),
    ],
)
def test_dials_are_judged(dial: Dial, expected: str) -> None:
    assert level("head", dial) == expected


def said(**situation: object) -> list[tuple[str, str]]:
    return [(w.level, w.text) for w in conditions(Situation(**situation))]  # type: ignore[arg-type]


def test_what_the_pilot_is_told() -> None:
    assert said(video_age_s=0.04) == []
    assert said() == [("info", "Waiting for video")]
    assert said(video_age_s=3.9, source_state="lost") == [("alert", "Video lost 3 s ago: lost")]
    assert said(video_age_s=0.04, video_late_ms=600.0) == [("warn", "Video old: 600 ms")]
    told = said(video_age_s=0.0, head="a", head_state="holding", head_age_ms=1600.0, limited=True)
    assert told == [("warn", "a silent for 2 s: holding"), ("warn", "At the lens's edge")]
    assert said(video_age_s=0.0, broken=("no space",)) == [("alert", "Recording failed: no space")]
    assert said(video_age_s=0.0, mode="world", mode_trouble="no attitude yet") == [
        ("warn", "Mode world: no attitude yet")
    ]


def test_an_unknown_theme_lists_the_known() -> None:
    with pytest.raises(RenderError, match="known: day, night, plain"):
        theme_named("dusk")
