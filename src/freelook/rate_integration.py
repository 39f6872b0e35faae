"""Attitude from a gyroscope and an accelerometer alone, for a whole recording at once.

The gyroscope's rates are integrated; what that drifts away in roll and pitch is taken off with
the accelerometer, which feels gravity on average: accelerations are turned into the integrated,
slowly drifting frame, where gravity hardly moves, and smoothed there (the idea of VQF: Laidig and
Seel, arXiv 2203.17024; here with a window that looks both ways, which a recording allows).

Heading has no such reference: it starts at 0 and drifts by the gyroscope's bias.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
GRAVITY_M_S2 = 9.80665
GRAVITY_WINDOW_S = 5.0  # standard deviation; longer than turns last, shorter than drift matters
_GRID_S = 0.05
_TRUSTED_WITHIN = 0.25  # of gravity: an accelerometer that feels more than itself is doubted


def integrated(times_s: Floats, rates: Floats) -> Rotation:
    """start_from_body at n times (n,), from body rates (n, 3) in rad/s; the first is identity.

    Between two samples the mean of both rates acts. All products are formed by doubling: log2(n)
    passes over arrays.
    """
    steps = 0.5 * (rates[:-1] + rates[1:]) * np.diff(times_s)[:, None]
    turns = Rotation.from_rotvec(np.concatenate([np.zeros((1, 3)), steps]))
    reach = 1
    while reach < len(times_s):
        further = turns[:-reach] * turns[reach:]
        turns = Rotation.concatenate([turns[:reach], further])
        reach *= 2
    return turns


def levelled(times_s: Floats, start_from_body: Rotation, accelerations: Floats) -> Rotation:
    """world_from_body (north east down), with what an accelerometer felt (n, 3), m/s^2, in body
    axes; at rest it feels gravity's reaction, upwards. Heading is 0 at the first sample.

    Rows that are NaN are not used; all NaN, or never about 1 g, leaves the first attitude as
    level as it came.
    """
    felt = start_from_body.apply(np.nan_to_num(accelerations))
    strength = np.linalg.norm(felt, axis=1) / GRAVITY_M_S2
    trust = np.exp(-0.5 * ((strength - 1) / _TRUSTED_WITHIN).clip(-30, 30) ** 2)
    trust[~np.isfinite(accelerations).all(axis=1)] = 0.0
    if trust.max() < 1e-3:
        return _headed(start_from_body)
    up = _smoothed(times_s, felt, trust)
    return _headed(_turning_up(up) * start_from_body)


def _smoothed(times_s: Floats, felt: Floats, trust: Floats) -> Floats:
    """The trusted mean of a vector (n, 3) in a Gaussian window round each time."""
    grid_s = np.arange(times_s[0], times_s[-1] + _GRID_S, _GRID_S)
    sigma = GRAVITY_WINDOW_S / _GRID_S
    weight = np.interp(grid_s, times_s, trust) + 1e-9
    columns = []
    total = gaussian_filter1d(weight, sigma, mode="constant")
    for column in felt.T:
        weighted = weight * np.interp(grid_s, times_s, column)
        mean = gaussian_filter1d(weighted, sigma, mode="constant") / total
        columns.append(np.interp(times_s, grid_s, mean))
    return np.stack(columns, axis=-1)


def _turning_up(up: Floats) -> Rotation:
    """The shortest turns that bring the directions (n, 3) to up, which is -z here."""
    unit = up / np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-9)
    x, y, z = unit.T
    # half-way quaternion (w, axis): 1 + u.t and u x t, for t = (0, 0, -1)
    quaternion = np.stack([-y, x, np.zeros_like(x), 1 - z], axis=-1)
    upside_down = np.linalg.norm(quaternion, axis=1) < 1e-6
    quaternion[upside_down] = [1, 0, 0, 0]
    return Rotation.from_quat(quaternion)


def _headed(world_from_body: Rotation) -> Rotation:
    """The same with the first sample's nose (or, nose up or down, its belly) to the north."""
    first = world_from_body[0].as_matrix()
    nose = first[:, 0] if np.hypot(first[0, 0], first[1, 0]) > 0.1 else first[:, 2]
    heading = float(np.arctan2(nose[1], nose[0]))
    return Rotation.from_euler("Z", -heading) * world_from_body
