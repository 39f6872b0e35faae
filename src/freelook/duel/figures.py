"""What the parts are set to, and where each figure is from.

A preset is a few figures of one part: the gimbal, the link with its camera and display, the head
tracker. `settings` puts one of each together; whoever knows better changes single ones.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

from ..errors import FreelookError


class DuelError(FreelookError):
    """Settings that make no duel; says what is known."""


@dataclass(frozen=True)
class Figure:
    """One value and its source; "assumed" where nobody has published one."""

    value: float
    source: str


Preset = Mapping[str, Figure]


@dataclass(frozen=True)
class Settings:
    """Everything both sides are made of. Times in milliseconds, angles in degrees.

    Head tracker, the same for both:
    tracker_period_ms     between two samples
    tracker_delay_ms      from a sample to its pose, in the tracker
    tracker_noise_deg     rms of each sample about each axis, independent of the one before

    freelook's station:
    station_delay_ms      from the tracker's output to the page
    compositor_frames     display frames from drawing to the display's input
    digitiser_ms          what it takes longer to get the video into a computer than into goggles

    Uplink of the gimbal:
    trainer_period_ms     between two head positions handed to the radio
    radio_period_ms       between two radio frames
    radio_latency_ms      from a changed input to the receiver's output, mean, with half a
                          radio period in it, as it is measured

    Gimbal:
    command_period_ms     between two commands to the motors: a servo's PWM frame
    command_delay_ms      until a command is understood: the length of its pulse
    slew_deg_s, accel_deg_s2, dead_band_deg: `freelook.duel.servo.Motor`
    axes                  2: pan and tilt, the view stays level; 3: it rolls with the head

    Camera, video link and display, the same for both:
    camera_hz             pictures (or fields) a second
    display_hz            pictures a second
    display_ms            from the display's input to light, in the middle of the picture
    glass_to_glass_ms     light at the camera to light at the display, mean, as it is measured:
                          half a camera and half a display period are in it
    """

    tracker_period_ms: float
    tracker_delay_ms: float
    tracker_noise_deg: float
    station_delay_ms: float
    compositor_frames: float
    digitiser_ms: float
    trainer_period_ms: float
    radio_period_ms: float
    radio_latency_ms: float
    command_period_ms: float
    command_delay_ms: float
    slew_deg_s: float
    accel_deg_s2: float
    dead_band_deg: float
    axes: float
    camera_hz: float
    display_hz: float
    display_ms: float
    glass_to_glass_ms: float

    def __post_init__(self) -> None:
        for field in fields(self):
            _check(field.name, getattr(self, field.name))
        if self.transport_ms < 0:
            raise DuelError(
                f"glass_to_glass_ms = {self.glass_to_glass_ms:g} is less than what camera and "
                f"display alone take, {self.glass_to_glass_ms - self.transport_ms:.1f} ms: half "
                "a period of each and display_ms"
            )
        if self.radio_delay_ms < 0:
            raise DuelError(
                f"radio_latency_ms = {self.radio_latency_ms:g} is less than half of "
                f"radio_period_ms = {self.radio_period_ms:g}, which is in it"
            )

    @property
    def camera_ms(self) -> float:
        return 1000 / self.camera_hz

    @property
    def refresh_ms(self) -> float:
        return 1000 / self.display_hz

    @property
    def transport_ms(self) -> float:
        """From exposure to the display's input, without waiting for either clock."""
        return self.glass_to_glass_ms - (self.camera_ms + self.refresh_ms) / 2 - self.display_ms

    @property
    def radio_delay_ms(self) -> float:
        return self.radio_latency_ms - self.radio_period_ms / 2

    @property
    def freelook_lag_ms(self) -> float:
        """Head to eye without prediction, on average: every delay, and half of every period."""
        return (
            self.tracker_period_ms / 2
            + self.tracker_delay_ms
            + self.station_delay_ms
            + self.refresh_ms * (0.5 + self.compositor_frames)
            + self.display_ms
        )

    @property
    def gimbal_wait_ms(self) -> float:
        """From handing a head position to the radio to the eye, on average, without the motors'
        own time."""
        return (
            self.trainer_period_ms / 2
            + self.radio_latency_ms
            + self.command_period_ms / 2
            + self.command_delay_ms
            + self.glass_to_glass_ms
        )

    @property
    def gimbal_lag_ms(self) -> float:
        """Head to eye without prediction and with motors of no inertia, on average."""
        return self.tracker_period_ms / 2 + self.tracker_delay_ms + self.gimbal_wait_ms


