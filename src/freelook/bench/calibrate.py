"""Calibrations side by side: ours, OpenCV's and mrcal's, on real and on simulated corners.

All get the same corners and are judged in the same way, whatever they print themselves: every
view gets the pose that suits the way's camera best (least squares over the points that are judged,
at any angle from the axis, whatever field the camera claims), and the distances are taken from
there. RMS is that of 2-D distances per point. Of simulated views only the points that are where
they belong are judged; of real ones all. Cross-validated: the same five folds for everybody. Which
of them is best: see `calibration_compared`.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..calibration.bundle import resect_all, rms
from ..calibration.calibrate import calibrate
from ..calibration.initial import pose_of
from ..calibration.left_out import FOLDS
from ..calibration.views import Pose, View
from ..camera import Camera, make_camera
from ..errors import CalibrationError, FreelookError
from ..lens import Equidistant, Equisolid, KannalaBrandt, Lens, Stereographic
from .boards import Simulated, board, simulate
from .calibration_peers import MRCAL, PEERS, Peer, PeerFailed

SUCCESS = 0.005  # of the picture's longer side: worse is no calibration
FEW = 60  # points of a view: enough to know about where it is
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Set:
    """Views to calibrate from, and which points (n,) of each are judged.

    poses  about where the target is in each view; only a start for those who judge. Some programs
           end with a camera that is turned far from its axis, and sees in its own formula's field
           only a part of what it was calibrated from
    """

    name: str
    views: tuple[View, ...]
    size: tuple[int, int]
    judged: tuple[Bools, ...]
    poses: tuple[Pose, ...]


@dataclass(frozen=True)
class Row:
    """What a way made of a set. `skipped` or `failed` say why there are no figures.

    seconds, cpu_seconds  of the one calibration from all views, other processes counted in; the
                          latter says more where the machine has other things to do
    """

    set: str
    way: str
    rms_px: float = float("nan")
    cross_validated_px: float = float("nan")
    seconds: float = float("nan")
    cpu_seconds: float = float("nan")
    failed: str = ""
    skipped: str = ""


@dataclass(frozen=True)
class Ours:
    """`freelook.calibration.calibrate` with a model, or choosing one; `control` points (across,
    down) of a splined one."""

    model: str
    control: tuple[int, int] | None = None

    @property
    def name(self) -> str:
        if self.control:
            return f"freelook, splined, {self.control[0]} x {self.control[1]}"
        return f"freelook, {self.model}"

    def missing(self) -> str:
        return ""

    def calibrate(self, views: Sequence[View], size: tuple[int, int]) -> Camera:
        try:
            return calibrate(views, size, self.model, control=self.control).camera
        except FreelookError as error:
            raise PeerFailed(str(error)) from None


OURS: tuple[Peer, ...] = (
    Ours("auto"),
    Ours("kannala_brandt"),
    Ours("splined_stereographic", (16, 12)),
)


@dataclass(frozen=True)
class LeastPredicted:
    """Of some ways the one with the least RMS on views left out, as a careful user would choose,
    set by set. That it is chosen by what it is then judged by is in its favour; its seconds are
    without those of the choice.

    name  of the choice, in words
    what  is chosen: the name of a row where there is nothing to choose from
    """

    name: str
    what: str
    ways: tuple[Peer, ...]

    def row(self, each: Set, rows: Sequence[Row]) -> Row:
        """`rows` of the ways."""
        if skipped := rows[0].skipped:
            return Row(each.name, f"{self.what}, {self.name}", skipped=skipped)
        able = [row for row in rows if np.isfinite(row.cross_validated_px)]
        if not able:
            why = "none of them has an RMS on views left out"
            return Row(each.name, f"{self.what}, {self.name}", failed=why)
        best = min(able, key=lambda row: row.cross_validated_px)
        return replace(best, way=f"{best.way}, {self.name}")


CHOSEN = LeastPredicted("chosen by cross-validation", "mrcal splined", MRCAL)


def run(
    sets: Sequence[Set],
    ways: Sequence[Peer] = (*OURS, *PEERS),
    choices: Sequence[LeastPredicted] = (),
    *,
    cross_validate: bool = True,
    progress: Callable[[str], None] = lambda _: None,
) -> Iterator[Row]:
    """A row for each set and way, as soon as it is there; and where cross-validated, for each
    choice, whose ways are run too but have no rows unless they are among `ways`."""
    choices = choices if cross_validate else ()
    every = {way.name: way for way in (*ways, *(way for c in choices for way in c.ways))}
    shown = {way.name for way in ways}
    for each in sets:
        done: dict[str, Row] = {}
        for name, way in every.items():
            progress(f"{each.name}: {name}")
            done[name] = _row(each, way, cross_validate)
            if name in shown:
                yield done[name]
        for choice in choices:
            yield choice.row(each, [done[way.name] for way in choice.ways])


def _row(each: Set, way: Peer, cross_validate: bool) -> Row:
    if why := way.missing():
        return Row(each.name, way.name, skipped=why)
    start, start_cpu = time.perf_counter(), cpu_seconds()
    try:
        camera = way.calibrate(each.views, each.size)
        seconds, cpu = time.perf_counter() - start, cpu_seconds() - start_cpu
        fitted = rms(_distances(camera, each, range(len(each.views))))
        if not fitted < SUCCESS * max(each.size):
            return Row(each.name, way.name, failed=f"ends at {fitted:.0f} px RMS")
        predicted = _cross_validated(each, way) if cross_validate else float("nan")
    except PeerFailed as error:
        return Row(each.name, way.name, failed=str(error))
    return Row(each.name, way.name, fitted, predicted, seconds, cpu)


def cpu_seconds() -> float:
    """Of this process and of those it waited for."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def _cross_validated(each: Set, way: Peer) -> float:
    """NaN where the way fails without some of the views, or cannot see those left out."""
    off = []
    for fold in range(FOLDS):
        kept = [v for i, v in enumerate(each.views) if i % FOLDS != fold]
        held = range(fold, len(each.views), FOLDS)
        try:
            off.append(_distances(way.calibrate(kept, each.size), each, held))
        except PeerFailed:
            return float("nan")
    return rms(np.concatenate(off))


