"""The page and its station: who has the command, what is shown, what happens when either is lost.

Messages of the station are given to the page as if they had come on the data channel.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from page_station import PageStation, PageView

from freelook.rotations import RDF_FROM_FRD, body_from_view, to_wxyz
from freelook.types import Picture
from freelook.viewport import Viewport

pytestmark = pytest.mark.browser

STATUS = {
    "type": "status",
    "source": {
        "state": "live",
        "message": "",
        "age_ms": 5,
        "codec": "h264",
        "size": [320, 240],
        "transcoding": None,
        "counters": {},
    },
    "trackers": [],
    "viewers": 3,
}


def gray_picture(level: int = 120) -> Picture:
    chroma = np.full((120, 160), 128, np.uint8)
    return Picture("i420", (np.full((240, 320), level, np.uint8), chroma, chroma))


def pose(page: PageView, yaw_deg: float, pitch_deg: float, state: str = "tracking") -> None:
    q = to_wxyz(RDF_FROM_FRD * body_from_view(yaw_deg, pitch_deg))
    page.message(type="pose", tracker="opentrack", q=q, state=state, t=None, sent=0)


@pytest.fixture
def tracked(open_page: Any) -> PageView:
    """A page whose view the tracker 'opentrack' commands, looking 30 right, 10 up."""
    page: PageView = open_page(trackers=["opentrack", "second"])
    page.js("""setInterval(() => freelook.app.link.receive(
        '{"type": "pong", "t": 0, "ns": 0}', performance.now()), 100)""")  # the station lives
    pose(page, 30, 10)
    return page


def test_the_stations_tracker_is_in_command(tracked: PageView) -> None:
    assert tracked.js("freelook.headSource") == "opentrack"
    assert tracked.head() == pytest.approx((30, 10, 0), abs=1e-6)


def test_touching_the_mouse_takes_the_command_where_the_view_is(tracked: PageView) -> None:
    tracked.page.mouse.move(320, 240)
    tracked.page.mouse.down()
    tracked.page.mouse.move(320, 245)
    tracked.shows("You have control")
    assert tracked.js("freelook.headSource") == "hand"
    assert tracked.head()[0] == pytest.approx(30, abs=0.5)
    pose(tracked, -60, 0)
    assert tracked.head()[0] == pytest.approx(30, abs=0.5)


def test_a_button_gives_the_command_back(tracked: PageView) -> None:
    tracked.page.keyboard.press("ArrowLeft", delay=80)
    tracked.until("freelook.headSource === 'hand'")
    tracked.page.get_by_role("button", name="Give back to opentrack").click()
    pose(tracked, 5, -5)
    assert tracked.js("freelook.headSource") == "opentrack"
    tracked.settles()
    assert tracked.head() == pytest.approx((5, -5, 0), abs=1e-6)


def test_another_tracker_can_be_chosen(tracked: PageView) -> None:
    tracked.page.get_by_role("button", name="second").click()
    assert tracked.js("freelook.headSource") == "second"
    tracked.shows("Waiting for second")


def test_recentre_and_switching_off_go_to_the_station(
    tracked: PageView, page_station: PageStation
) -> None:
    tracked.page.keyboard.press("r")
    tracked.shows("opentrack recentred")
    tracked.page.keyboard.press("t")
    tracked.shows("opentrack switched off")
    pose(tracked, 0, 0, "disabled")
    tracked.page.keyboard.press("t")
    tracked.shows("opentrack switched on")
    actions = [control["action"] for control in page_station.controls]
    assert actions == ["recentre", "disable", "enable"]
    assert {control["tracker"] for control in page_station.controls} == {"opentrack"}


def test_a_refused_control_says_why(tracked: PageView, page_station: PageStation) -> None:
    page_station.control_answer = 404
    tracked.page.keyboard.press("c")
    tracked.shows("opentrack: no such tracker")


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ("holding", "opentrack silent for 2 s: holding"),
        ("easing", "opentrack silent for 2 s: easing to centre"),
        ("centred", "opentrack silent for 2 s: looking straight ahead"),
        ("disabled", "opentrack is switched off"),
        ("waiting", "Waiting for opentrack"),
    ],
)
def test_what_the_station_says_of_its_tracker_is_shown(
    tracked: PageView, state: str, words: str
) -> None:
    tracker = {"name": "opentrack", "state": state, "message": "", "age_ms": 2000, "rate_hz": 0}
    tracked.js(
        """([status, pose]) => setInterval(() => {
            const link = freelook.app.link, now = performance.now();
            link.receive(JSON.stringify(status), now);
            link.receive(JSON.stringify(pose), now);
        }, 50)""",
        [
            STATUS | {"trackers": [tracker | {"counters": {}}]},
            {"type": "pose", "tracker": "opentrack", "q": [1, 0, 0, 0], "state": state, "t": None},
        ],
    )
    tracked.shows(words)


def test_a_dead_station_is_held_then_eased_from_then_left(tracked: PageView) -> None:
    """hold_s is 1 and ease_s 2, counted from the last thing the station said."""
    at = """s => { const a = freelook.app;
        const aim = a.command.aim(a.link.lastMs + 1000 * s); return [aim.state, aim.q]; }"""
    held = to_wxyz(RDF_FROM_FRD * body_from_view(30, 10))
    states = {s: tracked.js(at, s) for s in (0.9, 1.0, 2.0, 3.1)}
    assert [states[s][0] for s in states] == ["tracking", "holding", "easing", "centred"]
    assert states[1.0][1] == pytest.approx(held, abs=1e-6)
    assert states[3.1][1] == [1, 0, 0, 0]
    assert states[2.0][1][0] == pytest.approx(np.cos(np.arccos(held[0]) / 2), abs=1e-6)
    pose(tracked, 20, 0)
    assert tracked.stats()["headState"] == "tracking"
    assert tracked.head() == pytest.approx((20, 0, 0), abs=1e-6)


def test_bad_messages_are_counted_and_change_nothing(tracked: PageView) -> None:
    bad = [
        "",
        "{",
        "[]",
        "null",
        '{"type":"pose"}',
        '{"type":"pose","tracker":"opentrack","q":[0,0,0,0]}',
        '{"type":"pose","tracker":"opentrack","q":[1,"x",0,0]}',
        '{"type":"frame","rtp":null,"arrival":1}',
        '{"type":"status"}',
        '{"type":"constructor"}',
    ]
    for text in bad:
        tracked.js("text => freelook.app.link.receive(text, performance.now())", text)
    assert tracked.stats()["badMessages"] == len(bad)
    assert tracked.head() == pytest.approx((30, 10, 0), abs=1e-6)


def test_lost_video_is_greyed_with_its_age_and_comes_back(view: PageView) -> None:
    chroma = np.full((120, 160), 128, np.uint8)
    red = Picture("i420", (np.full((240, 320), 90, np.uint8), chroma, chroma + 90))
    view.set_view(16, 16, 30)
    view.put(red)
    assert np.ptp(view.view()[8, 8].astype(int)) > 100
    view.shows("Video lost 1 s ago")
    assert view.stats()["grey"] == 1
    assert np.ptp(view.view()[8, 8].astype(int)) == 0
    view.shows("Video lost 2 s ago")
    view.put(red)
    view.until("freelook.stats().grey === 0")
    view.page.get_by_text("Video lost").wait_for(state="detached")


def test_status_is_shown(view: PageView) -> None:
    status = STATUS | {"source": STATUS["source"] | {"transcoding": "H.265 is not decoded here"}}  # type: ignore[operator]
    view.js(
        """status => setInterval(() =>
            freelook.app.link.receive(JSON.stringify(status), performance.now()), 50)""",
        status,
    )
    view.shows("Transcoding: H.265 is not decoded here")
    view.shows("rtp://127.0.0.1:5004")
    view.until("document.getElementById('count-viewers').textContent === '3'")
    view.until("document.getElementById('source').dataset.state === 'live'")


def test_video_of_another_shape_is_said(view: PageView) -> None:
    chroma = np.full((90, 160), 128, np.uint8)
    view.put(Picture("i420", (np.full((180, 320), 90, np.uint8), chroma, chroma)))
    view.shows("another shape than the lens profile")


def test_a_station_that_refuses_says_why(view: PageView) -> None:
    view.shows("Station lost: no video in this test. Trying again")
    assert view.stats()["whep"] == "lost"


def test_the_two_dials(view: PageView) -> None:
    """The station's clock is 5 s ahead; frames came 40 ms, poses 12 ms before they were drawn."""
    view.js("""() => {
        const { link, latency } = freelook.app, now = performance.now();
        const ns = ms => Math.round((ms + 5000) * 1e6);
        link.receive(JSON.stringify({type: 'pong', t: now - 90, ns: ns(now + 40)}), now);  // slow
        link.receive(JSON.stringify({type: 'pong', t: now - 4, ns: ns(now - 2)}), now);
        for (let rtp = 1; rtp <= 20; rtp++) {
            const late = rtp > 18 ? 100 : 0;
            if (rtp % 2) link.receive(JSON.stringify(
                {type: 'frame', rtp, arrival: ns(now - 40 - late)}), now);
            latency.frameDrawn(now, {rtp, receivedMs: now - 9});
            if (!(rtp % 2)) link.receive(JSON.stringify(
                {type: 'frame', rtp, arrival: ns(now - 40 - late)}), now);
            latency.poseDrawn(now, now - 12 + rtp / 1e3);
            latency.poseDrawn(now + 50, now - 12 + rtp / 1e3);  // the same pose, drawn again
        }
    }""")
    measured = view.js("freelook.latencies()")
    assert measured["clock"]["offsetMs"] == pytest.approx(5000, abs=1e-3)
    assert measured["video"]["count"] == 20
    assert measured["video"]["median"] == pytest.approx(40, abs=1e-3)
    assert measured["video"]["p95"] == pytest.approx(140, abs=1e-3)
    assert measured["head"]["count"] == 20
    assert measured["head"]["median"] == pytest.approx(12, abs=0.05)
    assert measured["videoSince"] == "since arrival"
    view.shows("p95 140 ms")


