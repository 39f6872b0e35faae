"""A program with a window, for test_window.py: it says what it did, and waits to be asked on.

Its own process, because what OpenGL and X leave behind must not meet other tests.
"""

from __future__ import annotations

import json
import sys

import numpy as np
from scene import AHEAD_DEG, CAMERA, HFOV_DEG, OPTICS, frame

from freelook.clock import now_ns
from freelook.mailbox import Mailbox
from freelook.types import Frame
from freelook.window.flight import Flight, Outside
from freelook.window.pilot import Pilot
from freelook.window.surface import Surface


def say(**what: object) -> None:
    print(json.dumps(what), flush=True)


def main() -> None:
    with Surface((320, 240)) as surface:
        opened = {"size": surface.size_px, "full": surface.full_screen}
        monitors = [str(monitor) for monitor in surface.monitors()]
        surface.toggle_full_screen()
        surface.events()
        filled = {"size": surface.size_px, "full": surface.full_screen}
        say(opened=opened, filled=filled, monitors=monitors, renderer=surface.renderer)
        frames: Mailbox[Frame] = Mailbox()
        frames.put(frame())
        pilot = Pilot({}, HFOV_DEG)
        pilot._yaw_deg, pilot._pitch_deg = AHEAD_DEG
        told = 0

        def until_told() -> bool:
            """After every view that changed something; the test answers when it has looked."""
            nonlocal told
            if flight.figures.views > told:
                told = flight.figures.views
                yaw = pilot._yaw_deg
                say(views=told, yaw=yaw, poses=len(flight.figures.pose_to_swap.values_ns))
                sys.stdin.readline()
            return False

        outside = Outside(now_ns, until_told)
        flight = Flight(surface, frames, CAMERA, pilot, outside, OPTICS)
        figures = flight.run()
    ages = [list(a.values_ns) for a in (figures.pose_to_swap, figures.latch_to_swap)]
    say(ended=True, views=figures.views, pose_to_swap_ns=ages[0], latch_to_swap_ns=ages[1])


if __name__ == "__main__":
    with np.errstate(all="raise"):
        main()
