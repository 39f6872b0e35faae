"""The gimbal in the page: modes, eyes front, what is eased, the lens's edge, sensible zoom."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from page_station import PageView
from scipy.spatial.transform import Rotation
from test_page_station import STATUS, gray_picture

from freelook.camera import make_camera
from freelook.gimbal import Aim, Base, soft_stop, zoom_limits
from freelook.lens import Equidistant
from freelook.rotations import RDF_FROM_FRD, body_from_view, head_angles_deg, to_wxyz
from freelook.viewport import Viewport
from freelook.web import messages

pytestmark = pytest.mark.browser

BASE = Base(Rotation.from_euler("ZYX", [30, 10, -20], degrees=True), "world", "world", turned=True)


def tell(page: PageView, text: str) -> None:
    """A message as the station writes it."""
    page.js("text => freelook.app.link.receive(text, performance.now())", text)


def show_frame(page: PageView, rtp: int) -> None:
    """As if the frame with this time stamp had come."""
    page.put(gray_picture())
    page.js("rtp => freelook.app.pictured({receivedMs: null, rtp})", rtp)


def looks(page: PageView, expected: Rotation) -> None:
    assert page.head() == pytest.approx(head_angles_deg(expected), abs=1e-3)


@pytest.fixture
def tracked(open_page: Any) -> PageView:
    page: PageView = open_page(trackers=["opentrack"])
    page.js("""setInterval(() => freelook.app.link.receive(
        '{"type": "pong", "t": 0, "ns": 0}', performance.now()), 100)""")  # the station lives
    return page


def test_heads_turn_in_the_base_of_the_frame_that_is_shown(view: PageView) -> None:
    view.set_head(15, 5)
    tell(view, messages.frame(1, 0, BASE))
    tell(view, messages.frame(2, 0))
    show_frame(view, 1)
    looks(view, BASE.body_from_base * body_from_view(15, 5))
    show_frame(view, 2)
    looks(view, body_from_view(15, 5))
    show_frame(view, 3)  # nothing is known of it yet: the last one's is the best there is
    looks(view, body_from_view(15, 5))
    tell(view, messages.frame(3, 0, BASE))
    looks(view, BASE.body_from_base * body_from_view(15, 5))


def test_a_stabilised_tracker_is_put_together_from_its_parts(tracked: PageView) -> None:
    leftover = Rotation.from_euler("z", 12, degrees=True)
    head = body_from_view(-25, 10)
    whole = leftover * BASE.body_from_base * head
    told = Aim(whole, "tracking", None, True, head, leftover, True, BASE)
    tell(tracked, messages.frame(1, 0, BASE))
    show_frame(tracked, 1)
    tell(tracked, messages.pose("opentrack", told, 0))
    looks(tracked, whole)
    forward = Aim(body_from_view(4, 0), "easing", None, True)
    tell(tracked, messages.pose("opentrack", forward, 0))
    looks(tracked, body_from_view(4, 0))  # along the nose: the base plays no part in it
    tell(tracked, messages.pose("opentrack", told, 0))
    tracked.js("freelook.app.command.takeByHand(performance.now())")
    looks(tracked, whole)


def test_eyes_front_acts_at_once_stays_and_is_left_gently(view: PageView) -> None:
    view.set_head(60, 10)
    view.page.keyboard.press("Space")
    assert view.head() == pytest.approx((0, 0, 0), abs=1e-9)
    assert view.stats()["headState"] == "front"
    view.shows("Eyes front: looking straight ahead; Space or T goes on")
    view.js("freelook.app.command.turnByHand({yaw: 20}, performance.now())")
    view.page.keyboard.press("r")
    assert view.head() == pytest.approx((0, 0, 0), abs=1e-9)
    view.set_head(40, 0)
    view.page.reload()
    view.until("window.freelook?.ready")
    assert view.stats()["headState"] == "front", "it outlives the page"
    view.js("freelook.app.hand.set({yaw: 70, pitch: 0, roll: 0}, 0)")
    released = "() => { freelook.app.command.toggleFront(); return freelook.stats().angles.yaw; }"
    assert view.js(released) < 1, "it begins where it was"
    view.settles()
    assert view.head() == pytest.approx((70, 0, 0))
    view.page.keyboard.press("Space")
    view.page.keyboard.press("t")
    assert view.stats()["headState"] == "tracking", "T goes on too"


def test_eyes_front_overrules_a_tracker_and_needs_no_station(tracked: PageView) -> None:
    tell(tracked, messages.pose("opentrack", Aim(body_from_view(50, 0), "tracking", None), 0))
    tracked.page.get_by_role("button", name="Front").click()
    assert tracked.head() == pytest.approx((0, 0, 0), abs=1e-9)
    assert tracked.js("freelook.headSource") == "opentrack"


def test_space_releases_eyes_front_of_the_station_too(tracked: PageView, page_station: Any) -> None:
    tell(tracked, messages.pose("opentrack", Aim(body_from_view(0, 0), "front", None), 0))
    tracked.page.keyboard.press("Space")
    tracked.until("document.getElementById('notice').textContent === 'opentrack switched on'")
    assert page_station.controls == [{"tracker": "opentrack", "action": "enable"}]


EASE = """([before, after]) => {
    const {command} = freelook.app;
    const ease = new command.ease.constructor(240);
    ease.start(before, after, 0);
    return [ease.seconds, ...Array.from({length: 2000}, (_, t) => ease.apply(after, t))];
}"""


def test_what_the_page_eases_is_no_faster_than_stated(view: PageView) -> None:
    before, after = (to_wxyz(RDF_FROM_FRD * body_from_view(yaw, 10)) for yaw in (-80, 75))
    seconds, *way = view.js(EASE, [before, after])
    quats = np.array(way)
    steps = 2 * np.degrees(np.arccos(np.abs((quats[1:] * quats[:-1]).sum(axis=1)).clip(max=1)))
    assert steps.max() == pytest.approx(0.240, rel=1e-3)
    assert quats[0] == pytest.approx(np.array(before))
    assert quats[-1] == pytest.approx(np.array(after))
    assert 1 < seconds < 2


def test_modes_are_asked_for_and_shown(open_page: Any, page_station: Any) -> None:
    page: PageView = open_page()
    page.page.keyboard.press("m")
    page.until("document.getElementById('notice').textContent === 'Mode: horizon'")
    assert page_station.controls == [{"mode": "horizon"}]
    vehicle = {"mode": "horizon", "effective": "body", "state": "degraded", "message": "why"}
    page.message(**STATUS, vehicle=vehicle)
    page.until("document.getElementById('mode').textContent === 'horizon'")
    page.shows("Mode horizon: why")
    page.page.get_by_role("button", name="Settings").click()
    page.page.get_by_label("Mode, for all viewers").select_option("follow")
    page.until("document.getElementById('notice').textContent === 'Mode: follow'")
    assert page_station.controls[-1] == {"mode": "follow"}


STOP = """([q, view]) => freelook.app.limit.stopped(q, view)"""


@pytest.mark.parametrize("field_deg", [150, 230])
def test_the_page_stops_where_the_station_would(open_page: Any, field_deg: float) -> None:
    camera = make_camera((320, 320), Equidistant(f=70.0), field_deg=field_deg)
    page: PageView = open_page(camera)
    rng = np.random.default_rng(4)
    for turn in Rotation.random(25, rng=rng):
        viewport = Viewport((640, 480), float(rng.uniform(30, 100)))
        size = {"width": 640, "height": 480, "hfovDeg": viewport.hfov_deg}
        head_from_view = RDF_FROM_FRD * turn
        stopped = page.js(STOP, [to_wxyz(head_from_view), size])
        wanted = soft_stop(camera.camera_from_body * turn, viewport, camera.theta_max)
        expected = to_wxyz(RDF_FROM_FRD * camera.camera_from_body.inv() * wanted)
        assert abs(np.dot(stopped, expected)) == pytest.approx(1, abs=1e-9)


def test_the_soft_stop_can_be_chosen(view: PageView) -> None:
    view.set_head(120, 0)
    assert view.head()[0] == pytest.approx(120)
    view.js("freelook.app.settings.set('limit', 'soft')")
    # the lens sees 94 degrees to the side, the view's corner reaches 49 beyond its middle
    assert view.head()[0] < 94 - 45
    # what the hand pushed past the edge is not there to be pulled back first
    view.until("freelook.app.hand.angles.yaw < 50")
    view.set_head(10, 0)
    view.until("Math.abs(freelook.stats().angles.yaw - 10) < 1e-6")


SCALED = "q => freelook.app.phone.scaled(q)"


def test_the_phone_has_gain_dead_zone_and_sense_of_each_axis(view: PageView) -> None:
    settings = {"yaw.dead": 5, "yaw.scale": 2, "pitch.invert": True, "roll.dead": 20}
    for name, value in settings.items():
        view.js("([n, v]) => freelook.app.settings.set(`phone.${n}`, v)", [name, value])
    q = view.js(SCALED, to_wxyz(RDF_FROM_FRD * body_from_view(-30, 12, 15)))
    expected = to_wxyz(RDF_FROM_FRD * body_from_view(-50, -12, 0))
    assert abs(np.dot(q, expected)) == pytest.approx(1, abs=1e-9)


def test_zoom_ends_where_the_cameras_pixels_only_grow(open_page: Any, page_station: Any) -> None:
    camera = make_camera((320, 240), Equidistant(f=70.0), field_deg=140)
    page_station.zoom = messages.zoom(camera)
    try:
        page: PageView = open_page(camera)
        width = page.js("freelook.app.zoom.spanPx")
        limits = zoom_limits(camera, width)
        page.js("freelook.app.zoom.set(1)")
        assert page.stats()["fieldDeg"] == pytest.approx(limits.narrowest_deg)
        assert limits.narrowest_deg > 30
        page.js("freelook.app.zoom.set(180)")
        assert page.stats()["fieldDeg"] == pytest.approx(limits.widest_deg)
        assert limits.widest_deg == pytest.approx(140)
    finally:
        page_station.zoom = {"narrowest_deg": 10.0, "widest_deg": 150.0, "focal_px": 1e9}
