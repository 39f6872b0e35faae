"""Everything that turns the head in the page: the right way, by the right angle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from page_station import PageView
from scipy.spatial.transform import Rotation

from freelook.rotations import RDF_FROM_FRD, body_from_view
from freelook.viewport import Viewport

pytestmark = pytest.mark.browser

# The page's window is 640 x 480 with 90 degrees across the longer side.
DEG_PER_PX = np.degrees(1 / Viewport((640, 480), 90.0).focal_px)


def drag(page: Any, dx: float, dy: float) -> None:
    page.mouse.move(320, 240)
    page.mouse.down()
    page.mouse.move(320 + dx / 2, 240 + dy / 2)
    page.mouse.move(320 + dx, 240 + dy)
    page.mouse.up()


def test_the_picture_follows_the_mouse(view: PageView) -> None:
    drag(view.page, 100, 0)
    assert view.head() == pytest.approx((-100 * DEG_PER_PX, 0, 0), abs=0.01)
    drag(view.page, -100, 40)
    assert view.head() == pytest.approx((0, 40 * DEG_PER_PX, 0), abs=0.2)


def test_dragging_with_a_tilted_head_moves_along_the_screen(view: PageView) -> None:
    view.set_head(0, 0, 90)
    drag(view.page, 100, 0)  # the picture's right is now the level world's down
    assert view.head() == pytest.approx((0, 100 * DEG_PER_PX, 90), abs=0.01)


def test_dragging_can_move_the_head_instead(view: PageView) -> None:
    view.js("freelook.app.settings.set('dragMoves', 'head')")
    drag(view.page, 100, 0)
    assert view.head()[0] == pytest.approx(100 * DEG_PER_PX, abs=0.01)


def test_axes_can_be_inverted_and_scaled_and_it_is_remembered(view: PageView) -> None:
    view.page.get_by_role("button", name="Settings").click()
    panel = view.page.locator("#settings-form")
    panel.locator("fieldset").first.get_by_label("invert").first.check()
    panel.get_by_label("pitch scale").first.fill("2")
    view.page.get_by_role("button", name="Close").last.click()
    view.page.reload()
    view.until("window.freelook?.ready")
    drag(view.page, 100, 40)
    assert view.head() == pytest.approx((100 * DEG_PER_PX, 80 * DEG_PER_PX, 0), abs=0.3)


def test_pitch_ends_straight_up_and_yaw_goes_round(view: PageView) -> None:
    view.js("freelook.app.command.turnByHand({yaw: 200, pitch: 500}, 0)")
    assert view.js("freelook.app.hand.angles") == {"yaw": -160, "pitch": 90, "roll": 0}


def test_the_wheel_zooms_within_10_and_150_degrees(view: PageView) -> None:
    view.page.mouse.move(320, 240)
    view.page.mouse.wheel(0, -100)
    view.until("freelook.stats().fieldDeg < 89")
    assert view.stats()["fieldDeg"] == pytest.approx(90 / 1.1, abs=0.1)
    for turn, limit in ((-300, 10), (300, 150)):
        for _ in range(14):
            view.page.mouse.wheel(0, turn)
        view.until(f"freelook.stats().fieldDeg === {limit}")


TOUCH = """([id, type, x, y]) => freelook.app.screen.stage.dispatchEvent(new PointerEvent(type,
    {pointerId: id, pointerType: 'touch', clientX: x, clientY: y, bubbles: true}))"""


def test_one_finger_looks_and_two_zoom(view: PageView) -> None:
    def touch(*event: Any) -> None:
        view.js(TOUCH, list(event))

    touch(1, "pointerdown", 300, 200)
    touch(1, "pointermove", 300, 250)
    assert view.head() == pytest.approx((0, 50 * DEG_PER_PX, 0), abs=0.01)
    touch(2, "pointerdown", 400, 250)
    touch(2, "pointermove", 500, 250)
    assert view.stats()["fieldDeg"] == pytest.approx(45, abs=0.1)
    assert view.head() == pytest.approx((0, 50 * DEG_PER_PX, 0), abs=0.01)
    touch(2, "pointerup", 500, 250)
    touch(1, "pointerup", 300, 250)
    touch(1, "pointermove", 0, 0)
    assert view.head() == pytest.approx((0, 50 * DEG_PER_PX, 0), abs=0.01)


HOLD = """([code, steps, stepMs]) => {
    const keys = freelook.app.keyboard;
    const start = performance.now() + 1e6;  // a clock of our own; the page's must not interfere
    keys.held.add(code);
    keys.steppedMs = start;
    for (let i = 1; i <= steps; i++) keys.advance(start + i * stepMs);
    keys.held.clear();
}"""


def test_held_keys_turn_by_four_fifths_of_the_field_in_a_second(view: PageView) -> None:
    turn = 0.8 * 90
    for codes, head in (
        (("ArrowLeft", "KeyA"), (-turn, 0, 0)),
        (("ArrowRight", "KeyD"), (turn, 0, 0)),
        (("ArrowUp", "KeyW"), (0, turn, 0)),
        (("ArrowDown", "KeyS"), (0, -turn, 0)),
    ):
        for code in codes:
            view.set_head(0, 0)
            view.js(HOLD, [code, 50, 20])
            assert view.head() == pytest.approx(head, abs=0.01), code


def test_q_and_e_tilt_the_head_left_and_right(view: PageView) -> None:
    view.js(HOLD, ["KeyE", 50, 20])
    assert view.head() == pytest.approx((0, 0, 45), abs=0.01)
    view.js(HOLD, ["KeyQ", 100, 20])
    assert view.head() == pytest.approx((0, 0, -45), abs=0.01)


def test_plus_and_minus_zoom(view: PageView) -> None:
    view.js(HOLD, ["Equal", 50, 20])
    assert view.stats()["fieldDeg"] == pytest.approx(45, abs=0.01)
    view.js(HOLD, ["Minus", 50, 20])
    assert view.stats()["fieldDeg"] == pytest.approx(90, abs=0.01)


def test_real_key_presses_reach_the_head_and_stop_with_the_key(view: PageView) -> None:
    view.page.keyboard.down("ArrowRight")
    view.until("freelook.stats().angles.yaw > 2")
    view.page.keyboard.up("ArrowRight")
    assert not view.js("freelook.app.keyboard.active")
    view.page.keyboard.press("r")
    assert view.head() == pytest.approx((0, 0, 0), abs=1e-6)


def test_t_switches_the_head_off_and_on(view: PageView) -> None:
    view.set_head(30, 10)
    view.page.keyboard.press("t")
    view.settles()
    assert view.head() == pytest.approx((0, 0, 0))
    view.shows("Head is switched off: looking straight ahead")
    view.page.keyboard.press("t")
    view.settles()
    assert view.head() == pytest.approx((30, 10, 0))


PADS = "navigator.getGamepads = () => window.pad ? [null, window.pad] : [];"
STEP = """([axes, pressed, steps, stepMs]) => {
    const pads = freelook.app.gamepads;
    const start = performance.now() + 1e6;
    const buttons = Array.from({length: 17}, (_, i) => ({pressed: pressed.includes(i)}));
    window.pad = {connected: true, axes, buttons};
    pads.steppedMs = start;
    for (let i = 1; i <= steps; i++) pads.advance(start + i * stepMs);
    window.pad = null;
    pads.down.clear();
}"""


@pytest.fixture
def pad_view(open_page: Any) -> PageView:
    page: PageView = open_page(script=PADS)
    return page


def test_the_right_stick_turns_at_a_rate(pad_view: PageView) -> None:
    pad_view.js(STEP, [[0, 0, 1, 0], [], 25, 20])
    assert pad_view.head() == pytest.approx((60, 0, 0), abs=0.01)
    pad_view.js(STEP, [[0, 0, 0, -1], [], 25, 20])
    assert pad_view.head() == pytest.approx((60, 60, 0), abs=0.01)


def test_a_stick_at_rest_does_not_drift(pad_view: PageView) -> None:
    pad_view.js(STEP, [[0.5, 0.5, 0.11, -0.11], [], 100, 20])
    assert pad_view.head() == pytest.approx((0, 0, 0), abs=1e-9)


def test_the_right_stick_can_point_instead(pad_view: PageView) -> None:
    pad_view.js("freelook.app.settings.set('stick', 'position')")
    pad_view.js(STEP, [[0, 0, -1, 0], [], 3, 20])
    assert pad_view.head() == pytest.approx((-120, 0, 0), abs=0.01)
    pad_view.js(STEP, [[0, 0, 0, 0], [], 3, 20])
    assert pad_view.head() == pytest.approx((0, 0, 0), abs=0.01)


def test_gamepad_buttons_recentre_switch_and_zoom(pad_view: PageView) -> None:
    pad_view.set_head(20, 0)
    pad_view.js(STEP, [[0, 0, 0, 0], [11], 2, 20])
    assert pad_view.head() == pytest.approx((0, 0, 0))
    pad_view.js(STEP, [[0, 0, 0, 0], [1], 2, 20])
    assert pad_view.stats()["headState"] == "disabled"
    pad_view.js(STEP, [[0, 0, 0, 0], [5], 50, 20])
    assert pad_view.stats()["fieldDeg"] == pytest.approx(45, abs=0.01)


def test_a_gamepad_wakes_the_page(pad_view: PageView) -> None:
    pad_view.js(
        "window.pad = {connected: true, axes: [0, 0, 1, 0], buttons: []};"
        "dispatchEvent(new Event('gamepadconnected'))"
    )
    pad_view.until("freelook.stats().angles.yaw > 3")
    pad_view.js("window.pad = null")


HELD_UP = {"alpha": 0, "beta": 90, "gamma": 0}
ORIENT = (
    """angles => window.dispatchEvent(new DeviceOrientationEvent('deviceorientation', angles))"""
)


@pytest.fixture
def phone(open_page: Any) -> PageView:
    page: PageView = open_page(
        viewport={"width": 390, "height": 844}, is_mobile=True, has_touch=True
    )
    page.page.get_by_role("button", name="Phone").tap()
    page.until("freelook.headSource === 'phone'")
    page.js(ORIENT, HELD_UP)
    return page


def test_the_phone_is_a_window(phone: PageView) -> None:
    for angles, head in (
        ({"alpha": 330, "beta": 90, "gamma": 0}, (30, 0, 0)),  # alpha counts anticlockwise
        ({"alpha": 30, "beta": 90, "gamma": 0}, (-30, 0, 0)),
        ({"alpha": 0, "beta": 110, "gamma": 0}, (0, 20, 0)),  # top edge towards the user: up
        ({"alpha": 0, "beta": 70, "gamma": 0}, (0, -20, 0)),
    ):
        phone.js(ORIENT, angles)
        assert phone.head() == pytest.approx(head, abs=1e-6)


def sensor_angles(yaw_deg: float, pitch_deg: float, roll_deg: float) -> dict[str, float]:
    """alpha, beta, gamma of a phone through which a head at these angles looks."""
    earth_from_level = Rotation.from_matrix([[1, 0, 0], [0, 0, 1], [0, -1, 0]])  # east north up
    view_from_screen = Rotation.from_matrix(np.diag([1, -1, -1]))
    level_from_view = RDF_FROM_FRD * body_from_view(yaw_deg, pitch_deg, roll_deg)
    earth_from_device = earth_from_level * level_from_view * view_from_screen
    right_edge_up = earth_from_device.apply([1, 0, 0])[2]
    assert right_edge_up * roll_deg <= 0  # tilted right: the phone's right edge is down
    angles = earth_from_device.as_euler("ZXY", degrees=True)
    return dict(zip(("alpha", "beta", "gamma"), angles.tolist(), strict=True))


def test_tilting_and_turning_the_phone_at_once(phone: PageView) -> None:
    for head in [(0, 10, 20), (0, 10, -20), (-50, -30, 15), (120, 40, -70)]:
        phone.js(ORIENT, sensor_angles(*head))
        assert phone.head() == pytest.approx(head, abs=1e-6)


def test_a_phone_held_sideways_knows_its_top(phone: PageView) -> None:
    upright = "import('/static/phone.js').then(m => m.levelFromView(0, 90, 0, 0))"
    sideways = "import('/static/phone.js').then(m => m.levelFromView(90, 0, -90, 90))"
    assert np.abs(np.dot(phone.js(upright), phone.js(sideways))) == pytest.approx(1, abs=1e-9)


def test_recentring_a_leaning_phone_keeps_yaw_about_the_vertical(phone: PageView) -> None:
    phone.js(ORIENT, {"alpha": 200, "beta": 50, "gamma": 0})
    phone.page.get_by_role("button", name="Centre").tap()
    assert phone.head() == pytest.approx((0, 0, 0), abs=1e-6)
    phone.js(ORIENT, {"alpha": 180, "beta": 50, "gamma": 0})
    assert phone.head() == pytest.approx((20, 0, 0), abs=1e-6)


def test_a_silent_phone_holds_then_looks_ahead(phone: PageView) -> None:
    phone.js(ORIENT, {"alpha": 330, "beta": 90, "gamma": 0})
    at = "s => freelook.app.phone.aim(freelook.app.phone.stampMs + 1000 * s).state"
    # The station's hold_s is 1, ease_s is 2; the phone counts as silent from its last event on.
    states = [phone.js(at, seconds) for seconds in (0.5, 1.0, 2.0, 3.1)]
    assert states == ["tracking", "holding", "easing", "centred"]
    phone.shows("looking straight ahead")


def test_a_page_without_https_says_why_there_is_no_sensor(open_page: Any) -> None:
    insecure = "Object.defineProperty(window, 'isSecureContext', {value: false});"
    phone = open_page(
        viewport={"width": 390, "height": 844}, is_mobile=True, has_touch=True, script=insecure
    )
    phone.page.get_by_role("button", name="Phone").tap()
    phone.shows("open this one with https")
    assert phone.js("freelook.headSource") == "hand"