_PERIODS = ("tracker_period_ms", "trainer_period_ms", "radio_period_ms", "command_period_ms")
_POSITIVE = (*_PERIODS, "camera_hz", "display_hz", "slew_deg_s", "accel_deg_s2")
_UNBOUNDED = ("slew_deg_s", "accel_deg_s2")
_LARGEST = 10_000.0


def _check(name: str, value: float) -> None:
    least = 0.1 if name in _POSITIVE else 0.0
    most = math.inf if name in _UNBOUNDED else _LARGEST
    if not least <= value <= most:
        raise DuelError(f"{name} = {value:g} is not within {least:g} and {most:g}")
    if name == "axes" and value not in (2, 3):
        raise DuelError(f"axes = {value:g}: a gimbal here has 2 or 3")
    if name == "compositor_frames" and value != int(value):
        raise DuelError(f"compositor_frames = {value:g} must be a whole number")


_SG90 = "data of the TowerPro SG90, 4.8 V"
_BITONIAU = "bitoniau.blogspot.com, October 2013"
_FPORT = "oscarliang.com/fport-latency-testing, logic analyser: iXJT, XSR, SBUS"
_ELRS = "mavlinkhud.com field manual, ExpressLRS at 250 Hz"

HEAD: Preset = {
    "tracker_period_ms": Figure(6.67, "dlktdr/HeadTracker, firmware: sensors at 150 Hz"),
    "tracker_delay_ms": Figure(3.5, "dlktdr/HeadTracker, firmware: half of its 7 ms cycle"),
    "tracker_noise_deg": Figure(0.02, "assumed: a fused MEMS sensor at rest"),
    "station_delay_ms": Figure(3.0, "docs/latency.md: datagram to drawn, quiet machine"),
    "compositor_frames": Figure(1, "a browser's picture is shown one display frame later"),
}

GIMBALS: dict[str, Preset] = {
    "hobby-servo": {
        "command_period_ms": Figure(20, f"{_SG90}: 50 Hz PWM"),
        "command_delay_ms": Figure(1.5, "the pulse itself, in its middle position"),
        "slew_deg_s": Figure(600, f"{_SG90}: 0.1 s for 60 degrees, no load"),
        "accel_deg_s2": Figure(20_000, "assumed: full speed after 30 ms"),
        "dead_band_deg": Figure(0.5, f"{_SG90}: 5 us of 1900 us for 180 degrees"),
        "axes": Figure(2, "pan and tilt, as usual"),
    },
    "brushless": {
        "command_period_ms": Figure(10, "Betaflight's driver for the Caddx GM3: 100 Hz"),
        "command_delay_ms": Figure(1, "assumed: a serial frame at 115200 baud"),
        "slew_deg_s": Figure(400, "DJI Onboard SDK: the highest rate it recommends"),
        "accel_deg_s2": Figure(8_000, "assumed: full speed after 50 ms"),
        "dead_band_deg": Figure(0, "none: encoders"),
        "axes": Figure(3, "Caddx GM3"),
    },
    "payload": {
        "command_period_ms": Figure(20, "assumed: MAVLink set-points at 50 Hz"),
        "command_delay_ms": Figure(1, "assumed: a serial frame"),
        "slew_deg_s": Figure(100, "data of the Gremsy G-Hadron: controlled rotation"),
        "accel_deg_s2": Figure(1_000, "assumed: full speed after 100 ms"),
        "dead_band_deg": Figure(0, "none: 16-bit encoders"),
        "axes": Figure(3, "data of the Gremsy G-Hadron"),
    },
}

