"""Attitude from a gyroscope and an accelerometer alone, for a whole recording at once.

The gyroscope's rates are integrated; what that drifts away in roll and pitch is taken off with
the accelerometer, which feels gravity on average: accelerations are turned into the integrated,
slowly drifting frame, where gravity hardly moves, and smoothed there (the idea of VQF: Laidig and
Seel, arXiv 2203.17024; here with a window that looks both ways, which a recording allows).

Before that the gyroscope's constant bias is found: where the rates stay small and the same for
seconds it is they, elsewhere it is told by how gravity seems to turn in the integrated frame.

Heading has no such reference: it starts at 0 and drifts by what is left of the bias.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]
GRAVITY_M_S2 = 9.80665
GRAVITY_WINDOW_S = 5.0  # standard deviation; longer than turns last, shorter than drift matters
BIAS_RAD_S = float(np.radians(1.0))  # expected, one standard deviation
WANDER_RAD = 0.1  # of what is felt round gravity, while a vehicle manoeuvres: as much as 1 m/s^2
WANDER_S = 5.0  # and for how long it does so in one direction
_PIECE_S = 30.0
# quiet: means over half a second stay within so much of each other for three seconds
_BLOCK_S, _BLOCKS = 0.5, 6
_QUIET_RAD_S = float(np.radians(0.5))
_SLOWEST_TURN_RAD_S = float(np.radians(0.3))  # that may be hidden in what looks like rest
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


def gyro_bias(times_s: Floats, rates: Floats, accelerations: Floats) -> Floats:
    """What the gyroscope shows at rest (3,), rad/s, by least squares.

    A vehicle that turns steadily and as slowly as a bias for all of three seconds looks like one
    at rest; of such seconds the mean is taken, good to `_SLOWEST_TURN_RAD_S` every five.

    While integrating, gravity seems to turn by the integral of the bias. That is fitted in pieces
    of half a minute, against a gyroscope's usual bias (`BIAS_RAD_S`) and against accelerations of
    the vehicle (`WANDER_RAD` for `WANDER_S`), which look alike for a while: so the short record of
    a vehicle that speeds up says little, and little is taken off. About the vertical gravity says
    nothing; a vehicle that is never at rest keeps its bias there.
    """
    bias = np.zeros(3)
    quiet, quiet_s = _quiet_rate(times_s, rates)
    still = quiet_s / WANDER_S / _SLOWEST_TURN_RAD_S**2
    for _ in range(2):  # the second time with smaller angles
        turned = integrated(times_s, rates - bias)
        felt, trust = _felt(turned, accelerations)
        grid_s = np.arange(times_s[0], times_s[-1], _GRID_S)
        place = np.minimum(np.searchsorted(times_s, grid_s), len(times_s) - 1)
        integral = np.cumsum(turned[place].as_matrix(), axis=0) * _GRID_S
        information = np.eye(3) * (1 / BIAS_RAD_S**2 + still)
        pull = still * (quiet - bias) - bias / BIAS_RAD_S**2  # `bias` is there already
        size = round(_PIECE_S / _GRID_S)
        for first in range(0, len(grid_s), size):
            piece = slice(first, first + size)
            more, force = _piece(felt[place[piece]], trust[place[piece]], integral[piece])
            information, pull = information + more, pull + force
        bias = bias + np.linalg.solve(information, pull)
    return bias


def _quiet_rate(times_s: Floats, rates: Floats) -> tuple[Floats, float]:
    """The mean rate (3,) while nothing seems to turn, and for how many seconds."""
    edges = np.arange(times_s[0], times_s[-1], _BLOCK_S)
    starts = np.unique(np.searchsorted(times_s, edges))
    counts = np.diff(np.append(starts, len(times_s)))
    means = np.add.reduceat(rates, starts, axis=0) / counts[:, None]
    if len(means) < _BLOCKS:
        return np.zeros(3), 0.0
    windows = np.lib.stride_tricks.sliding_window_view(means, _BLOCKS, axis=0)
    same = np.ptp(windows, axis=2).max(axis=1) < _QUIET_RAD_S
    slow = np.linalg.norm(windows.mean(axis=2), axis=1) < 2.5 * BIAS_RAD_S
    quiet = np.convolve(same & slow, np.ones(_BLOCKS), mode="full") > 0
    if not quiet.any():
        return np.zeros(3), 0.0
    return means[quiet].mean(axis=0), float(quiet.sum() * _BLOCK_S)


def _piece(felt: Floats, trust: Floats, integral: Floats) -> tuple[Floats, Floats]:
    """What a piece says about the bias: information (3, 3), and the same times the bias (3,)."""
    weight = trust * (_GRID_S / WANDER_S) / WANDER_RAD**2
    total = float(weight.sum())
    if total < 1e-6:
        return np.zeros((3, 3)), np.zeros(3)
    share = weight / total
    up = share @ felt
    length = float(np.linalg.norm(up))
    if length < 0.1 * GRAVITY_M_S2:
        return np.zeros((3, 3)), np.zeros(3)
    up = up / length
    # felt = up + (integral b) x up: what b makes of it, and what is seen, about their means
    x, y, z = up
    across = np.array([[0, z, -y], [-z, 0, x], [y, -x, 0]])
    made = across @ (integral - np.einsum("n,nij->ij", share, integral))
    seen = felt / GRAVITY_M_S2 - (share @ felt) / GRAVITY_M_S2
    information = np.einsum("nki,n,nkj->ij", made, weight, made)
    return information, np.einsum("nki,n,nk->i", made, weight, seen)


def levelled(times_s: Floats, start_from_body: Rotation, accelerations: Floats) -> Rotation:
    """world_from_body (north east down), with what an accelerometer felt (n, 3), m/s^2, in body
    axes; at rest it feels gravity's reaction, upwards. Heading is 0 at the first sample.

    Rows that are NaN are not used; all NaN, or never about 1 g, leaves the first attitude as
    level as it came.
    """
    felt, trust = _felt(start_from_body, accelerations)
    if trust.max() < 1e-3:
        return _headed(start_from_body)
    up = _smoothed(times_s, felt, trust)
    return _headed(_turning_up(up) * start_from_body)


def _felt(start_from_body: Rotation, accelerations: Floats) -> tuple[Floats, Floats]:
    """Accelerations in the integrated frame (n, 3), 0 where unknown, and the trust in each (n,)."""
    felt = start_from_body.apply(np.nan_to_num(accelerations))
    strength = np.linalg.norm(felt, axis=1) / GRAVITY_M_S2
    trust = np.exp(-0.5 * ((strength - 1) / _TRUSTED_WITHIN).clip(-30, 30) ** 2)
    trust[~np.isfinite(accelerations).all(axis=1)] = 0.0
    return felt, trust


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
