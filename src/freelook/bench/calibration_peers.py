"""Other programs' calibrations, called as their documentation says, their results as our cameras.

A peer takes views, the picture's size and the board's spacing, and returns a `Camera` or raises
`PeerFailed` with its reason. None gets a guess but the ones that cannot do without: those get the
focal length of a lens that shows 180 degrees over the picture's width.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from ..calibration.views import View
from ..camera import Camera, make_camera
from ..errors import FreelookError, ProfileError
from ..formats import load_camera
from ..lens import Floats, KannalaBrandt, Lens, Mei

MOST_SECONDS = 600
STEPS = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-8)


class PeerFailed(Exception):  # noqa: N818 - reads as what it is
    """Why a peer has no result."""


class Peer(Protocol):
    """One way to calibrate."""

    @property
    def name(self) -> str: ...

    def missing(self) -> str:
        """What is not installed; "" if nothing."""
        ...

    def calibrate(self, views: Sequence[View], size: tuple[int, int]) -> Camera: ...


@dataclass(frozen=True)
class OpenCVFisheye:
    """`cv2.fisheye.calibrate`; with `guess`, from K with f = width / pi and the middle."""

    guess: bool

    @property
    def name(self) -> str:
        return "OpenCV fisheye, f = width / pi by hand" if self.guess else "OpenCV fisheye"

    def missing(self) -> str:
        return "" if hasattr(cv2, "fisheye") else "OpenCV without fisheye"

    def calibrate(self, views: Sequence[View], size: tuple[int, int]) -> Camera:
        flags = _flag("CALIB_RECOMPUTE_EXTRINSIC") | _flag("CALIB_FIX_SKEW")
        matrix = terms = None
        if self.guess:
            flags |= _flag("CALIB_USE_INTRINSIC_GUESS")
            f, (cx, cy) = size[0] / np.pi, ((size[0] - 1) / 2, (size[1] - 1) / 2)
            matrix, terms = np.array([[f, 0, cx], [0, f, cy], [0, 0, 1]]), np.zeros((4, 1))
        try:
            _, matrix, terms, *_ = cv2.fisheye.calibrate(
                *_arrays(views), size, matrix, terms, flags=flags, criteria=STEPS
            )
        except cv2.error as error:
            raise PeerFailed(_first_line(error)) from None
        k1, k2, k3, k4 = map(float, np.ravel(terms))
        return _camera(size, KannalaBrandt(float(matrix[0, 0]), k1, k2, k3, k4), matrix)


@dataclass(frozen=True)
class OpenCVOmnidir:
    """`cv2.omnidir.calibrate` of OpenCV's contributed modules."""

    @property
    def name(self) -> str:
        return "OpenCV omnidir"

    def missing(self) -> str:
        return "" if hasattr(cv2, "omnidir") else "OpenCV without its contributed modules"

    def calibrate(self, views: Sequence[View], size: tuple[int, int]) -> Camera:
        omnidir = vars(cv2)["omnidir"]  # not every OpenCV has it
        try:
            _, matrix, xi, terms, *_ = omnidir.calibrate(
                *_arrays(views), size, None, None, None, omnidir.CALIB_FIX_SKEW, STEPS
            )
        except cv2.error as error:
            raise PeerFailed(_first_line(error)) from None
        k1, k2, p1, p2 = map(float, np.ravel(terms))
        lens = Mei(float(matrix[0, 0]), float(np.ravel(xi)[0]), k1, k2, 0.0, p1, p2)
        return _camera(size, lens, matrix)


