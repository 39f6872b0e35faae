"""The calibration page: with a scripted target, and the whole way with a board in real RTP."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from board_camera import BoardCamera
from calibration_bench import (
    BOARD,
    CAMERA,
    MIDDLE,
    PLACES,
    SIZE,
    CalibrationBench,
    apart_px,
    everywhere_sharp,
)
from commands import running, stop
from page_station import PageView

from board_pictures import Board, Held
from freelook.calibration.chessboard import find_chessboard
from freelook.datagrams import free_port
from freelook.formats import load_camera
from freelook.web.security import Guard

pytestmark = pytest.mark.browser

WaitUntil = Callable[..., None]
DESKTOP = {"width": 1180, "height": 760}
PHONE = {"width": 390, "height": 844}


@contextmanager
def opened(browser: Any, url: str, window: dict[str, int] | None = None) -> Iterator[PageView]:
    """The page; whatever it complains about fails the test."""
    context = browser.new_context(viewport=window or DESKTOP)
    page = context.new_page()
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.set_default_timeout(15000)
    try:
        page.goto(url)
        yield PageView(page)
    finally:
        context.close()
    assert [c for c in complaints if "ERR_CONNECTION_REFUSED" not in c] == []


@pytest.fixture
def bench() -> Iterator[CalibrationBench]:
    with CalibrationBench() as running_bench:
        yield running_bench


@pytest.fixture
def page(browser: Any, bench: CalibrationBench) -> Iterator[PageView]:
    with opened(browser, bench.url) as view:
        view.until("window.calibration?.news?.look")
        yield view


def views(page: PageView) -> int:
    return int(page.js("calibration.news.views"))


def take_all(bench: CalibrationBench, page: PageView) -> None:
    """Show the board wherever it is needed, and take each view at once."""
    for count, held in enumerate(PLACES, start=1):
        bench.see(held)
        bench.station.act("take")
        page.until(f"calibration.news.views >= {count}")


# --- what is shown


def test_a_still_board_is_taken_and_the_next_place_is_asked_for(
    bench: CalibrationBench, page: PageView
) -> None:
    page.shows("Hold the board in the middle")
    page.shows("No board in sight")
    bench.see(MIDDLE)
    page.shows("Taken: 1")
    page.shows("This view is there already")
    page.shows("Tilt the board: its left side nearer to the camera")
    page.shows("seen: 1 of 17 parts of the picture")
    look = page.js("calibration.news.look")
    assert bench.target.view is not None
    np.testing.assert_allclose(look["corners"], bench.target.view.pixels, atol=0.051)
    assert look["size"] == list(SIZE)
    bench.see(PLACES[1])
    page.until("calibration.news.views === 2")
    page.shows("Tilt the board: its top side nearer to the camera")


def test_corners_are_drawn_where_they_are_in_the_picture(
    bench: CalibrationBench, page: PageView
) -> None:
    """Green dots: found by their colour on the gray picture."""
    bench.gray = np.full(SIZE[::-1], 90, np.uint8)
    bench.see(MIDDLE)
    bench.station.act("take")
    page.until("calibration.news.views === 1 && calibration.feed.pictures > 2")
    bench.see(None)  # or the ring hides some of them
    page.until("calibration.news.look.corners.length === 0")
    corner = [120.0, 90.0]
    page.js(
        """corner => {
        calibration.feed.onNews = () => {};
        Object.assign(calibration.news.look,
            { corners: [corner], held: 0, hold: null, verdict: 'known' });
        calibration.draw();
    }""",
        corner,
    )
    found = page.js("""() => {
        const canvas = document.getElementById('camera');
        const { width, height } = canvas;
        const data = canvas.getContext('2d').getImageData(0, 0, width, height).data;
        let [x, y, n] = [0, 0, 0];
        for (let i = 0; i < data.length; i += 4) {
            if (data[i + 1] > 230 && data[i] < 170) {
                x += (i / 4) % width; y += Math.floor(i / 4 / width); n += 1;
            }
        }
        return { x: x / n, y: y / n, n, width, height };
    }""")
    scale = min(found["width"] / SIZE[0], found["height"] / SIZE[1])
    left = (found["width"] - SIZE[0] * scale) / 2
    top = (found["height"] - SIZE[1] * scale) / 2
    assert found["n"] > 5
    at = ((found["x"] + 0.5 - left) / scale - 0.5, (found["y"] + 0.5 - top) / scale - 0.5)
    assert at == pytest.approx(corner, abs=0.5)


def test_a_mirrored_picture_swaps_left_and_right_in_words(
    bench: CalibrationBench, page: PageView
) -> None:
    bench.see(MIDDLE)
    page.shows("its left side nearer")
    page.page.keyboard.press("m")
    page.shows("its right side nearer")
    assert page.js("getComputedStyle(document.getElementById('camera')).transform").startswith(
        "matrix(-1"
    )
    page.page.get_by_role("button", name="Mirror").click()
    page.shows("its left side nearer")


def test_views_are_taken_and_dropped_by_key_and_by_button(
    bench: CalibrationBench, page: PageView
) -> None:
    page.page.keyboard.press("d")  # nothing there: the button is off
    bench.gray = np.full(SIZE[::-1], 90, np.uint8)  # never sharp
    bench.see(MIDDLE)
    page.shows("Blurred")
    page.page.keyboard.press("t")
    page.until("calibration.news.views === 1")
    page.page.get_by_role("button", name="Take now").click()
    page.until("calibration.news.views === 2")
    page.page.keyboard.press("d")
    page.until("calibration.news.views === 1")
    page.page.get_by_role("button", name="Drop last").click()
    page.until("calibration.news.views === 0")


def test_finishing_too_early_says_what_is_missing(bench: CalibrationBench, page: PageView) -> None:
    bench.see(MIDDLE)
    page.until("calibration.news.views === 1")
    page.page.keyboard.press("f")
    page.shows("1 view cannot be solved: take at least 4, better 8")
    assert page.js("document.body.dataset.phase") == "taking"


def test_from_views_to_the_rectified_view_and_on(bench: CalibrationBench, page: PageView) -> None:
    take_all(bench, page)
    page.until("calibration.news.look.history.length > 1")
    page.shows("RMS 0.0")
    assert page.js("document.querySelectorAll('#chart polyline').length") == 3
    bench.see(None)
    page.page.keyboard.press("f")
    page.until("document.body.dataset.phase === 'done'", 30)
    page.shows("Saved on the desk")
    (result,) = bench.desk.results
    assert sorted(result.pictures) == sorted(f"view {n + 1}" for n in range(len(PLACES)))
    assert apart_px(result.calibration.camera, CAMERA) < 0.3  # three times what it says itself
    page.until("calibration.view.drawn > 0")
    assert page.js("document.getElementById('view').offsetParent !== null")
    assert_rectified(bench, page)
    with page.page.expect_download() as download:
        page.page.get_by_role("button", name="Download profile").click()
    assert Path(download.value.path()).read_text("utf-8") == '{"a": "profile"}\n'
    assert download.value.suggested_filename == "lens.json"
    page.page.keyboard.press("v")
    page.until("document.getElementById('view').hidden")
    page.page.keyboard.press("v")
    page.page.get_by_role("button", name="More views").click()
    page.until("document.body.dataset.phase === 'taking'")
    assert views(page) == len(PLACES)
    page.page.keyboard.press("f")
    page.until("calibration.result?.number === 2", 30)
    assert len(bench.desk.results) == 2


def assert_rectified(bench: CalibrationBench, page: PageView) -> None:
    """The board's corners lie where a camera without distortion would have them."""
    bench.gray = BOARD.picture(MIDDLE)
    drawn = page.js("calibration.view.drawn")
    page.until(f"calibration.view.drawn > {drawn} + 5")
    data = page.js("""() => {
        const rgba = calibration.view.renderer.readView(
            { width: 480, height: 360, hfovDeg: 90 }, [1, 0, 0, 0]);
        const green = rgba.filter((_, i) => i % 4 === 1);
        return btoa(Array.from(green, (value) => String.fromCharCode(value)).join(''));
    }""")
    view = np.frombuffer(base64.b64decode(data), np.uint8).reshape(360, 480)
    grid = find_chessboard(view, BOARD.inner)
    assert grid is not None
    assert len(grid.cells) == 48
    turn, middle = BOARD.pose(MIDDLE)
    flat = np.column_stack([grid.cells - (grid.cells.max(axis=0) / 2), np.zeros(48)])
    if grid.cells[:, 0].max() == 5:
        flat = flat[:, [1, 0, 2]]
    there = turn.apply(flat * BOARD.square) + middle
    expected = 240 * there[:, :2] / there[:, 2:] + [239.5, 179.5]
    apart = np.linalg.norm(grid.pixels[:, None] - expected, axis=-1).min(axis=1)
    assert np.median(apart) < 0.3  # through H.264 and JPEG; a fisheye left as it is: several


