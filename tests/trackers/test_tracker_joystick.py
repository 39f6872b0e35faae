"""The joystick tracker on a device made up here; tests/vm has the kernel's."""

from __future__ import annotations

import errno
import sys
from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from freelook.axes import AxisMap
from freelook.clock import FakeClock
from freelook.errors import TrackerError
from freelook.rotations import head_angles_deg
from freelook.trackers import joystick, open_tracker
from freelook.trackers.joystick import AxisSampler, parse_buttons, parse_inputs

pytest.importorskip("evdev", reason="python-evdev is not installed (freelook[evdev])")

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="evdev is Linux's")

X, Y, Z = 0, 1, 2


@dataclass
class Info:
    value: int
    min: int = -100
    max: int = 100


@dataclass
class MadeUpDevice:
    axes: dict[int, Info] = field(default_factory=dict)
    present: bool = True
    closed: int = 0
    keys: list[int] = field(default_factory=list)

    def active_keys(self) -> list[int]:
        return self.keys

    def absinfo(self, number: int) -> Info:
        if not self.present:
            raise OSError(errno.ENODEV, "No such device")
        return self.axes.get(number, Info(0, 0, 0))

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> MadeUpDevice:
    made = MadeUpDevice({X: Info(50), Y: Info(-25), Z: Info(10)})

    def open_device(wanted: str) -> MadeUpDevice:
        if not made.present:
            raise OSError(errno.ENOENT, "no device of that name (readable here: nothing)")
        return made

    monkeypatch.setattr(joystick, "open_device", open_device)
    return made


def sampler(inputs: tuple[int | None, ...] = (X, Y, Z), span_deg: float = 90.0) -> AxisSampler:
    return AxisSampler("Radio", inputs, span_deg, AxisMap())


def angles(made: AxisSampler, now_s: float = 0.0) -> object:
    rotation = made.sample(round(now_s * 1e9))
    return None if rotation is None else pytest.approx(head_angles_deg(rotation))


def test_axes_are_parts_of_the_span(device: MadeUpDevice) -> None:
    assert angles(sampler()) == (45, -22.5, 9)
    assert angles(sampler((Z, None, X), span_deg=180)) == (18, 0, 90)


def test_the_middle_of_the_range_is_straight_ahead(device: MadeUpDevice) -> None:
    device.axes = {X: Info(1024, 0, 2048), Y: Info(2048, 0, 2048), Z: Info(-3, 0, 2048)}
    assert angles(sampler(span_deg=45)) == (0, 45, -45)


def test_a_device_that_was_pulled_out_is_looked_for_once_a_second(device: MadeUpDevice) -> None:
    made = sampler()
    assert angles(made, 0.0) == (45, -22.5, 9)
    device.present = False
    assert angles(made, 5.0) is None
    assert "it was pulled out" in made.message
    assert device.closed == 1
    assert angles(made, 5.1) is None
    assert "no device of that name" in made.message
    device.present = True
    assert angles(made, 5.9) is None
    assert angles(made, 6.2) == (45, -22.5, 9)
    assert made.counters.values == {"reconnects": 1}


def test_an_axis_the_device_lacks_is_said(device: MadeUpDevice) -> None:
    del device.axes[Z]
    made = sampler()
    assert made.sample(0) is None
    assert "it lacks one of the axes; choose others with inputs=" in made.message


def test_buttons_recentre_switch_and_bring_eyes_front(device: MadeUpDevice) -> None:
    buttons = parse_buttons("trigger,-,thumb")
    made = AxisSampler("Radio", (X, Y, Z), 90.0, AxisMap(), buttons)
    trigger, thumb = buttons
    device.keys = [thumb]
    made.sample(0)
    asked: list[str] = []
    made.on_action = asked.append
    for keys in ([thumb], [thumb, 7], [], [thumb], [thumb, trigger], [thumb, trigger]):
        device.keys = keys
        made.sample(0)
    assert asked == ["eyes_front", "recentre"], "not what was held when we began to listen"


@pytest.mark.parametrize("text", ["", "south", "south,east,up", "south,east,west,north"])
def test_buttons_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(TrackerError, match="must be three buttons"):
        parse_buttons(text)


@given(st.tuples(*[st.integers(-(2**31), 2**31 - 1)] * 3))
def test_any_numbers_of_a_device_are_a_pose_or_explained(numbers: tuple[int, int, int]) -> None:
    with pytest.MonkeyPatch.context() as patch:
        device = MadeUpDevice({X: Info(*numbers)})
        patch.setattr(joystick, "open_device", lambda wanted: device)
        made = sampler((X, None, None))
        rotation = made.sample(0)
    _, low, high = numbers
    assert (rotation is None) == (high <= low)
    if rotation is not None:
        assert abs(head_angles_deg(rotation)[0]) <= 90.0001


def test_the_tracker_yields_while_nothing_moves_and_lets_go(device: MadeUpDevice) -> None:
    clock = FakeClock(7)
    tracker = open_tracker("joystick:Radio?pitch=-pitch&rate=1000", clock=clock)
    poses = tracker.poses()
    found = [next(poses) for _ in range(3)]
    tracker.close()
    assert list(poses) == []
    assert head_angles_deg(found[2].body_from_view) == pytest.approx((45, 22.5, 9))
    assert tracker.counters["received"] == 3
    assert device.closed == 1


def test_inputs_by_name() -> None:
    assert parse_inputs("x,y,z") == (0, 1, 2)
    assert parse_inputs("RX,-,throttle") == (3, None, 6)


@pytest.mark.parametrize("inputs", ["", "x", "x,y,z,rx", "x,y,w", "x,y,mt_slot", "x, y,z"])
def test_inputs_are_checked(inputs: str) -> None:
    with pytest.raises(TrackerError, match="must be three axes, for yaw, pitch and roll, such as"):
        open_tracker(f"joystick:Radio?inputs={inputs}")


def test_a_device_must_be_named() -> None:
    with pytest.raises(TrackerError, match=r"which device.*PART_OF_ITS_NAME; here: "):
        open_tracker("joystick")


def test_elsewhere_it_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    with pytest.raises(TrackerError, match="works on Linux only; elsewhere use the page"):
        open_tracker("joystick:Radio")


@pytest.mark.parametrize("name", ["/dev/input/event9999", "/dev/null", "no\0name", "/no\0path"])
def test_what_is_no_device_is_explained(name: str) -> None:
    made = AxisSampler(name, (X, Y, Z), 90.0, AxisMap())
    assert made.sample(0) is None
    assert made.message.endswith("; looking for it")
