"""Pictures of printed targets through known cameras: every pixel is the mean over its area."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from freelook.calibration.drawing import Drawing
from freelook.calibration.views import Pose
from freelook.camera import Camera, make_camera
from freelook.lens import Equidistant, Floats

Gray = NDArray[np.uint8]
Pictures = NDArray[np.float32]

STRIDE = 8
TURNS = np.arange(16) * np.pi / 8
BEHIND = 0.35  # reflectance of what is behind a target
# Places in a pixel that are looked at: a Fibonacci lattice, in which no two lie in one row or
# column, so that an edge moves in steps of 1/21 pixel.
STEPS = np.arange(21)
SAMPLES = (np.stack([STEPS, STEPS * 13 % 21], axis=-1) + 0.5) / 21


@dataclass(frozen=True)
class Light:
    """How reflectance becomes grey levels: black, white, blur and noise of the camera."""

    black: float = 30.0
    white: float = 220.0
    blur_px: float = 0.6
    noise: float = 1.5
    fall_off: float = 0.0  # towards the right edge: share of the light that is lost there


@dataclass(frozen=True)
class Print:
    """A target on paper: reflectance by texel, texels per unit.

    The print's top left corner is the target point `corner`, and its y runs down along the
    target's y, or against it if `up`.
    """

    texture: Pictures
    per_unit: float
    corner: tuple[float, float] = (0.0, 0.0)
    up: bool = False

    @property
    def size(self) -> tuple[float, float]:
        rows, columns = self.texture.shape
        return columns / self.per_unit, rows / self.per_unit

    @property
    def middle(self) -> tuple[float, float]:
        """In the target's coordinates."""
        width, height = self.size
        return self.corner[0] + width / 2, self.corner[1] + height / (-2 if self.up else 2)

    def texels(self, points: Floats) -> Floats:
        """(..., 2) texel coordinates of target points (..., 2)."""
        offset = (points - self.corner) * (1.0, -1.0 if self.up else 1.0)
        return np.asarray(offset * self.per_unit - 0.5)

    def hidden(self, left: float, top: float, right: float, bottom: float) -> Print:
        """Something dark lies on this part, in shares of width and height."""
        rows, columns = self.texture.shape
        texture = self.texture.copy()
        texture[
            int(top * rows) : int(bottom * rows), int(left * columns) : int(right * columns)
        ] = 0
        return Print(texture, self.per_unit, self.corner, self.up)


def printed(
    drawing: Drawing,
    corner: tuple[float, float] = (0.0, 0.0),
    *,
    up: bool = False,
    across: int = 900,
) -> Print:
    """A drawing in `across` texels along its longer side; each is the mean over its area."""
    per_unit = across / max(drawing.size)
    columns, rows = (round(length * per_unit) for length in drawing.size)
    dark = np.zeros((rows, columns))
    for x, y, width, height in drawing.rectangles * per_unit:
        wide, wide_at = _covered(x, width, columns)
        high, high_at = _covered(y, height, rows)
        dark[high_at, wide_at] += np.outer(high, wide)
    y, x = np.mgrid[:rows, :columns] + 0.5
    for middle_x, middle_y, radius in drawing.circles * per_unit:
        box = np.s_[
            max(0, int(middle_y - radius - 2)) : int(middle_y + radius + 2),
            max(0, int(middle_x - radius - 2)) : int(middle_x + radius + 2),
        ]
        inside = 0.5 + radius - np.hypot(x[box] - middle_x, y[box] - middle_y)
        dark[box] = np.maximum(dark[box], np.clip(inside, 0, 1))
    texture = (1 - np.clip(dark, 0, 1)).astype(np.float32)
    return Print(texture, per_unit, corner, up)


def _covered(start: float, length: float, count: int) -> tuple[Floats, slice]:
    """How much of each texel, along one axis, lies between start and start + length."""
    first, last = max(0, int(start)), min(count, int(np.ceil(start + length)))
    edges = np.clip(np.arange(first, last + 1), start, start + length)
    return np.diff(edges), slice(first, last)


