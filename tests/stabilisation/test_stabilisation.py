"""Smoothed paths, views kept in the lens, and the modes, on motions known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from freelook.attitude_track import AttitudeTrack
from freelook.camera import Camera, make_camera
from freelook.errors import AttitudeError
from freelook.lens import Equidistant
from freelook.rotations import FRD_FROM_RDF, angle_between_deg, body_from_view
from freelook.stabilisation.containment import Containment, eased, widest_hfov_deg
from freelook.stabilisation.smooth_aim import STEP_NS, Flight, SmoothAim
from freelook.stabilisation.smoothing import smoothed
from freelook.viewport import Viewport

TIMES_S = np.arange(0, 40, 0.01)
VIEW = Viewport((64, 48), 80.0)


def ahead(_t_ns: int) -> Rotation:
    return body_from_view(0, 0)


def track_of_euler(yaw_pitch_roll_deg: np.ndarray) -> AttitudeTrack:
    turned = Rotation.from_euler("ZYX", yaw_pitch_roll_deg, degrees=True)
    return AttitudeTrack(np.round(TIMES_S * 1e9).astype(np.int64), turned)


def rolling(amplitude_deg: float, hz: float) -> AttitudeTrack:
    angles = np.zeros((len(TIMES_S), 3))
    angles[:, 2] = amplitude_deg * np.sin(2 * np.pi * hz * TIMES_S)
    return track_of_euler(angles)


def fisheye(field_deg: float = 200.0) -> Camera:
    return make_camera((200, 200), Equidistant(200 / np.radians(field_deg)), field_deg=field_deg)


def views_of(aim: SmoothAim, count: int) -> Rotation:
    return Rotation.concatenate([aim(k * STEP_NS) for k in range(count)])


# --- the low-pass filter


@pytest.mark.parametrize(
    ("hz", "gain"), [(0.125, 0.978), (0.25, 0.917), (0.5, 0.707), (1.0, 0.25), (2.0, 0.004)]
)
def test_the_cut_off_is_where_it_is_said_to_be(hz: float, gain: float) -> None:
    path = smoothed(rolling(10, hz), 0.5)
    middle = np.round(np.arange(12, 28, 0.01) * 1e9).astype(np.int64)
    roll = path.at(middle).as_euler("ZYX", degrees=True)[:, 2]
    wave = np.exp(-2j * np.pi * hz * middle / 1e9)
    found = 2 * np.mean(roll * wave) / 10
    # sin has the phase -90 degrees; a delay would show as another one
    assert abs(found) == pytest.approx(gain, abs=0.01)
    if gain > 0.01:
        assert np.degrees(np.angle(found)) == pytest.approx(-90, abs=0.5)


def test_a_steady_turn_through_all_headings_is_left_alone() -> None:
    angles = np.zeros((len(TIMES_S), 3))
    angles[:, 0] = 90 * TIMES_S
    turning = track_of_euler(angles)
    path = smoothed(turning, 0.2)
    middle = np.round(np.arange(10, 30, 0.1) * 1e9).astype(np.int64)
    apart = (path.at(middle).inv() * turning.at(middle)).magnitude()
    assert np.degrees(apart.max()) < 0.01


def test_a_vehicle_at_rest_stays_where_it_is() -> None:
    still = track_of_euler(np.tile([30.0, -10.0, 5.0], (len(TIMES_S), 1)))
    path = smoothed(still, 0.5)
    assert (
        np.degrees((path.world_from_body.inv() * still.world_from_body[0]).magnitude().max()) < 1e-5
    )


@pytest.mark.parametrize("cutoff_hz", [0.0, -1.0, 11.0, float("nan")])
def test_impossible_cut_offs_are_refused(cutoff_hz: float) -> None:
    with pytest.raises(AttitudeError, match=r"0\.02 to 10 Hz"):
        smoothed(rolling(1, 1), cutoff_hz)


# --- the lens


def test_a_view_is_whole_until_its_corner_leaves_the_lens() -> None:
    containment = Containment(fisheye(180), VIEW)
    x, y = 32 / VIEW.focal_px, 24 / VIEW.focal_px
    for pitch_deg in (-50.0, -20.0, 0.0, 20.0, 50.0):
        for yaw_deg in range(0, 90, 2):
            view = body_from_view(yaw_deg, pitch_deg)
            corners = view.apply([[sx * x, sy * y, 1] for sx in (-1, 1) for sy in (-1, 1)])
            inside = bool((corners[:, 0] > 1e-3).all())  # in front of the plane of the lens
            outside = bool((corners[:, 0] < -1e-3).any())
            found = bool(containment.holds(Rotation.concatenate([view]))[0])
            assert found == inside or not (inside or outside)


def test_the_largest_fraction_reaches_the_edge_and_not_beyond() -> None:
    containment = Containment(fisheye(180), VIEW)
    raw = Rotation.concatenate([body_from_view(yaw, 0) for yaw in (0, 0, 0, 80)])
    wanted = Rotation.concatenate([body_from_view(yaw, 0) for yaw in (20, 90, 170, 100)])
    fractions = containment.largest_fractions(raw, wanted)
    assert fractions[0] == 1.0
    assert fractions[3] == 0.0  # neither the raw view is whole nor any other
    reached = fractions[1] * 90
    assert 40 < reached < 52
    assert fractions[2] * 170 == pytest.approx(reached, abs=0.3)  # halved ten times
    for step, whole in ((-0.3, True), (0.3, False)):
        view = Rotation.concatenate([body_from_view(reached + step, 0)])
        assert containment.holds(view)[0] == whole


def test_a_sensor_that_cuts_the_circle_limits_too() -> None:
    wide = make_camera((200, 100), Equidistant(200 / np.radians(180)), field_deg=180)
    view = Rotation.concatenate([body_from_view(0, 0), body_from_view(0, 30)])
    assert Containment(wide, VIEW).holds(view).tolist() == [True, False]


def test_the_widest_view_is_told() -> None:
    widest = widest_hfov_deg(fisheye(120), Viewport((64, 48), 150), body_from_view(0, 0))
    assert widest is not None
    x = np.tan(np.radians(widest) / 2)
    assert np.degrees(np.arctan(np.hypot(x, 0.75 * x))) == pytest.approx(60, abs=0.7)
    assert widest_hfov_deg(fisheye(120), VIEW, body_from_view(90, 0)) is None


def test_an_eased_curve_is_smooth_and_nowhere_higher(rng: np.random.Generator) -> None:
    allowed = np.where(rng.random(400) < 0.02, rng.random(400), 1.0)
    curve = eased(allowed, 15)
    assert (curve <= allowed).all()
    assert np.abs(np.diff(curve)).max() <= 1 / 31 + 1e-9
    assert curve.max() == pytest.approx(1.0)
    assert eased(np.ones(5), 0).tolist() == [1.0] * 5


# --- the aim


def test_smooth_takes_out_what_is_quick_and_nothing_else() -> None:
    angles = np.zeros((len(TIMES_S), 3))
    angles[:, 0] = 5 * TIMES_S
    angles[:, 2] = 10 * np.sin(2 * np.pi * 3 * TIMES_S)
    track = track_of_euler(angles)
    aim = SmoothAim(Flight(track, 5 * 10**9, 25), ahead, fisheye(), VIEW, 0.5)
    assert aim.limited == 0.0
    for k in range(0, 700, 31):
        seen = track.at(np.array([k * STEP_NS + 5 * 10**9]))[0] * aim(k * STEP_NS)
        yaw, pitch, roll = (seen * FRD_FROM_RDF.inv()).as_euler("ZYX", degrees=True)
        assert yaw == pytest.approx(5 * (k * STEP_NS / 1e9 + 5), abs=0.05)
        assert abs(pitch) < 0.05
        assert abs(roll) < 0.05


def test_smooth_never_shows_what_the_lens_does_not_see() -> None:
    """Sways by 70 degrees: the smoothed view would look far beyond a lens of 180."""
    angles = np.zeros((len(TIMES_S), 3))
    angles[:, 0] = 70 * np.sin(2 * np.pi * 0.4 * TIMES_S) * (TIMES_S > 15)
    track, camera = track_of_euler(angles), fisheye(180)
    flight, containment = Flight(track, 0, 28), Containment(camera, VIEW)
    boundless = SmoothAim(flight, ahead, fisheye(280), VIEW, 0.05)
    assert not containment.holds(views_of(boundless, 800)).all()
    aim = SmoothAim(flight, ahead, camera, VIEW, 0.05)
    views = views_of(aim, 800)
    assert containment.holds(views).all()
    assert 0.3 < aim.limited < 0.8
    quiet = views[30:100]  # long before the first swing nothing is drawn back
    assert angle_between_deg(quiet[0], quiet[-1]) < 0.01
    seen = track.at(np.arange(800) * STEP_NS) * views
    steps = np.degrees((seen[:-1].inv() * seen[1:]).magnitude())
    assert steps.max() < 7  # a frame; it swings by 5.9 a frame itself


def test_a_view_that_never_fits_is_refused_with_one_that_does() -> None:
    flight = Flight(rolling(5, 1), 0, 30)
    with pytest.raises(AttitudeError, match=r"try --hfov 10[0-9]"):
        SmoothAim(flight, ahead, fisheye(120), Viewport((64, 48), 140))
    with pytest.raises(AttitudeError, match="look elsewhere"):
        SmoothAim(flight, lambda _: body_from_view(150, 0), fisheye(120), VIEW)


def test_where_the_attitude_is_unknown_the_view_is_the_vehicle_s() -> None:
    track = rolling(20, 0.5)
    kept = (track.times_ns < 10**10) | (track.times_ns > 2 * 10**10)
    holed = AttitudeTrack(track.times_ns[kept], track.world_from_body[kept])
    aim = SmoothAim(Flight(holed, -5 * 10**9, 40), ahead, fisheye(), VIEW, 0.1)
    views = views_of(aim, 1200)
    raw = np.degrees((views.inv() * body_from_view(0, 0)).magnitude())
    assert raw[:147].max() == 0  # until 0.1 s before the log begins
    assert raw[455:745].max() == 0  # in the hole, from 15 to 25 s
    assert raw[200:400].max() > 15
    assert aim.unknown == pytest.approx(15 / 40, abs=0.01)
    steps = np.degrees((views[:-1].inv() * views[1:]).magnitude())
    assert steps.max() < 20 * 2 * np.pi * 0.5 / 30 + 20 / 15  # its own motion, and the easing


def test_a_log_that_ends_with_the_last_frame_is_enough() -> None:
    track = rolling(20, 2)
    aim = SmoothAim(Flight(track, 0, 40), ahead, fisheye(), VIEW, 0.3)
    assert aim.unknown == 0
    assert aim.limited == 0


def test_a_log_of_another_time_is_refused() -> None:
    flight = Flight(rolling(1, 1), -100 * 10**9, 20)
    with pytest.raises(AttitudeError, match=r"from 0\.000 to 39\.990 s .* begins at -100\.000 s"):
        SmoothAim(flight, ahead, fisheye(), VIEW)
