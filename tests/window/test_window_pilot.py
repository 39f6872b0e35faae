"""Keys, mouse, wheel and gamepad of the window, and who has control."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.clock import NS_PER_S
from freelook.gimbal import Gimbal, GimbalSettings, Stabiliser
from freelook.head import Head
from freelook.projections import PROJECTIONS
from freelook.rotations import angle_between_deg, body_from_view, head_angles_deg
from freelook.types import Attitude, Counters, Pose
from freelook.viewport import NARROWEST_DEG, WIDEST_DEG, Viewport
from freelook.window.events import Closed, Damaged, Drag, Key, Left, Pad, Wheel
from freelook.window.pilot import LOOK_PER_S, Pilot

SIZE = (640, 360)
STEP_NS = NS_PER_S // 20
LATER_NS = NS_PER_S  # when every change is over


class OnePose:
    """A tracker that looked once, 20 degrees to the right and tilted."""

    message = ""

    def __init__(self) -> None:
        self.counters = Counters()

    def poses(self) -> Iterator[Pose]:
        yield Pose(body_from_view(20, 5, 30), 1000)

    def close(self) -> None:
        pass


def tracked() -> tuple[Pilot, Head]:
    settings = GimbalSettings(lost_after_s=60, blend_s=0, rate_deg_s=36_000)
    head = Head("one", OnePose(), Gimbal(settings), clock=lambda: 1000)
    head.start()
    head.close()  # waits until the pose is there
    return Pilot({"one": head}, 90.0), head


def angles(pilot: Pilot, now_ns: int = LATER_NS) -> tuple[float, float, float]:
    return head_angles_deg(pilot.look(now_ns).body_from_view)


def held(pilot: Pilot, *names: str, seconds: float = 1.0, now_ns: int = 0) -> None:
    """Keys held so long, with the loop running."""
    pilot.advance(now_ns)
    pilot.take([Key(name, True) for name in names], now_ns, SIZE)
    for _ in range(round(seconds * NS_PER_S / STEP_NS)):
        now_ns += STEP_NS
        pilot.advance(now_ns)
    pilot.take([Key(name, False) for name in names], now_ns, SIZE)
    pilot.advance(now_ns + STEP_NS)


@pytest.mark.parametrize(
    ("key", "yaw", "pitch"), [("left", -1, 0), ("right", 1, 0), ("up", 0, 1), ("down", 0, -1)]
)
def test_arrows_turn_the_view_by_a_share_of_its_field_each_second(
    key: str, yaw: int, pitch: int
) -> None:
    pilot = Pilot({}, 60.0)
    held(pilot, key, seconds=0.5)
    turned = 0.5 * LOOK_PER_S * 60.0
    assert angles(pilot) == pytest.approx((yaw * turned, pitch * turned, 0), abs=1e-6)


def test_a_key_held_while_another_window_takes_the_keyboard_is_let_go() -> None:
    pilot = Pilot({}, 60.0)
    pilot.take([Key("left", True), Left()], 0, SIZE)
    held(pilot, seconds=1)
    assert angles(pilot) == pytest.approx((0, 0, 0))


def test_a_pause_of_the_loop_turns_the_view_by_a_tenth_of_a_second_at_most() -> None:
    pilot = Pilot({}, 90.0)
    pilot.advance(0)
    pilot.take([Key("right", True)], 0, SIZE)
    pilot.advance(30 * NS_PER_S)
    assert angles(pilot)[0] == pytest.approx(0.1 * LOOK_PER_S * 90)


@pytest.mark.parametrize("hfov_deg", [30.0, 90.0])
def test_a_drag_keeps_the_picture_under_the_mouse(hfov_deg: float) -> None:
    """What was in the middle of the view is then where the mouse went: some pixels off, and a
    pixel or two beside it, as a drag is exact in the middle only."""
    pilot = Pilot({}, hfov_deg)
    pilot.take([Drag(30, -12)], 5, SIZE)
    view_from_before = pilot.look(5).body_from_view.inv() * body_from_view(0, 0)
    x, y, z = view_from_before.apply([0, 0, 1])
    focal_px = Viewport(SIZE, hfov_deg).focal_px
    assert (x / z * focal_px, y / z * focal_px) == pytest.approx((30, -12), abs=1)
    assert pilot.look(5).pose_ns == 5


@pytest.mark.parametrize("pitch_deg", [-90.0, 90.0])
def test_the_view_stops_straight_up_and_down(pitch_deg: float) -> None:
    pilot = Pilot({}, 90.0)
    pilot.take([Drag(0, np.sign(pitch_deg) * 10_000)], 0, SIZE)
    assert angles(pilot)[1] == pytest.approx(pitch_deg, abs=1e-4)


def test_wheel_and_keys_zoom_as_far_as_views_go() -> None:
    pilot = Pilot({}, 90.0)
    pilot.take([Wheel(1)], 0, SIZE)
    assert pilot.hfov_deg == pytest.approx(90 / 1.1)
    held(pilot, "-", seconds=1)
    assert pilot.hfov_deg == pytest.approx(min(2 * 90 / 1.1, WIDEST_DEG))
    held(pilot, "+", seconds=9)
    assert pilot.hfov_deg == NARROWEST_DEG
    wide = Pilot({}, 90.0, projection="stereographic")
    held(wide, "-", seconds=9)
    assert wide.hfov_deg == 300


@pytest.mark.parametrize(
    ("event", "asked"),
    [
        (Key("f", True), ["full screen"]),
        (Key("q", True), ["quit"]),
        (Key("escape", True), ["quit"]),
        (Closed(), ["quit"]),
        (Damaged(), ["draw again"]),
        (Key("q", False), []),
        (Key("x", True), []),
    ],
)
def test_what_is_for_the_window_itself(event: Key | Damaged | Closed, asked: list[str]) -> None:
    assert Pilot({}, 90.0).take([event], 0, SIZE) == asked


def test_recentre_by_hand_goes_there() -> None:
    pilot = Pilot({}, 90.0)
    pilot.take([Drag(80, 40), Key("r", True)], 7, SIZE)
    assert angles(pilot) == pytest.approx((0, 0, 0))


def test_eyes_front_and_back() -> None:
    pilot = Pilot({}, 90.0)
    pilot.take([Drag(-80, 0)], 7, SIZE)
    turned = angles(pilot)
    pilot.take([Key("e", True), Key("e", False)], 8, SIZE)
    assert angles(pilot) == pytest.approx((0, 0, 0))
    pilot.take([Key("e", True)], 9, SIZE)
    assert angles(pilot, 9) == pytest.approx((0, 0, 0)), "back without a jump"
    assert angles(pilot, 10**9) == pytest.approx(turned)


def test_a_tracker_has_control_until_something_is_touched() -> None:
    pilot, _ = tracked()
    assert angles(pilot) == pytest.approx((20, 5, 30))
    assert pilot.look(LATER_NS).pose_ns == 1000
    pilot.take([Drag(-10, 0)], LATER_NS, SIZE)
    yaw, pitch, roll = angles(pilot)
    assert 20 < yaw < 23
    assert (pitch, roll) == pytest.approx((5, 0), abs=1e-6)  # from where it looked, upright
    pilot.take([Key("g", True)], LATER_NS, SIZE)
    assert angles(pilot) == pytest.approx((20, 5, 30))


def test_the_vehicles_turning_is_taken_out_of_the_hands_view() -> None:
    """Level with the horizon, in a vehicle that banks by 30 degrees."""
    stabiliser = Stabiliser()
    stabiliser.set_mode("horizon")
    banked = Rotation.from_euler("x", 30, degrees=True)  # body x is forward: right wing down
    for k in range(5 * 20):
        stabiliser.push(Attitude(k * STEP_NS, banked))
        stabiliser.at(k * STEP_NS, k * STEP_NS)  # the modes ease in
    pilot, newest_ns = Pilot({}, 90.0, stabiliser), (5 * 20 - 1) * STEP_NS
    look = pilot.look(newest_ns, newest_ns).body_from_view
    assert head_angles_deg(look) == pytest.approx((0, 0, -30), abs=0.01)
    pilot.take([Key("e", True)], newest_ns, SIZE)  # eyes front is the vehicle's front
    assert angles(pilot, newest_ns) == pytest.approx((0, 0, 0), abs=0.01)


def test_m_goes_round_the_modes_that_are_possible() -> None:
    stabiliser = Stabiliser()
    pilot = Pilot({}, 90.0, stabiliser)
    seen = []
    for _ in range(5):
        pilot.take([Key("m", True), Key("m", False)], 1, SIZE)
        seen.append(stabiliser.mode)
    assert seen == ["horizon", "world", "follow", "body", "horizon"]


def test_o_goes_round_the_projections_that_a_window_may_have() -> None:
    """Each takes the field as far as it goes; drags keep the picture under the mouse in all."""
    pilot = Pilot({}, 150.0)
    held(pilot, "-", seconds=3)
    seen = []
    for _ in range(len(PROJECTIONS)):
        assert pilot.take([Key("o", True), Key("o", False)], 1, SIZE) == ["projection"]
        pilot.take([Drag(1, 0)], 1, SIZE)
        seen.append(pilot.projection)
    assert seen == [name for name in PROJECTIONS if name not in ("perspective", "strip")] + [
        "perspective",
        "pannini",
    ]
    assert pilot.hfov_deg == WIDEST_DEG  # again, after the wider ones
    held(pilot, "-", seconds=3)
    pilot.take([Key("o", True), Key("o", True), Key("o", True)], 1, SIZE)
    assert pilot.projection == "equirectangular"
    assert pilot.hfov_deg == 240
    for _ in range(3):
        pilot.next_projection()
    assert (pilot.projection, pilot.hfov_deg) == ("pannini", WIDEST_DEG)


def test_zooming_leaves_control_where_it_is() -> None:
    pilot, _ = tracked()
    pilot.take([Wheel(2)], 3000, SIZE)
    assert angles(pilot) == pytest.approx((20, 5, 30))


def test_recentre_and_eyes_front_of_a_tracker() -> None:
    pilot, head = tracked()
    pilot.take([Key("r", True)], LATER_NS, SIZE)
    straight = body_from_view(0, 0)
    assert angle_between_deg(pilot.look(LATER_NS).body_from_view, straight) < 1e-6
    pilot.take([Key("e", True)], LATER_NS, SIZE)
    assert head.aim(LATER_NS).state == "front"
    pilot.take([Key("e", True)], LATER_NS, SIZE)
    assert head.aim(LATER_NS).state == "tracking"


def test_the_right_stick_turns_and_its_buttons_act_once() -> None:
    pilot = Pilot({}, 90.0)
    pilot.advance(0, Pad(0.05, -0.05))
    pilot.advance(STEP_NS, Pad(0.05, -0.05))
    assert angles(pilot) == (0, 0, 0)  # near the middle is the middle
    pilot.advance(2 * STEP_NS, Pad(1.0, 0.0))
    assert angles(pilot)[0] == pytest.approx(120 / 20)
    pilot.advance(3 * STEP_NS, Pad(0.0, -1.0, frozenset({"narrower"})))
    assert angles(pilot)[1] > 0
    assert pilot.hfov_deg < 90
    for k in range(4, 6):  # held over two steps: eyes front, not back at once
        pilot.advance(k * STEP_NS, Pad(0.0, 0.0, frozenset({"toggle"})))
    assert angles(pilot) == pytest.approx((0, 0, 0))
    pilot.advance(6 * STEP_NS, Pad(0.0, 0.0))
    pilot.advance(7 * STEP_NS, Pad(0.0, 0.0, frozenset({"toggle"})))
    assert angles(pilot)[0] > 0
    pilot.advance(8 * STEP_NS, Pad(0.0, 0.0, frozenset({"recentre"})))
    assert angles(pilot) == pytest.approx((0, 0, 0))