def held(
    paper: Print,
    toward_deg: tuple[float, float],
    distance: float,
    tilt_deg: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Pose:
    """A pose: the print's middle lies `distance` along the ray (right, down) degrees away.

    Untilted, the print faces the camera; `tilt_deg` turns it about its own x, y and z.
    """
    right, down = toward_deg
    look = Rotation.from_euler("YX", [right, -down], degrees=True)
    turn = look * Rotation.from_euler("xyz", tilt_deg, degrees=True)
    if paper.up:
        turn = turn * Rotation.from_euler("x", 180, degrees=True)
    place = look.apply([0.0, 0.0, distance])
    return Pose(turn, place - turn.apply([*paper.middle, 0.0]))


@dataclass(frozen=True)
class Studio:
    """A camera that photographs targets, and knows exactly where it saw their points."""

    camera: Camera

    def seen(self, pose: Pose, points: Floats) -> Floats:
        """Pixels (n, 2) of target points (n, 3), wherever they are; NaN beyond the field."""
        return self.camera.project(pose.apply(points))

    def inside(self, pixels: Floats, margin: float) -> NDArray[np.bool_]:
        """Which pixels (n, 2) are in the picture, that far from its edge and the field's."""
        around = margin * np.stack([np.cos(TURNS), np.sin(TURNS)], axis=-1)
        places = np.round(np.nan_to_num(pixels, nan=-1e6)[:, None] + around).astype(int)
        last = np.array(self.camera.size) - 1
        within = ((places >= 0) & (places <= last)).all(axis=-1)
        x, y = np.moveaxis(np.clip(places, 0, last), -1, 0)
        return np.asarray((within & self._lit[y, x]).all(axis=1))

    def photograph(
        self,
        pose: Pose,
        paper: Print,
        light: Light | None = None,
        rng: np.random.Generator | None = None,
    ) -> Gray:
        """What is seen of the target, with mid grey around it and black outside the field."""
        light, rng = light or Light(), rng or np.random.default_rng(0)
        width, height = self.camera.size
        value = np.full((height, width), BEHIND, np.float32)
        box = self._box(pose, paper)
        texels, there = _texels(self._rays[_with_last(box)], pose, paper)
        if there.any():
            value[box] = np.where(_whole(there), _mean(paper.texture, texels), BEHIND)
        value = light.black + (light.white - light.black) * value
        value *= 1 - light.fall_off * np.arange(width, dtype=np.float32) / width
        value = np.where(self._lit, value, 8.0)
        if light.blur_px:
            value = cv2.GaussianBlur(value, (0, 0), light.blur_px)
        value = value + light.noise * rng.standard_normal(value.shape, np.float32)
        return np.asarray(np.clip(np.round(value), 0, 255), dtype=np.uint8)

    def _box(self, pose: Pose, paper: Print) -> tuple[slice, slice]:
        """The part of the picture that a print is in, from every eighth pixel."""
        _, there = _texels(self._rays[::STRIDE, ::STRIDE], pose, paper)
        if not there.any():
            return slice(0, 0), slice(0, 0)
        columns, rows = self.camera.size
        parts = []
        for axis, count in ((1, rows), (0, columns)):
            seen = np.flatnonzero(there.any(axis=axis)) * STRIDE
            parts.append(slice(max(0, seen[0] - STRIDE), min(count, seen[-1] + STRIDE)))
        return parts[0], parts[1]

    @cached_property
    def _rays(self) -> Floats:
        """(rows + 1, columns + 1, 3) through the corners of pixels."""
        width, height = self.camera.size
        x, y = np.meshgrid(np.arange(width + 1) - 0.5, np.arange(height + 1) - 0.5)
        return self.camera.ray(np.stack([x, y], axis=-1))

    @cached_property
    def _lit(self) -> NDArray[np.bool_]:
        return _whole(np.isfinite(self._rays[..., 2]))


def _with_last(box: tuple[slice, slice]) -> tuple[slice, slice]:
    """The corners of the pixels in a box."""
    rows, columns = box
    return slice(rows.start, rows.stop + 1), slice(columns.start, columns.stop + 1)


def _whole(corners: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels all of whose corners are so."""
    return corners[:-1, :-1] & corners[:-1, 1:] & corners[1:, :-1] & corners[1:, 1:]


FISHEYE = Studio(make_camera((960, 720), Equidistant(260.0), center=(487.3, 352.8), field_deg=200))


def _texels(rays: Floats, pose: Pose, paper: Print) -> tuple[Floats, NDArray[np.bool_]]:
    """Texels that rays meet (linear between pixels to 1e-3 px), and which meet the print."""
    rays = np.where(np.isfinite(rays[..., 2:]), rays, [0.0, 0.0, 0.0])
    turn = pose.camera_from_target.as_matrix()
    direction, origin = rays @ turn, -pose.translation @ turn
    steep = np.abs(direction[..., 2]) > 0.02
    depth = np.full(steep.shape, -1.0)
    np.divide(-origin[2], direction[..., 2], out=depth, where=steep)
    texels = paper.texels(origin[:2] + depth[..., None] * direction[..., :2])
    rows, columns = paper.texture.shape
    on_it = (depth > 0) & ((texels >= -0.5) & (texels <= (columns - 0.5, rows - 0.5))).all(axis=-1)
    return texels, on_it


def _mean(texture: Pictures, corners: Floats) -> Pictures:
    """Mean of a texture over pixels whose corners are at these texels."""
    corners = np.clip(corners, -1e4, 1e4).astype(np.float32)
    quarters = corners[:-1, :-1], corners[:-1, 1:], corners[1:, :-1], corners[1:, 1:]
    total = np.zeros(quarters[0].shape[:2], np.float32)
    for u, v in SAMPLES:
        shares = (1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v
        at = sum(np.float32(share) * part for share, part in zip(shares, quarters, strict=True))
        total += cv2.remap(texture, at, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(total / len(SAMPLES), np.float32)
