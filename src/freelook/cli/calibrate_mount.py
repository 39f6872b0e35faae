"""Find how a camera is fixed to its vehicle, from known points or from the horizon.

Known points, with the vehicle standing level: pixels, and how far right and up from straight ahead
of the vehicle that is, in degrees. Two or more, far apart:

  freelook calibrate mount --lens lens.json --point 812,455:0,0 --point 200,430:-60,0 -o lens.json

The horizon, in pictures or in a video taken while the vehicle's roll and pitch were known:

  freelook calibrate mount --lens lens.json shots/*.jpg --attitude shots.csv -o lens.json
  freelook calibrate mount --lens lens.json flight.mp4 --attitude truth.csv -o lens.json

The CSV has the columns roll_deg (right side down) and pitch_deg (nose up), or qw, qx, qy, qz
(north-east-down from forward-right-down); and name, the picture's file name. Without a column
`name`, it has one row for every frame of one video. What the profile or --mount says about the
mounting may be 45 degrees wrong. Yaw is found where roll and pitch differ enough between frames,
and otherwise left as it was told.
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import CalibrationError, FreelookError
from ._cameras import LENS_HELP, MOUNT_HELP, add_format_arguments, lens_profile, mounted_camera

if TYPE_CHECKING:
    from ..calibration.mounting import KnownPoint, LevelledFrame, Mounting
    from ..camera import Camera

FRAMES = 15  # of a video
Attitude = tuple[float, float]  # roll, pitch
ANGLES, QUATERNION = ("roll_deg", "pitch_deg"), ("qw", "qx", "qy", "qz")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    from ._arguments import three_angles

    parser.add_argument("inputs", nargs="*", metavar="INPUT", help="pictures, or one video")
    parser.add_argument("--lens", required=True, metavar="PROFILE", help=LENS_HELP)
    add_format_arguments(parser)
    parser.add_argument("--attitude", metavar="CSV", help="roll and pitch of the vehicle")
    parser.add_argument(
        "--point",
        action="append",
        default=[],
        metavar="X,Y:YAW,PITCH",
        help="a pixel, and where from the vehicle that is: degrees right, up",
    )
    parser.add_argument(
        "--mount",
        type=three_angles,
        metavar="YAW,PITCH,ROLL",
        help=f"about {MOUNT_HELP} (default: as the profile says)",
    )
    parser.add_argument("--hold-yaw", action="store_true", help="leave the yaw as it was told")
    parser.add_argument("-o", "--output", metavar="FILE", help="write the lens profile here")
    parser.add_argument("--json", action="store_true", help="print all figures as JSON")
    parser.add_argument(
        "--overwrite", action="store_true", help="replace a file that is not the profile itself"
    )


def run(args: argparse.Namespace) -> int:
    if bool(args.point) == bool(args.inputs):
        raise FreelookError(
            "give either --point twice or more, or pictures of the horizon with --attitude CSV"
        )
    _check_output(args)
    camera = mounted_camera(args)
    if args.point:
        from ..calibration.mounting import mounting_from_points

        mounting = mounting_from_points(camera, [known_point(text) for text in args.point])
    else:
        mounting = _from_horizon(args, camera)
    if args.json:
        print(json.dumps(_figures(mounting), indent=2))
    else:
        for line in _sentences(mounting):
            print(line)
    if args.output:
        _write(args, mounting)
    return 0


def known_point(text: str) -> KnownPoint:
    """X,Y:YAW,PITCH. FreelookError for anything else."""
    from ..calibration.mounting import KnownPoint

    number = r"\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*"
    match = re.fullmatch(f"{number},{number}:{number},{number}", text)
    if not match:
        raise FreelookError(
            f"--point {text!r} is not X,Y:YAW,PITCH, such as 812,455:-30,10: a pixel, and degrees "
            "to the right and up"
        )
    x, y, yaw, pitch = map(float, match.groups())
    return KnownPoint((x, y), yaw, pitch)


def _check_output(args: argparse.Namespace) -> None:
    output = Path(args.output) if args.output else None
    if output is None or not output.exists() or args.overwrite:
        return
    if not (Path(args.lens).exists() and output.samefile(args.lens)):
        raise FreelookError(f"{args.output} exists; --overwrite replaces it")


def _from_horizon(args: argparse.Namespace, camera: Camera) -> Mounting:
    from ..calibration.mounting import mounting_from_horizon

    if args.attitude is None:
        raise FreelookError(
            "how was the vehicle turned? --attitude CSV with the columns name, roll_deg, pitch_deg"
        )
    frames, lost = _frames(args, camera)
    mounting = mounting_from_horizon(frames, camera.camera_from_body, hold_yaw=args.hold_yaw)
    return dataclasses.replace(mounting, dropped=(*lost, *mounting.dropped))


def _frames(
    args: argparse.Namespace, camera: Camera
) -> tuple[list[LevelledFrame], list[tuple[str, str]]]:
    """The frames with a horizon, and the others with the reason."""
    from ..calibration.horizon import find_horizon
    from ..calibration.mounting import LevelledFrame, down_in_body
    from ._bars import bar

    found, lost = [], []
    with bar("looking for the horizon", None, "pictures", quiet=args.json) as advance:
        for name, rgb, (roll, pitch) in _pictures(args.inputs, read_attitudes(args.attitude)):
            expected = camera.camera_from_body.apply(down_in_body(roll, pitch))
            try:
                horizon = find_horizon(rgb, camera, expected)
            except CalibrationError as error:
                lost.append((name, str(error)))
            else:
                found.append(LevelledFrame(name, horizon, roll, pitch))
            advance()
    if not found:
        shown = "; ".join(f"{name}: {why}" for name, why in lost[:3])
        raise CalibrationError(f"no horizon in any of {len(lost)} pictures: {shown}")
    return found, lost


def read_attitudes(name: str) -> list[tuple[str | None, Attitude]]:
    """(picture's name or None, (roll, pitch) in degrees) of every row of a CSV."""
    try:
        text = Path(name).read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FreelookError(f"{name}: {getattr(error, 'strerror', 'not a text file')}") from None
    rows = list(csv.DictReader(text.splitlines(), skipinitialspace=True))
    columns = list(rows[0]) if rows else []
    if not ({*ANGLES} <= {*columns} or {*QUATERNION} <= {*columns}):
        raise FreelookError(
            f"{name}: a first line with the columns name, roll_deg, pitch_deg (or qw, qx, qy, qz) "
            f"and rows below it are needed; there are: {', '.join(map(str, columns)) or 'none'}"
        )
    read = []
    for line, row in enumerate(rows, 2):
        try:
            attitude = _attitude(row)
        except (TypeError, ValueError):
            raise FreelookError(f"{name}, line {line}: roll and pitch are no numbers") from None
        read.append((row.get("name"), attitude))
    return read


def _attitude(row: dict[str, str]) -> Attitude:
    if row.get("roll_deg") is not None:
        roll, pitch = (float(row[key]) for key in ANGLES)
    else:
        from ..rotations import from_wxyz

        turn = from_wxyz([float(row[key]) for key in QUATERNION])
        _, pitch, roll = turn.as_euler("ZYX", degrees=True)
    if not (np.isfinite(roll) and abs(pitch) <= 90):
        raise ValueError
    return float(roll), float(pitch)


def _pictures(
    inputs: list[str], attitudes: list[tuple[str | None, Attitude]]
) -> Iterator[tuple[str, Any, Attitude]]:
    """(name, RGB (rows, columns, 3), (roll, pitch)) of every picture or chosen frame."""
    from ..media.pictures import is_picture, read_picture

    if all(is_picture(name) for name in inputs):
        known = {Path(name).name: attitude for name, attitude in attitudes if name}
        for name in inputs:
            attitude = known.get(Path(name).name)
            if attitude is None:
                raise FreelookError(
                    f"no row for {Path(name).name} among the attitudes; there are: "
                    f"{', '.join(list(known)[:5]) or 'none with a name'}"
                )
            yield name, read_picture(name).picture.planes[0], attitude
    elif len(inputs) == 1:
        yield from _video_frames(inputs[0], [attitude for _, attitude in attitudes])
    else:
        raise FreelookError("give pictures, or one video; not both")


def _video_frames(name: str, attitudes: list[Attitude]) -> Iterator[tuple[str, Any, Attitude]]:
    from ..media.decoder import Decoder
    from ..offline import decoded
    from ..sinks.picture import rgb24
    from ..sources.file import FileSource

    source = FileSource(name, loop=False, pace=False, clock=lambda: 0)
    chosen = set(np.linspace(0, len(attitudes) - 1, FRAMES).astype(int).tolist())
    number = -1
    for number, frame in enumerate(decoded(source.units(), Decoder(low_delay=False))):
        if number in chosen:
            yield f"frame {number}", rgb24(frame.picture), attitudes[number]
    if number + 1 != len(attitudes):
        raise FreelookError(
            f"{name} has {number + 1} frames, the attitudes are {len(attitudes)}; without a "
            "column 'name' there has to be one row for every frame"
        )


def _figures(mounting: Mounting) -> dict[str, Any]:
    keys = ("yaw", "pitch", "roll")
    sigma = [value if np.isfinite(value) else None for value in mounting.sigma_deg]
    return {
        "mount_deg": dict(zip(keys, mounting.angles_deg, strict=True)),
        "sigma_deg": dict(zip(keys, sigma, strict=True)),
        "yaw": "found" if mounting.yaw_found else "as told",
        "height_deg": mounting.height_deg,
        "used": [{"name": name, "error_deg": error} for name, error in mounting.errors_deg],
        "dropped": [{"name": name, "why": why} for name, why in mounting.dropped],
    }


def _sentences(mounting: Mounting) -> list[str]:
    sides = (("right", "left"), ("up", "down"), ("right side down", "left side down"))
    names = ("yaw", "pitch", "roll")
    lines = []
    for name, angle, sigma, words in zip(
        names, mounting.angles_deg, mounting.sigma_deg, sides, strict=True
    ):
        known = f"± {sigma:.2f}" if np.isfinite(sigma) else "as told: the frames do not show it"
        lines.append(f"{name:5} {angle:8.2f} degrees ({words[angle < 0]}), {known}")
    errors = [error for _, error in mounting.errors_deg]
    what = "points" if mounting.height_deg is None else "frames"
    lines.append(f"{len(errors)} {what}, off by at most {max(errors):.2f} degrees")
    if not mounting.yaw_found:
        lines.append("for the yaw: frames with the vehicle banked, or --point; or tell it: --mount")
    return lines + [f"{name} not used: {why}" for name, why in mounting.dropped]


def _write(args: argparse.Namespace, mounting: Mounting) -> None:
    from ..formats import format_module

    profile = lens_profile(args, args.lens)
    camera = dataclasses.replace(profile.camera, camera_from_body=mounting.camera_from_body)
    how = "known points" if mounting.height_deg is None else "horizon"
    note = f"mounting from {len(mounting.errors_deg)} x {how}"
    source = f"{profile.source}; {note}" if profile.source else note
    text = format_module("freelook").write(
        dataclasses.replace(profile, camera=camera, source=source)
    )
    try:
        Path(args.output).write_text(text, "utf-8")
    except OSError as error:
        raise FreelookError(f"{args.output}: {error.strerror}") from None
    print(f"written: {args.output}", file=sys.stderr if args.json else sys.stdout)
