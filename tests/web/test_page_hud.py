"""The page's HUD is the window's: the same shapes of the same numbers, the same words, and on the
canvas the same picture; nothing is drawn where no shape is; keys; what the station tells."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from page_station import PageView

from freelook.hud import (
    THEMES,
    Box,
    Shape,
    Situation,
    conditions,
    place_of,
    shapes,
    theme_named,
)
from freelook.hud.letters import make_sheet
from freelook.renderers.gl_pen import GlPen
from gl_here import gl_context
from hud_states import SIZES, STATES, message

pytestmark = pytest.mark.browser

WIDTH, HEIGHT = 640, 480  # of the page


def test_the_page_makes_the_same_shapes(view: PageView) -> None:
    """Of every state, on every size, with and without room at the sides."""
    cases = [
        (state, place)
        for state in STATES.values()
        for place in [*(place_of(*size) for size in SIZES), place_of(500, 500, inset=(40, 30))]
    ]
    told = [
        [message(state), place.width, place.height, list(place.parts), list(place.inset)]
        for state, place in cases
    ]
    made = view.js(
        """async cases => { const {shapes, placeOn} = await import('/static/hud.js');
        const known = freelook.app.hud; return cases.map(([state, ...place]) =>
            shapes(known, state, placeOn(known, ...place))); }""",
        told,
    )
    for (state, place), theirs in zip(cases, made, strict=True):
        ours = shapes(state, place)
        assert len(ours) == len(theirs)
        for one, other in zip(ours, theirs, strict=True):
            assert_alike(one, other)


def assert_alike(one: Shape, other: dict[str, Any]) -> None:
    """To a hundredth of a point, and to the letter."""
    assert type(one).__name__.lower() == other.pop("kind")
    for name, theirs in other.items():
        ours = getattr(one, name)
        if isinstance(ours, str):
            assert ours == theirs
        elif isinstance(one, Box) and name == "rect":
            assert vars(ours) == pytest.approx(theirs, abs=0.01)
        else:
            assert np.size(ours) == np.size(theirs)
            assert np.ravel(ours) == pytest.approx(np.ravel(theirs), abs=0.01)


@pytest.mark.parametrize("theme", THEMES)
def test_the_page_draws_the_same_picture(open_page: Any, theme: str) -> None:
    """Both pens over black, the page's with its panels hidden."""
    state = STATES["rolled"]
    page: PageView = open_page(query="?pixels=400000")
    theirs = canvas(
        page,
        """([state, theme]) => { const { screen, renderer, hud } = freelook.app;
        return import('/static/hud.js').then(({shapes, placeOn, MOVING, RESTING}) => {
            screen.fitCanvas(); renderer.clear(); renderer.pen.begin(screen.ratio, theme);
            const rect = {x: 0, y: 0, width: 640, height: 480};
            for (const parts of [MOVING, RESTING]) renderer.pen.draw(
                shapes(hud, state, placeOn(hud, 640, 480, parts)), rect);
            renderer.pen.end(); }); }""",
        [message(state), theme],
    )
    with gl_context() as context:
        frame = context.framebuffer([context.texture((WIDTH, HEIGHT), 3)])
        frame.use()
        pen = GlPen(context, theme_named(theme), 1.0)
        place = place_of(WIDTH, HEIGHT)
        split = place.parts.index("state")
        inks = [
            pen.ink(shapes(state, place_of(WIDTH, HEIGHT, parts)))
            for parts in (place.parts[:split], place.parts[split:])
        ]
        pen.draw(inks, (WIDTH, HEIGHT))
        data = np.frombuffer(frame.read(components=3, alignment=1), np.uint8)
    ours = data.reshape(HEIGHT, WIDTH, 3)[::-1]
    assert (ours > 40).mean() > 0.005
    apart = np.abs(ours.astype(int) - theirs)
    # the browser may have another driver, whose edges fall one code or a thin line's end elsewhere
    assert (apart > 8).mean() < 0.0005


def canvas(page: PageView, draw: str, argument: Any = None) -> NDArray[np.uint8]:
    """(rows from the top, columns, 3) of the page's canvas just after drawing."""
    text = page.js(
        f"""async argument => {{ await ({draw})(argument);
        const {{ gl, canvas: {{ width, height }} }} = freelook.app.renderer;
        const bytes = new Uint8Array(4 * width * height);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
        let text = ''; for (let i = 0; i < bytes.length; i += 32768)
            text += String.fromCharCode(...bytes.subarray(i, i + 32768));
        return btoa(text); }}""",
        argument,
    )
    values = np.frombuffer(base64.b64decode(text), np.uint8)
    return values.reshape(HEIGHT, WIDTH, 4)[::-1, :, :3]


REDRAW = "() => { freelook.app.screen.drawnKey = ''; freelook.app.drawNow(); }"