def test_a_profile_that_cannot_be_written_is_not_lost(
    bench: CalibrationBench, page: PageView
) -> None:
    bench.desk.why_not = "not saved: /nowhere/lens.json: No space left on device"
    take_all(bench, page)
    page.page.keyboard.press("f")
    page.shows("Not saved: /nowhere/lens.json: No space left on device", 30)
    assert page.page.get_by_role("button", name="Download profile").is_enabled()


def test_starting_over_asks_first(bench: CalibrationBench, page: PageView) -> None:
    bench.see(MIDDLE)
    page.until("calibration.news.views === 1")
    asked: list[str] = []

    def answer(dialog: Any, yes: bool) -> None:
        asked.append(dialog.message)
        dialog.accept() if yes else dialog.dismiss()

    page.page.once("dialog", lambda dialog: answer(dialog, False))
    page.page.get_by_role("button", name="Start over").click()
    assert asked == ["Forget all views?"]
    assert views(page) == 1
    bench.see(None)
    page.page.once("dialog", lambda dialog: answer(dialog, True))
    page.page.get_by_role("button", name="Start over").click()
    page.until("calibration.news.views === 0")
    page.shows("Hold the board in the middle")


# --- what goes wrong


def test_lost_video_is_said_and_comes_back(bench: CalibrationBench, page: PageView) -> None:
    bench.see(MIDDLE)
    page.until("calibration.news.views === 1")
    bench.silent.set()
    bench.sources[-1].fail("the cable came off")
    page.shows("Video lost: ")
    assert page.js("document.body.dataset.lost") == "true"
    bench.silent.clear()
    page.until("document.body.dataset.lost === 'false'")
    assert views(page) == 1
    bench.see(PLACES[1])
    page.until("calibration.news.views === 2")


