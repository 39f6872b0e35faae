"""A live source whose offset is found while frames and attitudes go by."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.alignment.image_turns import ImageTurns
from freelook.alignment.live_offset import LiveOffset
from freelook.attitude_track import AttitudeTrack
from freelook.attitudes._pushed import PushedAttitudes
from freelook.camera import make_camera
from freelook.gimbal import Stabiliser
from freelook.lens import Equidistant
from freelook.mailbox import Mailbox
from freelook.offset_finder import OffsetFinder
from freelook.simulation.camera import SimulatedCamera
from freelook.types import Attitude, Frame, Picture
from freelook.vehicle import Vehicle
from logged_flight import LoggedFlight, small_fisheye

DELAY_NS = 90_000_000
STEP_NS = 40_000_000
FRAMES = 80


def shaken() -> AttitudeTrack:
    times_s = np.arange(0, 4, 0.02)
    phases = times_s[:, None] * [5.1, 3.7, 6.9] + [[0.3, 1.0, 2.0]]
    slow = times_s[:, None] * [1.3, 2.2, 0.9]
    angles = 0.12 * np.sin(phases) + 0.1 * np.sin(slow + phases**1.2)
    return AttitudeTrack(
        np.round(times_s * 1e9).astype(np.int64), Rotation.from_euler("ZYX", angles)
    )


def test_the_offset_is_found_while_flying(wait_until: Callable[..., None]) -> None:
    track = shaken()
    camera = make_camera((160, 160), Equidistant(160 / np.radians(200)), field_deg=200)
    world = SimulatedCamera(camera, flight=LoggedFlight(track))
    source, frames = PushedAttitudes("waiting"), Mailbox[Frame]()
    used: list[int] = []
    live = LiveOffset(window_s=5)
    finder = OffsetFinder(source, camera, frames, used.append, live)
    stabiliser = Stabiliser()
    vehicle = Vehicle(stabiliser, finder)
    seen: list[Attitude] = []
    vehicle.start(seen.append)
    assert "not found yet" in finder.report
    index = 0
    for k in range(FRAMES):
        taken_ns = k * STEP_NS
        while track.times_ns[index] <= taken_ns + DELAY_NS:
            attitude = Attitude(int(track.times_ns[index]), track.world_from_body[index])
            source.push(attitude)
            wait_until(lambda want=attitude: seen and seen[-1] is want)
            index += 1
        frames.put(Frame(world.picture(taken_ns), taken_ns + DELAY_NS))
        wait_until(lambda k=k: finder._turns.counters["frames"] > k)
    wait_until(lambda: used)
    vehicle.close()
    # 160 pixels for 200 degrees; a frame is 40 ms
    assert abs(used[-1] + DELAY_NS) < 3_000_000
    assert "found; last look: confidence" in finder.report
    assert finder.counters["received"] == len(seen)
    assert finder.message == "waiting"
    assert frames.closed


def test_frames_that_do_not_fit_the_lens_are_told_and_attitudes_go_on(
    wait_until: Callable[..., None],
) -> None:
    source, frames = PushedAttitudes("waiting"), Mailbox[Frame]()
    finder = OffsetFinder(source, small_fisheye(), frames, lambda _: pytest.fail("no offset"))
    vehicle = Vehicle(Stabiliser(), finder)
    vehicle.start()
    wide = Picture("gray", (np.zeros((100, 300), np.uint8),))
    frames.put(Frame(wide, 1))
    wait_until(lambda: "not of the shape" in finder.report)
    source.push(Attitude(5, Rotation.identity()))
    wait_until(lambda: vehicle.status().received == 1)
    vehicle.close()


def test_whatever_a_picture_does_the_attitudes_go_on(
    wait_until: Callable[..., None], monkeypatch: pytest.MonkeyPatch
) -> None:
    def breaks(_turns: ImageTurns, _frame: Frame) -> None:
        raise RuntimeError("corners out of the picture")

    monkeypatch.setattr(ImageTurns, "push", breaks)
    source, frames = PushedAttitudes("waiting"), Mailbox[Frame]()
    finder = OffsetFinder(source, small_fisheye(), frames, lambda _: pytest.fail("no offset"))
    vehicle = Vehicle(Stabiliser(), finder)
    vehicle.start()
    frames.put(Frame(Picture("gray", (np.zeros((100, 100), np.uint8),)), 1))
    wait_until(lambda: "stopped: RuntimeError: corners out of" in finder.report)
    source.push(Attitude(5, Rotation.identity()))
    wait_until(lambda: vehicle.status().received == 1)
    vehicle.close()