def test_letters_are_made_alike(view: PageView) -> None:
    for size_px, theme in ((12.0, "day"), (21.5, "night")):
        chosen = theme_named(theme)
        made = view.js(
            """([size, rim, weight]) => import('/static/letters.js').then(({makeSheet}) => {
            const sheet = makeSheet(freelook.app.hud, size, rim, weight);
            const letters = [...sheet.numbers.keys()];
            return { ...sheet, letters, covered: [...sheet.covered] }; })""",
            [size_px, chosen.rim_width, chosen.weight],
        )
        ours = make_sheet(size_px, chosen.rim_width, chosen.weight)
        assert made["cell"] == list(ours.cell)
        assert made["step"] == pytest.approx(ours.step)
        theirs = np.array(made["covered"], dtype=int).reshape(ours.covered.shape)
        wide = ours.cell[0]
        for place, letter in enumerate(made["letters"]):  # browsers put digits first
            (column,) = ours.columns(letter)
            one = ours.covered[:, column : column + wide]
            other = theirs[:, wide * place : wide * (place + 1)]
            assert np.abs(other - one).max() <= 1  # a half may be rounded either way


def test_off_there_is_nothing_and_on_only_where_shapes_are(open_page: Any) -> None:
    page: PageView = open_page(query="?pixels=400000")
    page.js("() => { for (const k of ['pip', 'panels']) freelook.app.settings.set(k, false); }")
    page.set_head(25, -6, 8)
    page.until("!freelook.app.scheduled")
    on = canvas(page, REDRAW)
    page.page.keyboard.press("i")
    assert canvas(page, REDRAW).max() == 0  # black: no picture has come
    page.page.keyboard.press("i")
    told = page.js(
        "() => { const { screen } = freelook.app; return screen.stateOf(screen.viewOn("
        "screen.panes().main), freelook.app.aim(performance.now()).q); }"
    )
    made = page.js(
        """state => import('/static/hud.js').then(({shapes, placeOn}) =>
        shapes(freelook.app.hud, state, placeOn(freelook.app.hud, 640, 480)))""",
        told,
    )
    near = np.zeros((HEIGHT, WIDTH), bool)
    for shape in made:
        mark(near, shape)
    lit = on.max(axis=2) > 20
    assert lit.sum() > 1000
    assert not (lit & ~near).any()


def mark(near: NDArray[np.bool_], shape: dict[str, Any]) -> None:
    """Where this shape may be seen."""
    if shape["kind"] == "text":
        half = len(shape["text"]) * shape["size"] * 0.64 + 3
        boxes = [(shape["x"] - half, shape["y"] - 12, shape["x"] + half, shape["y"] + 12)]
    elif shape["kind"] == "box":
        rect = shape["rect"]
        boxes = [(rect["x"], rect["y"], rect["x"] + rect["width"], rect["y"] + rect["height"])]
    else:
        boxes = [
            (x0 + (x1 - x0) * i / 40, y0 + (y1 - y0) * i / 40) * 2
            for x0, y0, x1, y1 in shape["pieces"]
            for i in range(41)
        ]
    reach = 3 + shape.get("width", 0) / 2
    for x0, y0, x1, y1 in boxes:
        rows = slice(max(0, int(y0 - reach)), max(0, int(y1 + reach) + 1))
        near[rows, max(0, int(x0 - reach)) : max(0, int(x1 + reach) + 1)] = True


def test_the_horizon_is_the_worlds_once_its_attitude_is_known(open_page: Any) -> None:
    page: PageView = open_page()
    world = message(STATES["rolled"])["world"]
    page.message(type="frame", rtp=1, arrival=1)
    assert page.js("freelook.app.screen.world") is None
    page.message(type="frame", rtp=1, arrival=1, world=world)
    page.js("freelook.app.takeBase()")
    assert page.js("freelook.app.screen.world") == pytest.approx(world)


def test_a_frame_that_came_before_its_message_keeps_the_horizon(open_page: Any) -> None:
    """Until there is word of it, when it is drawn anew."""
    page: PageView = open_page()
    one, two = (message(STATES[name])["world"] for name in ("rolled", "all around"))
    took = page.js(
        """([one, two]) => { const { app } = freelook, seen = [];
        const tell = (rtp, world) => app.link.receive(
            JSON.stringify({ type: 'frame', rtp, arrival: rtp, world }), performance.now());
        const look = () => { seen.push([app.screen.world, app.scheduled !== 0]); app.drawNow(); };
        const show = (rtp) => { app.shownRtp = rtp; app.takeBase(); };
        app.drawNow();
        tell(1, one); show(1); look();
        show(2); look();
        tell(2, two); look();
        tell(3); show(3); look();
        return seen; }""",
        [one, two],
    )
    assert [drawn_anew for _, drawn_anew in took] == [True, False, True, True]
    worlds = [world for world, _ in took]
    assert worlds[0] == worlds[1] == pytest.approx(one)
    assert worlds[2] == pytest.approx(two)
    assert worlds[3] is None


