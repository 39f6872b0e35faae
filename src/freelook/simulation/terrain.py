"""What lies on the ground and in the sky far away: fields, woods, a river, clouds, hills.

Everything is computed from formulas and a fixed seed; nothing is loaded. The ground repeats
every 2048 m, which haze hides.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .pyramid import Float32s, Pyramid, make_pyramid

Floats = NDArray[np.floating[Any]]

GROUND_TEXELS, GROUND_TEXEL_M = 1024, 2.0
DETAIL_TEXELS, DETAIL_TEXEL_M = 256, 0.25
CLOUD_TEXELS, CLOUD_TEXEL_M = 512, 24.0
PERIOD_M = GROUND_TEXELS * GROUND_TEXEL_M
FIELD_ROWS = 15
HILL_SAMPLES = 2048

CROPS = np.array(
    [
        (0.40, 0.53, 0.24),
        (0.50, 0.62, 0.27),
        (0.31, 0.46, 0.20),
        (0.80, 0.72, 0.43),
        (0.72, 0.63, 0.36),
        (0.56, 0.43, 0.30),
        (0.46, 0.36, 0.27),
        (0.86, 0.79, 0.26),
        (0.58, 0.66, 0.36),
        (0.36, 0.50, 0.29),
    ]
)
WOOD, WATER = (0.17, 0.28, 0.14), (0.24, 0.42, 0.55)
MEADOW, HEDGE, DIRT = (0.43, 0.56, 0.26), (0.22, 0.34, 0.16), (0.72, 0.65, 0.52)


@cache
def ground() -> Pyramid:
    """Colour of the ground: axis 0 north, axis 1 east."""
    axis = (np.arange(GROUND_TEXELS, dtype=np.float32) + 0.5) * np.float32(GROUND_TEXEL_M)
    east, north = np.meshgrid(axis, axis)
    rng = np.random.default_rng(20110)
    noise = fractal_noise(rng, GROUND_TEXELS, octaves=(16, 32, 64, 128, 256))
    color = _fields(rng, north, east)
    color = _mix(color, _airfield_grass(east), _airfield(north, east))
    color *= (1 + 0.22 * noise)[..., None]
    speckle = fractal_noise(rng, GROUND_TEXELS, octaves=(128, 256, 512))
    wood = np.asarray(WOOD) * (1 + 0.7 * speckle)[..., None]
    color = _mix(color, wood, _woods(rng, north, east))
    for far, near in ((22.0, 19.0), (17.0, 14.0)):  # a bank of sand, then water
        inside = _step(far, near, np.abs(_from_river(north, east)))
        color = _mix(color, np.asarray(WATER if far < 20 else DIRT), inside)
    return make_pyramid(np.clip(color, 0, 1), GROUND_TEXEL_M)


@cache
def detail() -> Pyramid:
    """How much brighter than its colour the ground is close up: grass and soil, mean 0."""
    noise = fractal_noise(np.random.default_rng(7), DETAIL_TEXELS, octaves=(12, 24, 48, 96, 128))
    return make_pyramid(0.2 * (noise - noise.mean()), DETAIL_TEXEL_M)


@cache
def clouds() -> Pyramid:
    """How thick a layer of fair-weather clouds is: 0 clear, 1 and more opaque."""
    noise = fractal_noise(np.random.default_rng(5), CLOUD_TEXELS, octaves=(6, 12, 24, 48, 96, 192))
    thick = 0.92 * _step(0.08, 0.75, noise) + np.maximum(noise - 0.6, 0)
    return make_pyramid(thick, CLOUD_TEXEL_M)


@cache
def hills() -> Float32s:
    """tan(elevation) of the two ridges (2, HILL_SAMPLES) against azimuth, far one first."""
    azimuth = np.arange(HILL_SAMPLES) * 2 * np.pi / HILL_SAMPLES
    rng = np.random.default_rng(3)
    ridges = []
    for mean, height in ((0.075, 0.055), (0.035, 0.022)):
        waves = sum(
            np.sin(k * azimuth + rng.uniform(0, 2 * np.pi)) / (k + 2) ** 1.05 for k in range(2, 48)
        )
        ridges.append(np.maximum(mean + height * waves / np.abs(waves).max(), 0.004))
    return np.asarray(ridges, dtype=np.float32)


def fractal_noise(
    rng: np.random.Generator, side: int, octaves: tuple[int, ...], gain: float = 0.62
) -> Floats:
    """Smooth periodic noise (side, side), about -1 to 1: each octave has that many waves."""
    total = np.zeros((side, side), dtype=np.float32)
    for order, cells in enumerate(octaves):
        total += np.float32(gain**order) * _value_noise(rng, side, cells)
    return total / np.float32(total.std() * 2)


def _value_noise(rng: np.random.Generator, side: int, cells: int) -> Floats:
    lattice = rng.uniform(-1, 1, (cells, cells)).astype(np.float32)
    place = (np.arange(side) + 0.5) * cells / side
    low = place.astype(int)
    part = (place - low).astype(np.float32)
    part = part * part * (3 - 2 * part)
    rows = lattice[low % cells] * (1 - part)[:, None] + lattice[(low + 1) % cells] * part[:, None]
    return rows[:, low % cells] * (1 - part) + rows[:, (low + 1) % cells] * part


def _fields(rng: np.random.Generator, north: Floats, east: Floats) -> Floats:
    """A patchwork in bent rows, hedges between, some with the furrows of the plough."""
    turn = 2 * np.pi / PERIOD_M
    bent_n = north + 34 * np.sin(turn * east * 3) + 16 * np.sin(turn * (5 * east + 2 * north))
    bent_e = east + 30 * np.sin(turn * north * 2 + 1) + 12 * np.sin(turn * (3 * north - 4 * east))
    row_place = np.mod(bent_n / PERIOD_M, 1) * FIELD_ROWS
    row = np.minimum(row_place.astype(int), FIELD_ROWS - 1)
    per_row = rng.integers(8, 15, FIELD_ROWS)
    shift = rng.uniform(0, 1, FIELD_ROWS)
    cell_place = np.mod(bent_e / PERIOD_M + shift[row], 1) * per_row[row]
    cell = np.minimum(cell_place.astype(int), per_row[row] - 1)
    kind = rng.integers(0, 2**31, (FIELD_ROWS, 16))[row, cell]
    color = CROPS[kind % len(CROPS)].astype(np.float32)
    color *= (0.90 + 0.2 * (kind // 16 % 64) / 63)[..., None]
    along = np.where(kind // 1024 % 2 == 0, bent_n, bent_e)
    furrows = np.sin(along * 2 * np.pi / 9.0) * (kind // 2048 % 3 > 0) * 0.06
    color *= (1 + furrows)[..., None]
    row_edge = _edge_m(row_place, PERIOD_M / FIELD_ROWS)
    cell_edge = _edge_m(cell_place, PERIOD_M / per_row[row])
    color = _mix(color, np.asarray(HEDGE), 0.8 * _step(5.5, 2.5, np.minimum(row_edge, cell_edge)))
    return _mix(color, np.asarray(DIRT), _step(5.0, 2.5, np.where(row % 4 == 1, row_edge, 99.0)))


def _edge_m(place: Floats, cell_m: Any) -> Floats:
    part = np.mod(place, 1)
    return np.minimum(part, 1 - part) * cell_m


def _airfield(north: Floats, east: Floats) -> Floats:
    """1 on the mown grass round the runway, a rounded rectangle about the origin."""
    n, e = _wrapped(north), _wrapped(east - 20)
    outside = np.hypot(np.maximum(np.abs(n) - 360, 0), np.maximum(np.abs(e) - 95, 0))
    return _step(50.0, 44.0, outside)


def _airfield_grass(east: Floats) -> Floats:
    stripes = 1 + 0.05 * np.sign(np.sin(east * 2 * np.pi / 32))
    return np.asarray(MEADOW, dtype=np.float32) * stripes[..., None]


def _woods(rng: np.random.Generator, north: Floats, east: Floats) -> Floats:
    clump = fractal_noise(rng, GROUND_TEXELS, octaves=(7, 14, 28, 56, 112))
    near = np.hypot(_wrapped(north) / 1.6, _wrapped(east))
    return _step(0.42, 0.50, clump - 1.2 * _step(420.0, 250.0, near))


def _from_river(north: Floats, east: Floats) -> Floats:
    turn = 2 * np.pi / PERIOD_M
    middle = 520 + 90 * np.sin(turn * north * 2 + 0.6) + 35 * np.sin(turn * north * 5)
    return _wrapped(east - middle)


def _wrapped(metres: Floats) -> Floats:
    """The same place of the repeating ground nearest the origin."""
    return np.mod(metres + PERIOD_M / 2, PERIOD_M) - PERIOD_M / 2


def _step(low: float, high: float, value: Floats) -> Floats:
    """0 at `low`, 1 at `high`, smooth between; `low` may be the larger."""
    part = np.clip((value - low) / (high - low), 0, 1)
    return part * part * (3 - 2 * part)


def _mix(below: Floats, above: Floats, cover: Floats) -> Floats:
    return below + (above - below) * cover[..., None]