def _distances(camera: Camera, each: Set, chosen: Sequence[int]) -> NDArray[np.float64]:
    """(n, 2) seen minus projected of the judged points of some views, each with the pose that
    suits it: the better of those found from two starts."""
    views, judged = [each.views[i] for i in chosen], [each.judged[i] for i in chosen]
    rough = [each.poses[i] for i in chosen]
    own = [
        pose_of(camera, view.only(good)) or pose
        for view, good, pose in zip(views, judged, rough, strict=True)
    ]
    ends = [_settled(camera, poses, views, judged) for poses in (own, rough)]
    return np.concatenate([min(pair, key=rms) for pair in zip(*ends, strict=True)])


def _settled(
    camera: Camera, poses: Sequence[Pose], views: Sequence[View], judged: Sequence[Bools]
) -> list[NDArray[np.float64]]:
    """Of every view the residuals (n, 2) of its judged points, from these poses on."""
    near, _ = resect_all(camera, poses, views, robust=True)
    _, residuals = resect_all(camera, near, views, judged)
    return [r[good] for r, good in zip(residuals, judged, strict=True)]


def simulated_sets() -> list[Set]:
    """Four lenses of which everything is known; 20 views of 50 corners, 0.2 px of noise."""
    off_center = (690.0, 505.0)
    bent = KannalaBrandt(300.0, 0.0035, 0.0007, -0.0021, 0.0002)
    lenses: tuple[tuple[str, Lens, float, float], ...] = (
        ("simulated: 120 degrees", Stereographic(415.0), 120, 0.0),
        ("simulated: 188 degrees", bent, 188, 0.0),
        ("simulated: 200 degrees, off centre", Equisolid(310.0), 200, 0.0),
        ("simulated: 160 degrees, 20 % outliers", Equidistant(340.0), 160, 0.2),
    )
    sets = []
    for seed, (name, lens, field, outliers) in enumerate(lenses):
        center = off_center if "off" in name else None
        camera = make_camera((1280, 960), lens, center=center, field_deg=field)
        rng = np.random.default_rng(seed)
        made = simulate(camera, board(10, 5), 20, rng, noise_px=0.2, outliers=outliers, fewest=40)
        sets.append(_of(name, made))
    return sets


def _of(name: str, made: Simulated) -> Set:
    return Set(name, made.views, made.camera.size, made.good, made.poses)


def real_sets(folder: Path) -> list[Set]:
    """`fish_1` (pictures, corners found by us) and `ov_plane` (given corners), where they are."""
    sets = []
    if (pictures := sorted((folder / "fish_1").glob("*.jpg"))) != []:
        sets.append(_from_pictures("fish_1", pictures))
    if (corners := sorted((folder / "ov_plane" / "train").glob("*.orpc"))) != []:
        from ..formats.corners import read_corner_files

        found = read_corner_files([str(path) for path in corners])
        views, size = found.views, found.size
        sets.append(_real("ov_plane", views, size))
    return sets


def _from_pictures(name: str, pictures: Sequence[Path]) -> Set:
    import cv2

    from ..calibration.targets import Chessboard

    target, views, size = Chessboard(0.0325, (6, 8)), [], (0, 0)
    for path in pictures:
        picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        if picture is None:
            raise CalibrationError(f"{path}: not a picture that can be read")
        gray = np.asarray(picture, np.uint8)
        size = (gray.shape[1], gray.shape[0])
        view = target.find(gray, path.name)
        if view is not None:
            views.append(view)
    return _real(name, views, size)


def _real(name: str, views: Sequence[View], size: tuple[int, int]) -> Set:
    every = tuple(np.ones(len(view.pixels), bool) for view in views)
    few = [v.only(np.arange(len(v.pixels)) % (1 + len(v.pixels) // FEW) == 0) for v in views]
    solution = calibrate(few, size, "kannala_brandt", drop=False).solution
    return Set(name, tuple(views), size, every, solution.poses)
