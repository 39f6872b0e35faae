"""The flight: smooth, closed, nose along the path, banked so that nobody slides sideways."""

from __future__ import annotations

import numpy as np
import pytest

from freelook.simulation.flight import GRAVITY_M_S2, FigureEight, Hover
from freelook.simulation.scene import airfield

TIMES_NS = np.arange(0, 72, 0.9) * 1e9
STEP_NS = 1_000_000


def numbers_at(t_ns: float) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and acceleration by differences."""
    before, here, after = (FigureEight().at(int(t_ns) + d).position for d in (-STEP_NS, 0, STEP_NS))
    step_s = STEP_NS / 1e9
    return (after - before) / (2 * step_s), (after - 2 * here + before) / step_s**2


def test_it_comes_back_and_never_ends() -> None:
    flight = FigureEight(period_s=40.0)
    here, later = flight.at(3_000_000_000), flight.at(3_000_000_000 + 7 * 40_000_000_000)
    assert later.position == pytest.approx(here.position, abs=1e-6)
    assert (later.world_from_body.inv() * here.world_from_body).magnitude() < 1e-6
    assert flight.at(-1).position == pytest.approx(flight.at(0).position, abs=1e-3)


@pytest.mark.parametrize("t_ns", TIMES_NS)
def test_the_nose_follows_the_path(t_ns: float) -> None:
    velocity, _ = numbers_at(t_ns)
    forward = FigureEight().at(int(t_ns)).world_from_body.apply([1.0, 0, 0])
    assert forward == pytest.approx(velocity / np.linalg.norm(velocity), abs=1e-4)


def test_turns_are_coordinated() -> None:
    """Gravity and the turn together press straight down through the floor, give or take the
    climb; left turns bank left."""
    banks = []
    for t_ns in TIMES_NS:
        _, acceleration = numbers_at(t_ns)
        body = FigureEight().at(int(t_ns)).world_from_body
        felt = body.inv().apply(np.array([0, 0, GRAVITY_M_S2]) - acceleration)
        assert abs(felt[1]) < 0.5
        banks.append(np.degrees(np.arcsin(body.apply([0.0, 1, 0])[2])))
    assert max(banks) > 15
    assert min(banks) < -15
    assert max(map(abs, banks)) < 50


def test_it_stays_above_the_ground_and_over_the_airfield() -> None:
    places = np.array([FigureEight().at(int(t)).position for t in TIMES_NS])
    assert (places[:, 2] < -30).all()
    assert np.abs(places[:, :2]).max() < 400
    assert np.ptp(places[:, 2]) > 20


def test_it_begins_northward_over_the_runway() -> None:
    state = FigureEight().at(0)
    assert state.position[:2] == pytest.approx([0, 0])
    assert state.world_from_body.apply([1.0, 0, 0])[0] > 0.8


def test_hovering() -> None:
    state = Hover((1.0, 2.0, -3.0), azimuth_deg=90).at(123)
    assert state.position.tolist() == [1, 2, -3]
    assert state.world_from_body.apply([1.0, 0, 0]) == pytest.approx([0, 1, 0])


def test_it_flies_into_nothing() -> None:
    scene = airfield()
    things = scene.rows[scene.flat :, :4].astype(float)
    for t_ns in TIMES_NS:
        away = np.linalg.norm(things[:, :3] - FigureEight().at(int(t_ns)).position, axis=1)
        assert (away > things[:, 3] + 10).all()
