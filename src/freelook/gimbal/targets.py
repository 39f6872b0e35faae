"""What the mode *point* looks at: a direction, or a location on the earth.

    AZIMUTH,ELEVATION     degrees from true north, clockwise; degrees above the horizon
    LAT,LON,ALT           WGS 84: degrees north, degrees east, metres above the ellipsoid

For a location the vehicle's own is needed. Both become Earth-centred coordinates, and their
difference is turned into north, east, down at the vehicle (any textbook of geodesy; constants of
NIMA TR8350.2, "World Geodetic System 1984"). Altitudes above mean sea level do as well, where both
are: the geoid is much the same under both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import TrackerError

SEMI_MAJOR_M = 6_378_137.0
FLATTENING = 1 / 298.257223563
NEAREST_M = 1.0
HIGHEST_M = 1e6


@dataclass(frozen=True)
class Direction:
    """Degrees: from north through east, and above the horizon (-90 to 90, TrackerError)."""

    azimuth_deg: float
    elevation_deg: float = 0.0

    def __post_init__(self) -> None:
        if not abs(self.azimuth_deg) <= 360:
            raise TrackerError(f"an azimuth must be -360 to 360 degrees, not {self.azimuth_deg}")
        if not abs(self.elevation_deg) <= 90:
            raise TrackerError(f"an elevation must be -90 to 90 degrees, not {self.elevation_deg}")


@dataclass(frozen=True)
class Location:
    """A place: degrees north and east, metres above the ellipsoid (TrackerError)."""

    lat_deg: float
    lon_deg: float
    alt_m: float

    def __post_init__(self) -> None:
        if not abs(self.lat_deg) <= 90:
            raise TrackerError(f"a latitude must be -90 to 90 degrees, not {self.lat_deg}")
        if not abs(self.lon_deg) <= 360:
            raise TrackerError(f"a longitude must be -360 to 360 degrees, not {self.lon_deg}")
        if not abs(self.alt_m) <= HIGHEST_M:
            raise TrackerError(f"an altitude must be at most {HIGHEST_M:g} m, not {self.alt_m}")


Target = Direction | Location


def parse_target(text: str) -> Target:
    """A target from "AZIMUTH,ELEVATION" or "LAT,LON,ALT". TrackerError says what is wrong."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) == 2:
        return Direction(*numbers)
    if len(numbers) == 3:
        return Location(*numbers)
    raise TrackerError(
        f"'{text}' is no target; write AZIMUTH,ELEVATION in degrees, or LAT,LON,ALT in degrees "
        "and metres"
    )


def direction_to(there: Location, here: Location) -> Direction | None:
    """Where `there` is seen from `here`; None when it is within a metre."""
    away = _ned_from_ecef(here) @ (_ecef(there) - _ecef(here))
    distance = float(np.linalg.norm(away))
    if distance < NEAREST_M:
        return None
    north, east, down = (float(value) for value in away)
    elevation = math.degrees(math.asin(max(-1.0, min(1.0, -down / distance))))
    return Direction(math.degrees(math.atan2(east, north)), elevation)


def _ecef(place: Location) -> NDArray[np.float64]:
    lat, lon = math.radians(place.lat_deg), math.radians(place.lon_deg)
    squared = FLATTENING * (2 - FLATTENING)
    across = SEMI_MAJOR_M / math.sqrt(1 - squared * math.sin(lat) ** 2)
    flat = (across + place.alt_m) * math.cos(lat)
    upright = (across * (1 - squared) + place.alt_m) * math.sin(lat)
    return np.array([flat * math.cos(lon), flat * math.sin(lon), upright])


def _ned_from_ecef(place: Location) -> NDArray[np.float64]:
    lat, lon = math.radians(place.lat_deg), math.radians(place.lon_deg)
    (sin_lat, cos_lat), (sin_lon, cos_lon) = (
        (math.sin(angle), math.cos(angle)) for angle in (lat, lon)
    )
    return np.array(
        [
            [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
            [-sin_lon, cos_lon, 0.0],
            [-cos_lat * cos_lon, -cos_lat * sin_lon, -sin_lat],
        ]
    )
