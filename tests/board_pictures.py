"""Pictures of a chessboard through a known lens, for tests: where it is held is known exactly."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from freelook.calibration.views import View
from freelook.camera import Camera

Floats = NDArray[np.float64]
Gray = NDArray[np.uint8]

SQUARE_PX = 60  # of the drawn board


@dataclass(frozen=True)
class Held:
    """A board held in the direction of a pixel, facing the camera, then tilted.

    tilt_deg  (about the picture's x axis, about its y axis): top nearer, right side nearer
    """

    at: tuple[float, float]
    distance: float = 0.28
    tilt_deg: tuple[float, float] = (0.0, 0.0)
    roll_deg: float = 0.0


@dataclass(frozen=True)
class Board:
    """A chessboard of `inner` corners with squares of `square` metres, seen by `camera`."""

    camera: Camera
    inner: tuple[int, int] = (8, 6)
    square: float = 0.03
    oversampling: int = 2
    light: tuple[int, int] = (25, 225)
    background: int = 100

    def picture(self, held: Held | None, noise: float = 0.0, seed: int = 0) -> Gray:
        """(rows, columns); black where the lens sees nothing, gray where it sees no board."""
        width, height = self.camera.size
        rays = self._fine_rays
        seen = np.isfinite(rays[..., 2])
        picture = np.where(seen, float(self.background), 0.0).astype(np.float32)
        if held is not None:
            place, there = self._on_board(rays, held)
            drawn = cv2.remap(
                self._drawn, place[..., 0], place[..., 1], cv2.INTER_LINEAR, borderValue=-1.0
            )
            picture = np.where(there & (drawn >= 0), drawn, picture)
        small = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
        if noise:
            small = small + np.random.default_rng(seed).normal(0, noise, small.shape)
        return np.asarray(np.clip(np.rint(small), 0, 255), np.uint8)

    @cached_property
    def _drawn(self) -> NDArray[np.float32]:
        """The board with a margin of one white square."""
        columns, rows = self.inner[0] + 3, self.inner[1] + 3
        y, x = np.mgrid[0:rows, 0:columns]
        dark = ((x + y) % 2 == 0) & (x > 0) & (y > 0) & (x < columns - 1) & (y < rows - 1)
        squares = np.where(dark, self.light[0], self.light[1]).astype(np.float32)
        return np.kron(squares, np.ones((SQUARE_PX, SQUARE_PX), np.float32))

    @cached_property
    def _fine_rays(self) -> NDArray[np.float32]:
        width, height = self.camera.size
        n = self.oversampling
        x = (np.arange(width * n) + 0.5) / n - 0.5
        y = (np.arange(height * n) + 0.5) / n - 0.5
        return self.camera.ray(np.stack(np.meshgrid(x, y), axis=-1)).astype(np.float32)

    def pose(self, held: Held) -> tuple[Rotation, Floats]:
        """camera_from_board and where the board's middle is."""
        ray = self.camera.ray(np.array([held.at], dtype=float))[0]
        across = np.cross([0.0, 0.0, 1.0], ray)
        sine = np.linalg.norm(across)
        turn = np.arctan2(sine, ray[2])
        there = Rotation.from_rotvec(across / sine * turn if sine > 0 else np.zeros(3))
        lean = Rotation.from_rotvec(np.radians([held.tilt_deg[0], held.tilt_deg[1], 0.0]))
        roll = Rotation.from_rotvec([0.0, 0.0, np.radians(held.roll_deg)])
        return there * lean * roll, ray * held.distance

    def view(self, held: Held, name: str = "view") -> View:
        """All corners that lie in the picture, exactly."""
        columns, rows = self.inner
        j, i = (part.ravel() for part in np.mgrid[0:rows, 0:columns])
        flat = np.column_stack([i - (columns - 1) / 2, j - (rows - 1) / 2, np.zeros(len(i))])
        camera_from_board, middle = self.pose(held)
        pixels = self.camera.project(camera_from_board.apply(flat * self.square) + middle)
        inside = np.isfinite(pixels[:, 0]) & (pixels > 0).all(1)
        inside &= (np.nan_to_num(pixels) < np.array(self.camera.size) - 1).all(1)
        points = np.column_stack([i, j, np.zeros(len(i))]) * self.square
        return View(name, points[inside], pixels[inside])

    def _on_board(self, rays: NDArray[np.float32], held: Held) -> tuple[Floats, NDArray[np.bool_]]:
        """Drawn-board pixels (..., 2) that rays meet, and whether they do, in front."""
        camera_from_board, middle = self.pose(held)
        axes = camera_from_board.as_matrix()
        ahead = np.nan_to_num(rays @ axes[:, 2].astype(np.float32), nan=0.0)
        meets = np.abs(ahead) > 1e-6
        along = np.divide(
            np.float32(axes[:, 2] @ middle), ahead, out=np.full_like(ahead, -1), where=meets
        )
        meets &= (along > 0) & (along < 10)
        point = np.nan_to_num(rays) * np.where(meets, along, 0)[..., None] - middle.astype(
            np.float32
        )
        board = point @ axes[:, :2].astype(np.float32) / np.float32(self.square) * SQUARE_PX
        rows, columns = self._drawn.shape
        place = board + np.array([(columns - 1) / 2, (rows - 1) / 2], np.float32)
        return place, meets
