"""What the learned predictor sees of a movement: numbers that are the same in every direction.

The rates of the last 0.4 seconds are looked at in a frame that belongs to the movement itself:

    first axis   the one the head turns about now
    second axis  where that axis is going: the change of the rate across the first axis
    third axis   completes them

and divided by the speed. So a turn to the left is the same as one to the right or upwards, and
what was learned from one head in one place holds for others. All that is left of the world is how
upright the three axes are, because heads turn about their vertical in another way than they nod.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..lens import Floats
from .history import PoseHistory

# Ends of the stretches over which mean rates are taken, seconds before the newest pose.
AGES_S: Floats = np.array([*(np.arange(1, 9) / 60.0), 1 / 6, 0.2, 0.25, 0.3, 0.4])
# Besides them the newest poses themselves, so that the jitter of their times can be seen through.
KNOTS = 4
KNOT_SPACING_S = 0.012  # poses closer than that are passed over
STEPS = 3
USUAL_STEP_S = 0.0168
SLOW_DEG_S = 3.0  # added to speeds that something is divided by
LIMIT = 4.0
NAN_FREE = 1e-9


@dataclass(frozen=True)
class Features:
    """inputs       what the network gets, (n,)
    axes         the frame's axes as rows, in the newest view (3, 3)
    speed_deg_s  about the first axis, and `SLOW_DEG_S`
    rate_deg_s   of the newest pose against the one before, in the newest view (3,)"""

    inputs: Floats
    axes: Floats
    speed_deg_s: float
    rate_deg_s: Floats


def features(history: PoseHistory) -> Features | None:
    """None until there are two poses far enough apart to have a rate."""
    knots_s = knot_ages_s(history.ages_s())
    if knots_s is None:
        return None
    past = history.past_deg(np.concatenate([AGES_S, knots_s]))
    rates = mean_rates(past[: len(AGES_S)], AGES_S)
    knot_rates = mean_rates(past[len(AGES_S) :], knots_s)
    assert history.newest is not None
    up = _up(history.newest.body_from_view.as_quat())
    axes = movement_axes(rates, up)
    speed = float(np.linalg.norm(rates[0] + rates[1]) / 2.0) + SLOW_DEG_S
    steps_s = _steps(knots_s)
    in_plane = rates @ axes[:2].T / speed
    knots_in_plane = knot_rates @ axes[:2].T / speed
    inputs: list[Floats] = [
        in_plane.T.ravel(),
        knots_in_plane.ravel(),
        np.array([np.log(speed) - 3.5]),
        (steps_s[:STEPS] - USUAL_STEP_S) * 200.0,
        # the same rates if the tracker's steps had been of one length
        (knots_in_plane * (steps_s / USUAL_STEP_S)[:, None]).ravel(),
        np.abs(axes @ up),
    ]
    return Features(np.clip(np.concatenate(inputs), -LIMIT, LIMIT), axes, speed, knot_rates[0])


def knot_ages_s(ages_s: Floats) -> Floats | None:
    """Ages of the `KNOTS` newest poses before the newest that lie far enough apart.

    Where the history ends earlier they go on in its last step.
    """
    knots: list[float] = []
    for age_s in ages_s[-2::-1]:
        if age_s - (knots[-1] if knots else 0.0) >= KNOT_SPACING_S:
            knots.append(float(age_s))
            if len(knots) == KNOTS:
                return np.array(knots)
    if not knots:
        return None
    step_s = knots[-1] - (knots[-2] if len(knots) > 1 else 0.0)
    while len(knots) < KNOTS:
        knots.append(knots[-1] + step_s)
    return np.array(knots)


def mean_rates(past_deg: Floats, ages_s: Floats) -> Floats:
    """Degrees per second over the stretches that end at these ages, newest first, (n, 3)."""
    return -_steps(past_deg) / _steps(ages_s)[:, None]


def movement_axes(rates_deg_s: Floats, up: Floats) -> Floats:
    """The frame above, its axes as rows."""
    now = 0.5 * (rates_deg_s[0] + rates_deg_s[1])
    first = _unit(now, np.array([0.0, 1.0, 0.0]))
    change = now - rates_deg_s[3:6].sum(axis=0) / 3.0
    across = _unit(_without(up, first), _without(np.array([1.0, 0.0, 0.0]), first))
    second = _unit(_without(change, first), across)
    return np.array([first, second, _cross(first, second)])


def _steps(values: Floats) -> Floats:
    """Differences from row to row, the first one from 0."""
    steps = values.copy()
    steps[1:] -= values[:-1]
    return steps


def _up(quat: Floats) -> Floats:
    """The vehicle's up (-z of the body) in the view, from body_from_view as x, y, z, w."""
    x, y, z, w = quat.tolist()
    return np.array([2 * (w * y - x * z), -2 * (y * z + w * x), 2 * (x * x + y * y) - 1])


def _cross(a: Floats, b: Floats) -> Floats:
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _without(vector: Floats, axis: Floats) -> Floats:
    return vector - (vector @ axis) * axis


def _unit(vector: Floats, otherwise: Floats) -> Floats:
    """`otherwise` (not of unit length) for a vector too short to have a direction."""
    for candidate in (vector, otherwise):
        if (length := float(np.linalg.norm(candidate))) > NAN_FREE:
            return candidate / length
    return np.array([0.0, 0.0, 1.0])