LINKS: dict[str, Preset] = {
    "analogue": {
        "trainer_period_ms": Figure(22.5, "the usual PPM frame of a trainer port"),
        "radio_period_ms": Figure(9, f"{_FPORT}: 111 Hz"),
        "radio_latency_ms": Figure(19.7, f"{_FPORT}: 19.7 ms mean"),
        "camera_hz": Figure(50, "fields of PAL"),
        "display_hz": Figure(60, "a usual monitor or headset"),
        "display_ms": Figure(5, "assumed"),
        "glass_to_glass_ms": Figure(37, f"{_BITONIAU}: CCD camera to LCD"),
        "digitiser_ms": Figure(83, f"{_BITONIAU}: EasyCap USB and PC 120 ms, less those 37"),
    },
    "digital": {
        "trainer_period_ms": Figure(4, "CRSF at 250 Hz, as the radio"),
        "radio_period_ms": Figure(4, f"{_ELRS}"),
        "radio_latency_ms": Figure(6, f"{_ELRS}: about 6 ms"),
        "camera_hz": Figure(120, "fpvOS release notes 2026.10: Caddx Ascent, 864p120"),
        "display_hz": Figure(120, "assumed: as the camera, for both"),
        "display_ms": Figure(3, "assumed"),
        "glass_to_glass_ms": Figure(27.5, "fpvOS release notes 2026.10: photodiode, median"),
        "digitiser_ms": Figure(35, "HDMI capture cards: 20 to 50, fpv-wtf/dji-moonlight-shim 14"),
    },
    "openhd": {
        "trainer_period_ms": Figure(4, "CRSF at 250 Hz, as the radio"),
        "radio_period_ms": Figure(4, f"{_ELRS}"),
        "radio_latency_ms": Figure(6, f"{_ELRS}: about 6 ms"),
        "camera_hz": Figure(60, "assumed"),
        "display_hz": Figure(60, "a usual monitor or headset"),
        "display_ms": Figure(5, "assumed"),
        "glass_to_glass_ms": Figure(66, "OpenHD/Open.HD 406: 62.5 to 70 ms with a Jetson"),
        "digitiser_ms": Figure(0, "its receiver is the computer"),
    },
}


def figures(gimbal: str, link: str) -> dict[str, Figure]:
    """All figures by the names of `Settings`. DuelError for a preset that does not exist."""
    for what, name, known in (("gimbal", gimbal, GIMBALS), ("link", link, LINKS)):
        if name not in known:
            raise DuelError(f"unknown {what} '{name}'; known: {', '.join(known)}")
    chosen = {**HEAD, **LINKS[link], **GIMBALS[gimbal]}
    return {field.name: chosen[field.name] for field in fields(Settings)}


def settings_of(chosen: Mapping[str, Figure]) -> Settings:
    return Settings(**{name: figure.value for name, figure in chosen.items()})


def changed(chosen: Mapping[str, Figure], changes: Mapping[str, float]) -> dict[str, Figure]:
    """The figures with some replaced. DuelError for a name that is none."""
    unknown = sorted(set(changes) - set(chosen))
    if unknown:
        raise DuelError(f"unknown setting '{unknown[0]}'; known: {', '.join(chosen)}")
    given = {name: Figure(float(value), "given") for name, value in changes.items()}
    return {**chosen, **given}


def ideal(settings: Settings) -> Settings:
    """The same with motors that are wherever they are told to be, and a tracker without noise."""
    motors = replace(settings, slew_deg_s=math.inf, accel_deg_s2=math.inf, dead_band_deg=0.0)
    return replace(motors, tracker_noise_deg=0.0)
