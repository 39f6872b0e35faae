"""Where a head points from a gyroscope, an accelerometer and perhaps a magnetometer.

The filter is x-io Technologies' Fusion (the library imufusion): the complementary filter of chapter
7 of S. Madgwick's thesis, AHRS algorithms and calibration solutions to facilitate new applications
using low-cost MEMS (University of Bristol, 2014), with rejection of accelerations and of disturbed
magnetic fields. The gyroscope's bias is learned here, while the head is still: the library's own
estimator needs some ten seconds of rest for it, and takes slow turning for rest.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..clock import NS_PER_S
from ..rotations import FRD_FROM_RDF, from_wxyz

Vector = NDArray[np.float64]

GAIN = 0.5
REJECTION_DEG = 10.0
REJECTION_TIMEOUT_S = 5.0
STILL_S = 1.0
STILL_DPS = 0.5  # rms about the mean; sensors at rest have 0.05 to 0.2
LARGEST_BIAS_DPS = 10.0
LARGEST_CHANGE_DPS = 0.5  # once known it only creeps, with the temperature
CREEP = 0.1
MEASURE_S = 1.0
LONGEST_GAP_S = 0.5


class OrientationFilter:
    """Vectors in the head's own axes, x forward, y right, z down; the world is north, east, down.

    Without a magnetometer yaw begins at 0 and drifts by what is left of the gyroscope's bias.
    """

    def __init__(self, rate_hz: float) -> None:
        import imufusion

        settings = imufusion.AhrsSettings()
        settings.convention = imufusion.CONVENTION_NED
        settings.gain = GAIN
        settings.acceleration_rejection = REJECTION_DEG
        settings.magnetic_rejection = REJECTION_DEG
        settings.rejection_timeout = REJECTION_TIMEOUT_S
        settings.sample_rate = rate_hz
        self._ahrs = imufusion.Ahrs()
        self._ahrs.set_settings(settings)
        self.bias = RestBias(rate_hz)
        self._started = False

    def update(
        self, gyro_dps: Vector, accel: Vector, mag: Vector | None, dt_s: float
    ) -> Rotation | None:
        """`body_from_view` after one more sample, `dt_s` after the one before.

        gyro_dps (3,) degrees a second; accel (3,) in any unit, upwards at rest; mag (3,) in any
        unit, towards the field. None when the numbers lead nowhere; then start again.
        """
        if not self._started:
            self._start(accel)
        self._ahrs.set_sample_period(dt_s)
        gyro_dps = self.bias.update(gyro_dps)
        if mag is None:
            self._ahrs.update_no_magnetometer(gyro_dps, accel)
        else:
            self._ahrs.update(gyro_dps, accel, mag)
        quaternion = np.array(self._ahrs.get_quaternion(), float)
        if not 0.9 < float(np.sqrt(np.sum(quaternion**2))) < 1.1:
            return None
        return from_wxyz([round(float(q), 15) for q in quaternion]) * FRD_FROM_RDF

    def _start(self, accel: Vector) -> None:
        """With the first sample's tilt, at once; the filter's own start takes three seconds."""
        self._started = True
        length = float(np.sqrt(np.sum(accel**2)))
        if length < 1e-3:
            return
        up_x, up_y, up_z = accel / length
        roll = np.arctan2(-up_y, -up_z)
        pitch = np.arctan2(up_x, np.hypot(up_y, up_z))
        x, y, z, w = Rotation.from_euler("ZYX", [0.0, pitch, roll]).as_quat()
        self._ahrs.set_quaternion(np.array([w, x, y, z]))
        self._ahrs.skip_startup()


class RestBias:
    """What a gyroscope reads although nothing turns.

    Learned from every second in which its reading hardly changes: from the first such second at
    once, from later ones slowly and only where they nearly agree, so that a head that turns slowly
    and evenly is not taken for a bias.
    """

    def __init__(self, rate_hz: float) -> None:
        self.dps: Vector = np.zeros(3)
        self.known = False
        self._window = max(round(STILL_S * rate_hz), 2)
        self._samples = 0
        self._first: Vector = np.zeros(3)
        self._sum: Vector = np.zeros(3)
        self._squares: Vector = np.zeros(3)

    def update(self, gyro_dps: Vector) -> Vector:
        """The reading (3,) without the bias."""
        if self._samples == 0:
            self._first = gyro_dps  # sums of differences from it lose no digits
            self._sum, self._squares = np.zeros(3), np.zeros(3)
        difference = gyro_dps - self._first
        self._samples += 1
        self._sum = self._sum + difference
        self._squares = self._squares + difference * difference
        if self._samples == self._window:
            self._judge()
            self._samples = 0
        return gyro_dps - self.dps

    def _judge(self) -> None:
        mean = self._sum / self._samples
        variance = self._squares / self._samples - mean * mean
        mean = mean + self._first
        if variance.max() > STILL_DPS**2:
            return
        if not self.known and np.abs(mean).max() <= LARGEST_BIAS_DPS:
            self.dps, self.known = mean, True
        elif np.abs(mean - self.dps).max() <= LARGEST_CHANGE_DPS:
            self.dps = self.dps + CREEP * (mean - self.dps)


class SampleTimes:
    """The time from sample to sample: by the sensor's clock, or by how many come in a second."""

    def __init__(self) -> None:
        self.rate_hz: float | None = None
        self._first_ns: int | None = None
        self._last_ns = 0
        self._elapsed_s = 0.0
        self._samples = 0
        self._sensor_s: float | None = None

    def arrived(self, samples: int, now_ns: int) -> None:
        """So many samples came with one read. The rate is known after a second of them."""
        if self._first_ns is None:
            self._first_ns = now_ns
        else:
            gap_s = (now_ns - self._last_ns) / NS_PER_S
            if 0 <= gap_s < LONGEST_GAP_S:
                self._elapsed_s += gap_s
                self._samples += samples
        self._last_ns = now_ns
        if self._elapsed_s >= MEASURE_S and self._samples >= 2:
            self.rate_hz = self._samples / self._elapsed_s
        if self._elapsed_s > 60 * MEASURE_S:  # what is old counts half
            self._elapsed_s, self._samples = self._elapsed_s / 2, self._samples // 2

    def step_s(self, sensor_s: float | None) -> float:
        """Seconds since the sample before; once the rate is known."""
        assert self.rate_hz is not None
        before, self._sensor_s = self._sensor_s, sensor_s
        if sensor_s is not None and before is not None and 0 < sensor_s - before < LONGEST_GAP_S:
            return sensor_s - before
        return 1.0 / self.rate_hz
