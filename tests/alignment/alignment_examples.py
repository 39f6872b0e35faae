"""Turns as a camera on a known motion would see them, without pictures."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from freelook.alignment.image_turns import ImageTurn
from freelook.attitude_track import AttitudeTrack


def tumbling(rng: np.random.Generator, seconds: float, hz: float = 100.0) -> AttitudeTrack:
    """A motion of many frequencies below 3 Hz, 20 to 40 degrees a second, with no period."""
    times_s = np.arange(0, seconds, 1 / hz)
    angles = np.zeros((len(times_s), 3))
    for axis in range(3):
        for frequency in rng.uniform(0.1, 3.0, 12):
            phase = rng.uniform(0, 2 * np.pi)
            angles[:, axis] += 0.06 / frequency * np.sin(2 * np.pi * frequency * times_s + phase)
    return AttitudeTrack(
        np.round(times_s * 1e9).astype(np.int64) + 5 * 10**9, Rotation.from_euler("ZYX", angles)
    )


def seen_turns(
    track: AttitudeTrack,
    start_s: float,
    seconds: float,
    delay_ns: int,
    rng: np.random.Generator,
    noise_deg: float = 0.03,
    fps: float = 30.0,
) -> list[ImageTurn]:
    """What the camera saw from `start_s` into the track on, stamped `delay_ns` late."""
    times = np.arange(0, seconds, 1 / fps)
    times_ns = track.start_ns + np.round((start_s + times) * 1e9).astype(np.int64)
    turned = track.at(times_ns)
    steps = (turned[:-1].inv() * turned[1:]).as_rotvec()
    steps += rng.normal(scale=np.radians(noise_deg), size=steps.shape)
    stamped = (times_ns + delay_ns).tolist()
    return [
        ImageTurn(start, end, step, 100)
        for start, end, step in zip(stamped[:-1], stamped[1:], steps, strict=True)
    ]