def test_without_the_stations_times_video_age_says_what_it_counts(view: PageView) -> None:
    view.js("freelook.app.latency.frameDrawn(performance.now(), {rtp: 7, receivedMs: 1})")
    assert view.js("freelook.latencies().videoSince") == "since reception"
    view.shows("since reception")


def test_frames_are_counted(view: PageView) -> None:
    for _ in range(3):
        view.put(gray_picture())
    stats = view.stats()
    assert (stats["received"], stats["drawn"], stats["dropped"]) == (3, 3, 0)


def test_nothing_is_drawn_when_nothing_changed(view: PageView) -> None:
    view.put(gray_picture())
    view.until("freelook.stats().grey === 1")
    view.until("!freelook.app.scheduled")
    draws = view.stats()["draws"]
    wait = "new Promise(done => setTimeout(done, 600))"  # two ticks of the page
    view.js(wait)
    assert view.stats()["draws"] == draws
    view.set_head(1, 0)
    view.until(f"freelook.stats().draws > {draws}")


def test_the_views_outline_on_the_fisheye(view: PageView) -> None:
    """Head right: the outline's middle is right of the picture's middle, and inside it."""
    points = view.js("""() => Promise.all([import('/static/viewport.js'),
        import('/static/quaternion.js')]).then(([{outline}, {fromAngles}]) => outline(
            {width: 64, height: 64, hfovDeg: 40}, fromAngles({yaw: 40, pitch: 0, roll: 0}),
            freelook.app.renderer.camera))""")
    x, y = np.array(points).T
    assert len(points) == 97
    # Equidistant, f = 70: the view's middle lies 70 * 40 degrees right of the centre.
    assert (x.min() + x.max()) / 2 == pytest.approx(159.5 + 70 * np.radians(40), abs=3)
    assert (y.min() + y.max()) / 2 == pytest.approx(119.5, abs=0.01)


