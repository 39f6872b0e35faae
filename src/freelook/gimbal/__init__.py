"""Where the virtual camera looks: pure functions of time (docs/gimbal.md).

`core` is the head: tracker, loss, recentre, eyes front. `stabiliser` is the vehicle: the modes.
`easing` is how one aim becomes another; `shaping` gain and dead zone; `limits` the lens's edge;
`zoom` sensible fields of view.
"""

from .base import BODY, MODES, Base
from .core import CENTRE, Aim, Gimbal
from .limits import LIMITS, LensLimit, soft_stop
from .settings import GimbalSettings, StabiliserSettings
from .shaping import AxisShape, Shape, parse_shape
from .stabiliser import Stabiliser
from .targets import Direction, Location, parse_target
from .zoom import ZoomLimits, most_focal_px, zoom_limits

__all__ = [
    "BODY",
    "CENTRE",
    "LIMITS",
    "MODES",
    "Aim",
    "AxisShape",
    "Base",
    "Direction",
    "Gimbal",
    "GimbalSettings",
    "LensLimit",
    "Location",
    "Shape",
    "Stabiliser",
    "StabiliserSettings",
    "ZoomLimits",
    "most_focal_px",
    "parse_shape",
    "parse_target",
    "soft_stop",
    "zoom_limits",
]