def test_another_size_is_said_and_can_be_started_over_with(
    bench: CalibrationBench, page: PageView
) -> None:
    bench.see(MIDDLE)
    page.until("calibration.news.views === 1")
    bench.see(None)  # or it would be taken again before anybody has looked
    bench.gray = everywhere_sharp((320, 240))
    page.shows("The picture is now 320 x 240 pixels, but the 1 views are of 480 x 360")
    page.page.once("dialog", lambda dialog: dialog.accept())
    page.page.get_by_role("button", name="Start over").click()
    page.until("calibration.news.look?.size[0] === 320 && calibration.news.views === 0")


def test_a_station_that_goes_away_is_said(bench: CalibrationBench, page: PageView) -> None:
    bench.stop()
    page.shows("No connection: the station does not answer", 15)
    assert page.js("document.body.dataset.lost") == "true"


def test_a_detector_that_breaks_does_not_end_the_session(
    bench: CalibrationBench, page: PageView
) -> None:
    bench.target.fails = True
    page.until("calibration.news.source.counters.looks_failed > 1")
    bench.target.fails = False
    bench.see(MIDDLE)
    page.until("calibration.news.views === 1")


def test_views_are_taken_with_the_page_closed(
    browser: Any, bench: CalibrationBench, wait_until: WaitUntil
) -> None:
    with opened(browser, bench.url) as page:
        page.until("window.calibration?.news?.look")
    bench.see(MIDDLE)
    wait_until(lambda: bench.station.status()["views"] == 1, 10)
    with opened(browser, bench.url) as page, opened(browser, bench.url) as other:
        for one in (page, other):
            one.until("window.calibration?.news?.views === 1")
            one.until("calibration.feed.pictures > 1")