@dataclass(frozen=True)
class MrcalSplined:
    """`mrcal-calibrate-cameras` with its splined stereographic model, on a cache of corners.

    It starts from a stereographic lens that shows 180 degrees over the width. How many control
    points a set can carry its user has to know, or to find out (see `calibrate.CHOSEN`).
    """

    control: tuple[int, int]
    field_deg: int = 200

    @property
    def name(self) -> str:
        return f"mrcal splined, {self.control[0]} x {self.control[1]}"

    def missing(self) -> str:
        return "" if shutil.which("mrcal-calibrate-cameras") else "mrcal is not installed"

    def calibrate(self, views: Sequence[View], size: tuple[int, int]) -> Camera:
        columns, rows = self.control
        model = (
            f"LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx={columns}_Ny={rows}"
            f"_fov_x_deg={self.field_deg}"
        )
        spacing, shape, grids = as_grids(views)
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "corners.vnl").write_text(corner_cache(grids), "utf-8")
            command = ["mrcal-calibrate-cameras", "--corners-cache", "corners.vnl"]
            command += ["--skip-calobject-warp-solve"]  # flat, as for all others and the judge
            command += ["--lensmodel", model, "--focal", f"{size[0] / 4:.1f}"]
            command += ["--object-spacing", f"{spacing:.9g}", "--object-width-n", str(shape[0])]
            command += ["--object-height-n", str(shape[1]), "--outdir", "."]
            command += ["--imagersize", *map(str, size), "view*.png"]
            try:
                done = subprocess.run(
                    command, cwd=folder, capture_output=True, text=True, timeout=MOST_SECONDS
                )
            except subprocess.TimeoutExpired:
                raise PeerFailed(f"not done after {MOST_SECONDS} s") from None
            written = sorted(Path(folder).glob("*.cameramodel"))
            if not written:
                said = (done.stderr or done.stdout).strip().splitlines()
                raise PeerFailed(said[-1][:200] if said else f"exit status {done.returncode}")
            try:
                return load_camera(str(written[0]))
            except FreelookError as error:
                raise PeerFailed(f"its result is no lens: {error}") from None


# From as dense as is usual down to nearly as few as there can be.
MRCAL = tuple(MrcalSplined(control) for control in ((16, 12), (12, 9), (10, 8), (8, 6)))
PEERS: tuple[Peer, ...] = (
    OpenCVFisheye(guess=False),
    OpenCVFisheye(guess=True),
    OpenCVOmnidir(),
    MRCAL[0],
)


def as_grids(views: Sequence[View]) -> tuple[float, tuple[int, int], list[Floats]]:
    """Spacing, (columns, rows) and, for each view, pixels (rows, columns, 2): NaN where not seen.

    ValueError for points that do not lie on a square grid along the target's axes.
    """
    flat = np.concatenate([view.points[:, :2] for view in views])
    steps = np.diff(np.unique(np.round(flat[:, 0], 9)))
    spacing, origin = float(steps.min()), flat.min(axis=0)
    cells = (flat - origin) / spacing
    if np.abs(cells - np.rint(cells)).max() > 1e-3:
        raise ValueError("the points do not lie on a square grid")
    columns, rows = (np.rint(cells.max(axis=0)).astype(int) + 1).tolist()
    grids = []
    for view in views:
        grid = np.full((rows, columns, 2), np.nan)
        column, row = np.rint((view.points[:, :2] - origin) / spacing).astype(int).T
        grid[row, column] = view.pixels
        grids.append(grid)
    return spacing, (columns, rows), grids


def corner_cache(grids: Sequence[Floats]) -> str:
    """mrcal's vnlog of corners: a line for each, in order; level "-" for those not seen."""
    lines = ["# filename x y level"]
    for number, grid in enumerate(grids):
        for x, y in grid.reshape(-1, 2):
            seen = np.isfinite(x)
            place = f"{x:.6f} {y:.6f} 0" if seen else "0 0 -"
            lines.append(f"view{number:04d}.png {place}")
    return "\n".join(lines) + "\n"


def _arrays(views: Sequence[View]) -> tuple[list[Floats], list[Floats]]:
    """In the shapes that OpenCV 4 and 5 both take."""
    points = [np.ascontiguousarray(view.points.reshape(1, -1, 3)) for view in views]
    return points, [np.ascontiguousarray(view.pixels.reshape(1, -1, 2)) for view in views]


def _flag(name: str) -> int:
    """OpenCV 4 has its fisheye flags in `cv2.fisheye`, OpenCV 5, with other numbers, in `cv2`."""
    return int(getattr(cv2.fisheye, name, None) or getattr(cv2, name))


def _camera(size: tuple[int, int], lens: Lens, matrix: NDArray[np.float64]) -> Camera:
    """From a camera matrix; its f is the lens's."""
    f = float(matrix[0, 0])
    stretch = np.array([[1.0, matrix[0, 1] / f], [0.0, matrix[1, 1] / f]])
    try:
        return make_camera(
            size, lens, center=(float(matrix[0, 2]), float(matrix[1, 2])), stretch=stretch
        )
    except ProfileError as error:
        raise PeerFailed(f"its result is no lens: {error}") from None


def _first_line(error: Exception) -> str:
    text = " ".join(str(error).split())
    return text.split("error: ", 1)[-1][:200] or type(error).__name__
