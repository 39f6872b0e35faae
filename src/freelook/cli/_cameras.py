"""The lens and the mounting, as commands ask for them."""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Callable

from ..camera import Camera
from ..errors import FreelookError
from ..formats import FORMATS, Profile, builtin_names, load_profile
from ..rotations import body_from_view
from ._arguments import size, three_angles

Seek = Callable[[float | None], Camera]

LENS_HELP = (
    "lens profile: a file of any known format (FILE#NAME for one of several cameras in it), "
    f"or one of: {', '.join(builtin_names())}"
)
MOUNT_HELP = (
    "how the camera is fixed to the vehicle, degrees right, up, right side down "
    "(write --mount=-10,0,0 with a leading minus)"
)
FOV_HELP = (
    "without --lens the image circle is looked for in the picture: "
    "the field of view across it (default: 180)"
)


def add_lens_arguments(parser: argparse.ArgumentParser) -> None:
    """--lens and what goes with it; `lens_profile` and `mounted_camera` read them."""
    parser.add_argument("--lens", metavar="PROFILE", help=LENS_HELP)
    add_format_arguments(parser)
    parser.add_argument("--fov", type=float, metavar="DEG", help=FOV_HELP)
    parser.add_argument("--mount", type=three_angles, metavar="YAW,PITCH,ROLL", help=MOUNT_HELP)


def add_format_arguments(parser: argparse.ArgumentParser) -> None:
    """How a profile is read; for commands that take it by its name alone."""
    parser.add_argument(
        "--lens-format", choices=FORMATS, metavar="FORMAT", help="if it is not recognised rightly"
    )
    parser.add_argument(
        "--lens-size",
        type=size,
        metavar="WxH",
        help="picture size the profile is for, where it does not say so itself",
    )


def lens_profile(args: argparse.Namespace, name: str) -> Profile:
    """The profile of this name, read as --lens-format and --lens-size say."""
    return load_profile(name, format=args.lens_format, size=args.lens_size)


def mounted_camera(args: argparse.Namespace, without_lens: Seek | None = None) -> Camera:
    """The camera of --lens, turned as --mount says.

    Where --lens is missing it is what `without_lens` makes of --fov; FreelookError without that.
    """
    if args.lens is not None and getattr(args, "fov", None) is not None:
        raise FreelookError("--fov is for when there is no --lens: a profile has its own field")
    if args.lens is not None:
        camera = lens_profile(args, args.lens).camera
    elif without_lens is not None:
        camera = without_lens(args.fov)
    else:
        raise FreelookError(
            "which lens does the camera have? give --lens PROFILE, a file or one of: "
            + ", ".join(builtin_names())
        )
    if args.mount is None:
        return camera
    if not all(map(math.isfinite, args.mount)):
        raise FreelookError(f"--mount takes three angles in degrees, not {args.mount}")
    return dataclasses.replace(camera, camera_from_body=body_from_view(*args.mount).inv())
