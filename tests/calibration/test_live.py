"""Live calibration: when a view is taken, what counts as new, where the board is wanted next."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from board_pictures import Board, Floats, Gray, Held
from freelook.calibration.calibrate import Calibration
from freelook.calibration.live import (
    ENOUGH_VIEWS,
    FIRST_SOLVE,
    FOLLOWED_PX,
    MOST_VIEWS,
    LiveCalibration,
    LiveState,
    Progress,
    solve_views,
)
from freelook.calibration.live_coverage import COUNT, LitPicture, Sectors, name_of
from freelook.calibration.live_guidance import PATIENCE, Guide, Hold, next_sector
from freelook.calibration.live_placing import placing, rough_camera
from freelook.calibration.live_sharpness import (
    HOLD_NS,
    LONGEST_GAP_NS,
    SHARP_PX,
    SOFT_LOOKS,
    Sharpness,
    edge_width_px,
)
from freelook.calibration.targets import Chessboard
from freelook.calibration.views import View
from freelook.camera import Camera, make_camera
from freelook.clock import NS_PER_MS
from freelook.errors import CalibrationError
from freelook.lens import Equidistant, KannalaBrandt

SIZE = (640, 480)
LENS = KannalaBrandt(185.0, -0.01, 0.002, -0.001, 0.0001)
CAMERA = make_camera(SIZE, LENS, center=(322.0, 237.0), field_deg=190)
BOARD = Board(CAMERA)
MIDDLE = Held((320.0, 240.0))
LOOK_NS = 120 * NS_PER_MS
NOISE_PX = 0.1


@dataclass
class Script:
    """A target that is seen where the test says; `asked` has the sizes of the pictures searched.

    view  in pictures that are small enough to be followed
    full  in larger ones
    """

    view: View | None = None
    full: View | None = None
    asked: list[tuple[int, int]] = field(default_factory=list)

    def find(self, gray: Gray, name: str) -> View | None:
        rows, columns = gray.shape
        self.asked.append((columns, rows))
        view = self.full if columns > FOLLOWED_PX else self.view
        return view and replace(view, name=name)


class Bench:
    """A live calibration, a script, a clock and a picture, all sharp unless the test says so."""

    def __init__(self, gray: Gray | None = None) -> None:
        self.target = Script()
        self.live = LiveCalibration(self.target)
        self.gray = everywhere_sharp() if gray is None else gray
        self.now_ns = 0

    def look(self, view: View | None, count: int = 1, every_ns: int = LOOK_NS) -> LiveState:
        self.target.view = view
        for _ in range(count):
            self.now_ns += every_ns
            state = self.live.step(self.gray, self.now_ns)
            if state.verdict == "taken":
                break
        return state

    def hold(self, held: Held) -> LiveState:
        """Hold the board there for longer than is needed."""
        return self.look(BOARD.view(held), 2 + HOLD_NS // LOOK_NS)


def everywhere_sharp(size: tuple[int, int] = SIZE) -> Gray:
    """Squares of 5 pixels all over: an edge near every corner, wherever the script puts it."""
    y, x = np.mgrid[0 : size[1], 0 : size[0]]
    return np.where((x // 5 + y // 5) % 2 == 0, 30, 220).astype(np.uint8)


# --- still


def test_a_view_is_taken_once_the_board_was_still_long_enough() -> None:
    bench = Bench()
    view = BOARD.view(MIDDLE)
    assert bench.look(view).verdict == "moving"
    states = [bench.look(view) for _ in range(5)]
    assert [s.verdict for s in states] == ["moving"] * 4 + ["taken"]
    assert [round(s.held, 2) for s in states] == [0.24, 0.48, 0.72, 0.96, 1.0]
    assert [v.name for v in states[-1].views] == ["view 1"]
    assert bench.look(view, 20).verdict == "known"
    assert len(bench.live.views) == 1


def test_a_moving_board_is_not_taken() -> None:
    bench = Bench()
    for step in range(30):
        state = bench.look(BOARD.view(Held((200.0 + 5 * step, 240.0))))
        assert state.verdict == "moving"


def test_a_hand_trembles_less_than_what_counts_as_moving(rng: np.random.Generator) -> None:
    bench = Bench()
    for _ in range(6):
        shake = rng.uniform(-0.15, 0.15, 2)
        state = bench.look(BOARD.view(Held((320.0 + shake[0], 240.0 + shake[1]))))
    assert state.verdict == "taken"


def test_a_board_that_jumps_by_whole_squares_is_moving() -> None:
    """Each corner then lies where another one was."""
    bench = Bench()
    at = BOARD.view(MIDDLE)
    for step in range(12):
        shifted = View("jump", at.points, at.pixels + np.array([0.0, 22.0 * (step % 2)]))
        assert bench.look(shifted).verdict == "moving"


def test_nothing_is_concluded_from_a_long_gap_between_two_looks() -> None:
    bench = Bench()
    view = BOARD.view(MIDDLE)
    bench.look(view)
    assert bench.look(view, every_ns=LONGEST_GAP_NS + 1).verdict == "moving"


def test_without_a_board_it_starts_over() -> None:
    bench = Bench()
    view = BOARD.view(MIDDLE)
    bench.look(view, 4)
    assert bench.look(None).verdict == "absent"
    assert bench.look(view).held == 0


# --- sharp


def pictured(held: Held, sigma_px: float = 0.0, smeared_px: int = 0) -> tuple[Gray, View]:
    gray = BOARD.picture(held)
    if sigma_px:
        gray = np.asarray(cv2.GaussianBlur(gray, (0, 0), sigma_px), np.uint8)
    if smeared_px:
        gray = np.asarray(cv2.blur(gray, (smeared_px, 1)), np.uint8)
    return gray, BOARD.view(held)


@pytest.mark.parametrize(
    ("sigma_px", "smeared_px", "verdict"),
    [(0.0, 0, "taken"), (0.7, 0, "taken"), (2.5, 0, "blurred"), (0.0, 9, "blurred")],
)
def test_only_a_sharp_board_is_taken(sigma_px: float, smeared_px: int, verdict: str) -> None:
    """Smeared along one direction too, in which half of the edges stay as sharp as they were."""
    gray, view = pictured(MIDDLE, sigma_px, smeared_px)
    assert Bench(gray).look(view, 8).verdict == verdict


def test_edges_have_the_width_they_were_blurred_to() -> None:
    """A blurred step's slope is contrast / (sigma sqrt(2 pi)), and less by sqrt(2) half way between
    the two edges of a corner: 3.5 px of width per sigma."""
    wide = Board(CAMERA, inner=(3, 3), square=0.08)
    gray, at = wide.picture(MIDDLE), wide.view(MIDDLE).pixels
    blurred = np.asarray(cv2.GaussianBlur(gray, (0, 0), 3.0), np.uint8)
    assert edge_width_px(gray, at) < 3
    assert edge_width_px(blurred, at) == pytest.approx(3.0 * 3.545, rel=0.1)


def test_a_soft_lens_is_measured_by_its_own_best() -> None:
    sharpness = Sharpness()
    looks = [sharpness.look(SHARP_PX + 2) for _ in range(SOFT_LOOKS + 1)]
    assert looks == [False] * SOFT_LOOKS + [True]
    assert not sharpness.look(1.5 * (SHARP_PX + 2))
    assert not sharpness.look(float("nan"))


# --- new


@pytest.mark.parametrize(
    ("held", "new"),
    [
        (Held((322.0, 241.0)), False),
        (Held((400.0, 240.0)), True),
        (replace(MIDDLE, tilt_deg=(0.0, 5.0)), False),
        (replace(MIDDLE, tilt_deg=(0.0, 30.0)), True),
        (replace(MIDDLE, tilt_deg=(-30.0, 0.0)), True),
        (replace(MIDDLE, distance=0.31), False),
        (replace(MIDDLE, distance=0.45), True),
        (replace(MIDDLE, roll_deg=20.0), False),
    ],
    ids=str,
)
def test_elsewhere_tilted_or_at_another_distance_is_new(held: Held, new: bool) -> None:
    bench = Bench()
    assert bench.hold(MIDDLE).verdict == "taken"
    assert bench.hold(held).verdict == ("taken" if new else "known")


def test_corners_counted_from_the_other_end_are_the_same_view() -> None:
    """Which corner of a chessboard is the first is chance."""
    bench = Bench()
    bench.hold(MIDDLE)
    view = BOARD.view(MIDDLE)
    turned = View(view.name, view.points.max(axis=0) - view.points, view.pixels)
    assert bench.look(turned, 8).verdict == "known"


def test_a_view_that_fills_an_empty_part_needs_to_be_less_new() -> None:
    guide = Guide(SIZE)
    near = replace(MIDDLE, distance=0.15)
    one, other = BOARD.view(near), BOARD.view(replace(near, at=(355.0, 240.0)))
    guide.update([one], None, float("nan"))
    assert guide.is_new(other)
    assert guide.counts[0] == len(one.pixels)
    guide.counts[:] = 100  # every part is full
    assert not guide.is_new(other)


# --- hands


def test_take_takes_what_is_there_however_it_is_held() -> None:
    gray, view = pictured(MIDDLE, sigma_px=2.5)
    bench = Bench(gray)
    bench.live.take()
    assert bench.look(view).verdict == "taken"
    assert bench.look(view).verdict == "moving"
    bench.live.take()
    assert bench.look(view).verdict == "taken"
    assert [v.name for v in bench.live.views] == ["view 1", "view 2"]


def test_take_without_a_board_is_not_kept_for_later() -> None:
    bench = Bench()
    bench.live.take()
    assert bench.look(None).verdict == "absent"
    assert bench.look(BOARD.view(MIDDLE)).verdict == "moving"


def test_a_dropped_view_is_forgotten_and_its_place_is_new_again() -> None:
    bench = Bench()
    bench.hold(MIDDLE)
    state = bench.hold(Held((520.0, 240.0)))
    filled = state.filled.sum()
    bench.live.drop()
    again = bench.live.again(state)
    assert len(again.views) == 1
    assert again.filled.sum() < filled
    state = bench.hold(Held((520.0, 240.0)))
    assert state.verdict == "taken"
    assert [v.name for v in state.views] == ["view 1", "view 3"]


def test_dropping_from_nothing_does_nothing() -> None:
    bench = Bench()
    bench.live.drop()
    bench.look(None)
    bench.live.drop()
    assert bench.live.views == ()


def test_starting_over_forgets_everything() -> None:
    bench = Bench()
    bench.hold(MIDDLE)
    bench.live.restart()
    assert (bench.live.views, bench.live.size) == ((), None)
    assert bench.hold(MIDDLE).verdict == "taken"


# --- odd pictures


def test_a_small_part_of_the_board_is_not_taken() -> None:
    bench = Bench()
    whole = BOARD.view(MIDDLE)
    bench.look(whole)
    part = whole.only(np.arange(len(whole.pixels)) < 12)
    assert bench.look(part, 8).verdict == "hidden"


def test_pictures_of_another_size_are_refused_once_there_are_views() -> None:
    bench = Bench()
    bench.look(BOARD.view(MIDDLE), 3)
    bench.gray = everywhere_sharp((320, 240))
    assert bench.look(None).size == (320, 240)  # nothing lost yet: it just starts with these
    bench.gray = everywhere_sharp()
    bench.hold(MIDDLE)
    bench.gray = everywhere_sharp((320, 240))
    state = bench.look(None, 3)
    assert state.verdict == "size"
    assert "320 x 240" in state.sentence
    assert "640 x 480" in state.sentence
    bench.gray = everywhere_sharp()
    assert bench.hold(MIDDLE).verdict == "known"


def test_a_large_picture_is_followed_small_and_taken_at_full_size() -> None:
    bench = Bench(everywhere_sharp((1920, 1440)))
    small = BOARD.view(MIDDLE)
    bench.target.full = replace(small, pixels=(small.pixels + 0.5) * 2.4 - 0.4)
    state = bench.look(small, 8)
    assert bench.target.asked == [(800, 600)] * 6 + [(1920, 1440)]
    (taken,) = state.views
    np.testing.assert_array_equal(taken.pixels, bench.target.full.pixels)
    followed = bench.look(small).found
    assert followed is not None
    np.testing.assert_allclose(followed.pixels, (small.pixels + 0.5) * 2.4 - 0.5)


def test_what_is_found_only_in_the_small_picture_is_not_taken() -> None:
    bench = Bench(everywhere_sharp((1920, 1440)))
    view = BOARD.view(MIDDLE)
    verdicts = [bench.look(view).verdict for _ in range(12)]
    assert verdicts == (["moving"] * 5 + ["coarse"]) * 2  # it has to be held still anew


def test_after_many_views_no_more_are_taken_unasked() -> None:
    bench = Bench()
    for _ in range(MOST_VIEWS):
        bench.live.take()
        bench.look(BOARD.view(MIDDLE))
    assert bench.hold(Held((520.0, 240.0))).verdict == "many"
    bench.live.take()
    assert bench.look(BOARD.view(MIDDLE)).verdict == "taken"


def test_real_pictures_are_followed_and_taken_exactly() -> None:
    """With the real detector, in a picture larger than what is followed."""
    board = Board(CAMERA.resized((1152, 864)))
    held = Held((630.0, 380.0), distance=0.2)
    gray = board.picture(held, noise=1.0)
    live = LiveCalibration(Chessboard(board.square))
    states = [live.step(gray, now_ns) for now_ns in (0, HOLD_NS // 2, HOLD_NS)]
    assert [s.verdict for s in states] == ["moving", "moving", "taken"]
    truth = board.view(held).pixels
    followed, exact = (
        np.linalg.norm(s.found.pixels[:, None] - truth, axis=-1).min(axis=1)
        for s in states[1:]
        if s.found
    )
    assert len(exact) == len(truth) == 48
    assert np.median(followed) < 0.3
    assert np.median(exact) < 0.06  # what the detector is good for; a tenth is a bad day


# --- parts of the picture


def sectors_of(camera: Camera) -> Sectors:
    lit = LitPicture(camera.size)
    lit.add(Board(camera, oversampling=1).picture(None))
    return Sectors(camera.center, lit.reach(camera.center))


CIRCULAR = make_camera((800, 450), Equidistant(133.0), center=(392.0, 229.0), field_deg=180)
FULL = make_camera((800, 450), Equidistant(500.0), field_deg=110)
CAMERAS = {"cropped circle": CAMERA, "circular": CIRCULAR, "full frame": FULL}


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS.keys())
def test_every_pixel_that_is_lit_is_in_one_part(camera: Camera) -> None:
    sectors = sectors_of(camera)
    y, x = np.mgrid[0 : camera.size[1] : 7, 0 : camera.size[0] : 7]
    pixels = np.stack([x.ravel(), y.ravel()], axis=-1).astype(float)
    lit = np.isfinite(camera.ray(pixels)[:, 2])
    number = sectors.of(pixels)
    assert (number[lit] >= 0).mean() > 0.99
    # the rim reaches 6 % beyond the edge, which is 12 % of the circle's area
    assert (number[~lit] >= 0).sum() < 0.13 * lit.sum()
    assert set(number[lit]) - {-1} == set(range(COUNT))
    drawn = np.stack([inside(sectors.outline(n), pixels) for n in range(COUNT)])
    known = lit & (number >= 0)
    own = drawn[number[known], np.flatnonzero(known)]
    assert own.mean() > 0.95  # outlines are coarse, and cut the picture's corners


def inside(outline: Floats, pixels: Floats) -> NDArray[np.bool_]:
    polygon = outline.astype(np.float32).reshape(-1, 1, 2)
    return np.array([cv2.pointPolygonTest(polygon, tuple(p), False) >= 0 for p in pixels])


def test_the_middle_of_a_part_is_in_it() -> None:
    sectors = sectors_of(CAMERA)
    middles = np.stack([sectors.middle(n) for n in range(COUNT)])
    np.testing.assert_array_equal(sectors.of(middles), np.arange(COUNT))


def test_parts_are_named_clockwise_from_the_right() -> None:
    assert [name_of(n) for n in (0, 1, 3, 9, 12)] == [
        "the middle",
        "the right, half way out",
        "the bottom, half way out",
        "the right, near the edge",
        "the lower left, near the edge",
    ]


def test_the_edge_is_where_the_light_ends() -> None:
    circle = sectors_of(CIRCULAR).reach
    radius = float(CIRCULAR.lens.radius(np.array([np.pi / 2]))[0])  # 209 px, all in the picture
    np.testing.assert_allclose(circle, radius, atol=8)  # a pixel and a half of the small picture
    full = sectors_of(FULL).reach
    assert full[0] == pytest.approx(399.5, abs=8)
    assert full[16] == pytest.approx(224.5, abs=8)


def test_in_the_dark_the_whole_picture_counts() -> None:
    lit = LitPicture(SIZE)
    lit.add(np.full(SIZE[::-1], 16, np.uint8))
    assert lit.reach((319.5, 239.5))[0] == pytest.approx(319.5)


# --- where to hold the board


@pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS.keys())
def test_who_does_as_told_fills_the_picture_and_gets_a_good_lens(
    camera: Camera, rng: np.random.Generator
) -> None:
    board = Board(camera, oversampling=1)
    live = LiveCalibration(script := Script())
    gray = np.where(board.picture(None) > 0, everywhere_sharp(camera.size), 0).astype(np.uint8)
    now_ns, state = 0, live.step(gray, 0)
    for _ in range(30):
        if state.hold is None:
            break
        view = board.view(as_told(camera, state.hold))
        noisy = view.pixels + rng.normal(0, NOISE_PX, view.pixels.shape)
        script.view = replace(view, pixels=noisy)
        for _ in range(8):
            now_ns += LOOK_NS
            state = live.step(gray, now_ns)
            if state.verdict == "taken":
                break
        else:
            live.take()  # wanted where it was before: an impatient person presses the button
        if state.verdict == "taken" and len(live.views) in (FIRST_SOLVE, ENOUGH_VIEWS, 16):
            live.solved(*solve_views(live.views, camera.size))
            state = live.again(state)
    assert state.enough
    assert state.filled.all()
    assert ENOUGH_VIEWS <= len(live.views) <= 22
    result, progress = solve_views(live.views, camera.size)
    print(f"{len(live.views)} views, {progress}, worst {worst_px(result.camera, camera):.3f}")
    # its own statement, 95 % of the picture within so many pixels, and the truth: 3 sigma
    # (the full frame, with the longest lens by far, is the least certain: 0.45 px)
    assert progress.uncertainty_px < 0.6
    assert worst_px(result.camera, camera) < 3 * progress.uncertainty_px


TILTS = {"left": (0.0, -38.0), "right": (0.0, 38.0), "top": (38.0, 0.0), "bottom": (-38.0, 0.0)}


def as_told(camera: Camera, hold: Hold) -> Held:
    """A person who follows the outline: its middle, its size, and the words about tilting."""
    outline = hold.outline[np.isfinite(hold.outline).all(axis=1)]
    at = outline.mean(axis=0)
    rays, middle = camera.ray(outline), camera.ray(at[None])[0]
    rays = rays[np.isfinite(rays).all(axis=1)]
    half = np.percentile(np.arccos(np.clip(rays @ middle, -1, 1)), 90)
    diagonal = np.hypot(BOARD.inner[0], BOARD.inner[1]) * BOARD.square / 2
    distance = float(np.clip(diagonal / np.tan(half), 0.1, 1.0))
    tilt = TILTS[hold.about] if isinstance(hold.about, str) else (0.0, 0.0)
    return Held((float(at[0]), float(at[1])), distance, tilt)


def worst_px(found: Camera, truth: Camera) -> float:
    """95th percentile, over the pixels both know, of how far the projections are apart when the
    camera may turn."""
    width, height = truth.size
    y, x = np.mgrid[10:height:20, 10:width:20]
    pixels = np.stack([x.ravel(), y.ravel()], axis=-1).astype(float)
    a, b = truth.ray(pixels), found.ray(pixels)
    both = np.isfinite(a[:, 2]) & np.isfinite(b[:, 2])
    a, b, pixels = a[both], b[both], pixels[both]
    for _ in range(3):
        u, _, vt = np.linalg.svd(a.T @ b)
        turned = b @ (u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt).T
        there = truth.project(turned)
        apart = np.linalg.norm(there - pixels, axis=1)
    return float(np.nanpercentile(apart, 95))


def test_the_next_part_is_at_the_rim_and_near_the_last_one() -> None:
    filled = np.zeros(COUNT, bool)
    assert next_sector(filled, 0, {}) == 9
    filled[[9, 10]] = True
    assert next_sector(filled, 10, {}) == 11
    filled[9:] = True
    assert next_sector(filled, 16, {}) == 8
    filled[:] = True
    assert next_sector(filled, 16, {}) is None


def test_what_cannot_be_reached_is_not_asked_for_for_ever() -> None:
    guide = Guide(SIZE)
    views = [BOARD.view(MIDDLE)]
    guide.update(views, None, float("nan"))
    assert guide.hold is not None
    first = guide.hold.about
    for _ in range(PATIENCE):
        guide.taking()
        guide.update(views, None, float("nan"))
    assert guide.hold.about != first


@pytest.mark.parametrize(
    ("tilt_deg", "side"),
    [
        ((0.0, 35.0), "right"),
        ((0.0, -35.0), "left"),
        ((35.0, 0.0), "top"),
        ((-35.0, 0.0), "bottom"),
        ((8.0, 8.0), None),
    ],
)
@pytest.mark.parametrize("at", [(320.0, 240.0), (480.0, 330.0)])
def test_the_nearer_side_is_known(
    tilt_deg: tuple[float, float], side: str | None, at: tuple[float, float]
) -> None:
    view = BOARD.view(Held(at, tilt_deg=tilt_deg))
    rough = rough_camera(SIZE, sectors_of(CAMERA), None)
    for known in (None, CAMERA):
        here = placing(view, rough, known)
        assert here is not None
        assert here.nearer_side() == side


# --- solving


@pytest.fixture(scope="module")
def solved() -> tuple[Calibration, Progress]:
    places = [(320, 240), (480, 240), (160, 240), (320, 380), (330, 100)]
    views = [
        BOARD.view(Held((float(x), float(y)), tilt_deg=(7.0 * i, -5.0 * i)), f"view {i}")
        for i, (x, y) in enumerate(places)
    ]
    with np.errstate(all="warn"):
        return solve_views(views, SIZE)


def taken(count: int) -> Bench:
    bench = Bench()
    for _ in range(count):
        bench.live.take()
        bench.look(BOARD.view(MIDDLE))
    return bench


def test_what_was_solved_shows_in_the_history(solved: tuple[Calibration, Progress]) -> None:
    calibration, progress = solved
    assert (progress.views, progress.rms_px < 1e-4) == (5, True)
    bench = taken(6)
    bench.live.failed("no lens fits")
    assert bench.look(None).trouble == "no lens fits"
    bench.live.solved(calibration, replace(progress, views=6))
    bench.live.solved(calibration, progress)  # came later, is about fewer views
    state = bench.look(None)
    assert [p.views for p in state.history] == [5, 6]
    assert state.trouble == ""
    assert state.sectors.center == calibration.camera.center
    bench.live.drop()
    assert [p.views for p in bench.look(None).history] == [5]


def test_results_about_views_that_are_no_more_are_ignored(
    solved: tuple[Calibration, Progress],
) -> None:
    bench = taken(2)
    bench.live.solved(*solved)
    assert bench.look(None).history == ()
    bench = Bench(everywhere_sharp((320, 240)))
    for _ in range(6):
        bench.live.take()
        bench.look(BOARD.view(Held((150.0, 120.0))))
    bench.live.solved(*solved)
    assert bench.look(None).history == ()


def test_too_few_views_are_not_solved() -> None:
    with pytest.raises(CalibrationError, match="3 views are too few; take at least 4, better 8"):
        solve_views([BOARD.view(MIDDLE)] * 3, SIZE)
