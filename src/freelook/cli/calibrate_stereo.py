"""Calibrate two cameras on one rig: both lenses, and how they stand to each other.

LEFT and RIGHT are folders of pictures, or two videos that started together. Pictures that belong
together have the same name, or the same last number in it (left_07.png, right_07.png); frames of
videos the same number. The target may be missing in either picture of a pair.

  freelook calibrate stereo shots/left shots/right --board 8x6 --square 0.03 -o rig
  freelook calibrate stereo left.mp4 right.mp4 --target charuco:10x7:0.024:0.018 -o rig

Of a target with numbered markers (charuco, aprilgrid) the cameras may see different parts.

The folder given with -o gets left.json and right.json, lens profiles mounted so that both look the
same way, and rig.json: rotation, baseline and how well they are known.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import FreelookError
from ..lens import MODELS
from ._targets import add_target_arguments, chosen_target, grid_without_names, measured

if TYPE_CHECKING:
    from ..calibration.stereo import Moment, StereoCalibration
    from ..calibration.targets import Target
    from ..calibration.views import View

    Found = tuple[list[Moment], tuple[tuple[int, int], tuple[int, int]]]

VERSION = 1
SIDES = ("left", "right")
FILES = ("left.json", "right.json", "rig.json")
MOST_FRAMES, MOST_MOMENTS = 150, 40  # of videos: looked at, used


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("left", metavar="LEFT", help="folder of pictures, or a video")
    parser.add_argument("right", metavar="RIGHT", help="the same of the other camera")
    parser.add_argument(
        "--model",
        default="auto",
        choices=("auto", *MODELS),
        metavar="NAME",
        help="lens model of both, or auto: for each the one that predicts unseen views best",
    )
    parser.add_argument("--square-pixels", action="store_true", help="take pixels as square")
    parser.add_argument("-o", "--output", metavar="FOLDER", help="write profiles and rig here")
    parser.add_argument("--name", default="", help="for people: which rig it is")
    parser.add_argument("--json", action="store_true", help="print all figures as JSON")
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist")
    add_target_arguments(parser)


def run(args: argparse.Namespace) -> int:
    from ..calibration.parameters import Freedom
    from ..calibration.stereo import calibrate_stereo

    _check_output(args)
    target = chosen_target(args)
    ambiguous, board = grid_without_names(target)
    moments, sizes = _moments(args, target)

    def say(what: str) -> None:
        if not args.json:
            print(f"solving: {what}", file=sys.stderr)

    stereo = calibrate_stereo(
        moments,
        sizes,
        args.model,
        Freedom(aspect=not args.square_pixels),
        ambiguous=ambiguous,
        board=board,
        progress=say,
    )
    if args.json:
        print(json.dumps(figures(stereo), indent=2))
    else:
        for line in sentences(stereo, measured=measured(target)):
            print(line)
    if args.output:
        _write(args, stereo)
    return 0


def _check_output(args: argparse.Namespace) -> None:
    if not args.output or args.overwrite:
        return
    there = [name for name in FILES if (Path(args.output) / name).exists()]
    if there:
        raise FreelookError(
            f"{args.output} has {', '.join(there)} already; --overwrite replaces them"
        )


def _moments(args: argparse.Namespace, target: Target) -> Found:
    folders = [Path(args.left).is_dir(), Path(args.right).is_dir()]
    if all(folders):
        return _from_folders(Path(args.left), Path(args.right), target, args.json)
    if any(folders):
        raise FreelookError("LEFT and RIGHT are a folder and a file; give two of a kind")
    return _from_videos(args.left, args.right, target, args.json)


def _from_folders(left: Path, right: Path, target: Target, quiet: bool) -> Found:
    from ..calibration.stereo import Moment
    from ..media.pictures import is_picture
    from ._target_views import find_views

    files: list[list[str]] = []
    for folder in (left, right):
        names = sorted(path.name for path in folder.iterdir() if is_picture(path.name))
        if not names:
            raise FreelookError(f"{folder}: no pictures in it")
        files.append(names)
    keys = paired(files[0], files[1])
    views: list[dict[str, View]] = []
    sizes = []
    for folder, names, own in zip((left, right), files, keys, strict=True):
        found = find_views([str(folder / name) for name in names], target, quiet=quiet)
        assert found.size is not None
        sizes.append(found.size)
        key_of = {str(folder / name): key for name, key in zip(names, own, strict=True)}
        views.append({key_of[view.name]: view for view in found.views})
    moments = [
        Moment(key, views[0].get(key), views[1].get(key)) for key in sorted({*keys[0], *keys[1]})
    ]
    return moments, (sizes[0], sizes[1])


def paired(left: list[str], right: list[str]) -> tuple[list[str], list[str]]:
    """A key for every file name, the same for those that belong together.

    Names without their ending, or else the last number in them; FreelookError if neither pairs any.
    """
    for key in (lambda name: Path(name).stem, _last_number):
        keys = [key(name) for name in left], [key(name) for name in right]
        alone = all(len(set(own)) == len(own) for own in keys)
        if alone and set(keys[0]) & set(keys[1]):
            return keys
    raise FreelookError(
        f"no picture of one folder belongs to one of the other ({left[0]} ... and {right[0]} ...); "
        "give those of a pair the same name, or the same number at its end"
    )


def _last_number(name: str) -> str:
    numbers = re.findall(r"\d+", Path(name).stem)
    return str(int(numbers[-1])) if numbers else Path(name).stem


def _from_videos(left: str, right: str, target: Target, quiet: bool) -> Found:
    """Moments at which the target was held still, as different as can be."""
    from ..calibration.stereo import Moment
    from ._bars import bar
    from ._target_views import _frames

    videos = [_frames(name) for name in (left, right)]
    expected = min((count for count, _ in videos if count), default=None)
    step = max(2, (expected or 0) // (MOST_FRAMES // 2))
    sizes: list[tuple[int, int]] = [(0, 0), (0, 0)]
    moments = []
    before: tuple[View | None, View | None] = (None, None)
    with bar("looking for the target", expected, "frames", quiet=quiet) as advance:
        for number, grays in enumerate(zip(videos[0][1], videos[1][1], strict=False)):
            advance()
            sizes = [(gray.shape[1], gray.shape[0]) for gray in grays]
            if number % step > 1:
                continue
            views = [target.find(gray, f"frame {number}") for gray in grays]
            if number % step == 0:
                before = (views[0], views[1])
            else:
                still = [_still(*pair) for pair in zip(before, views, strict=True)]
                moments.append(Moment(f"frame {number}", still[0], still[1]))
    return _differing(moments, sizes), (sizes[0], sizes[1])


def _still(before: View | None, after: View | None) -> View | None:
    from ..calibration.choice import moved_px
    from ._target_views import STILL_PX

    moved = before is None or after is None or moved_px(before, after) >= STILL_PX
    return None if moved else after


def _differing(moments: list[Moment], sizes: list[tuple[int, int]]) -> list[Moment]:
    """Those that one side or the other would choose."""
    from ..calibration.choice import differing

    chosen: set[int] = set()
    for side, of_size in zip(SIDES, sizes, strict=True):
        views = [view for m in moments if (view := getattr(m, side)) is not None]
        chosen |= {id(view) for view in differing(views, MOST_MOMENTS, of_size)}
    return [m for m in moments if id(m.left) in chosen or id(m.right) in chosen]


def rig_figures(stereo: StereoCalibration) -> dict[str, Any]:
    """The rig alone, as it is written down."""
    from ..rotations import to_wxyz

    return {
        "freelook_rig": VERSION,
        "right_from_left": {
            "rotation_wxyz": to_wxyz(stereo.right_from_left),
            "rotation_vector_deg": np.degrees(stereo.right_from_left.as_rotvec()).tolist(),
            "rotation_sigma_deg": stereo.turn_sigma_deg.tolist(),
            "translation": stereo.translation.tolist(),
            "translation_sigma": stereo.shift_sigma.tolist(),
        },
        "baseline": stereo.baseline,
        "baseline_sigma": stereo.baseline_sigma,
        "right_in_rig": stereo.right_in_body.tolist(),
        "epipolar_median_deg": _percentile(stereo.epipolar_deg, 50),
        "epipolar_p95_deg": _percentile(stereo.epipolar_deg, 95),
    }


def _percentile(values: Any, share: float) -> float | None:
    return float(np.percentile(values, share)) if len(values) else None


def figures(stereo: StereoCalibration) -> dict[str, Any]:
    """Everything, for JSON; RMS is that of 2-D distances per point, pixels."""
    from ..formats import Profile, format_module

    cameras = {
        side: json.loads(format_module("freelook").write(Profile(camera)))
        for side, camera in zip(SIDES, (stereo.left, stereo.right), strict=True)
    }
    sigma = np.sqrt(np.diag(stereo.covariance))
    return {
        "rig": rig_figures(stereo),
        "cameras": cameras,
        "rms_px": dict(zip(SIDES, stereo.rms_px, strict=True)),
        "rms_alone_px": {s: c.rms_px for s, c in zip(SIDES, stereo.alone, strict=True)},
        "sigma": dict(zip(stereo.names, map(float, sigma), strict=True)),
        "pairs": stereo.pairs,
        "singles": stereo.singles,
        "points_dropped": stereo.rejected,
        "dropped": [{"name": name, "why": why} for name, why in stereo.dropped],
        "swapped": stereo.swapped,
    }


def sentences(stereo: StereoCalibration, *, measured: bool) -> list[str]:
    """The result in words; without a measured square, lengths are in squares."""
    unit = "m" if measured else "squares"
    left, right = stereo.rms_px
    turn = np.degrees(stereo.right_from_left.as_rotvec())
    forward, to_right, down = stereo.right_in_body
    lines = [
        f"RMS {left:.3f} px left, {right:.3f} px right (2-D, per point); {stereo.pairs} pairs, "
        f"{stereo.singles} single views",
        f"baseline {stereo.baseline:.5g} ± {stereo.baseline_sigma:.1g} {unit}: the right camera is "
        f"{to_right:.5g} to the right, {forward:.3g} ahead, {-down:.3g} up",
        "rotation about x, y, z: "
        + ", ".join(f"{a:.3f} ± {s:.3f}" for a, s in zip(turn, stereo.turn_sigma_deg, strict=True))
        + " degrees",
        f"epipolar error: median {np.median(stereo.epipolar_deg):.3f}, "
        f"95 % below {np.percentile(stereo.epipolar_deg, 95):.3f} degrees"
        if len(stereo.epipolar_deg)
        else "epipolar error: no point was seen by both cameras",
    ]
    if stereo.swapped:
        lines.append("RIGHT stands to the left of LEFT: are they swapped, or upside down?")
    if stereo.rejected:
        lines.append(f"{stereo.rejected} points dropped: too far from the rest")
    return lines + [f"{name} not used: {why}" for name, why in stereo.dropped]


def _write(args: argparse.Namespace, stereo: StereoCalibration) -> None:
    from ..formats import Profile, format_module

    folder = Path(args.output)
    cameras = zip(SIDES, (stereo.left, stereo.right), stereo.rms_px, strict=True)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for side, camera, error in cameras:
            source = f"stereo calibration with {stereo.pairs} pairs, {error:.3f} px RMS"
            profile = Profile(camera, f"{args.name} {side}".strip(), source)
            (folder / f"{side}.json").write_text(format_module("freelook").write(profile), "utf-8")
        rig = {**rig_figures(stereo), "left": "left.json", "right": "right.json"}
        (folder / "rig.json").write_text(json.dumps(rig, indent=2) + "\n", "utf-8")
    except OSError as error:
        raise FreelookError(f"{args.output}: {error.strerror}") from None
    print(f"written: {args.output}", file=sys.stderr if args.json else sys.stdout)
