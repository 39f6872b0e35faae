"""The lens and the mounting, as commands ask for them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from ..camera import Camera
from ..errors import FreelookError
from ..formats import builtin_names, load_camera
from ..rotations import body_from_view

LENS_HELP = f"lens profile: a file, or one of: {', '.join(builtin_names())}"
MOUNT_HELP = (
    "how the camera is fixed to the vehicle, degrees right, up, right side down "
    "(write --mount=-10,0,0 with a leading minus)"
)


def mounted_camera(lens: str | None, mount: Sequence[float] | None) -> Camera:
    """The camera of a lens profile, turned as it is mounted."""
    if lens is None:
        raise FreelookError(
            "which lens does the camera have? give --lens PROFILE, a file or one of: "
            + ", ".join(builtin_names())
        )
    camera = load_camera(lens)
    if mount is None:
        return camera
    if not all(map(math.isfinite, mount)):
        raise FreelookError(f"--mount takes three angles in degrees, not {mount}")
    return dataclasses.replace(camera, camera_from_body=body_from_view(*mount).inv())
