"""A virtual camera's path: the vehicle's attitude through a low-pass filter without delay."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from ..attitude_track import AttitudeTrack
from ..clock import NS_PER_S
from ..errors import AttitudeError

LOWEST_HZ, HIGHEST_HZ = 0.02, 10.0
DEFAULT_HZ = 0.5
_LONGEST_STEP_S = 0.02
_STEPS_PER_SIGMA = 8


def smoothed(track: AttitudeTrack, cutoff_hz: float) -> AttitudeTrack:
    """The track with motions above the cut-off taken out, without any delay.

    The filter is a Gaussian in time, symmetrical, so that it needs the future too. Its gain is
    exp(-(f / cutoff)^2 ln(2) / 2): 0.71 (-3 dB) at `cutoff_hz`, 0.25 at twice, 0.002 at four times
    that; its standard deviation in time is 0.13 / cutoff. Quaternions are averaged with its
    weights (the chordal mean: Markley et al., J. Guidance 30 (2007) 1193), so turns of any size
    are followed. Before and after its ends the track is taken to stand still.

    AttitudeError for a cut-off outside 0.02 to 10 Hz.
    """
    if not LOWEST_HZ <= cutoff_hz <= HIGHEST_HZ:
        raise AttitudeError(
            f"the cut-off must be {LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz, not {cutoff_hz:g}"
        )
    sigma_s = float(np.sqrt(np.log(2))) / (2 * np.pi * cutoff_hz)
    step_ns = round(min(_LONGEST_STEP_S, sigma_s / _STEPS_PER_SIGMA) * NS_PER_S)
    count = max(2, int((track.times_ns[-1] - track.times_ns[0]) // step_ns) + 2)
    times_ns = track.times_ns[0] + step_ns * np.arange(count)
    exact = track.at(times_ns).as_quat()
    flips = np.sign(np.sum(exact[1:] * exact[:-1], axis=1))
    exact[1:] *= np.cumprod(np.where(flips == 0, 1.0, flips))[:, None]
    sigma = sigma_s * NS_PER_S / step_ns
    mean = gaussian_filter1d(exact, sigma, axis=0, mode="nearest", truncate=6.0)
    # several turns within the window cancel out; then there is no mean, and no smoothing
    lost = np.linalg.norm(mean, axis=1) < 1e-4
    mean[lost] = exact[lost]
    return AttitudeTrack(times_ns, Rotation.from_quat(mean))