def test_what_makes_no_sense_is_not_taken(open_page: Any) -> None:
    """From the station, and from what the page remembers: readings go on."""
    page: PageView = open_page()
    status = {"type": "status", "source": {"state": "live", "message": ""}, "viewers": 1}
    recording = {"state": "live", "shown": 77}
    for broken in (
        {"trackers": [], "recordings": 5},
        {"trackers": [], "recordings": [None]},
        {"trackers": [None]},
    ):
        page.message(**status, **broken)
    assert page.js("freelook.app.link.status") is None
    page.message(**status, trackers=[], recordings=[recording])
    page.shows("REC 77")
    page.message(type="frame", rtp=1, arrival=1, world=[None, "x", {}, 1e999])
    names = ["constructor", "dusk", None, 5]
    drawn = page.js(
        """names => { const { app } = freelook; return names.map((name) => {
        app.settings.set('hud', name); app.settings.set('panels', false);
        app.screen.told = { ...app.screen.told, warnings: [{ level: 'x', text: 5 }],
            dials: { head: { median: -0.4, p95: null } } };
        app.screen.drawnKey = ''; app.drawNow();
        return app.renderer.gl.getError(); }); }""",
        names,
    )
    assert drawn == [0] * len(names)


def test_keys_change_the_theme_and_hide_the_panels(view: PageView) -> None:
    controls = view.page.locator("#controls")
    assert view.js("freelook.app.settings.get('hud')") == THEMES[0]
    view.page.keyboard.press("u")
    assert view.js("freelook.app.settings.get('hud')") == THEMES[1]
    view.shows(f"Lines: {THEMES[1]}")
    view.page.keyboard.press("b")
    controls.wait_for(state="hidden")
    view.page.locator("#conditions").wait_for(state="hidden")  # the HUD says it
    view.page.keyboard.press("i")
    view.page.locator("#conditions").wait_for(state="visible")  # nobody else does
    view.page.locator("#unhide").click()
    controls.wait_for(state="visible")


def test_what_the_pilot_is_told_is_told_in_the_same_words(view: PageView) -> None:
    situations = [
        {"video_age_s": 0.02},
        {"source_state": "lost", "source_message": "no packets"},
        {"video_age_s": 2.7, "source_state": "lost", "head": "a", "head_state": "waiting"},
        {"video_age_s": 0.7, "head": "a", "head_state": "holding", "head_age_ms": 2500.0},
        {"video_age_s": 0.1, "video_late_ms": 812.5, "head": "a", "head_state": "easing"},
        {"video_age_s": 0.1, "head_state": "front", "limited": True},
        {"video_age_s": 0.1, "head_state": "disabled", "broken": ("disk full", "")},
        {"video_age_s": 0.1, "source_message": "slow", "mode": "world", "mode_trouble": "why"},
    ]
    known = [Situation(**entry) for entry in situations]  # type: ignore[arg-type]
    made = view.js(
        """list => import('/static/conditions.js').then(({conditions}) => list.map((one) =>
        conditions(freelook.app.hud, one)))""",
        [as_the_page_knows(one) for one in known],
    )
    for one, theirs in zip(known, made, strict=True):
        assert [vars(warned) for warned in conditions(one)] == theirs


def as_the_page_knows(one: Situation) -> dict[str, Any]:
    recordings = [
        {"name": "f", "state": "failed", "message": why, "shown": 0} for why in one.broken
    ]
    return {
        "whep": "connected",
        "whepMessage": "",
        "linked": True,
        "videoAgeS": one.video_age_s,
        "videoLateMs": one.video_late_ms,
        "status": {
            "source": {"state": one.source_state, "message": one.source_message},
            "trackers": [{"name": one.head, "age_ms": one.head_age_ms}],
            "vehicle": {"mode": one.mode, "message": one.mode_trouble},
            "recordings": recordings,
        },
        "head": one.head,
        "aim": {"state": one.head_state},
        "limited": one.limited,
        "fits": True,
    }


def test_a_recording_is_shown(view: PageView) -> None:
    status = {
        "type": "status",
        "source": {"state": "live", "message": "", "counters": {}},
        "trackers": [],
        "viewers": 1,
        "recordings": [{"name": "file:a.mp4", "state": "live", "message": "", "shown": 77}],
    }
    view.js(
        """status => setInterval(() =>
            freelook.app.link.receive(JSON.stringify(status), performance.now()), 50)""",
        status,
    )
    view.shows("REC 77")
