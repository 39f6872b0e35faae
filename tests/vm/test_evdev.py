"""The joystick tracker on a real driver: uinput, by which a program is an input device.

Run by scripts/test-devices in a virtual machine; skipped on machines without the driver.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from typing import Any

import pytest

from freelook.rotations import head_angles_deg
from freelook.trackers import open_tracker
from freelook.types import Tracker

evdev = pytest.importorskip("evdev")
pytestmark = pytest.mark.skipif(
    not os.access("/dev/uinput", os.W_OK), reason="no uinput driver (scripts/test-devices)"
)

NAME = "Made-up Radio"


def plug_in() -> Any:
    """A device with axes x, y and z from 0 to 2048, in their middle."""
    middle = evdev.AbsInfo(value=1024, min=0, max=2048, fuzz=0, flat=0, resolution=0)
    codes = (evdev.ecodes.ABS_X, evdev.ecodes.ABS_Y, evdev.ecodes.ABS_Z)
    return evdev.UInput({evdev.ecodes.EV_ABS: [(code, middle) for code in codes]}, name=NAME)


@pytest.fixture
def tracker() -> Iterator[Tracker]:
    made = open_tracker(f"joystick:{NAME}?span=45")
    yield made
    made.close()


def wait_for(tracker: Tracker, expected: tuple[float, float, float]) -> None:
    deadline = time.monotonic() + 20
    for pose in tracker.poses():
        if head_angles_deg(pose.body_from_view) == pytest.approx(expected, abs=0.01):
            return
        assert time.monotonic() < deadline, tracker.message


def test_its_axes_are_the_head(tracker: Tracker) -> None:
    with plug_in() as radio:
        wait_for(tracker, (0, 0, 0))
        for code, value in ((evdev.ecodes.ABS_X, 2048), (evdev.ecodes.ABS_Y, 0)):
            radio.write(evdev.ecodes.EV_ABS, code, value)
        radio.syn()
        wait_for(tracker, (45, -45, 0))


def test_it_is_found_again(tracker: Tracker) -> None:
    with plug_in():
        wait_for(tracker, (0, 0, 0))
    with plug_in() as radio:
        radio.write(evdev.ecodes.EV_ABS, evdev.ecodes.ABS_Z, 2048)
        radio.syn()
        wait_for(tracker, (0, 0, 45))
    assert tracker.counters["reconnects"] == 1