def pixel_sum(view: PageView, x: int, y: int) -> int:
    """What the page's canvas shows there just after drawing."""
    return int(
        view.js(
            """([x, y]) => { const a = freelook.app, gl = a.renderer.gl; a.screen.drawnKey = '';
            a.drawNow(); const p = new Uint8Array(4); const r = a.screen.ratio;
            gl.readPixels(x * r, a.renderer.canvas.height - y * r, 1, 1, gl.RGBA,
                gl.UNSIGNED_BYTE, p);
            return p[0] + p[1] + p[2]; }""",
            [x, y],
        )
    )


def test_keys_switch_picture_in_picture_and_split(view: PageView) -> None:
    view.put(gray_picture())
    view.page.keyboard.press("i")  # no lines over the picture
    box = view.page.locator("#pip").bounding_box()
    corner = (int(box["x"]) + 4, int(box["y"]) + 4)
    view.set_head(180, 0)  # behind the camera: the view is black, the fisheye is not
    assert pixel_sum(view, *corner) > 200
    view.page.keyboard.press("p")
    assert pixel_sum(view, *corner) == 0
    assert pixel_sum(view, 160, 240) == 0
    view.page.keyboard.press("v")  # the whole fisheye, left
    assert pixel_sum(view, 160, 240) > 200
    assert pixel_sum(view, 480, 240) == 0
    view.page.keyboard.press("v")  # straight ahead, left
    assert pixel_sum(view, 160, 100) > 200
    view.page.keyboard.press("v")
    assert pixel_sum(view, 160, 240) == 0


