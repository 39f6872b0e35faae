"""Mounting: from known points, and from the horizon of simulated flights."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from freelook.calibration.horizon import Horizon, find_horizon
from freelook.calibration.mounting import (
    KnownPoint,
    LevelledFrame,
    Mounting,
    down_in_body,
    mounting_from_horizon,
    mounting_from_points,
)
from freelook.camera import Camera, make_camera
from freelook.clock import NS_PER_S
from freelook.errors import CalibrationError
from freelook.lens import Equidistant, Perspective
from freelook.rotations import angle_between_deg, body_from_view
from freelook.simulation.camera import SimulatedCamera, pixel_deg
from freelook.simulation.world import World
from freelook.sinks.picture import rgb24

PX_PER_DEG = 2.5
CENTER = (239.5, 239.5)


def fisheye(yaw_deg: float = 0, pitch_deg: float = 0, roll_deg: float = 0) -> Camera:
    """188 degrees on 480 x 480 pixels, mounted so."""
    return make_camera(
        (480, 480),
        Equidistant(float(np.degrees(PX_PER_DEG))),
        center=CENTER,
        field_deg=188,
        camera_from_body=body_from_view(yaw_deg, pitch_deg, roll_deg).inv(),
    )


def wrong_deg(mounting: Mounting, camera: Camera) -> float:
    return angle_between_deg(mounting.camera_from_body, camera.camera_from_body)


def test_a_camera_mounted_10_degrees_nose_down_gives_pitch_minus_10() -> None:
    """What is straight ahead of the vehicle is then seen 10 degrees above the middle."""
    ahead = KnownPoint((CENTER[0], CENTER[1] - 10 * PX_PER_DEG), yaw_deg=0, pitch_deg=0)
    in_the_middle = KnownPoint(CENTER, yaw_deg=0, pitch_deg=-10)
    right = KnownPoint((CENTER[0] + 90 * PX_PER_DEG, CENTER[1]), yaw_deg=90, pitch_deg=0)
    mounting = mounting_from_points(fisheye(), [ahead, in_the_middle, right])
    np.testing.assert_allclose(mounting.angles_deg, (0, -10, 0), atol=1e-9)


def test_a_camera_turned_to_the_right_gives_a_positive_yaw() -> None:
    """What is straight ahead is then left of the middle."""
    ahead = KnownPoint((CENTER[0] - 20 * PX_PER_DEG, CENTER[1]), 0, 0)
    below = KnownPoint((CENTER[0], CENTER[1] + 80 * PX_PER_DEG), 20, -80)
    mounting = mounting_from_points(fisheye(), [ahead, below])
    np.testing.assert_allclose(mounting.angles_deg, (20, 0, 0), atol=1e-9)


def test_a_camera_with_its_right_side_down_gives_a_positive_roll() -> None:
    """What is to the right of the vehicle is then seen to the upper right."""
    ahead = KnownPoint(CENTER, 0, 0)
    across = 80 * PX_PER_DEG * np.sqrt(0.5)
    right = KnownPoint((CENTER[0] + across, CENTER[1] - across), 80, 0)
    mounting = mounting_from_points(fisheye(), [ahead, right])
    np.testing.assert_allclose(mounting.angles_deg, (0, 0, 45), atol=1e-9)


def points_seen_by(camera: Camera, noise_px: float, rng: np.random.Generator) -> list[KnownPoint]:
    angles = [(-70, 5), (-30, -20), (0, 0), (25, 30), (60, -10), (10, -60)]
    found = []
    for yaw, pitch in angles:
        direction = body_from_view(yaw, pitch).apply([0, 0, 1])
        x, y = camera.project(camera.camera_from_body.apply(direction))
        x, y = np.array([x, y]) + rng.normal(0, noise_px, 2)
        found.append(KnownPoint((float(x), float(y)), yaw, pitch))
    return found


def test_the_stated_spread_is_the_real_one() -> None:
    """Over 300 clickings, squared errors are those of three normal variables: 3 +- 0.14 on
    average; the wide margin is for the noise being estimated from 12 numbers."""
    rng = np.random.default_rng(1)
    camera = fisheye(12, -25, 4)
    truth = np.array([12, -25, 4])
    off = []
    for _ in range(300):
        mounting = mounting_from_points(camera, points_seen_by(camera, 3.0, rng))
        off.append((np.array(mounting.angles_deg) - truth) / mounting.sigma_deg)
    assert 0.8 < np.mean(np.square(off)) < 1.5


def test_two_points_have_a_spread_too_though_they_fit() -> None:
    points = points_seen_by(fisheye(5, 0, 0), 0.0, np.random.default_rng(0))[:2]
    mounting = mounting_from_points(fisheye(), points)
    assert max(error for _, error in mounting.errors_deg) < 1e-6
    assert min(mounting.sigma_deg) > 0.2  # one pixel is 0.4 degrees


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([KnownPoint(CENTER, 0, 0)], "two are needed"),
        ([KnownPoint(CENTER, 0, 0), KnownPoint((3, 3), 80, 0)], "3,3 is outside"),
        ([KnownPoint(CENTER, 0, 0), KnownPoint((245, 239), 2, 0)], "5 degrees apart"),
        ([KnownPoint(CENTER, 0, 0), KnownPoint((400, 239), 20, 0)], "contradict"),
    ],
)
def test_points_that_do_not_do_are_named(points: list[KnownPoint], said: str) -> None:
    with pytest.raises(CalibrationError, match=said):
        mounting_from_points(fisheye(), points)


def test_down_in_a_banked_and_in_a_climbing_vehicle() -> None:
    forward, right, down = np.eye(3)
    np.testing.assert_allclose(down_in_body(0, 0), down, atol=1e-12)
    np.testing.assert_allclose(down_in_body(90, 0), right, atol=1e-12)  # on its right side
    np.testing.assert_allclose(down_in_body(0, 90), -forward, atol=1e-12)  # on its tail
    turn = Rotation.from_euler("ZYX", [50, 20, 30], degrees=True)
    np.testing.assert_allclose(down_in_body(30, 20), turn.inv().apply(down), atol=1e-12)


# --- the horizon -----------------------------------------------------------------------------

TIMES_S = (0, 9, 25, 40)  # roll 0, -18, -20, 8; pitch 0, 10, -11, 4
Shot = tuple[NDArray[np.uint8], float, float]  # picture, roll, pitch


@cache
def flight(yaw_deg: float, pitch_deg: float, roll_deg: float) -> tuple[Camera, list[Shot]]:
    camera = fisheye(yaw_deg, pitch_deg, roll_deg)
    simulated = SimulatedCamera(camera, World(pixel_deg(camera)))
    shots = []
    for time_s in TIMES_S:
        turn = simulated.truth(time_s * NS_PER_S).world_from_body
        _, pitch, roll = turn.as_euler("ZYX", degrees=True)
        shots.append((rgb24(simulated.picture(time_s * NS_PER_S)), float(roll), float(pitch)))
    return camera, shots


def frames_of(camera: Camera, shots: list[Shot], told: Rotation) -> list[LevelledFrame]:
    return [
        LevelledFrame(f"shot {i}", find_horizon(rgb, camera, told.apply(down_in_body(r, p))), r, p)
        for i, (rgb, r, p) in enumerate(shots)
    ]


MOUNTS = [(5, -10, 3), (0, -60, 0), (40, 20, 90)]


@pytest.mark.parametrize("mount", MOUNTS, ids=str)
def test_the_horizon_of_simulated_frames_is_found(mount: tuple[float, float, float]) -> None:
    """To 0.15 degrees, a third of a pixel of this camera, though told 15 degrees wrong. Hills of
    up to 7 degrees stand on it, trees and towers in front of it."""
    camera, shots = flight(*mount)
    wrong = Rotation.from_euler("xyz", [15, -12, 5], degrees=True)
    for frame in frames_of(camera, shots, wrong * camera.camera_from_body):
        down = camera.camera_from_body.apply(frame.down_in_body)
        across = np.linalg.norm(np.cross(down, frame.horizon.down_in_camera))
        assert np.degrees(np.arcsin(across)) < 0.15
        assert frame.horizon.down_in_camera @ down > 0
        assert -1.5 < frame.horizon.height_deg < 0  # haze covers the last of the ground


@pytest.mark.parametrize("mount", MOUNTS, ids=str)
def test_the_mounting_is_found_from_the_horizon(mount: tuple[float, float, float]) -> None:
    """To 0.3 degrees, yaw included, since the vehicle banks and pitches; within 3 sigma."""
    camera, shots = flight(*mount)
    yaw, pitch, roll = mount
    told = body_from_view(yaw - 9, pitch + 8, roll - 7).inv()
    mounting = mounting_from_horizon(frames_of(camera, shots, told), told)
    assert mounting.yaw_found
    assert wrong_deg(mounting, camera) < 0.3
    off = (np.array(mounting.angles_deg) - mount) / mounting.sigma_deg
    assert np.abs(off).max() < 3
    assert not mounting.dropped


def test_one_frame_leaves_the_yaw_as_told() -> None:
    camera, shots = flight(*MOUNTS[0])
    told = body_from_view(5, 0, 0).inv()
    mounting = mounting_from_horizon(frames_of(camera, shots[:1], told), told)
    assert not mounting.yaw_found
    np.testing.assert_allclose(mounting.angles_deg, MOUNTS[0], atol=0.3)


def test_a_yaw_that_is_held_stays() -> None:
    camera, shots = flight(*MOUNTS[0])
    told = body_from_view(5, 0, 0).inv()
    mounting = mounting_from_horizon(frames_of(camera, shots, told), told, hold_yaw=True)
    assert not mounting.yaw_found
    assert mounting.angles_deg[0] == pytest.approx(5, abs=0.05)
    assert wrong_deg(mounting, camera) < 0.3


def test_a_frame_with_a_wrong_attitude_is_dropped_and_named() -> None:
    camera, shots = flight(*MOUNTS[0])
    frames = frames_of(camera, shots, camera.camera_from_body)
    wrong = LevelledFrame("late", frames[2].horizon, frames[2].roll_deg + 12, frames[2].pitch_deg)
    mounting = mounting_from_horizon([*frames[:2], wrong, frames[3]], camera.camera_from_body)
    assert [name for name, _ in mounting.dropped] == ["late"]
    assert wrong_deg(mounting, camera) < 0.3


def test_attitudes_of_other_frames_are_no_attitudes() -> None:
    camera, shots = flight(*MOUNTS[0])
    frames = frames_of(camera, shots, camera.camera_from_body)
    swapped = [
        LevelledFrame(f.name, f.horizon, -2 * f.roll_deg - 5, -3 * f.pitch_deg) for f in frames
    ]
    with pytest.raises(CalibrationError, match="contradict each other"):
        mounting_from_horizon(swapped, camera.camera_from_body)


def test_no_frames_no_mounting() -> None:
    with pytest.raises(CalibrationError, match="no frame"):
        mounting_from_horizon([], fisheye().camera_from_body)


def test_gray_pictures_do_too_where_the_ground_is_dark() -> None:
    camera, shots = flight(*MOUNTS[0])
    rgb, roll, pitch = shots[0]
    gray = np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), np.uint8)
    down = camera.camera_from_body.apply(down_in_body(roll, pitch))
    found = find_horizon(gray, camera, down)
    assert np.degrees(np.arccos(min(1.0, float(found.down_in_camera @ down)))) < 0.3


def plain(camera: Camera, down: NDArray[np.float64]) -> NDArray[np.uint8]:
    """A picture of nothing but light sky and dark ground."""
    width, height = camera.size
    rays = camera.ray(np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).astype(float))
    level = np.nan_to_num(rays) @ down
    return np.where(level > 0, 60, 200).astype(np.uint8)


def test_narrow_lenses_see_a_horizon_too() -> None:
    camera = make_camera((640, 360), Perspective(400.0))
    down = body_from_view(0, 12, 20).inv().apply([0, 0, 1])
    found = find_horizon(plain(camera, down), camera, np.array([0, 1.0, 0]))
    # an edge of whole pixels, 0.14 degrees wide, over 75 degrees
    assert np.degrees(np.arccos(min(1.0, float(found.down_in_camera @ down)))) < 0.2


def test_a_night_has_no_horizon() -> None:
    night = np.full((480, 480), 9, np.uint8)
    with pytest.raises(CalibrationError, match="same colour"):
        find_horizon(night, fisheye(), np.array([0, 1.0, 0]))


def test_a_room_has_no_horizon() -> None:
    rng = np.random.default_rng(4)
    blobs = cv2.GaussianBlur(rng.normal(0, 1, (480, 480)), (0, 0), 20)
    room = np.clip(128 + 900 * blobs, 0, 255).astype(np.uint8)
    with pytest.raises(CalibrationError, match=r"skyline|circle"):
        find_horizon(room, fisheye(), np.array([0, 1.0, 0]))


def test_a_horizon_where_none_can_be_is_said() -> None:
    camera = make_camera((640, 360), Perspective(600.0))
    with pytest.raises(CalibrationError, match="tell how the camera is mounted"):
        find_horizon(np.zeros((360, 640), np.uint8), camera, np.array([0, 0, 1.0]), 20)


def test_a_picture_of_another_size_is_refused() -> None:
    with pytest.raises(CalibrationError, match="320 x 240 pixels, the lens profile for 480 x 480"):
        find_horizon(np.zeros((240, 320), np.uint8), fisheye(), np.array([0, 1.0, 0]))


def test_a_camera_that_looks_straight_down_needs_no_yaw() -> None:
    """There yaw and roll are one; the picture stays turned as it was told."""
    down = np.array([0, 0, 1.0])
    turn = np.radians(np.arange(0, 360, 3.0))
    level = np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)], axis=-1)
    tilted = Rotation.from_euler("x", 4, degrees=True)
    horizon = Horizon(tilted.apply(down), 0.0, tilted.apply(level), 360.0, 1.0)
    told = body_from_view(0, -90, 30).inv()
    mounting = mounting_from_horizon([LevelledFrame("one", horizon, 0, 0)], told)
    assert angle_between_deg(mounting.camera_from_body, told) == pytest.approx(4, abs=0.05)