def test_everything_fits_on_a_phone(browser: Any, bench: CalibrationBench) -> None:
    with opened(browser, bench.url, PHONE) as page:
        page.until("window.calibration?.news?.look")
        bench.see(MIDDLE)
        page.until("calibration.news.views === 1")
        assert page.js("document.documentElement.scrollWidth") <= PHONE["width"]
        boxes = page.js("""[...document.querySelectorAll('#buttons .taking')].map((button) => {
            const { left, right, top, bottom } = button.getBoundingClientRect();
            return [left, right, top, bottom];
        })""")
        assert len(boxes) == 4
        for left, right, top, bottom in boxes:
            assert 0 <= left < right <= PHONE["width"]
            assert 0 <= top < bottom <= PHONE["height"]
            assert bottom - top >= 40  # a finger


def test_ticks_are_round_numbers_around_the_values(page: PageView) -> None:
    ticks = "import('/static/calibrate_chart.js').then((chart) => chart.ticks({}))"
    for values, expected in {
        (0.06, 0.19): [0.05, 0.1, 0.2],
        (0.05, 0.05): [0.05, 0.1, 0.2],
        (0.3, 40): [0.2, 0.5, 1, 2, 5, 10, 20, 50],
    }.items():
        found = page.js(ticks.format(list(values)))
        assert found == pytest.approx(expected)


def test_a_token_goes_along(browser: Any) -> None:
    with (
        CalibrationBench(Guard("secret")) as bench,
        opened(browser, bench.url + "?token=secret") as page,
    ):
        page.until("window.calibration?.news?.look")
        bench.see(MIDDLE)
        page.page.keyboard.press("t")
        page.until("calibration.news.views === 1")


# --- the whole way


TILTS = {"left": (0.0, -38.0), "right": (0.0, 38.0), "top": (38.0, 0.0), "bottom": (-38.0, 0.0)}


def as_told(hold: dict[str, Any]) -> Held:
    """A person who follows the outline and the words."""
    at = np.mean([point for point in hold["outline"] if point], axis=0)
    words = hold["sentence"].split()
    tilt = TILTS[words[words.index("its") + 1]] if "Tilt" in words else (0.0, 0.0)
    return Held((float(at[0]), float(at[1])), 0.22, tilt)


@pytest.mark.timeout(240)
def test_a_board_held_as_told_in_front_of_a_real_stream_gives_its_lens(
    browser: Any, tmp_path: Path
) -> None:
    """RTP, the command, detection, page and profile, each for real; the truth is known."""
    address, profile = f"rtp://127.0.0.1:{free_port()}", tmp_path / "lens.json"
    board = Board(CAMERA)
    options = ["--square", "0.03", "--model", "kannala_brandt", "-o", str(profile)]
    with (
        running("calibrate", "--live", address, *options) as (process, url),
        BoardCamera(board, address) as camera,
        opened(browser, url) as page,
    ):
        page.until("window.calibration?.news?.look", 30)
        page.shows("No board in sight")
        taken = 0
        while taken < 8:
            hold = page.js("calibration.news.look.hold")
            camera.hold(as_told(hold))
            page.until(f"calibration.news.views > {taken}", 30)
            taken = views(page)
        page.until("calibration.news.look.history.length > 0", 30)
        page.shows("RMS 0.")
        page.page.keyboard.press("f")
        page.shows(f"Saved as {profile}", 60)
        page.until("calibration.view.drawn > 0")
        status, out, errors = stop(process)
    assert (status, errors) == (0, "")
    assert f"saved as {profile}" in out
    # noise of 1.5 grey levels and H.264: corners are good to 0.05 px or so, and the lens, which
    # here rests on 8 views, to a few times that
    apart = apart_px(load_camera(profile), CAMERA)
    print(f"{taken} views; 95 % of the projection within {apart:.3f} px of the truth")
    assert apart < 0.3