def test_the_horizon_is_where_the_vehicles_level_plane_is(view: PageView) -> None:
    """Green along pitch 0, which a head turned 10 degrees up sees below the middle."""
    view.set_head(15, 10)  # between two ticks
    focal_px = Viewport((640, 480), 90.0).focal_px
    row = round(239.5 + focal_px * np.tan(np.radians(10)))
    green = [pixel_sum(view, 320, row + offset) for offset in range(-8, 9)]
    assert abs(int(np.argmax(green)) - 8) <= 1
    assert max(green) > 300
    view.page.keyboard.press("i")
    assert pixel_sum(view, 320, row) == 0


def test_help_opens_and_closes(view: PageView) -> None:
    view.page.keyboard.press("h")
    view.shows("whole fisheye in a corner")
    view.page.keyboard.press("Escape")
    view.page.get_by_text("whole fisheye in a corner").wait_for(state="hidden")


def test_the_token_goes_along(open_page: Any, page_station: PageStation) -> None:
    page_station.token = "open sesame"
    page = open_page(query="?token=open%20sesame")
    page.until("freelook.stats().whep === 'lost'")
    sent = {path: authorization for _, path, authorization in page_station.requests}
    assert sent["/api/station"] == sent["/whep"] == "Bearer open sesame"


def test_without_the_token_the_page_says_so(open_page: Any, page_station: PageStation) -> None:
    page_station.token = "open sesame"
    page = open_page(ready=False)
    page.shows("Cannot start: a token is needed. Trying again")


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("delete window.RTCPeerConnection;", "no WebRTC"),
        ("HTMLCanvasElement.prototype.getContext = () => null;", "no WebGL2"),
    ],
)
def test_a_browser_that_lacks_something_is_told(open_page: Any, script: str, words: str) -> None:
    open_page(ready=False, script=script).shows(words)


@pytest.mark.parametrize("viewport", [(1280, 720), (390, 844), (844, 390), (320, 568)])
def test_nothing_lies_outside_the_window_or_on_something_else(
    open_page: Any, viewport: tuple[int, int]
) -> None:
    width, height = viewport
    page = open_page(viewport={"width": width, "height": height}, trackers=["opentrack"])
    boxes = {
        name: page.page.locator(f"#{name}").bounding_box()
        for name in ("top", "readings", "controls", "pip")
    }
    for box in boxes.values():
        assert box["x"] >= 0
        assert box["y"] >= 0
        assert box["x"] + box["width"] <= width + 0.5
        assert box["y"] + box["height"] <= height + 0.5
    for one, other in (("top", "readings"), ("pip", "readings"), ("pip", "controls")):
        a, b = boxes[one], boxes[other]
        apart = (
            a["x"] + a["width"] <= b["x"]
            or b["x"] + b["width"] <= a["x"]
            or a["y"] + a["height"] <= b["y"]
            or b["y"] + b["height"] <= a["y"]
        )
        assert apart, (one, other)
    for button in page.page.locator("#controls button").all():
        assert button.bounding_box()["height"] >= 44
